//! The lat-long panorama: its lookup, and its resampling to cubes (MODEL 1, 4).

use std::borrow::Cow;

use rayon::prelude::*;

use crate::model::cube::{Cube, corner_solid_angle, face_direction, texel_direction};
use crate::scene::maps::{Environment, Map};

/// Panoramas wider than this are first reduced, unless the cube that is made of them is finer: a texel of 0.18
/// degrees is a tenth of the sharpest lobe's width.
const FINEST_WIDTH: usize = 2048;

/// Samples within a texel are taken as even when they differ by less than this share of the sphere's
/// whole flux, were it in that texel.
const EVEN: f64 = 2e-5;

/// The texture coordinates of a unit direction: u = 1/2 + atan2(x, -z) / 2 pi, v = acos(y) / pi.
#[must_use]
#[inline]
pub fn direction_to_uv(d: [f64; 3]) -> (f64, f64) {
    use std::f64::consts::{PI, TAU};
    (0.5 + d[0].atan2(-d[2]) / TAU, d[1].clamp(-1.0, 1.0).acos() / PI)
}

/// The bilinear value of a `width x height` lat-long image along the unit direction `d`; u wraps,
/// v clamps. `texel(column, row)` reads the image, row 0 being +Y.
#[inline]
pub fn sample_latlong<const C: usize>(
    width: usize,
    height: usize,
    texel: impl Fn(usize, usize) -> [f64; C],
    d: [f64; 3],
) -> [f64; C] {
    let (u, v) = direction_to_uv(d);
    let x = u * width as f64 - 0.5;
    let y = (v * height as f64 - 0.5).clamp(0.0, (height - 1) as f64);
    let row = (y as usize).min(height.saturating_sub(2));
    let (fx, fy, below) = (x - x.floor(), y - row as f64, (row + 1).min(height - 1));
    // As u is from 0 to 1, half a texel beyond the first or the last column at most, where they wrap.
    let left = if x < 0.0 { width - 1 } else { x as usize };
    let right = if left + 1 < width { left + 1 } else { 0 };
    let (a, b, c, d) = (texel(left, row), texel(right, row), texel(left, below), texel(right, below));
    std::array::from_fn(|i| {
        let top = a[i] * (1.0 - fx) + b[i] * fx;
        let bottom = c[i] * (1.0 - fx) + d[i] * fx;
        top * (1.0 - fy) + bottom * fy
    })
}

/// A cube of `size` texels a side, each the solid-angle weighted mean of `sub x sub` samples of
/// `lookup` (by unit direction) within it; alpha is 0. All cores.
pub fn to_cube(size: usize, sub: usize, lookup: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> Cube<f64> {
    cube_of(size, |face, column, row| mean_over(face, column, row, size, sub, &lookup).0)
}

fn cube_of(size: usize, texel: impl Fn(usize, usize, usize) -> [f64; 3] + Sync) -> Cube<f64> {
    let rows: Vec<Vec<[f64; 3]>> = (0..6 * size)
        .into_par_iter()
        .map(|i| (0..size).map(|column| texel(i / size, column, i % size)).collect())
        .collect();
    Cube::from_fn(size, |face, column, row| {
        let [r, g, b] = rows[face * size + row][column];
        [r, g, b, 0.0]
    })
}

/// The mean of `lookup` over a texel, from `sub x sub` samples, and how far they lie apart.
fn mean_over(
    face: usize,
    column: usize,
    row: usize,
    size: usize,
    sub: usize,
    lookup: &impl Fn([f64; 3]) -> [f64; 3],
) -> ([f64; 3], f64) {
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let columns = column * sub..(column + 1) * sub;
    // Cells share corners, each of which costs an arc tangent.
    let corners = |y: usize| -> Vec<f64> {
        (columns.start..=columns.end).map(|x| corner_solid_angle(x, y, size * sub)).collect()
    };
    let mut above = corners(row * sub);
    for y in row * sub..(row + 1) * sub {
        let below = corners(y + 1);
        for (x, i) in columns.clone().zip(0..) {
            let weight = below[i + 1] - below[i] - above[i + 1] + above[i];
            let value = lookup(cell_direction(face, x, y, size * sub));
            for c in 0..3 {
                sum[c] += weight * value[c];
                least[c] = value[c].min(least[c]);
                most[c] = value[c].max(most[c]);
            }
            weights += weight;
        }
        above = below;
    }
    let apart = (0..3).map(|c| most[c] - least[c]).fold(0.0, f64::max);
    (sum.map(|s| s / weights), apart)
}

/// The unit direction through the middle of a cell's edges. The same as `texel_direction` but for
/// rounding, which decides at the poles, where u is undefined: this is the reference's order.
fn cell_direction(face: usize, column: usize, row: usize, size: usize) -> [f64; 3] {
    let edge = |i: usize| i as f64 * (2.0 / size as f64) - 1.0;
    let middle = |i: usize| 0.5 * (edge(i) + edge(i + 1));
    let d = face_direction(face, middle(column), middle(row));
    let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    d.map(|x| x / length)
}

/// An environment in world orientation, its rotation and intensity applied.
pub struct Radiance<'a> {
    map: Cow<'a, Map<3>>,
    /// Cosine and sine of the rotation.
    turn: (f64, f64),
    intensity: f64,
}

