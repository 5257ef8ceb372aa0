//! The environment as a pyramid of cells, and the set of cells that a lobe of a given width needs:
//! coarse where the light is even, fine where it is not.

use rayon::prelude::*;

use crate::model::cube::{Cube, face_direction};

/// A square of a cube's face, and the light that comes through it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    /// First moment: the integral of the unit direction, over the solid angle.
    pub(super) moment: [f64; 3],
    /// Solid angle, steradians.
    pub(super) solid_angle: f64,
    /// Integral of the radiance, over the solid angle.
    pub(super) flux: [f64; 3],
    /// Root of the summed squares of how much flux of each finer cell differs from its parent's
    /// mean: what is lost when the cell is taken as evenly lit.
    pub(super) unevenness: f64,
}

impl Cell {
    fn mean(&self, c: usize) -> f64 {
        self.flux[c] / self.solid_angle
    }
}

/// What becomes of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Visit {
    /// It counts as it is.
    Take,
    /// The four that it is made of are visited in its place.
    Split,
    /// It counts nothing.
    Skip,
}

/// Cells of every size, the finest first.
pub(super) struct Pyramid {
    levels: Vec<Level>,
    /// Mean radiance over the sphere.
    pub(super) mean: [f32; 3],
    /// Least and greatest radiance, channel by channel.
    pub(super) range: [[f32; 2]; 3],
}

struct Level {
    size: usize,
    cells: Vec<Cell>,
}

/// Antiderivatives, at the corner (s, t) of a face, of the first moment's components along s, t and
/// the face's normal, and of the solid angle: with r^2 = 1 + s^2 + t^2, those of s/r^4, t/r^4, 1/r^4
/// and 1/r^3.
fn corner(s: f64, t: f64) -> [f64; 4] {
    let arc = |a: f64, b: f64| (b / (1.0 + a * a).sqrt()).atan() / (1.0 + a * a).sqrt();
    let (along_t, along_s) = (arc(s, t), arc(t, s));
    let solid_angle = (s * t).atan2((1.0 + s * s + t * t).sqrt());
    [-0.5 * along_t, -0.5 * along_s, 0.5 * (s * along_t + t * along_s), solid_angle]
}

impl Pyramid {
    /// The pyramid over the rgb of a cube.
    pub(super) fn new(cube: &Cube<f64>) -> Self {
        let mut levels = vec![Level::finest(cube)];
        while let Some(last) = levels.last()
            && last.size.is_multiple_of(2)
        {
            let coarser = last.coarser();
            levels.push(coarser);
        }
        let cells = &levels[0].cells;
        let total: f64 = cells.iter().map(|cell| cell.solid_angle).sum();
        let channel = |c: usize| cells.iter().map(move |cell| cell.mean(c) as f32);
        let mean = [0, 1, 2].map(|c| (cells.iter().map(|cell| cell.flux[c]).sum::<f64>() / total) as f32);
        let range = [0, 1, 2].map(|c| {
            [channel(c).fold(f32::INFINITY, f32::min), channel(c).fold(f32::NEG_INFINITY, f32::max)]
        });
        Self { levels, mean, range }
    }

    /// The mean radiance of the brightest channel.
    pub(super) fn brightness(&self) -> f64 {
        self.mean.iter().fold(0.0, |a: f64, &x| a.max(f64::from(x.abs())))
    }

    /// The cells for a lobe of the given Phong exponent, in an order that keeps neighbours together.
    ///
    /// A cell is split while it is wider than `width` (radians), or while taking it as evenly lit may move the result
    /// by more than `tolerance` times the mean radiance.
    pub(super) fn cells_for(&self, exponent: f64, width: f64, tolerance: f64) -> Vec<Cell> {
        let deviation = 1.0 / exponent.sqrt();
        let peak = (exponent + 1.0) / std::f64::consts::TAU;
        // The steepest slope of a Gaussian is 0.6 of its height over its deviation, and the flux of
        // a cell lies 0.3 of its width beside its centre.
        let slope = 0.6 * 0.3 * peak / deviation;
        let brightness = self.brightness();
        let split = |cell: &Cell| {
            let side = cell.solid_angle.sqrt();
            side > width || slope * side * cell.unevenness > tolerance * brightness
        };
        let visit = |cell: &Cell| if split(cell) { Visit::Split } else { Visit::Take };
        let faces: Vec<Vec<Cell>> = (0..6).into_par_iter().map(|face| self.of_face(face, &visit)).collect();
        faces.concat()
    }

    /// The cells that `visit` takes, in an order that keeps neighbours together. The finest are not split.
    pub(super) fn cells(&self, visit: impl Fn(&Cell) -> Visit) -> Vec<Cell> {
        (0..6).flat_map(|face| self.of_face(face, &visit)).collect()
    }

    fn of_face(&self, face: usize, visit: &impl Fn(&Cell) -> Visit) -> Vec<Cell> {
        let (mut cells, top) = (Vec::new(), self.levels.len() - 1);
        let size = self.levels[top].size;
        for i in 0..size * size {
            self.gather(top, face, i % size, i / size, visit, &mut cells);
        }
        cells
    }

    /// The mean radiance over each texel of a cube of `size` texels a side, where the pyramid has
    /// cells of that size.
    pub(super) fn means(&self, size: usize) -> Option<Cube<f64>> {
        let level = self.levels.iter().find(|level| level.size == size)?;
        Some(Cube::from_fn(size, |face, column, row| {
            let cell = level.at(face, column, row);
            [cell.mean(0), cell.mean(1), cell.mean(2), 0.0]
        }))
    }

