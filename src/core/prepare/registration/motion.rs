//! How what a camera sees moves over its image as the camera moves: places of the mesh move, and their colours with them.
//!
//! What the camera's place changes of a colour (gloss, the rim) is left out, and so is how the weights of terms change that make
//! colours nearest to the target's: of a step of a pixel both are little. Steps end where differences have no share along these
//! slopes, which is the loss' minimum but for that.

use glam::Vec3;
use rayon::prelude::*;

use super::unknowns::{COUNT, Pixels};
use crate::scene::view::Camera;

/// To either side, in pixels, where places are projected: far from roundings of f64, near enough to be straight.
const STEP: f64 = 1e-3;

/// Pixels beyond a border that move with it: one that it covers a part of, and the next, whose gradient reaches there.
const RINGS: usize = 2;

/// By how many pixels a place moves to the right and down, for a pixel of each unknown.
type OfUnknowns = [[f64; 2]; COUNT];

/// By how many pixels, to the right and down, what each pixel shows moves for a pixel of each unknown.
pub(super) struct Motion(Vec<OfUnknowns>);

impl Motion {
    /// Of what is at `places`, `None` where a pixel shows none of it. A border reaches into pixels beside it: these move as
    /// those around them do.
    pub(super) fn new(camera: &Camera, places: &[Option<Vec3>], pixels: &Pixels) -> Self {
        let moved: Vec<[Camera; 2]> = (0..COUNT)
            .map(|unknown| {
                [STEP, -STEP].map(|step| {
                    let mut by = [0.0; COUNT];
                    by[unknown] = step;
                    pixels.moved(camera, &by)
                })
            })
            .collect();
        let of = |place: &Option<Vec3>| {
            place.map(|place| {
                std::array::from_fn(|unknown| {
                    let [ahead, behind] =
                        moved[unknown].each_ref().map(|camera| camera.project(place.as_dvec3()));
                    [ahead.0 - behind.0, ahead.1 - behind.1].map(|pixels| pixels / (2.0 * STEP))
                })
            })
        };
        let mut known: Vec<Option<OfUnknowns>> = places.par_iter().map(of).collect();
        let width = camera.width as usize;
        for _ in 0..RINGS {
            known = (0..known.len())
                .into_par_iter()
                .map(|i| known[i].or_else(|| around(&known, width, i)))
                .collect();
        }
        Self(known.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// What pixel `i` shows, along an unknown.
    pub(super) fn at(&self, i: usize, unknown: usize) -> [f64; 2] {
        self.0[i][unknown]
    }
}

/// The mean of those of the eight pixels around one that move; `None` where none does.
fn around(known: &[Option<OfUnknowns>], width: usize, i: usize) -> Option<OfUnknowns> {
    let (x, y) = (i % width, i / width);
    let near = |at: usize, most: usize| at.saturating_sub(1)..(at + 2).min(most);
    let beside = near(y, known.len() / width).flat_map(|y| near(x, width).map(move |x| y * width + x));
    let mut sum = OfUnknowns::default();
    let mut count = 0.0;
    for motion in beside.filter_map(|j| known[j].as_ref()) {
        sum.iter_mut().flatten().zip(motion.as_flattened()).for_each(|(sum, motion)| *sum += motion);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|motion| motion.map(|sum| sum / count)))
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DVec3, vec3};

    use super::*;
    use crate::scene::mesh::PosedMesh;

    #[test]
    fn what_is_seen_moves_as_its_places_are_projected_and_its_border_with_it() {
        let corners =
            [vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0), vec3(1.0, -1.0, 0.5), vec3(-0.3, 0.9, 0.0)];
        let mesh = PosedMesh { positions: corners.to_vec(), ..PosedMesh::default() };
        let world_to_camera =
            DMat4::from_translation(DVec3::new(0.2, 0.1, -9.0)) * DMat4::from_rotation_y(0.3);
        let camera = Camera::pinhole(world_to_camera, 0.4, [6, 5]);
        let pixels = Pixels::new(&camera, &mesh).unwrap();
        let mut places = vec![None; 30];
        // A, B
        // . C
        (places[0], places[1], places[7]) = (Some(corners[0]), Some(corners[1]), Some(corners[2]));
        let motion = Motion::new(&camera, &places, &pixels);
        for unknown in 0..COUNT {
            let step = 1e-4;
            let by: [f64; COUNT] = std::array::from_fn(|k| if k == unknown { step } else { 0.0 });
            let moved = pixels.moved(&camera, &by);
            let exact = |place: Vec3| {
                let [(x, y, _), (u, v, _)] = [&camera, &moved].map(|camera| camera.project(place.as_dvec3()));
                [(u - x) / step, (v - y) / step]
            };
            let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-3;
            // The difference to one side bends by a ten-thousandth of what moves, some pixels.
            for (pixel, corner) in [0, 1, 7].into_iter().zip(corners) {
                assert!(near(motion.at(pixel, unknown), exact(corner)), "{pixel}, {unknown}");
            }
            // Beside all three, beside the last two, and below the last; then the ring around those; then none.
            let mean = |of: &[usize]| {
                [0, 1].map(|axis| {
                    of.iter().map(|&i| motion.at(i, unknown)[axis]).sum::<f64>() / of.len() as f64
                })
            };
            let alike = |pixel: usize, of: &[usize]| {
                let (found, wanted) = (motion.at(pixel, unknown), mean(of));
                // Roundings of means.
                (0..2).all(|axis| (found[axis] - wanted[axis]).abs() < 1e-12)
            };
            assert!(alike(6, &[0, 1, 7]) && alike(2, &[1, 7]) && alike(14, &[7]), "{unknown}");
            assert!(alike(3, &[2, 8]) && alike(21, &[14]), "{unknown}");
            assert_eq!(motion.at(29, unknown), [0.0; 2]);
        }
    }
}
