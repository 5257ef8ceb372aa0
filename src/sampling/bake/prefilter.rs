//! The radial filter F(r) = int L(w) k(r.w) dw / int k(r.w) dw: Phong lobes k = max(r.w, 0)^e (MODEL 4), and
//! the lobes of BRDFs (MODEL 9).
//!
//! Exponent 1 is irradiance / pi. Both integrals are sums over the same cells, and the mean radiance
//! is taken out before and added after, so that a constant environment stays exactly that constant.
//! Each cell counts with the mean of the lobe over it to second order (see `lobe_kernel`).

use std::borrow::Borrow;
use std::f64::consts::{FRAC_PI_2, TAU};

use fearless_simd::Level;
use rayon::prelude::*;

use super::lobe_kernel::{BLOCK, Cells, Ggx, Kelemen, Lobe, WIDE, Weigh, gather};
use super::panorama::Radiance;
use super::pyramid::{Cell, Pyramid, Visit};
use super::radial::Radial;
use crate::model::cube::{Cube, texel_direction, texel_solid_angle};
use crate::scene::maps::luminance;
use crate::specular::SpecularModel;
use crate::with_simd;

/// Cells are wide by this share of a lobe's standard deviation, at most (see `pyramid`).
const CELL_WIDTH: f64 = 0.5;
/// Nor are they wider than this (radians): wide lobes end at the horizon, which cuts through cells.
const WIDEST_CELL: f64 = 0.05;
/// An unevenly lit cell is split when it may move the result by this share of the mean radiance.
const CELL_TOLERANCE: f64 = 3e-5;
/// Deviations from a bell's peak beyond which (1 + t^2)^2 exp(-t^2 / 2) is below its 3 at the peak, and falls.
const TAIL: f64 = 2.26;
/// Texels along the face of the finest source: 0.35 degrees, a quarter of the standard deviation of
/// the sharpest lobe (exponent 2048).
const FINEST: usize = 256;
/// The exponent from which on a Phong lobe is so narrow that each tile of the output has cells of its own.
const NARROW: f64 = 16.0;
/// Texels along the side of a tile of the output, whose texels share a list of blocks.
const TILE: usize = 8;

/// An environment that is ready to be filtered with any exponent.
pub struct Prefilter {
    pyramid: Pyramid,
}

/// Cells, and a cone around them.
struct Block {
    cells: [Cells; BLOCK],
    axis: [f64; 3],
    /// Half angle of the cone of directions whose lobes reach into the block, radians.
    reach: f64,
}

impl Prefilter {
    /// Prepare the rgb of `environment`, a piecewise constant cube.
    #[must_use]
    pub fn new(environment: &Cube<f64>) -> Self {
        Self { pyramid: Pyramid::new(environment) }
    }

    /// Prepare `radiance`, on a cube that is fine enough for its panorama and for every exponent
    /// of the parameter table.
    #[must_use]
    pub fn of(radiance: &Radiance<'_>) -> Self {
        let size = (radiance.width() / 2).next_power_of_two().clamp(16, FINEST);
        Self::new(&radiance.to_cube(size))
    }

    /// The mean radiance over each texel of a cube of `size` texels a side, where that is a power
    /// of 2 times coarser than the cube that is filtered; alpha is 0.
    #[must_use]
    pub fn means(&self, size: usize) -> Option<Cube<f64>> {
        self.pyramid.means(size)
    }

    /// The environment filtered for the centre of each texel of a cube of `size` texels a side;
    /// alpha is the Rec.709 luminance. All cores; `progress` is called with the number of texels
    /// done since the last call.
    #[must_use]
    pub fn lobe(&self, size: usize, exponent: f64, progress: impl Fn(u64) + Sync) -> Cube<f32> {
        self.lobe_at(Level::new(), size, exponent, progress)
    }

    /// As [`Self::lobe`], with the instructions of `level`.
    #[must_use]
    pub fn lobe_at(
        &self,
        level: Level,
        size: usize,
        exponent: f64,
        progress: impl Fn(u64) + Sync,
    ) -> Cube<f32> {
        self.radial_at(level, size, Radial::Phong(exponent), progress)
    }

