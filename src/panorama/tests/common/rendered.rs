//! Shots rendered of a known world: a panorama's texels as the weights of cubic B-splines over its lat-long grid, which
//! holds next to nothing above half of the grid's Nyquist frequency.

use std::f64::consts::PI;

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;
use skinfit_panorama::latlong::{direction_to_uv, uv_to_direction};
use skinfit_panorama::lens::Lens;
use skinfit_panorama::picture::Picture;

/// Samples across a pixel.
const SAMPLES: usize = 4;

/// The world's radiance in a direction.
pub(crate) fn radiance(world: &Picture, direction: DVec3) -> [f64; 3] {
    let (u, v) = direction_to_uv(direction);
    let (x, y) = (u * world.width as f64 - 0.5, v * world.height as f64 - 0.5);
    let weights = |t: f64| {
        let s = 1.0 - t;
        let side = |t: f64| (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0;
        [s * s * s / 6.0, side(t), side(s), t * t * t / 6.0]
    };
    let (across, down) = (weights(x - x.floor()), weights(y - y.floor()));
    let mut sum = [0.0; 3];
    for (j, wy) in down.into_iter().enumerate() {
        // Beyond a pole, the sphere goes on half a turn around.
        let row = y.floor() as i64 + j as i64 - 1;
        let height = world.height as i64;
        let (row, turn) = match row {
            row if row < 0 => (-1 - row, world.width / 2),
            row if row >= height => (2 * height - 1 - row, world.width / 2),
            row => (row, 0),
        };
        for (i, wx) in across.into_iter().enumerate() {
            let column = (x.floor() as i64 + i as i64 - 1 + turn as i64).rem_euclid(world.width as i64);
            let texel = world.texels[row as usize * world.width + column as usize];
            for c in 0..3 {
                sum[c] += wx * wy * f64::from(texel[c]);
            }
        }
    }
    sum
}

/// A square shot of the world, each pixel the mean of 16 samples; black outside the image circle.
pub(crate) fn shot(world: &Picture, lens: &Lens, orientation: DQuat, size: usize) -> Picture {
    mean(size, size, |x, y| Some(radiance(world, orientation * lens.direction(DVec2::new(x, y))?)))
}

/// The panorama that a perfect stitch would be, each texel the mean of 16 samples.
pub(crate) fn truth(world: &Picture, width: usize) -> Picture {
    let height = width / 2;
    mean(width, height, |x, y| Some(radiance(world, uv_to_direction(x / width as f64, y / height as f64))))
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
    let (mut sum, mut signed, mut weights) = (0.0, 0.0, 0.0);
    for (i, (got, truth)) in got.texels.iter().zip(&truth.texels).enumerate() {
        let share = |at: usize, size: usize| (at as f64 + 0.5) / size as f64;
        let (u, v) = (share(i % 1024, 1024), share(i / 1024, 512));
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
