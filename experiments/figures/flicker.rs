//! How far the open shares of neighbouring frames are apart, and how much of that is flicker.
//!
//! Three differences, each over skin vertices and frames. The change from a frame to the next is motion and noise. The same
//! over vertices that move as one piece with what is around them is noise, and what far parts of the head cover. How far a
//! frame is off the middle of the two beside it is what goes up and comes down again: noise, and the bends of true curves.
//! A bake with many rays, for comparison, has hardly any noise.

use std::path::Path;

use glam::Vec3;
use serde_json::{Value, json};
use skinfit::report::plot::{Dot, Joined, Plot};
use skinfit::scene::mesh::PosedMesh;

use crate::lab::Result;

/// Metres around a vertex that have to move with it.
const AROUND: f64 = 0.02;
/// Metres by which distances within them may change from a frame to the next: a hundredth of a millimetre, well above the
/// rounding of 32 bits, well below what a bone's blend or a target does.
const CHANGE: f64 = 1e-5;
/// Vertices that are as open as this have no noise to show.
const OPEN: f64 = 0.95;

/// A way to follow a clip.
pub(crate) struct Way {
    pub(crate) name: String,
    /// Bakes a second; none for one that bakes no poses.
    pub(crate) rate: Option<usize>,
    /// Seconds of baking by the frame; none where the program does not bake so.
    pub(crate) seconds: Option<f64>,
    /// The open shares of the skin's vertices, frame by frame.
    pub(crate) frames: Vec<Vec<f32>>,
}

/// Root mean square and greatest of differences.
#[derive(Clone, Copy, Default)]
pub(crate) struct Apart {
    squares: f64,
    most: f64,
    count: usize,
}

impl Apart {
    fn of(differences: impl Iterator<Item = f32>) -> Self {
        differences.fold(Self::default(), |all, difference| {
            let difference = f64::from(difference).abs();
            all.and(Self { squares: difference * difference, most: difference, count: 1 })
        })
    }

    fn and(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            most: self.most.max(other.most),
            count: self.count + other.count,
        }
    }

    fn all(parts: &[Self]) -> Self {
        parts.iter().copied().fold(Self::default(), Self::and)
    }

    /// Of all frames of two ways.
    pub(crate) fn between(a: &[Vec<f32>], b: &[Vec<f32>]) -> Self {
        let frames = a.iter().zip(b).map(|(a, b)| Self::of(a.iter().zip(b).map(|(a, b)| a - b)));
        frames.fold(Self::default(), Self::and)
    }

    /// None of no differences.
    fn rms(self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    pub(crate) fn json(self) -> Value {
        json!({ "rms": self.rms(), "most": self.rms().map(|_| self.most) })
    }
}

/// Of each step to the next frame, the places among the skin's vertices of those that move, but as one piece with what is
/// around them.
pub(crate) struct Pieces(Vec<Vec<usize>>);

impl Pieces {
    /// `fine` tells which are open anyway.
    pub(crate) fn of(poses: &[PosedMesh], skin: &[usize], fine: &[Vec<f32>]) -> Self {
        let around: Vec<Vec<usize>> = skin.iter().map(|&v| near(&poses[0].positions, v)).collect();
        let step = |(pair, open): (&[PosedMesh], &Vec<f32>)| {
            let [before, after] = [&pair[0].positions, &pair[1].positions];
            let whole = |&i: &usize| {
                let v = skin[i];
                before[v] != after[v] && f64::from(open[i]) < OPEN && is_piece(before, after, v, &around[i])
            };
            (0..skin.len()).filter(whole).collect::<Vec<usize>>()
        };
        Self(poses.windows(2).zip(fine).map(step).collect())
    }

    /// How they are told, and how many there are in the mean of the steps and at the least.
    pub(crate) fn json(&self) -> Value {
        let count = |step: &Vec<usize>| step.len();
        let sum: usize = self.0.iter().map(count).sum();
        json!({
            "around": AROUND, "change": CHANGE, "open_below": OPEN,
            "mean": sum as f64 / self.0.len().max(1) as f64, "least": self.0.iter().map(count).min(),
        })
    }
}

/// The vertices around another.
fn near(positions: &[Vec3], vertex: usize) -> Vec<usize> {
    let close = |&other: &usize| f64::from(positions[other].distance(positions[vertex])) < AROUND;
    (0..positions.len()).filter(close).collect()
}

/// Whether all that was around a vertex is as far from it as before.
fn is_piece(before: &[Vec3], after: &[Vec3], vertex: usize, around: &[usize]) -> bool {
    let distance = |at: &[Vec3], other: usize| f64::from(at[vertex].distance(at[other]));
    around.iter().all(|&other| (distance(after, other) - distance(before, other)).abs() < CHANGE)
}

impl Way {
    /// From each frame to the next.
    fn changes(&self) -> Vec<Apart> {
        let step =
            |pair: &[Vec<f32>]| Apart::of(pair[0].iter().zip(&pair[1]).map(|(before, after)| after - before));
        self.frames.windows(2).map(step).collect()
    }

    /// The same of vertices that move as one piece with what is around them.
    fn of_pieces(&self, pieces: &Pieces) -> Vec<Apart> {
        let steps = self.frames.windows(2).zip(&pieces.0);
        steps.map(|(pair, piece)| Apart::of(piece.iter().map(|&i| pair[1][i] - pair[0][i]))).collect()
    }

    /// Each frame off the middle of the two beside it.
    fn flicker(&self) -> Vec<Apart> {
        let frame = |three: &[Vec<f32>]| {
            Apart::of((0..three[1].len()).map(|i| three[1][i] - 0.5 * (three[0][i] + three[2][i])))
        };
        self.frames.windows(3).map(frame).collect()
    }

    /// What is told of it: over all frames, and frame by frame.
    pub(crate) fn row(&self, pieces: &Pieces, fps: usize) -> Value {
        let (changes, of_pieces, flicker) = (self.changes(), self.of_pieces(pieces), self.flicker());
        let step = |i: usize| {
            json!({
                "seconds": (i + 1) as f64 / fps as f64,
                "change": changes[i].json(), "pieces": of_pieces[i].json(),
                // The last frame has none behind it.
                "flicker": flicker.get(i).copied().map(Apart::json),
            })
        };
        json!({
            "name": self.name, "rate": self.rate, "seconds": self.seconds,
            "change": Apart::all(&changes).json(), "pieces": Apart::all(&of_pieces).json(),
            "flicker": Apart::all(&flicker).json(), "steps": (0..changes.len()).map(step).collect::<Vec<_>>(),
        })
    }
}

/// Draw the changes from frame to frame, a curve a way.
pub(crate) fn plot(file: &Path, ways: &[Way], fps: usize) -> Result<()> {
    let mut dots = Vec::new();
    for (series, way) in ways.iter().enumerate() {
        let changes = way.changes();
        for (i, change) in changes.iter().enumerate() {
            let (x, y) = ((i + 1) as f64 / fps as f64, change.rms().unwrap_or_default());
            let label = if i + 1 == changes.len() { way.name.clone() } else { String::new() };
            let title = format!("{}: {x:.2} s, {y:.4}", way.name);
            dots.push(Dot { x, y, label, title, series, front: true });
        }
    }
    let series = ways.iter().map(|way| way.name.clone()).collect();
    let (x, y) = ("seconds of the clip", "change of the open share from frame to frame, root mean square");
    Ok(std::fs::write(file, Plot { x, y, log_x: false, dots, series, joined: Joined::Series }.file())?)
}