    /// As [`Self::lobe`], with any radial weight.
    #[must_use]
    pub fn radial(&self, size: usize, radial: Radial, progress: impl Fn(u64) + Sync) -> Cube<f32> {
        self.radial_at(Level::new(), size, radial, progress)
    }

    fn radial_at(
        &self,
        level: Level,
        size: usize,
        radial: Radial,
        progress: impl Fn(u64) + Sync,
    ) -> Cube<f32> {
        match radial {
            Radial::Phong(exponent) => self.bell(level, size, radial, Lobe::new(exponent), progress),
            Radial::Brdf(SpecularModel::Kelemen, m) => {
                self.bell(level, size, radial, Kelemen::new(m), progress)
            }
            Radial::Brdf(SpecularModel::Ggx, m) => {
                let about = |directions: &[[f64; 3]]| self.blocks_of_tail(m * m, directions);
                self.filtered(level, size, about, Ggx::new(m), progress)
            }
        }
    }

    /// Lobes that fall as a Gaussian does. Wide ones reach nearly all cells, which then are found once for all tiles.
    fn bell(
        &self,
        level: Level,
        size: usize,
        radial: Radial,
        lobe: impl Weigh,
        progress: impl Fn(u64) + Sync,
    ) -> Cube<f32> {
        if radial.exponent() < NARROW {
            let blocks = self.blocks(radial);
            let near = |directions: &[[f64; 3]]| blocks_near(&blocks, directions);
            return self.filtered(level, size, near, lobe, progress);
        }
        let about = |directions: &[[f64; 3]]| self.blocks_of_bell(radial, directions);
        self.filtered(level, size, about, lobe, progress)
    }

    /// `near` yields the blocks that lobes about the directions of a tile reach.
    fn filtered<B: Borrow<[Cells; BLOCK]>>(
        &self,
        level: Level,
        size: usize,
        near: impl Fn(&[[f64; 3]]) -> Vec<B> + Sync,
        lobe: impl Weigh,
        progress: impl Fn(u64) + Sync,
    ) -> Cube<f32> {
        let tiles = size.div_ceil(TILE);
        let filtered: Vec<Vec<[f32; 4]>> = (0..6 * tiles * tiles)
            .into_par_iter()
            .map(|tile| {
                let directions = tile_directions(tile, tiles, size);
                let near = near(&directions);
                let texel = |&r: &[f64; 3]| {
                    let cells = || near.iter().map(B::borrow);
                    let sums = with_simd!(level, simd => gather(simd, cells(), r, lobe));
                    self.finish(sums)
                };
                let texels: Vec<[f32; 4]> = directions.iter().map(texel).collect();
                progress(texels.len() as u64);
                texels
            })
            .collect();
        Cube::from_fn(size, |face, column, row| {
            let tile = &filtered[(face * tiles + row / TILE) * tiles + column / TILE];
            let across = TILE.min(size - column / TILE * TILE);
            tile[row % TILE * across + column % TILE]
        })
    }

    /// Radiance from the sums of weight and weighted flux.
    fn finish(&self, [weight, red, green, blue]: [f64; 4]) -> [f32; 4] {
        let sums = [red, green, blue];
        let rgb: [f32; 3] = std::array::from_fn(|c| {
            let mean = self.pyramid.mean[c];
            let [least, greatest] = self.pyramid.range[c];
            // A mean lies within the range; rounding beside a sun could leave it.
            ((f64::from(mean) + sums[c] / weight) as f32).clamp(least, greatest)
        });
        [rgb[0], rgb[1], rgb[2], luminance(rgb)]
    }

    fn blocks(&self, radial: Radial) -> Vec<Block> {
        let exponent = radial.exponent();
        let width = (CELL_WIDTH / exponent.sqrt()).min(WIDEST_CELL);
        let cells = self.pyramid.cells_for(exponent, width, CELL_TOLERANCE);
        let cut = radial.reach();
        let block = |cells: &[Cell]| Block::new(cells, self.pyramid.mean, cut);
        cells.par_chunks(WIDE * BLOCK).map(block).collect()
    }