    fn gather(
        &self,
        level: usize,
        face: usize,
        column: usize,
        row: usize,
        visit: &impl Fn(&Cell) -> Visit,
        into: &mut Vec<Cell>,
    ) {
        let cell = self.levels[level].at(face, column, row);
        match visit(cell) {
            Visit::Skip => {}
            Visit::Split if level > 0 => {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    self.gather(level - 1, face, 2 * column + dx, 2 * row + dy, visit, into);
                }
            }
            Visit::Split | Visit::Take => into.push(*cell),
        }
    }
}

impl Level {
    fn finest(cube: &Cube<f64>) -> Self {
        let size = cube.size();
        let edge = |i: usize| 2.0 * i as f64 / size as f64 - 1.0;
        let corners: Vec<[f64; 4]> = (0..(size + 1) * (size + 1))
            .into_par_iter()
            .map(|i| corner(edge(i % (size + 1)), edge(i / (size + 1))))
            .collect();
        let cell = |i: usize| {
            let (face, row, column) = (i / (size * size), i / size % size, i % size);
            let at = |dx: usize, dy: usize| corners[(row + dy) * (size + 1) + column + dx];
            let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
            let [s, t, normal, solid_angle]: [f64; 4] = std::array::from_fn(|k| d[k] - b[k] - c[k] + a[k]);
            let moment = face_direction(face, s / normal, t / normal).map(|x| x * normal);
            let [r, g, b, _] = cube.texel(face, column, row);
            Cell { moment, solid_angle, flux: [r, g, b].map(|x| x * solid_angle), unevenness: 0.0 }
        };
        Self { size, cells: (0..6 * size * size).into_par_iter().map(cell).collect() }
    }

    fn coarser(&self) -> Self {
        let size = self.size / 2;
        let cell = |i: usize| {
            let (face, row, column) = (i / (size * size), i / size % size, i % size);
            let four =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.at(face, 2 * column + dx, 2 * row + dy));
            let mut sum = Cell::default();
            for part in four {
                (0..3).for_each(|c| sum.moment[c] += part.moment[c]);
                (0..3).for_each(|c| sum.flux[c] += part.flux[c]);
                sum.solid_angle += part.solid_angle;
            }
            let squares = four.map(|part| {
                let off = |c: usize| (part.flux[c] - sum.mean(c) * part.solid_angle).abs();
                let beyond = off(0).max(off(1)).max(off(2));
                part.unevenness * part.unevenness + beyond * beyond
            });
            sum.unevenness = squares.iter().sum::<f64>().sqrt();
            sum
        };
        Self { size, cells: (0..6 * size * size).into_par_iter().map(cell).collect() }
    }

    fn at(&self, face: usize, column: usize, row: usize) -> &Cell {
        &self.cells[(face * self.size + row) * self.size + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cube::texel_solid_angle;

    #[test]
    fn moments_and_solid_angles_are_the_integrals_over_each_cell() {
        let cube = Cube::from_fn(2, |_, _, _| [1.0, 2.0, 3.0, 0.0]);
        for cell in Pyramid::new(&cube).cells_for(1e6, 0.1, 0.0) {
            // By the midpoint rule over 64 x 64 parts of the cell that holds the moment's direction.
            let near = |d: [f64; 3]| (0..3).map(|i| d[i] * cell.moment[i]).sum::<f64>();
            let (mut moment, mut solid_angle) = ([0.0; 3], 0.0);
            let best = (0..24).map(|i| (i / 4, i % 2, i / 2 % 2)).max_by(|&a, &b| {
                let at = |(f, c, r)| near(crate::model::cube::texel_direction(f, c, r, 2));
                at(a).total_cmp(&at(b))
            });
            let (face, column, row) = best.unwrap();
            for i in 0..64 * 64 {
                let (x, y) = (column * 64 + i % 64, row * 64 + i / 64);
                let weight = texel_solid_angle(x, y, 128);
                let d = crate::model::cube::texel_direction(face, x, y, 128);
                (0..3).for_each(|c| moment[c] += weight * d[c]);
                solid_angle += weight;
            }
            // Midpoint rule: (1/64)^2 / 24 of the second derivative's scale, 1.
            assert!((0..3).all(|c| (moment[c] - cell.moment[c]).abs() < 2e-5), "{cell:?} {moment:?}");
            assert!((solid_angle - cell.solid_angle).abs() < 1e-12);
        }
    }

    #[test]
    fn cells_are_few_where_the_light_is_even_and_fine_around_a_sun() {
        let even = Pyramid::new(&Cube::from_fn(64, |_, _, _| [0.5; 4])).cells_for(1.0, 0.3, 1e-4);
        let lit = |f: usize, c: usize, r: usize| f == 2 && c == 20 && r == 9;
        let sun = Cube::from_fn(64, |f, c, r| if lit(f, c, r) { [1e4; 4] } else { [0.5; 4] });
        let sun = Pyramid::new(&sun).cells_for(1.0, 0.3, 1e-4);
        assert!(sun.len() > even.len() && sun.len() < even.len() + 40, "{} {}", even.len(), sun.len());
        let finest = sun.iter().map(|cell| cell.solid_angle).fold(f64::INFINITY, f64::min);
        // The sun's own texel, of about 4 pi / (6 64^2) steradians.
        assert!(finest < 6e-4);
        for cells in [even, sun] {
            let total: f64 = cells.iter().map(|cell| cell.solid_angle).sum();
            // Sums of a few hundred numbers in f64.
            assert!((total - 4.0 * std::f64::consts::PI).abs() < 1e-11);
        }
    }
}
