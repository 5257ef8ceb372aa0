//! The head's signed distance on a grid that is finer where the features are, and the sheets of the
//! surface in its cells.

use std::collections::BTreeMap;

use glam::{DVec3, USizeVec3};
use rayon::prelude::*;

use super::head::Head;

/// The box that holds the bust, metres.
const LOW: DVec3 = DVec3::new(-0.200, -0.250, -0.140);
const HIGH: DVec3 = DVec3::new(0.200, 0.122, 0.140);
/// Grid cells along a side of the blocks that are skipped where the surface is far.
const BLOCK: usize = 6;
/// Cell lengths (metres) wanted along each axis: (coordinate, length), linear in between.
const SPACING: [&[(f64, f64)]; 3] = [
    &[
        (-0.200, 0.0092),
        (-0.108, 0.0042),
        (-0.095, 0.0027),
        (-0.070, 0.0027),
        (-0.040, 0.0024),
        (0.040, 0.0024),
        (0.070, 0.0027),
        (0.095, 0.0027),
        (0.108, 0.0042),
        (0.200, 0.0092),
    ],
    &[
        (-0.250, 0.0092),
        (-0.140, 0.0050),
        (-0.095, 0.0030),
        (-0.078, 0.0023),
        (-0.055, 0.0022),
        (0.020, 0.0024),
        (0.045, 0.0038),
        (0.122, 0.0058),
    ],
    &[
        (-0.140, 0.0072),
        (-0.050, 0.0040),
        (-0.032, 0.0024),
        (0.010, 0.0024),
        (0.030, 0.0038),
        (0.070, 0.0027),
        (0.140, 0.0023),
    ],
];

/// The planes of the grid along one axis.
fn planes(axis: usize) -> Vec<f64> {
    let wanted = |x: f64| {
        let table = SPACING[axis];
        let upper = table.iter().position(|&(at, _)| x < at).unwrap_or(table.len() - 1).max(1);
        let ((x0, h0), (x1, h1)) = (table[upper - 1], table[upper]);
        h0 + (h1 - h0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
    };
    let mut planes = vec![LOW[axis]];
    while let Some(&last) = planes.last().filter(|&&last| last < HIGH[axis]) {
        planes.push(last + wanted(last));
    }
    planes
}

/// The grid's planes, and the signed distance where they meet.
pub(super) struct Grid {
    pub(super) axes: [Vec<f64>; 3],
    pub(super) values: Vec<f32>,
}

impl Grid {
    pub(super) fn sample(head: &Head) -> Self {
        let axes = [planes(0), planes(1), planes(2)];
        let [nx, ny, nz] = [axes[0].len(), axes[1].len(), axes[2].len()];
        let mut values = vec![0.0; nx * ny * nz];
        let slab = nx * ny;
        values.par_chunks_mut(slab * BLOCK).enumerate().for_each(|(bz, values)| {
            let z0 = bz * BLOCK;
            let z1 = (z0 + BLOCK).min(nz);
            for y0 in (0..ny).step_by(BLOCK) {
                for x0 in (0..nx).step_by(BLOCK) {
                    let (x1, y1) = ((x0 + BLOCK).min(nx), (y0 + BLOCK).min(ny));
                    let low = DVec3::new(axes[0][x0], axes[1][y0], axes[2][z0]);
                    let high = DVec3::new(axes[0][x1 - 1], axes[1][y1 - 1], axes[2][z1 - 1]);
                    let middle = head.distance(0.5 * (low + high));
                    // The blends may overstate a distance; by half is more than was ever seen. A
                    // cell's own length on top, as edges run on into the next block.
                    let far = middle.abs() > 0.75 * low.distance(high) + 0.008;
                    for z in z0..z1 {
                        for y in y0..y1 {
                            for x in x0..x1 {
                                let at = DVec3::new(axes[0][x], axes[1][y], axes[2][z]);
                                let value = if far { middle } else { head.distance(at) };
                                values[(z - z0) * slab + y * nx + x] = value as f32;
                            }
                        }
                    }
                }
            }
        });
        Self { axes, values }
    }

    pub(super) fn index(&self, node: USizeVec3) -> usize {
        (node.z * self.axes[1].len() + node.y) * self.axes[0].len() + node.x
    }

    fn at(&self, node: USizeVec3) -> DVec3 {
        DVec3::new(self.axes[0][node.x], self.axes[1][node.y], self.axes[2][node.z])
    }

    /// The cell's eight corners: how they hang together along the cell's edges, inside with inside
    /// and outside with outside; and inside with inside across a face whose corners alternate, so
    /// that both cells at the face agree. Each is labelled with the least corner of its part.
    pub(super) fn parts(&self, cell: USizeVec3) -> [u8; 8] {
        let inside: [bool; 8] = std::array::from_fn(|i| self.values[self.index(cell + corner(i))] < 0.0);
        let mut label: [u8; 8] = std::array::from_fn(|i| i as u8);
        // A label may have to pass every other corner.
        for _ in 0..7 {
            for i in 0..8 {
                for j in [i ^ 1, i ^ 2, i ^ 4] {
                    if inside[i] == inside[j] {
                        label[i] = label[i].min(label[j]);
                    }
                }
                for (a, b) in [(1, 2), (2, 4), (4, 1)] {
                    let alternate = !inside[i ^ a] && !inside[i ^ b];
                    if inside[i] && inside[i ^ a ^ b] && alternate {
                        label[i] = label[i].min(label[i ^ a ^ b]);
                    }
                }
            }
        }
        label
    }

    /// The cell's vertices, one for each sheet of the surface in it: which parts the sheet parts,
    /// and the mean of its crossings with the cell's edges.
    pub(super) fn cell_vertices(&self, cell: USizeVec3) -> BTreeMap<Sheet, DVec3> {
        let mut sums: BTreeMap<Sheet, (DVec3, f64)> = BTreeMap::new();
        let parts = self.parts(cell);
        for i in 0..8 {
            for j in [i | 1, i | 2, i | 4].into_iter().filter(|&j| j != i) {
                let (a, b) = (cell + corner(i), cell + corner(j));
                let (va, vb) = (self.values[self.index(a)], self.values[self.index(b)]);
                if (va < 0.0) != (vb < 0.0) {
                    let sum = sums.entry(sheet(parts[i], parts[j])).or_insert((DVec3::ZERO, 0.0));
                    sum.0 += self.at(a).lerp(self.at(b), f64::from(va / (va - vb)));
                    sum.1 += 1.0;
                }
            }
        }
        sums.into_iter().map(|(sheet, (sum, count))| (sheet, sum / count)).collect()
    }
}

/// The labels of the two parts that a sheet of the surface lies between, the lesser first.
pub(super) type Sheet = (u8, u8);

pub(super) fn sheet(a: u8, b: u8) -> Sheet {
    (a.min(b), a.max(b))
}

/// The offset of corner `i` of a cell.
fn corner(i: usize) -> USizeVec3 {
    USizeVec3::new(i & 1, i >> 1 & 1, i >> 2)
}
