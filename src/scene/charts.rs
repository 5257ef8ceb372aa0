//! Charts of a UV atlas: what of a mesh hangs together there.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

/// The chart of each vertex, counted from 1; 0 of one that is of no triangle.
///
/// Triangles are of one chart where they share a vertex. A file splits vertices where normals or tangents jump, too: those
/// at one place, on the surface and in the atlas, are one.
#[must_use]
pub fn charts(positions: &[Vec3], uvs: &[Vec2], triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..positions.len() as u32).collect();
    let mut known: HashMap<[u32; 5], u32> = HashMap::with_capacity(positions.len());
    for (i, (position, uv)) in (0..).zip(positions.iter().zip(uvs)) {
        // -0 and 0 are one place.
        let place = [position.x, position.y, position.z, uv.x, uv.y].map(|x| (x + 0.0).to_bits());
        let first = *known.entry(place).or_insert(i);
        join(&mut parents, first, i);
    }
    for &[a, b, c] in triangles {
        join(&mut parents, a, b);
        join(&mut parents, a, c);
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut charts = vec![0; positions.len()];
    for &corner in triangles.as_flattened() {
        let root = root(&mut parents, corner);
        let next = numbers.len() as u32 + 1;
        charts[corner as usize] = *numbers.entry(root).or_insert(next);
    }
    charts
}

/// The vertex that stands for all that hang together with one.
fn root(parents: &mut [u32], mut at: u32) -> u32 {
    while parents[at as usize] != at {
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_hang_together_by_vertices_and_by_places() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        // Two triangles of a square by vertices of their own (split normals), one that touches it in the atlas alone, and a
        // vertex of none.
        let positions =
            [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, -0.0), at(1.0, 1.0), at(0.0, 1.0)].to_vec();
        let apart = [at(5.0, 5.0), at(6.0, 5.0), at(5.0, 6.0), at(9.0, 9.0)];
        let uvs: Vec<Vec2> = positions.iter().map(|p| p.truncate() / 4.0).collect();
        let beside = [Vec2::new(0.25, 0.25), Vec2::new(0.5, 0.25), Vec2::new(0.25, 0.5), Vec2::ZERO];
        let (positions, uvs) = ([positions, apart.to_vec()].concat(), [uvs, beside.to_vec()].concat());
        let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
        assert_eq!(charts(&positions, &uvs, &triangles), [1, 1, 1, 1, 1, 1, 2, 2, 2, 0]);
        assert_eq!(charts(&[], &[], &[]), Vec::<u32>::new());
    }
}
