//! The scale about an image's centre and the shift that lay one silhouette over another.

use super::plane::Plane;

/// Silhouettes are laid over each other at no more pixels than this along their longer side: it finds a shift to a tenth
/// of a pixel there, as coverage is a share of the pixel.
const LONGEST: usize = 160;

/// The least share of the target that a move must leave to be compared.
const KNOWN: f64 = 0.6;

/// The search's first steps of scale and of pixels (of the reduced image), and how often both are halved.
const FIRST_SCALE: f64 = 0.04;
const FIRST_PIXELS: f64 = 4.0;
const HALVINGS: usize = 8;

/// A point c + d of an image with the centre c is moved to c + scale d + (x, y): pixels to the right and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moved {
    pub(super) scale: f64,
    pub(super) x: f64,
    pub(super) y: f64,
}

/// The move of `mesh` after which it covers `target` best, and the overlap of both then.
pub(super) fn lay_over(mesh: &Plane, target: &Plane) -> (Moved, f64) {
    let side = mesh.width.max(mesh.height).div_ceil(LONGEST).max(1);
    let (mesh, target) = (mesh.reduced(side), target.reduced(side));
    let none = Moved { scale: 1.0, x: 0.0, y: 0.0 };
    let starts = [Some(none), by_moments(&mesh, &target)];
    let found = starts.into_iter().flatten().map(|start| climb(&mesh, &target, start));
    let (moved, overlap) = found.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((none, 0.0));
    let pixels = side as f64;
    (Moved { scale: moved.scale, x: moved.x * pixels, y: moved.y * pixels }, overlap)
}

/// The move that makes areas and centres the same.
fn by_moments(mesh: &Plane, target: &Plane) -> Option<Moved> {
    let ((mesh_area, [mx, my]), (target_area, [tx, ty])) = (mesh.moments()?, target.moments()?);
    let scale = (target_area / mesh_area).sqrt();
    let (cx, cy) = centre(mesh);
    Some(Moved { scale, x: tx - cx - scale * (mx - cx), y: ty - cy - scale * (my - cy) })
}

/// Steps along scale, x and y for as long as one is better, then shorter ones.
fn climb(mesh: &Plane, target: &Plane, start: Moved) -> (Moved, f64) {
    let (mut best, mut overlap) = (start, overlap_after(mesh, target, start));
    let (mut scale_step, mut pixel_step) = (FIRST_SCALE, FIRST_PIXELS);
    for _ in 0..HALVINGS {
        loop {
            let Moved { scale, x, y } = best;
            let steps = [
                Moved { scale: scale * (1.0 + scale_step), ..best },
                Moved { scale: scale / (1.0 + scale_step), ..best },
                Moved { x: x + pixel_step, ..best },
                Moved { x: x - pixel_step, ..best },
                Moved { y: y + pixel_step, ..best },
                Moved { y: y - pixel_step, ..best },
            ];
            let tried = steps.map(|step| (step, overlap_after(mesh, target, step)));
            let (step, reached) =
                tried.into_iter().fold((best, overlap), |a, b| if b.1 > a.1 { b } else { a });
            if reached <= overlap {
                break;
            }
            (best, overlap) = (step, reached);
        }
        scale_step *= 0.5;
        pixel_step *= 0.5;
    }
    (best, overlap)
}

fn centre(plane: &Plane) -> (f64, f64) {
    (0.5 * plane.width as f64, 0.5 * plane.height as f64)
}

/// The overlap of the target and the moved mesh, where the mesh's image says what is there: a neck that its border cuts
/// goes on beyond it.
fn overlap_after(mesh: &Plane, target: &Plane, moved: Moved) -> f64 {
    let (cx, cy) = centre(mesh);
    let (mut both, mut either, mut known) = (0.0, 0.0, 0.0);
    for (y, row) in target.cover.chunks_exact(target.width).enumerate() {
        for (x, &asked) in row.iter().enumerate() {
            let from = |at: usize, shift: f64, c: f64| c + (at as f64 + 0.5 - shift - c) / moved.scale;
            let (u, v) = (from(x, moved.x, cx), from(y, moved.y, cy));
            if !((0.0..=mesh.width as f64).contains(&u) && (0.0..=mesh.height as f64).contains(&v)) {
                continue;
            }
            let cover = mesh.at(u, v);
            both += f64::from(asked.min(cover));
            either += f64::from(asked.max(cover));
            known += f64::from(asked);
        }
    }
    let whole: f64 = target.cover.iter().map(|&cover| f64::from(cover)).sum();
    // A move that leaves most of the target without anything to compare it with explains nothing.
    if either > 0.0 && known >= KNOWN * whole { both / either } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An egg with a nose: no symmetry hides a wrong move. Coverage as a share of 4 x 4 places in a pixel.
    fn head(width: usize, height: usize, moved: Moved) -> Plane {
        let mut plane = Plane { width, height, cover: vec![0.0; width * height] };
        let (cx, cy) = centre(&plane);
        for (y, row) in plane.cover.chunks_exact_mut(width).enumerate() {
            for (x, cover) in row.iter_mut().enumerate() {
                for place in 0..16 {
                    let (px, py) = (
                        x as f64 + f64::from(place % 4) / 4.0 + 0.125,
                        y as f64 + f64::from(place / 4) / 4.0 + 0.125,
                    );
                    let (dx, dy) = ((px - cx - moved.x) / moved.scale, (py - cy - moved.y) / moved.scale);
                    let egg = (dx / 22.0).powi(2) + (dy / 30.0).powi(2) < 1.0;
                    let nose = (dx - 20.0).powi(2) + (dy - 6.0).powi(2) < 49.0;
                    *cover += if egg || nose { 1.0 / 16.0 } else { 0.0 };
                }
            }
        }
        plane
    }

    #[test]
    fn a_known_move_is_found_again() {
        let here = Moved { scale: 1.0, x: 0.0, y: 0.0 };
        for (scale, x, y) in [(1.06, 0.0, 0.0), (0.9, 3.3, -2.1), (1.0, -11.0, 7.5), (1.3, 5.0, 0.0)] {
            let asked = Moved { scale, x, y };
            let (found, overlap) = lay_over(&head(120, 100, here), &head(120, 100, asked));
            // A tenth of a pixel at the silhouette, some 30 pixels from the centre.
            let near = |a: f64, b: f64, bound: f64| (a - b).abs() < bound;
            let close =
                near(found.scale, scale, 0.1 / 30.0) && near(found.x, x, 0.1) && near(found.y, y, 0.1);
            assert!(close, "{found:?} is not {asked:?}");
            assert!(overlap > 0.98, "{overlap}");
        }
    }
}
