//! Light where no shot sees: the mean of what is around, at the coarsest distance that has any (push and pull;
//! Gortler et al. 1996). A black hole under a ball or behind a lens takes light away that was there.

use std::f64::consts::PI;

use crate::picture::Picture;

/// A level of the push: radiance times weight, and weight.
struct Level {
    width: usize,
    height: usize,
    pixels: Vec<([f64; 3], f64)>,
}

/// The share of the sphere whose texels no shot sees.
pub(super) fn unseen(seen: &[u8], width: usize) -> f64 {
    let height = seen.len() / width;
    let (mut none, mut all) = (0.0, 0.0);
    for (y, row) in seen.chunks_exact(width).enumerate() {
        let solid = (PI * (y as f64 + 0.5) / height as f64).sin();
        none += solid * row.iter().filter(|by| **by == 0).count() as f64;
        all += solid * width as f64;
    }
    none / all
}

/// Fills the texels that no shot sees; the others stay as they are.
pub(super) fn fill(panorama: &mut Picture, seen: &[u8]) {
    let (width, height) = (panorama.width, panorama.height);
    let pixel = |i: usize| {
        // By solid angle, so that a pole's row counts as the point that it is.
        let weight = if seen[i] > 0 { (PI * ((i / width) as f64 + 0.5) / height as f64).sin() } else { 0.0 };
        (panorama.texels[i].map(|x| weight * f64::from(x)), weight)
    };
    let mut levels = vec![Level { width, height, pixels: (0..width * height).map(pixel).collect() }];
    while levels[levels.len() - 1].width > 1 {
        let halved = levels[levels.len() - 1].halved();
        levels.push(halved);
    }
    // From the coarsest down, what has no weight takes the value of the level above.
    let mut above: Option<(Vec<[f64; 3]>, usize, usize)> = None;
    while let Some(level) = levels.pop() {
        let value = |i: usize| {
            let (sum, weight) = level.pixels[i];
            if weight > 0.0 {
                return sum.map(|s| s / weight);
            }
            let (x, y) = ((i % level.width) as f64 + 0.5, (i / level.width) as f64 + 0.5);
            above.as_ref().map_or([0.0; 3], |(values, width, height)| {
                bilinear(values, *width, *height, 0.5 * x, 0.5 * y)
            })
        };
        let values = (0..level.pixels.len()).map(value).collect();
        above = Some((values, level.width, level.height));
    }
    if let Some((values, ..)) = above {
        for (i, value) in values.into_iter().enumerate().filter(|(i, _)| seen[*i] == 0) {
            panorama.texels[i] = value.map(|x| x as f32);
        }
    }
}

impl Level {
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut pixels = vec![([0.0; 3], 0.0); width * height];
        for (i, (sum, weight)) in self.pixels.iter().enumerate() {
            let into = &mut pixels[i / self.width / 2 * width + i % self.width / 2];
            for c in 0..3 {
                into.0[c] += sum[c];
            }
            into.1 += weight;
        }
        Self { width, height, pixels }
    }
}

/// The value at a point, in pixels; columns go around, rows end.
fn bilinear(values: &[[f64; 3]], width: usize, height: usize, x: f64, y: f64) -> [f64; 3] {
    let (x, y) = (x - 0.5, (y - 0.5).clamp(0.0, (height - 1) as f64));
    let (left, row) = (x.floor(), y as usize);
    let (fx, fy) = (x - left, y - row as f64);
    let column = |at: f64| (at as i64).rem_euclid(width as i64) as usize;
    let (left, right, below) = (column(left), column(left + 1.0), (row + 1).min(height - 1));
    let at = |x: usize, y: usize| values[y * width + x];
    std::array::from_fn(|c| {
        let top = at(left, row)[c] * (1.0 - fx) + at(right, row)[c] * fx;
        let bottom = at(left, below)[c] * (1.0 - fx) + at(right, below)[c] * fx;
        top * (1.0 - fy) + bottom * fy
    })
}