impl<'a> Radiance<'a> {
    /// The radiance of `environment` for the lobes; a very fine panorama is reduced first.
    #[must_use]
    pub fn new(environment: &'a Environment) -> Self {
        Self::for_cube(environment, 1)
    }

    /// The same for a cube of `size` texels a side: its four faces around the equator keep a column of the
    /// panorama a texel, where the panorama has as many.
    #[must_use]
    pub fn for_cube(environment: &'a Environment, size: usize) -> Self {
        let mut map = Cow::Borrowed(&environment.panorama);
        let halves = |map: &Map<3>| map.width.is_multiple_of(2) && map.height.is_multiple_of(2);
        while map.width > FINEST_WIDTH && map.width / 2 >= 4 * size && halves(&map) {
            map = Cow::Owned(halve(&map));
        }
        Self::of(map, environment, environment.rotation_degrees)
    }

    /// As [`Self::new`], turned by `rotation_degrees` about +Y instead of its own rotation.
    #[must_use]
    pub fn turned(environment: &'a Environment, rotation_degrees: f64) -> Self {
        let turn = rotation_degrees.to_radians();
        Self { turn: (turn.cos(), turn.sin()), ..Self::new(environment) }
    }

    /// The radiance of `environment` as fine as its file, turned by `rotation_degrees` about +Y instead of its own
    /// rotation: what a camera sees of it.
    #[must_use]
    pub fn whole(environment: &'a Environment, rotation_degrees: f64) -> Self {
        Self::of(Cow::Borrowed(&environment.panorama), environment, rotation_degrees)
    }

    fn of(map: Cow<'a, Map<3>>, environment: &Environment, rotation_degrees: f64) -> Self {
        let turn = rotation_degrees.to_radians();
        Self { map, turn: (turn.cos(), turn.sin()), intensity: environment.intensity }
    }

    /// Columns of the (reduced) panorama.
    #[must_use]
    pub fn width(&self) -> usize {
        self.map.width
    }

    /// The radiance from the unit direction `d` of the world: the panorama at Ry(r)^-1 d.
    #[must_use]
    #[inline]
    pub fn along(&self, d: [f64; 3]) -> [f64; 3] {
        let (cos, sin) = self.turn;
        let d = [cos * d[0] - sin * d[2], d[1], sin * d[0] + cos * d[2]];
        let Map { width, height, texels } = self.map.as_ref();
        let texel = |column: usize, row: usize| texels[row * width + column].map(f64::from);
        sample_latlong(*width, *height, texel, d).map(|x| x * self.intensity)
    }

