//! How what is compared changes from pixel to pixel, and so how it moves with what is drawn (Lucas and Kanade, "An Iterative
//! Image Registration Technique", 1981, section 4).

use rayon::prelude::*;

use super::image::Picture;
use super::residual::{Colors, Differences, Residual};

/// How differences change over an image, to the right and down.
pub(super) struct Gradients {
    width: usize,
    cover: Vec<[f64; 2]>,
    color: Vec<Option<[[f64; 2]; 3]>>,
    colors: Colors,
}

impl Gradients {
    /// Of what is drawn, as it is compared with a target; of a colour beside one that is not compared, none.
    pub(super) fn new(residual: &Residual, drawn: &Picture, target: &Picture) -> Self {
        let (width, height) = (target.width, target.height);
        let cover = |i: usize| match (&target.alpha, &drawn.alpha) {
            (Some(_), Some(alpha)) => {
                change(beside(i, width, height), |j| f64::from(alpha[j])).map(|x| target.weight(i) * x)
            }
            _ => [0.0; 2],
        };
        let compared = &residual.differences.color;
        let color = |i: usize| {
            let beside = beside(i, width, height);
            let known = |at: &Beside| compared[at.before].is_some() && compared[at.after].is_some();
            let all = compared[i].is_some() && beside.iter().all(known);
            let channel = |c: usize| {
                let fitted = &residual.fitted[c];
                change(beside, |j| fitted.made(drawn, j, c)).map(|x| fitted.scale * x)
            };
            all.then(|| std::array::from_fn(channel))
        };
        let pixels = || (0..width * height).into_par_iter();
        let (cover, color) = (pixels().map(cover).collect(), pixels().map(color).collect());
        Self { width, cover, color, colors: residual.colors }
    }

    /// How the differences move as what is drawn moves by `motion` at each pixel: there comes what was that far to the left and
    /// above.
    pub(super) fn along(&self, motion: impl Fn(usize) -> [f64; 2]) -> Differences {
        let come = |i: usize, [right, down]: [f64; 2]| {
            let [u, v] = motion(i);
            -(u * right + v * down)
        };
        let cover = self.cover.iter().enumerate().map(|(i, &change)| come(i, change)).collect();
        let color = self.color.iter().enumerate();
        let color = color.map(|(i, change)| change.map(|change| change.map(|change| come(i, change))));
        Differences { cover, color: self.colors.of(color.collect(), self.width) }
    }
}

/// Two pixels along an axis of an image, and how far they lie apart.
#[derive(Clone, Copy)]
struct Beside {
    before: usize,
    after: usize,
    apart: f64,
}

/// The pixels to the left and right of one, and those above and below; at a border that one itself.
fn beside(i: usize, width: usize, height: usize) -> [Beside; 2] {
    let along = |at: usize, most: usize, step: usize| {
        let (less, more) = (usize::from(at > 0), usize::from(at + 1 < most));
        Beside { before: i - less * step, after: i + more * step, apart: (less + more).max(1) as f64 }
    };
    [along(i % width, width, 1), along(i / width, height, width)]
}

/// How a number changes from pixel to pixel.
fn change(beside: [Beside; 2], of: impl Fn(usize) -> f64) -> [f64; 2] {
    beside.map(|Beside { before, after, apart }| (of(after) - of(before)) / apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is drawn lies on planes over the image, and so moves by their slopes, coverage against the target's and colours by
    /// their weights; where a neighbour is not compared no colour moves.
    #[test]
    fn differences_move_by_the_slopes_of_what_is_drawn() {
        let (width, height) = (8, 6);
        let plane = |of: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..width * height).map(|i| of((i % width) as f32, (i / width) as f32)).collect()
        };
        let rgb = |of: Vec<f32>| of.into_iter().map(|x| [x, 2.0 * x, 0.0]).collect::<Vec<[f32; 3]>>();
        let layers = vec![rgb(plane(|x, y| 0.25 * x - 0.5 * y)), rgb(plane(|x, y| x * y))];
        let target = (0..width * height).map(|i| [0, 1, 2].map(|c| 3.0 * layers[0][i][c])).collect();
        let picture = |layers, alpha| Picture {
            width,
            height,
            layers,
            alpha: Some(alpha),
            mask: Vec::new(),
            plain: Vec::new(),
        };
        let alpha = plane(|x, _| if x < 6.0 { 1.0 } else { 0.5 });
        let drawn = picture(layers, alpha);
        let target = picture(vec![target], vec![1.0; width * height]);
        let residual = Residual::new(&drawn, &target, Colors::Whole);
        let moving = Gradients::new(&residual, &drawn, &target).along(|_| [2.0, 3.0]);
        // Right of the column where it falls by a half there comes what was two pixels to the left: half of that is known here.
        let fall = |x: usize| if x == 5 || x == 6 { 0.5 } else { 0.0 };
        assert!((0..width * height).all(|i| moving.cover[i] == fall(i % width)));
        // At the image's border between two pixels.
        let ahead = moving.color[2 * width].unwrap();
        assert!((ahead[0] - moving.color[2 * width + 1].unwrap()[0]).abs() < 1e-5, "{ahead:?}");
        // 3 (0.25 x - 0.5 y), moved by 2 to the right and 3 down, over the target's deviation.
        let inside = 2 * width + 2;
        let slope = -(2.0 * 0.75 - 3.0 * 1.5) * residual.fitted[0].scale;
        let found = moving.color[inside].unwrap();
        // Numbers of 32 bits make up the fit.
        assert!((found[0] - slope).abs() < 1e-5 * slope.abs(), "{found:?} {slope}");
        assert!(
            found[2] == 0.0
                && moving.color[2 * width + 5].is_none()
                && residual.differences.color[2 * width + 5].is_some()
        );
    }
}
