//! Shots rendered of a known world, which is a radiance for each direction.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;
use skinfit_panorama::latlong::uv_to_direction;
use skinfit_panorama::lens::Lens;
use skinfit_panorama::picture::Picture;

/// Samples across a pixel.
const SAMPLES: usize = 4;

/// A square shot of the world, each pixel the mean of 16 samples; black outside the image circle.
pub(crate) fn shot(
    world: impl Fn(DVec3) -> [f64; 3] + Sync,
    lens: &Lens,
    orientation: DQuat,
    size: usize,
) -> Picture {
    mean(size, size, |x, y| Some(world(orientation * lens.direction(DVec2::new(x, y))?)))
}

/// The panorama that a perfect stitch would be, each texel the mean of 16 samples.
pub(crate) fn truth(world: impl Fn(DVec3) -> [f64; 3] + Sync, width: usize) -> Picture {
    let height = width / 2;
    mean(width, height, |x, y| Some(world(uv_to_direction(x / width as f64, y / height as f64))))
}

fn mean(width: usize, height: usize, at: impl Fn(f64, f64) -> Option<[f64; 3]> + Sync) -> Picture {
    let pixel = |i: usize| {
        let mut sum = [0.0; 3];
        for sample in 0..SAMPLES * SAMPLES {
            let inside = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
            let (x, y) = (
                (i % width) as f64 + inside(sample % SAMPLES),
                (i / width) as f64 + inside(sample / SAMPLES),
            );
            let value = at(x, y).unwrap_or([0.0; 3]);
            for c in 0..3 {
                sum[c] += value[c] / (SAMPLES * SAMPLES) as f64;
            }
        }
        sum.map(|x| x as f32)
    };
    Picture { width, height, texels: (0..width * height).into_par_iter().map(pixel).collect() }
}

/// The mean over the sphere, by solid angle, and over the channels of |got / truth - 1|, where `counts` says so by the
/// texel's direction; and that of got / truth - 1 with its sign.
pub(crate) fn error(got: &Picture, truth: &Picture, counts: impl Fn(DVec3) -> bool) -> (f64, f64) {
    let (width, mut sum, mut signed, mut weights) = (truth.width, 0.0, 0.0, 0.0);
    for (i, (got, truth)) in got.texels.iter().zip(&truth.texels).enumerate() {
        let share = |at: usize, size: usize| (at as f64 + 0.5) / size as f64;
        let (u, v) = (share(i % width, width), share(i / width, width / 2));
        if counts(uv_to_direction(u, v)) {
            let solid = (PI * v).sin();
            for c in 0..3 {
                let relative = f64::from(got[c]) / f64::from(truth[c]).max(1e-9) - 1.0;
                sum += solid * relative.abs();
                signed += solid * relative;
                weights += solid;
            }
        }
    }
    (sum / weights, signed / weights)
}