    /// A cube of `size` texels a side: the mean radiance over each texel, from at least 3 x 3
    /// samples for each of the panorama's texels (more towards the poles, where those are narrow:
    /// up to 8 times, within 7 degrees), and from 16 times as many where they are far apart, so
    /// that a sun in one texel keeps its energy.
    #[must_use]
    pub fn to_cube(&self, size: usize) -> Cube<f64> {
        let texels = (6 * size * size) as f64;
        let even = EVEN * texels * self.brightness();
        cube_of(size, |face, column, row| {
            let d = texel_direction(face, column, row, size);
            let narrow = (1.0 - d[1] * d[1]).sqrt().max(0.125);
            let sub = (self.width() as f64 / size as f64 / narrow).ceil().max(2.0) as usize;
            let (mean, apart) = mean_over(face, column, row, size, sub, &|d| self.along(d));
            if apart <= even {
                return mean;
            }
            mean_over(face, column, row, size, 4 * sub, &|d| self.along(d)).0
        })
    }

    /// The mean radiance over the sphere, the brightest channel's.
    fn brightness(&self) -> f64 {
        let Map { width, height, texels } = self.map.as_ref();
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for (y, row) in texels.chunks_exact(*width).enumerate() {
            let sine = ((y as f64 + 0.5) / *height as f64 * std::f64::consts::PI).sin();
            row.iter().for_each(|t| (0..3).for_each(|c| sum[c] += sine * f64::from(t[c].abs())));
            weights += sine * *width as f64;
        }
        self.intensity.abs() * sum.iter().fold(0.0, |a: f64, &s| a.max(s)) / weights
    }
}

