//! The panorama's texels: each the blend of what the shots that see it show.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::view::View;
use crate::latlong::uv_to_direction;

/// Samples across a texel, at most: a shot 16 times as fine as the panorama still counts in whole.
const MOST_SAMPLES: f64 = 16.0;

/// A blended panorama.
pub(super) struct Blend {
    pub(super) texels: Vec<[f32; 3]>,
    /// How many shots each texel is made of.
    pub(super) seen: Vec<u8>,
}

/// Blends views, each times its gain, into a panorama; weights rise to 1 over `feather` radians inside a border.
pub(super) fn blend(views: &[View<'_>], gains: &[f64], width: usize, feather: f64) -> Blend {
    let height = width / 2;
    let row = |y: usize| -> Vec<([f32; 3], u8)> {
        (0..width).map(|x| texel(views, gains, (x, y), (width, height), feather)).collect()
    };
    let rows: Vec<_> = (0..height).into_par_iter().map(row).collect();
    let (texels, seen) = rows.into_iter().flatten().unzip();
    Blend { texels, seen }
}

fn texel(
    views: &[View<'_>],
    gains: &[f64],
    (x, y): (usize, usize),
    (width, height): (usize, usize),
    feather: f64,
) -> ([f32; 3], u8) {
    let (mut sum, mut weights, mut seen) = ([0.0; 3], 0.0, 0u8);
    for (view, gain) in views.iter().zip(gains) {
        if let Some((mean, weight)) = mean(view, (x, y), (width, height), feather) {
            for c in 0..3 {
                sum[c] += weight * gain * mean[c];
            }
            weights += weight;
            seen = seen.saturating_add(1);
        }
    }
    if seen == 0 {
        return ([0.0; 3], 0);
    }
    // A panorama is never negative (skinfit-core refuses one); a picture that was resampled before may be.
    (sum.map(|s| (s / weights).clamp(0.0, f64::from(f32::MAX)) as f32), seen)
}

/// A view's mean over a texel, weighted by solid angle and depth, and its weight; `None` where it sees nothing of it.
fn mean(
    view: &View<'_>,
    (x, y): (usize, usize),
    (width, height): (usize, usize),
    feather: f64,
) -> Option<([f64; 3], f64)> {
    let direction = |x: f64, y: f64| uv_to_direction(x / width as f64, y / height as f64);
    let (across, down) = samples(view, (x, y), height, direction);
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for j in 0..down {
        let v = y as f64 + (j as f64 + 0.5) / down as f64;
        let solid = (PI * v / height as f64).sin();
        for i in 0..across {
            let Some((point, depth)) = view.look(direction(x as f64 + (i as f64 + 0.5) / across as f64, v))
            else {
                continue;
            };
            let weight = solid * smoothstep(depth / feather);
            let radiance = view.shot.picture.bicubic(point);
            for c in 0..3 {
                sum[c] += weight * radiance[c];
            }
            weights += weight;
        }
    }
    let middle = (PI * (y as f64 + 0.5) / height as f64).sin();
    let weight = weights / ((across * down) as f64 * middle);
    (weights > 0.0).then(|| (sum.map(|s| s / weights), weight))
}

/// How many samples a texel takes to the right and down, so that none of the view's pixels falls between two.
fn samples(
    view: &View<'_>,
    (x, y): (usize, usize),
    height: usize,
    direction: impl Fn(f64, f64) -> DVec3,
) -> (usize, usize) {
    let point = |x: f64, y: f64| view.look(direction(x, y)).map(|(point, _)| point);
    let (x, y) = (x as f64, y as f64);
    let span = |a, b| match (a, b) {
        (Some(a), Some(b)) => DVec2::distance(a, b),
        // Across the border the pixels are about as wide as in the middle.
        _ => PI / height as f64 / view.pixel_angle(),
    };
    let across = span(point(x, y + 0.5), point(x + 1.0, y + 0.5));
    let down = span(point(x + 0.5, y), point(x + 0.5, y + 1.0));
    let count = |span: f64| span.ceil().clamp(1.0, MOST_SAMPLES) as usize;
    (count(across), count(down))
}

/// 0 at 0, 1 from 1 on, level at both.
fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
