//! Whether what a target shows lies where the mesh is: a wrong camera bends constants without a word.
//!
//! The target's alpha is laid over the mesh's coverage. Where they overlap too little, the simplest mistake that brings
//! them together is named: targets that were swapped, an image that is mirrored, a field of view, a shift.
//!
//! - `plane`: coverage of an image, and what may be done to it
//! - `register`: the scale and shift that lay one over another

mod plane;
mod register;

use crate::samples::ViewSamples;
use crate::scene::view::{Camera, View};

use plane::{Plane, Turned};
use register::Moved;

/// Silhouettes of this share less overlap are the same: path-traced targets and traced samples of one camera lack 1.1%
/// at most (their pixels at the edge are noisy), a field of view that is 3% wrong more.
const APART: f64 = 0.03;

/// Where an image is small its edge is much of it: an edge that is sharp in one and soft in the other is off by so much of
/// each of its pixels in the mean.
const EDGE: f64 = 0.25;

/// By how much a mistake's overlap has to be nearer to the whole than the scene's own, to be named as the likely one.
const NEARER: f64 = 0.5;

/// A shift below this share of the image's height, and a scale as near to 1, is none.
const NONE: f64 = 0.005;

/// A target's silhouette that does not lie where the mesh is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Apart<'a> {
    /// The view's name.
    view: &'a str,
    /// Covered by both, over what either covers.
    overlap: f64,
    likely: Likely<'a>,
}

/// What would bring the two together.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Likely<'a> {
    /// The target shows what another view sees.
    Swapped { other: &'a str, overlap: f64 },
    /// The target is turned.
    Turned { how: Turned, overlap: f64 },
    /// The camera's field of view is another, or its distance.
    Zoomed { from: f64, to: f64, scale: f64, overlap: f64 },
    /// The image is displaced, and perhaps of another scale as well.
    Displaced { moved: Moved, overlap: f64 },
    /// None of these.
    Other { best: f64 },
}

/// What is to be said of a scene's views, whose samples are in their order; nothing of a target that has no alpha, or
/// whose alpha is the same everywhere: it shows no silhouette.
pub(super) fn warnings(scene: &str, views: &[View], samples: &[ViewSamples]) -> Vec<String> {
    let shows = |view: &View| view.target.as_ref().is_some_and(|target| target.alpha.is_some());
    if !views.iter().any(shows) {
        return Vec::new();
    }
    let meshes: Vec<Plane> =
        views.iter().zip(samples).map(|(view, samples)| Plane::of_mesh(view, samples)).collect();
    let apart = (0..meshes.len()).filter_map(|i| look(i, views, &meshes));
    apart.map(|apart| format!("{scene}: {}", apart.told())).collect()
}

/// Compare view `i`'s target with the mesh.
fn look<'a>(i: usize, views: &'a [View], meshes: &[Plane]) -> Option<Apart<'a>> {
    let (view, mesh) = (&views[i], &meshes[i]);
    let target = Plane::of_target(view)?;
    let overlap = target.overlap(mesh);
    let same = 1.0 - APART.max(EDGE * target.edge());
    if overlap >= same {
        return None;
    }
    // What brings them together so far that it is the likely mistake.
    let enough = same.min(1.0 - NEARER * (1.0 - overlap));
    let others = views.iter().zip(meshes).enumerate().filter(|&(j, (other, _))| {
        let size = |camera: &Camera| (camera.width, camera.height);
        j != i && size(&other.camera) == size(&view.camera)
    });
    let swapped = others.map(|(_, (other, mesh))| (other.name.as_str(), target.overlap(mesh)));
    let turned = Turned::ALL.into_iter().map(|how| (how, target.turned(how).overlap(mesh)));
    // Heads overlap much from any side: another view, or another turn, has to be it.
    let likely = if let Some((other, overlap)) = largest(swapped).filter(|(_, o)| *o >= same) {
        Likely::Swapped { other, overlap }
    } else if let Some((how, overlap)) = largest(turned).filter(|(_, o)| *o >= same) {
        Likely::Turned { how, overlap }
    } else {
        let (moved, overlap) = register::lay_over(mesh, &target);
        if overlap >= enough {
            of_move(&view.camera, moved, overlap)
        } else {
            Likely::Other { best: overlap }
        }
    };
    Some(Apart { view: &view.name, overlap, likely })
}

/// The larger second entry.
fn largest<T>(found: impl Iterator<Item = (T, f64)>) -> Option<(T, f64)> {
    found.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// A scale about the image's centre is a field of view.
fn of_move(camera: &Camera, moved: Moved, overlap: f64) -> Likely<'static> {
    let shift = moved.x.hypot(moved.y) / f64::from(camera.height);
    if shift < NONE && (moved.scale - 1.0).abs() >= NONE {
        let to = 2.0 * ((0.5 * camera.fov_y).tan() / moved.scale).atan();
        return Likely::Zoomed { from: camera.fov_y, to, scale: moved.scale, overlap };
    }
    Likely::Displaced { moved, overlap }
}

impl Apart<'_> {
    /// What is wrong, by how much, and what to do.
    fn told(&self) -> String {
        let Self { view, overlap, likely } = *self;
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let begin = format!(
            "view \"{view}\": the silhouettes of its target and of the mesh overlap by {}",
            percent(overlap)
        );
        let ending = match likely {
            Likely::Swapped { other, overlap } => {
                format!("the target fits view \"{other}\" ({}). Are their targets swapped?", percent(overlap))
            }
            Likely::Turned { how, overlap } => format!(
                "the target {} fits ({}). Save it the other way round, or mend the camera.",
                how.told(),
                percent(overlap)
            ),
            Likely::Zoomed { from, to, scale, overlap } => format!(
                "with fov_y_degrees = {:.2} instead of {:.2} they would by {} (or with a camera {:.3} times as far away).",
                to.to_degrees(),
                from.to_degrees(),
                percent(overlap),
                1.0 / scale
            ),
            Likely::Displaced { moved: Moved { scale, x, y }, overlap } => {
                let zoom = if (scale - 1.0).abs() < NONE {
                    String::new()
                } else {
                    format!(", and is {scale:.3} times as large")
                };
                let (right, down) = (direction(x, "right", "left"), direction(y, "down", "up"));
                format!(
                    "the target's lies {right} and {down}{zoom}; so moved, they would by {}. Mend the view's \
                     world_to_camera, crop the target as the camera sees it, or have the fit move the camera there: \
                     cameras = true in [fit].",
                    percent(overlap)
                )
            }
            Likely::Other { best } => format!(
                "no shift and no scale brings them beyond {}: another camera, pose or mesh than the target's. Compare \
                 the picture of a render with it.",
                percent(best)
            ),
        };
        format!("{begin}: {ending}")
    }
}

/// A length in pixels, with its side.
fn direction(pixels: f64, positive: &str, negative: &str) -> String {
    format!("{:.1} pixels {}", pixels.abs(), if pixels < 0.0 { negative } else { positive })
}
