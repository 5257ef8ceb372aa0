//! A shot's ln luminance, at ever coarser levels.
//!
//! Means are taken of the logarithm, so that another exposure adds one number at every level; and over what the lens
//! shows only, as black around the image circle would darken its border.

use glam::DVec2;
use rayon::prelude::*;

use super::view::View;
use crate::picture::luminance;
use crate::robust::median;

/// One level: values, and how much of each is known.
struct Level {
    width: usize,
    height: usize,
    /// The value times how much is known, and how much is, 0 to 1.
    pixels: Vec<(f32, f32)>,
}

/// All levels, from the picture's own on.
pub(super) struct Pyramid {
    levels: Vec<Level>,
}

impl Pyramid {
    /// Of what a view shows, with `count` levels or as many as there are pixels for.
    pub(super) fn new(view: &View<'_>, count: usize) -> Self {
        let picture = &view.shot.picture;
        let shown = |i: usize| {
            let at = DVec2::new((i % picture.width) as f64 + 0.5, (i / picture.width) as f64 + 0.5);
            view.shot.lens.direction(at).is_some_and(|direction| view.shot.lens.depth(direction) > 0.0)
        };
        let lights: Vec<(f64, bool)> = (0..picture.texels.len())
            .into_par_iter()
            .map(|i| (luminance(picture.texels[i].map(f64::from)), shown(i)))
            .collect();
        let mut lit: Vec<f64> =
            lights.iter().filter(|(light, shown)| *shown && *light > 0.0).map(|at| at.0).collect();
        // What is darker than a hundredth of the median differs by noise.
        let floor = 0.01 * median(&mut lit).unwrap_or(1.0);
        let pixel = |(light, shown): (f64, bool)| {
            if shown { ((light.max(0.0) + floor).ln() as f32, 1.0) } else { (0.0, 0.0) }
        };
        let pixels = lights.into_iter().map(pixel).collect();
        let mut levels = vec![Level { width: picture.width, height: picture.height, pixels }];
        while levels.len() < count {
            let last = &levels[levels.len() - 1];
            if last.width.min(last.height) < 8 {
                break;
            }
            levels.push(last.halved());
        }
        Self { levels }
    }

    /// How many levels there are.
    pub(super) fn count(&self) -> usize {
        self.levels.len()
    }

    /// The bilinear value of a level at a point of the picture; `None` near what is not known.
    pub(super) fn at(&self, level: usize, point: DVec2) -> Option<f64> {
        let (of, scale) = (&self.levels[level], 0.5f64.powi(level as i32));
        let (x, y) = (point.x * scale - 0.5, point.y * scale - 0.5);
        if !(x >= 0.0 && y >= 0.0 && x <= (of.width - 1) as f64 && y <= (of.height - 1) as f64) {
            return None;
        }
        let (column, row) = ((x as usize).min(of.width.max(2) - 2), (y as usize).min(of.height.max(2) - 2));
        let (fx, fy) = (x - column as f64, y - row as f64);
        let (right, below) = ((column + 1).min(of.width - 1), (row + 1).min(of.height - 1));
        let (mut sum, mut known) = (0.0, 0.0);
        for (px, py, weight) in [
            (column, row, (1.0 - fx) * (1.0 - fy)),
            (right, row, fx * (1.0 - fy)),
            (column, below, (1.0 - fx) * fy),
            (right, below, fx * fy),
        ] {
            let (value, share) = of.pixels[py * of.width + px];
            sum += weight * f64::from(value);
            known += weight * f64::from(share);
        }
        (known > 0.9).then(|| sum / known)
    }
}

impl Level {
    /// Half the sides, by the binomial filter (Burt and Adelson 1983, at even places).
    fn halved(&self) -> Self {
        // Two pixels make one: their middle lies between them, so the filter has four taps.
        const TAPS: [(i64, f32); 4] = [(-1, 0.125), (0, 0.375), (1, 0.375), (2, 0.125)];
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let inside = |at: i64, size: usize| (0..size as i64).contains(&at);
        let row = |y: usize| -> Vec<(f32, f32)> {
            let pixel = |x: usize| {
                let (mut sum, mut known) = (0.0, 0.0);
                for (dy, wy) in TAPS {
                    let py = 2 * y as i64 + dy;
                    for (dx, wx) in TAPS {
                        let px = 2 * x as i64 + dx;
                        if inside(px, self.width) && inside(py, self.height) {
                            let (value, share) = self.pixels[py as usize * self.width + px as usize];
                            sum += wx * wy * value;
                            known += wx * wy * share;
                        }
                    }
                }
                (sum, known)
            };
            (0..width).map(pixel).collect()
        };
        let rows: Vec<_> = (0..height).into_par_iter().map(row).collect();
        Self { width, height, pixels: rows.into_iter().flatten().collect() }
    }
}