/// Half as wide and high, each texel the solid-angle weighted mean of four.
fn halve(map: &Map<3>) -> Map<3> {
    let (width, height) = (map.width / 2, map.height / 2);
    let sine = |row: usize| ((row as f64 + 0.5) / map.height as f64 * std::f64::consts::PI).sin();
    let texel = |i: usize| {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let (top, bottom) = (sine(y), sine(y + 1));
        let at = |dx: usize, dy: usize| map.texels[(y + dy) * map.width + x + dx];
        std::array::from_fn(|c| {
            let row = |dy: usize| f64::from(at(0, dy)[c]) + f64::from(at(1, dy)[c]);
            ((top * row(0) + bottom * row(1)) / (2.0 * (top + bottom))) as f32
        })
    };
    Map { width, height, texels: (0..width * height).into_par_iter().map(texel).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cube::texel_solid_angle;
    use crate::scene::maps::Spots;

    /// A panorama whose colour is its direction.
    fn compass(height: usize) -> Map<3> {
        use std::f64::consts::PI;
        let width = 2 * height;
        let texel = |i: usize| {
            let theta = ((i / width) as f64 + 0.5) / height as f64 * PI;
            let phi = ((i % width) as f64 + 0.5 - height as f64) / height as f64 * PI;
            [theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()].map(|x| x as f32)
        };
        Map { width, height, texels: (0..width * height).map(texel).collect() }
    }

    #[test]
    fn each_direction_finds_its_own_colour_and_a_rotation_turns_the_environment_the_right_way() {
        let still = Environment {
            panorama: compass(256),
            rotation_degrees: 0.0,
            intensity: 1.0,
            spots: Spots::default(),
        };
        let d = [0.48, -0.6, 0.64];
        let got = Radiance::new(&still).along(d);
        // Bilinear error: (pi / 256)^2 / 8 = 2e-5 in each axis, a little more towards the poles.
        assert!((0..3).all(|c| (got[c] - d[c]).abs() < 1e-4), "{got:?}");
        // Turned by +90 degrees, what was at -Z stands at -X.
        let turned = Environment { rotation_degrees: 90.0, intensity: 2.0, ..still };
        let got = Radiance::new(&turned).along([-1.0, 0.0, 0.0]);
        assert!((got[2] + 2.0).abs() < 2e-4 && got[0].abs() < 2e-4, "{got:?}");
    }

    #[test]
    fn one_bright_texel_keeps_its_flux_wherever_it_stands() {
        let (width, height) = (128, 64);
        let black = vec![[0.0; 3]; width * height];
        for (x, y) in [(0, 32), (64, 20), (77, 5), (127, 50), (40, 60)] {
            let mut texels = black.clone();
            texels[y * width + x] = [16336.0; 3];
            let panorama = Map { width, height, texels };
            let environment =
                Environment { panorama, rotation_degrees: 33.0, intensity: 1.0, spots: Spots::default() };
            let cube = Radiance::new(&environment).to_cube(64);
            let edge = |y: usize| (y as f64 / height as f64 * std::f64::consts::PI).cos();
            let want = 16336.0 * (edge(y) - edge(y + 1)) * std::f64::consts::TAU / width as f64;
            let got: f64 = (0..6 * 64 * 64)
                .map(|i| (i / 4096, i % 64, i / 64 % 64))
                .map(|(f, c, r)| cube.texel(f, c, r)[0] * texel_solid_angle(c, r, 64))
                .sum();
            // Twelve samples and more a texel: 1e-3 of the bilinear tent, which nearer the poles is
            // a curved one.
            assert!((got / want - 1.0).abs() < 0.01, "({x}, {y}): {got} {want}");
        }
    }

    #[test]
    fn a_fine_cube_keeps_what_a_fine_panorama_shows() {
        // Columns by turns dark and bright, which reducing makes grey.
        let (width, height) = (4096, 4);
        let texels = (0..width * height).map(|i| [(i % 2) as f32; 3]).collect();
        let panorama = Map { width, height, texels };
        let environment =
            Environment { panorama, rotation_degrees: 0.0, intensity: 1.0, spots: Spots::default() };
        let contrast = |radiance: &Radiance<'_>| {
            let along = |column: usize| {
                let phi = ((column as f64 + 0.5) / width as f64 - 0.5) * std::f64::consts::TAU;
                radiance.along([phi.sin(), 0.0, -phi.cos()])[0]
            };
            (0..64).map(|i| along(2 * i + 1) - along(2 * i)).sum::<f64>() / 64.0
        };
        // Columns to the bit but for atan2's rounding of a few 1e-16, times 4096 columns.
        assert!(contrast(&Radiance::for_cube(&environment, 1024)) > 1.0 - 1e-9);
        assert!(contrast(&Radiance::whole(&environment, 0.0)) > 1.0 - 1e-9);
        assert!(contrast(&Radiance::for_cube(&environment, 512)).abs() < 1e-9);
        assert_eq!(Radiance::for_cube(&environment, 513).width(), 4096);
        assert_eq!(Radiance::new(&environment).width(), 2048);
    }

    #[test]
    fn reducing_a_panorama_keeps_its_flux_and_a_constant() {
        let map = compass(64);
        let flux = |map: &Map<3>| -> [f64; 3] {
            let mut sum = [0.0; 3];
            for (i, texel) in map.texels.iter().enumerate() {
                let theta = ((i / map.width) as f64 + 0.5) / map.height as f64 * std::f64::consts::PI;
                let weight = theta.sin() / texel_count(map);
                (0..3).for_each(|c| sum[c] += weight * f64::from(texel[c].abs()));
            }
            sum
        };
        let (before, after) = (flux(&map), flux(&halve(&map)));
        for c in 0..3 {
            // The two rows' sines differ from their mean's by (pi / 64)^2 / 8 = 3e-4; texels where
            // the sign changes cancel within, 1 in 64 at most.
            assert!((before[c] - after[c]).abs() < 1e-3, "{before:?} {after:?}");
        }
        let grey = Map { width: 8, height: 4, texels: vec![[0.37, 1.0, 65504.0]; 32] };
        assert!(halve(&grey).texels.iter().all(|&t| t == [0.37, 1.0, 65504.0]));
    }

    fn texel_count(map: &Map<3>) -> f64 {
        map.texels.len() as f64
    }
}
