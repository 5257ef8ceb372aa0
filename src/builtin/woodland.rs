//! The environment: a clearing in a wood, the low sun behind the trees. Lat-long, linear Rec.709,
//! the orientation of docs/model.md: the centre is -Z, the right quarter +X.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::noise::{bell, fractal, gradient_noise, lerp, smoothstep, uniform};

/// Texels around; half as many from zenith to nadir.
pub(super) const WIDTH: usize = 512;

/// Where the sun stands: behind the head, to its left, 13 degrees up.
const SUN: DVec3 = DVec3::new(0.42, 0.24, -0.876);
/// The break in the canopy that fills in from the front, at the picture's left.
const CLEARING: DVec3 = DVec3::new(-0.62, 0.50, 0.60);

/// The panorama, row by row from the zenith.
pub(super) fn panorama() -> Vec<[f32; 3]> {
    let height = WIDTH / 2;
    (0..WIDTH * height)
        .into_par_iter()
        .map(|i| {
            let mut sum = DVec3::ZERO;
            // Four rays a texel, as leaves are finer than texels.
            for sub in 0..4 {
                let offset = DVec2::new(0.25 + 0.5 * f64::from(sub % 2), 0.25 + 0.5 * f64::from(sub / 2));
                let at = DVec2::new((i % WIDTH) as f64, (i / WIDTH) as f64) + offset;
                let (u, v) = (at.x / WIDTH as f64, at.y / height as f64);
                sum += 0.25 * radiance(direction(u, v));
            }
            sum.as_vec3().to_array()
        })
        .collect()
}

/// The direction of image coordinates (u, v) in [0, 1].
fn direction(u: f64, v: f64) -> DVec3 {
    let (azimuth, polar) = ((u - 0.5) * TAU, v * PI);
    DVec3::new(polar.sin() * azimuth.sin(), polar.cos(), -polar.sin() * azimuth.cos())
}

/// Radiance that arrives from the unit direction `d`.
fn radiance(d: DVec3) -> DVec3 {
    let sun = SUN.normalize();
    let towards_sun = d.dot(sun);
    let angle = towards_sun.clamp(-1.0, 1.0).acos().to_degrees();
    let open = opening(d, angle);
    let mut out = sky(d, towards_sun) * open + foliage(d, towards_sun) * (1.0 - open);
    let trunk = trunks(d) * (1.0 - 0.8 * bell(angle, 3.0));
    out = out.lerp(DVec3::new(0.035, 0.028, 0.022) * (1.0 + 6.0 * bell(angle, 14.0)), trunk);
    out = out.lerp(ground(d, towards_sun), smoothstep(0.02, -0.06, d.y + 0.03 * fractal(d * 6.0, 3, 5)));
    let warm = DVec3::new(1.0, 0.80, 0.52);
    // The disc through the leaves, blurred as a small camera would, and its glow.
    out + warm * (260.0 * bell(angle, 2.0) + 9.0 * bell(angle, 7.0) + 1.2 * bell(angle, 20.0))
}

/// The share of sky seen between the leaves.
fn opening(d: DVec3, angle: f64) -> f64 {
    let leaves = 0.65 * fractal(d * 7.0, 5, 1) + 0.35 * fractal(d * 28.0, 3, 2);
    let clearing = d.dot(CLEARING.normalize()).clamp(-1.0, 1.0).acos().to_degrees();
    let threshold = 0.14 - 0.16 * d.y - 0.50 * bell(clearing, 24.0) - 0.22 * bell(angle, 16.0);
    smoothstep(threshold - 0.05, threshold + 0.10, leaves)
}

fn sky(d: DVec3, towards_sun: f64) -> DVec3 {
    let up = d.y.max(0.0);
    let clear = DVec3::new(1.45, 1.75, 2.20) * lerp(1.1, 0.75, up);
    clear + DVec3::new(3.2, 2.3, 1.2) * towards_sun.max(0.0).powi(6)
}

/// Leaves: darker in the depth of the wood, glowing green where the sun is behind them.
fn foliage(d: DVec3, towards_sun: f64) -> DVec3 {
    let depth = 0.6 + 0.8 * fractal(d * 4.0, 4, 3);
    let tone = gradient_noise(d * 3.0, 4);
    let green = DVec3::new(0.085 + 0.03 * tone, 0.115, 0.045) * depth.max(0.15);
    let lit = DVec3::new(0.95, 0.85, 0.22) * towards_sun.max(0.0).powi(5);
    green * (1.0 + 0.9 * d.y.max(0.0)) + lit * depth.max(0.1) * 0.8
}

/// How much of a trunk stands in the direction: two rows of trees, the nearer ones thicker.
fn trunks(d: DVec3) -> f64 {
    let azimuth = d.x.atan2(-d.z) / TAU + 0.5;
    let row = |count: i32, half_width: f64, top: f64, seed: u32| {
        let cell = (azimuth * f64::from(count)).floor() as i32;
        let mut found: f64 = 0.0;
        for i in cell - 1..=cell + 1 {
            let id = glam::IVec3::new(i.rem_euclid(count), 0, 0);
            let place = (f64::from(i) + uniform(id, seed)) / f64::from(count);
            let lean = 0.02 * (uniform(id, seed + 1) - 0.5) * d.y
                + 0.002 * gradient_noise(DVec3::new(f64::from(i), d.y * 5.0, 0.0), seed);
            let width = half_width * (0.5 + uniform(id, seed + 2)) * (1.0 - 0.45 * d.y.max(0.0));
            let across = (azimuth - place - lean).abs();
            let fade = smoothstep(top, 0.5 * top, d.y);
            found = found.max(smoothstep(width, 0.7 * width, across) * fade);
        }
        found
    };
    row(17, 0.0075, 1.0, 301).max(0.8 * row(47, 0.0026, 0.55, 311))
}

/// The forest floor: litter, moss, and flecks of sun.
fn ground(d: DVec3, towards_sun: f64) -> DVec3 {
    let floor = d / (-d.y).max(0.08);
    let litter = 0.5 + 0.5 * fractal(floor * 2.5, 4, 6);
    let moss = smoothstep(-0.1, 0.4, fractal(floor * 0.8, 3, 7));
    let base = DVec3::new(0.20, 0.135, 0.075).lerp(DVec3::new(0.10, 0.15, 0.05), moss) * (0.4 + litter);
    let flecks = smoothstep(0.28, 0.42, fractal(floor * 1.6, 3, 8));
    base + DVec3::new(1.5, 1.15, 0.65) * flecks * (0.25 + towards_sun.max(0.0))
}
