//! A triangle mesh of the head's surface: surface nets on a grid (see `grid`), its vertices then moved
//! onto the surface and spread evenly.
//!
//! Naive surface nets: S. Gibson, *Constrained Elastic SurfaceNets*, 1998.

use std::collections::BTreeMap;

use glam::{DVec3, USizeVec3};
use rayon::prelude::*;

use super::grid::{Grid, sheet};
use super::head::Head;

/// A closed triangle mesh, metres.
pub(super) struct Surface {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// Counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Rounds of spreading the vertices.
const ROUNDS: usize = 6;

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