    /// Blocks of cells for lobes of GGX about directions that are near one another. The tail of such a lobe,
    /// 1 / (1 + (t / 2 alpha)^2)^2 of the angle t, reaches to the horizon, but falls the more slowly the further out:
    /// over a quarter of the angle. So cells are the wider, and may be the more unevenly lit, the further they are off. At the
    /// horizon masking takes over, which falls to 0 within about alpha.
    fn blocks_of_tail(&self, alpha: f64, directions: &[[f64; 3]]) -> Vec<[Cells; BLOCK]> {
        let (axis, radius) = cone(directions);
        let peak = (alpha.powi(-2) + 1.0) / TAU;
        let unseen = CELL_TOLERANCE * self.pyramid.brightness();
        let visit = |cell: &Cell| {
            let side = cell.solid_angle.sqrt();
            let off = (about_angle(axis, cell.moment) - radius - side).max(0.0);
            if off >= FRAC_PI_2 {
                return Visit::Skip;
            }
            let height = peak * (1.0 + (0.5 * off / alpha).powi(2)).powi(-2);
            let falls_over = alpha.max(0.25 * off);
            let widest = (CELL_WIDTH * falls_over).min(WIDEST_CELL);
            let masked_over = (0.5 * alpha).max(FRAC_PI_2 - off - 2.0 * (radius + side));
            // The flux of a cell lies 0.3 of its width beside its centre.
            let moved = 0.3 * side * height / falls_over.min(masked_over) * cell.unevenness;
            if side > widest || moved > unseen { Visit::Split } else { Visit::Take }
        };
        self.packed_cells(visit)
    }

    /// Blocks of cells for lobes about directions that are near one another, which fall as a Gaussian of deviation s does.
    /// At t deviations from the peak a cell is as wide as the fourth derivative, which the kernel's mean leaves out, allows:
    /// that of a Gaussian is (t^4 - 6 t^2 + 3) exp(-t^2 / 2) / s^4, 3 at the peak and from [`TAIL`] on at most
    /// (1 + t^2)^2 exp(-t^2 / 2) / s^4, which falls. Its slope there is t exp(-t^2 / 2) / s.
    fn blocks_of_bell(&self, radial: Radial, directions: &[[f64; 3]]) -> Vec<[Cells; BLOCK]> {
        let (axis, radius) = cone(directions);
        let (exponent, reach) = (radial.exponent(), radial.reach());
        let deviation = 1.0 / exponent.sqrt();
        let peak = (exponent + 1.0) / TAU;
        let unseen = CELL_TOLERANCE * self.pyramid.brightness();
        let visit = |cell: &Cell| {
            let side = cell.solid_angle.sqrt();
            let off = (about_angle(axis, cell.moment) - radius - side).max(0.0);
            if off > reach {
                return Visit::Skip;
            }
            let t = off / deviation;
            let height = (-0.5 * t * t).exp();
            // The directions are of a cone: nearer to the peak any of them may be at it.
            let fourth = if t < TAIL { 1.0 } else { (height * (1.0 + t * t).powi(2) / 3.0).min(1.0) };
            let widest = (CELL_WIDTH * deviation / fourth.sqrt().sqrt()).min(WIDEST_CELL);
            // The flux of a cell lies 0.3 of its width beside its centre.
            let slope = if t < 1.0 { 0.6 } else { t * height };
            let moved = 0.3 * side * peak * slope / deviation * cell.unevenness;
            if side > widest || moved > unseen { Visit::Split } else { Visit::Take }
        };
        self.packed_cells(visit)
    }

    fn packed_cells(&self, visit: impl Fn(&Cell) -> Visit) -> Vec<[Cells; BLOCK]> {
        let cells = self.pyramid.cells(visit);
        cells.chunks(WIDE * BLOCK).map(|cells| packed(cells, self.pyramid.mean)).collect()
    }
}

impl Block {
    fn new(cells: &[Cell], mean: [f32; 3], cut: f64) -> Self {
        let mut sum = [0.0; 3];
        for cell in cells {
            (0..3).for_each(|i| sum[i] += cell.moment[i]);
        }
        let axis = unit(sum);
        let radius = |cell: &Cell| {
            // A cell reaches to half its diagonal, and a little more where it is distorted.
            angle(axis, unit(cell.moment)) + cell.solid_angle.sqrt()
        };
        let radius = cells.iter().map(radius).fold(0.0, f64::max);
        Self { cells: packed(cells, mean), axis, reach: radius + cut }
    }
}

