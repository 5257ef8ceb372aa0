//! A triangle mesh of the head's surface: surface nets on a grid that is finer where the features
//! are, its vertices then moved onto the surface and spread evenly.
//!
//! Naive surface nets: S. Gibson, *Constrained Elastic SurfaceNets*, 1998.

use std::collections::BTreeMap;

use glam::{DVec3, USizeVec3};
use rayon::prelude::*;

use super::head::Head;

/// A closed triangle mesh, metres.
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// Counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The box that holds the bust, metres.
const LOW: DVec3 = DVec3::new(-0.200, -0.250, -0.140);
const HIGH: DVec3 = DVec3::new(0.200, 0.122, 0.140);
/// Grid cells along a side of the blocks that are skipped where the surface is far.
const BLOCK: usize = 6;
/// Rounds of spreading the vertices.
const ROUNDS: usize = 6;

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
struct Grid {
    axes: [Vec<f64>; 3],
    values: Vec<f32>,
}

impl Grid {
    fn sample(head: &Head) -> Self {
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

    fn index(&self, node: USizeVec3) -> usize {
        (node.z * self.axes[1].len() + node.y) * self.axes[0].len() + node.x
    }

    fn at(&self, node: USizeVec3) -> DVec3 {
        DVec3::new(self.axes[0][node.x], self.axes[1][node.y], self.axes[2][node.z])
    }

    /// The cell's eight corners: how they hang together along the cell's edges, inside with inside
    /// and outside with outside; and inside with inside across a face whose corners alternate, so
    /// that both cells at the face agree. Each is labelled with the least corner of its part.
    fn parts(&self, cell: USizeVec3) -> [u8; 8] {
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
    fn cell_vertices(&self, cell: USizeVec3) -> BTreeMap<Sheet, DVec3> {
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
type Sheet = (u8, u8);

fn sheet(a: u8, b: u8) -> Sheet {
    (a.min(b), a.max(b))
}

/// The offset of corner `i` of a cell.
fn corner(i: usize) -> USizeVec3 {
    USizeVec3::new(i & 1, i >> 1 & 1, i >> 2)
}

impl Surface {
    /// The surface of `head`.
    pub(super) fn extract(head: &Head) -> Self {
        let grid = Grid::sample(head);
        let cells = USizeVec3::new(grid.axes[0].len(), grid.axes[1].len(), grid.axes[2].len()) - 1;
        let mut vertex_of = BTreeMap::new();
        let mut positions = Vec::new();
        for z in 0..cells.z {
            for y in 0..cells.y {
                for x in 0..cells.x {
                    let cell = USizeVec3::new(x, y, z);
                    for (sheet, at) in grid.cell_vertices(cell) {
                        vertex_of.insert((grid.index(cell), sheet), positions.len() as u32);
                        positions.push(at);
                    }
                }
            }
        }
        let mut quads = Vec::new();
        let mut indices: Vec<usize> = vertex_of.keys().map(|&(index, _)| index).collect();
        indices.dedup();
        for index in indices {
            let (nx, ny) = (grid.axes[0].len(), grid.axes[1].len());
            let node = USizeVec3::new(index % nx, index / nx % ny, index / (nx * ny));
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut next = node;
                next[axis] += 1;
                let (a, b) = (grid.values[index] < 0.0, grid.values[grid.index(next)] < 0.0);
                if a == b || node[u] == 0 || node[v] == 0 {
                    continue;
                }
                // The edge from `node` to `next`, as the cell that lies (du, dv) before it sees it.
                let around = |du: usize, dv: usize| {
                    let mut cell = node;
                    cell[u] -= du;
                    cell[v] -= dv;
                    let parts = grid.parts(cell);
                    let here = (du << u) | (dv << v);
                    let sheet = sheet(parts[here], parts[here | (1 << axis)]);
                    vertex_of.get(&(grid.index(cell), sheet)).copied()
                };
                if let (Some(p), Some(q), Some(r), Some(s)) =
                    (around(1, 1), around(0, 1), around(0, 0), around(1, 0))
                {
                    quads.push(if a { [p, q, r, s] } else { [s, r, q, p] });
                }
            }
        }
        let neighbours = ring(&quads, positions.len());
        settle(head, &mut positions, &neighbours);
        let triangles = split(&quads, &positions);
        let normals = normals(head, &positions, &triangles);
        Self { positions, normals, triangles }
    }
}

/// The vertices that share a quad's side with each vertex.
fn ring(quads: &[[u32; 4]], count: usize) -> Vec<Vec<u32>> {
    let mut ring = vec![Vec::new(); count];
    for quad in quads {
        for i in 0..4 {
            let (a, b) = (quad[i], quad[(i + 1) % 4]);
            ring[a as usize].push(b);
            ring[b as usize].push(a);
        }
    }
    for around in &mut ring {
        around.sort_unstable();
        around.dedup();
    }
    ring
}

/// Spread the vertices along the surface, and put them on it.
fn settle(head: &Head, positions: &mut Vec<DVec3>, neighbours: &[Vec<u32>]) {
    for round in 0..=ROUNDS {
        // The last rounds only land.
        let spread = if round + 2 < ROUNDS { 0.5 } else { 0.0 };
        let old = &*positions;
        *positions = (0..old.len())
            .into_par_iter()
            .map(|i| {
                let (p, around) = (old[i], &neighbours[i]);
                let mean =
                    around.iter().map(|&j| old[j as usize]).sum::<DVec3>() / around.len().max(1) as f64;
                let g = gradient(head, p, 2e-4);
                let along = spread * (mean - p);
                let n = g.normalize_or_zero();
                let onto = g * (head.distance(p) / g.length_squared().max(0.25));
                p + along - n * along.dot(n) - onto.clamp_length_max(1.5e-3)
            })
            .collect();
    }
}

/// The normals: the distance's own, but for the few vertices in creases finer than the grid, where
/// it turns away from a triangle that it belongs to; there the triangles' mean.
fn normals(head: &Head, positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals: Vec<DVec3> = positions.par_iter().map(|&p| normal(head, p)).collect();
    let facing = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a)
    };
    let mut means = vec![DVec3::ZERO; positions.len()];
    let mut agrees = vec![true; positions.len()];
    for triangle in triangles {
        let n = facing(triangle);
        for &i in triangle {
            means[i as usize] += n;
            agrees[i as usize] &= n.normalize_or_zero().dot(normals[i as usize]) > 0.2;
        }
    }
    for i in 0..normals.len() {
        if !agrees[i] {
            normals[i] = means[i].normalize_or(normals[i]);
        }
    }
    normals
}

/// The unit normal: the distance's gradient over a millimetre, so that no facet of a blend shows.
pub(super) fn normal(head: &Head, p: DVec3) -> DVec3 {
    gradient(head, p, 4e-4).normalize_or(DVec3::Y)
}

/// The gradient of the distance, by differences over `h` metres at a tetrahedron's corners.
fn gradient(head: &Head, p: DVec3, h: f64) -> DVec3 {
    [DVec3::new(1.0, -1.0, -1.0), DVec3::new(-1.0, -1.0, 1.0), DVec3::new(-1.0, 1.0, -1.0), DVec3::ONE]
        .into_iter()
        .map(|corner| corner * (head.distance(p + corner * h) / (4.0 * h)))
        .sum()
}

/// Each quad as two triangles, along its shorter diagonal.
fn split(quads: &[[u32; 4]], positions: &[DVec3]) -> Vec<[u32; 3]> {
    let length = |a: u32, b: u32| positions[a as usize].distance(positions[b as usize]);
    quads
        .iter()
        .flat_map(
            |&[a, b, c, d]| {
                if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
            },
        )
        .collect()
}