/// At most [`WIDE`] times [`BLOCK`] cells.
fn packed(cells: &[Cell], mean: [f32; 3]) -> [Cells; BLOCK] {
    std::array::from_fn(|i| Cells::pack(cells.get(i * WIDE..).unwrap_or(&[]), mean))
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { v.map(|x| x / length) } else { [0.0, 0.0, 1.0] }
}

fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum::<f64>().clamp(-1.0, 1.0).acos()
}

/// The angle between a unit vector and any other vector to 1e-4, which is a small part of any cell (Abramowitz and Stegun 1964,
/// 4.4.45): every tile asks for that of thousands of cells.
fn about_angle(axis: [f64; 3], v: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cosine = dot(axis, v) / dot(v, v).sqrt().max(f64::MIN_POSITIVE);
    let x = cosine.abs().min(1.0);
    let below = (1.0 - x).sqrt() * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - x * 0.018_729_3)));
    if cosine < 0.0 { std::f64::consts::PI - below } else { below }
}

/// The directions of a tile's texels, row by row.
fn tile_directions(tile: usize, tiles: usize, size: usize) -> Vec<[f64; 3]> {
    let (face, row, column) = (tile / (tiles * tiles), tile / tiles % tiles * TILE, tile % tiles * TILE);
    let rows = row..(row + TILE).min(size);
    let columns = column..(column + TILE).min(size);
    rows.flat_map(|y| columns.clone().map(move |x| texel_direction(face, x, y, size))).collect()
}

/// The middle of directions, and how far they lie from it.
fn cone(directions: &[[f64; 3]]) -> ([f64; 3], f64) {
    let mut sum = [0.0; 3];
    for d in directions {
        (0..3).for_each(|i| sum[i] += d[i]);
    }
    let axis = unit(sum);
    (axis, directions.iter().map(|&d| angle(axis, d)).fold(0.0, f64::max))
}

/// The cells of the blocks that a lobe about any of `directions` reaches.
fn blocks_near<'a>(blocks: &'a [Block], directions: &[[f64; 3]]) -> Vec<&'a [Cells; BLOCK]> {
    let (axis, radius) = cone(directions);
    let near = blocks.iter().filter(|block| angle(axis, block.axis) <= block.reach + radius);
    near.map(|block| &block.cells).collect()
}

/// The filter by brute force in f64: the piecewise constant `cube` along the unit direction `r`,
/// each texel split into `splits x splits` cells of exact solid angle. What the fast filter is
/// tested against; any four channels.
#[must_use]
pub fn by_brute_force(cube: &Cube<f64>, r: [f64; 3], exponent: f64, splits: usize) -> [f64; 4] {
    radial_by_brute_force(cube, r, Radial::Phong(exponent), splits)
}

/// As [`by_brute_force`], with any radial weight.
#[must_use]
pub fn radial_by_brute_force(cube: &Cube<f64>, r: [f64; 3], radial: Radial, splits: usize) -> [f64; 4] {
    let fine = cube.size() * splits;
    let (mut sum, mut weights) = ([0.0; 4], 0.0);
    for face in 0..6 {
        for row in 0..fine {
            for column in 0..fine {
                let d = texel_direction(face, column, row, fine);
                let cosine: f64 = (0..3).map(|i| r[i] * d[i]).sum();
                if cosine <= 0.0 {
                    continue;
                }
                let weight = radial.weight(cosine) * texel_solid_angle(column, row, fine);
                let texel = cube.texel(face, column / splits, row / splits);
                (0..4).for_each(|c| sum[c] += weight * texel[c]);
                weights += weight;
            }
        }
    }
    sum.map(|s| s / weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_about_those_of_the_arc_cosine() {
        for i in 0..=2000 {
            let want = std::f64::consts::PI * f64::from(i) / 2000.0;
            let found = about_angle([0.0, 0.0, 1.0], [3.0 * want.sin(), 0.0, 3.0 * want.cos()]);
            // The formula's own error is 6.7e-5.
            assert!((found - want).abs() < 1e-4, "{want} {found}");
        }
        assert!(about_angle([0.0, 0.0, 1.0], [0.0; 3]).is_finite());
    }
}
