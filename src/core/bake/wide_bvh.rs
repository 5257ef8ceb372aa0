//! Many rays against a mesh: the hierarchy of `rays`, with its boxes and triangles laid out so that a ray meets eight
//! boxes, or four triangles, at a time.

use fearless_simd::{Level, Simd, f32x4, f32x8, prelude::*};
use glam::Vec3A;

use super::rays::RayMesh;
use crate::with_simd;

/// What a ray into the open meets.
pub(super) const NOTHING: u32 = u32::MAX;
/// Marks a child that is a block of triangles, not a node.
const BLOCK: u32 = 1 << 31;
/// Rounding of a distance to a plane, three operations each; boxes are left that much later.
const LATER: f32 = 1.0 + 1e-6;

/// Boxes around eight children.
struct Node {
    /// Least and greatest corner by axis; an empty place has its least above its greatest.
    bounds: [[[f32; 8]; 3]; 2],
    child: [u32; 8],
}

/// Four triangles.
struct Block {
    /// By corner and axis; a missing triangle is without area.
    corners: [[[f32; 4]; 3]; 3],
    /// Which triangle of the mesh each is.
    index: [u32; 4],
}

/// A hierarchy of boxes over triangles.
pub(super) struct WideBvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    level: Level,
}

/// A ray, each number of it in every lane.
struct Ray<S: Simd> {
    simd: S,
    origin: [f32; 3],
    direction: [f32; 3],
    inverse: [f32x8<S>; 3],
    /// For each axis, which of a node's bounds is met first.
    near: [usize; 3],
}

impl WideBvh {
    /// Of the same triangles.
    pub(super) fn new(mesh: &RayMesh) -> Self {
        let mut wide = Self { nodes: Vec::new(), blocks: Vec::new(), level: Level::new() };
        let Some(bvh) = mesh.bvh() else { return wide };
        for node in &bvh.nodes {
            let mut own =
                Node { bounds: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]], child: [NOTHING; 8] };
            for i in (0..8).filter(|&i| !node.is_child_empty(i)) {
                let aabb = node.child_aabb(i);
                for axis in 0..3 {
                    own.bounds[0][axis][i] = aabb.min[axis];
                    own.bounds[1][axis][i] = aabb.max[axis];
                }
                own.child[i] = if node.is_leaf(i) {
                    let (first, count) = node.child_primitives(i);
                    let slots = &bvh.primitive_indices[first as usize..][..count as usize];
                    wide.blocks.push(Block::of(mesh, slots));
                    BLOCK | (wide.blocks.len() as u32 - 1)
                } else {
                    node.child_node_index(i)
                };
            }
            wide.nodes.push(own);
        }
        wide
    }

    /// Whether each ray from `origin` meets any triangle, from either side.
    pub(super) fn hits(&self, origin: Vec3A, directions: &[Vec3A]) -> Vec<bool> {
        let mut found = vec![NOTHING; directions.len()];
        with_simd!(self.level, simd => self.trace_all::<false, _>(simd, origin, directions, &mut found));
        found.into_iter().map(|found| found != NOTHING).collect()
    }

    /// The first triangle that each ray from `origin` meets, by its index in the mesh, or [`NOTHING`].
    pub(super) fn first(&self, origin: Vec3A, directions: &[Vec3A]) -> Vec<u32> {
        let mut found = vec![NOTHING; directions.len()];
        with_simd!(self.level, simd => self.trace_all::<true, _>(simd, origin, directions, &mut found));
        found
    }

    // Loops instead of iterators here and below: what is not inlined has no vector instructions.
    #[inline(always)]
    fn trace_all<const FIRST: bool, S: Simd>(
        &self,
        simd: S,
        origin: Vec3A,
        directions: &[Vec3A],
        found: &mut [u32],
    ) {
        let mut stack = Vec::new();
        for (&direction, found) in directions.iter().zip(found) {
            *found = self.trace::<FIRST, S>(simd, origin, direction, &mut stack);
        }
    }

    /// A triangle that the ray meets: the first, or any one.
    #[inline(always)]
    fn trace<const FIRST: bool, S: Simd>(
        &self,
        simd: S,
        origin: Vec3A,
        direction: Vec3A,
        stack: &mut Vec<(u32, f32)>,
    ) -> u32 {
        let (mut found, mut farthest) = (NOTHING, f32::INFINITY);
        let Some(root) = self.nodes.first() else { return found };
        let ray = Ray::new(simd, origin, direction);
        stack.clear();
        let mut node = root;
        loop {
            let (mut met, distances) = ray.boxes(node, farthest);
            let bottom = stack.len();
            while met != 0 {
                let i = met.trailing_zeros() as usize;
                met &= met - 1;
                let child = node.child[i];
                if child & BLOCK == 0 {
                    let mut at = stack.len();
                    stack.push((child, distances[i]));
                    // The nearest last, which is the first to be taken.
                    while FIRST && at > bottom && stack[at - 1].1 < stack[at].1 {
                        stack.swap(at - 1, at);
                        at -= 1;
                    }
                    continue;
                }
                let block = &self.blocks[(child & !BLOCK) as usize];
                let Some((triangle, distance)) = ray.triangles(block, farthest) else { continue };
                (found, farthest) = (triangle, distance);
                if !FIRST {
                    return found;
                }
            }
            node = loop {
                match stack.pop() {
                    None => return found,
                    Some((next, distance)) if distance <= farthest => break &self.nodes[next as usize],
                    Some(_) => {}
                }
            };
        }
    }
}

impl Block {
    fn of(mesh: &RayMesh, slots: &[u32]) -> Self {
        let mut block = Self { corners: [[[0.0; 4]; 3]; 3], index: [NOTHING; 4] };
        for (k, &slot) in slots.iter().enumerate().take(4) {
            let (corners, index) = mesh.triangle(slot);
            block.index[k] = index;
            for (own, corner) in block.corners.iter_mut().zip(corners) {
                (0..3).for_each(|axis| own[axis][k] = corner[axis]);
            }
        }
        block
    }
}

impl<S: Simd> Ray<S> {
    #[inline(always)]
    fn new(simd: S, origin: Vec3A, direction: Vec3A) -> Self {
        let direction = direction.to_array();
        let (mut inverse, mut near) = ([f32x8::splat(simd, 0.0); 3], [0; 3]);
        for axis in 0..3 {
            let x = direction[axis];
            // Not infinite, so that a plane through the origin is at 0.
            let slope = if x.abs() < 1e-20 { 1e20_f32.copysign(x) } else { 1.0 / x };
            inverse[axis] = f32x8::splat(simd, slope);
            near[axis] = usize::from(x.is_sign_negative());
        }
        Self { simd, origin: origin.to_array(), direction, inverse, near }
    }

    /// Which children's boxes the ray meets up to `farthest`, and where it enters each.
    #[inline(always)]
    fn boxes(&self, node: &Node, farthest: f32) -> (u32, [f32; 8]) {
        let simd = self.simd;
        let (mut enter, mut leave) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, f32::INFINITY));
        for axis in 0..3 {
            let near = f32x8::from_slice(simd, &node.bounds[self.near[axis]][axis]);
            let far = f32x8::from_slice(simd, &node.bounds[1 - self.near[axis]][axis]);
            enter = enter.max((near - self.origin[axis]) * self.inverse[axis]);
            leave = leave.min((far - self.origin[axis]) * self.inverse[axis]);
        }
        let met = enter.simd_le((leave * LATER).min(f32x8::splat(simd, farthest)));
        (met.to_bitmask() as u32, enter.into())
    }

    /// The nearest of a block's triangles that the ray meets before `farthest`, and where. An edge's test is the exact
    /// negative of its neighbour's, so no ray slips between two triangles.
    #[inline(always)]
    fn triangles(&self, block: &Block, farthest: f32) -> Option<(u32, f32)> {
        let simd = self.simd;
        let mut corners = [[f32x4::splat(simd, 0.0); 3]; 3];
        for corner in 0..3 {
            for axis in 0..3 {
                let place = f32x4::from_slice(simd, &block.corners[corner][axis]);
                corners[corner][axis] = place - self.origin[axis];
            }
        }
        let [a, b, c] = corners;
        let (u, v, w) = (self.along(cross(b, c)), self.along(cross(c, a)), self.along(cross(a, b)));
        let zero = f32x4::splat(simd, 0.0);
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let determinant = u + v + w;
        let inside = (least.simd_ge(zero) | most.simd_le(zero)) & !determinant.simd_eq(zero);
        let mut inside = inside.to_bitmask();
        if inside == 0 {
            return None;
        }
        let [ab, ac] = [[b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]];
        let normal = cross(ab, ac);
        let height = normal[0].mul_add(a[0], normal[1].mul_add(a[1], normal[2] * a[2]));
        let distances: [f32; 4] = (height / determinant).into();
        let mut nearest = None;
        let mut farthest = farthest;
        while inside != 0 {
            let k = inside.trailing_zeros() as usize;
            inside &= inside - 1;
            if distances[k] >= 0.0 && distances[k] < farthest {
                farthest = distances[k];
                nearest = Some((block.index[k], farthest));
            }
        }
        nearest
    }

    /// A vector's part along the ray.
    #[inline(always)]
    fn along(&self, p: [f32x4<S>; 3]) -> f32x4<S> {
        let lit = |x: f32| f32x4::splat(self.simd, x);
        let [x, y, z] = self.direction;
        p[0].mul_add(lit(x), p[1].mul_add(lit(y), p[2] * z))
    }
}

/// Differences of two rounded products: with the vectors exchanged, the exact negative.
#[inline(always)]
fn cross<S: Simd>(p: [f32x4<S>; 3], q: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::low_discrepancy::mix;
    use glam::{Vec3, vec3};

    /// A number in [-1, 1) of a seed.
    fn number(seed: u32) -> f32 {
        (mix(seed) >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn place(seed: u32) -> Vec3 {
        vec3(number(3 * seed), number(3 * seed + 1), number(3 * seed + 2))
    }

    #[test]
    fn rays_meet_what_they_meet_triangle_by_triangle_with_every_instruction_set() {
        let count = 300;
        let corner = |i: u32| place(i / 3 + 10_000) + 0.2 * place(i);
        let positions: Vec<Vec3> = (0..3 * count).map(corner).collect();
        let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let directions: Vec<Vec3A> =
            (0..200).map(|i| Vec3A::from(place(20_000 + i)).normalize_or(Vec3A::X)).collect();
        let origin = Vec3A::new(0.05, -0.1, 0.02);
        let mesh = RayMesh::new(&positions, &triangles);
        let one_by_one = |d: Vec3A| {
            mesh.nearest(origin, d, |index| {
                let [a, b, c] = triangles[index as usize].map(|i| positions[i as usize].as_dvec3());
                let (o, d) = (origin.as_dvec3(), d.as_dvec3());
                let normal = (b - a).cross(c - a);
                let distance = (a - o).dot(normal) / d.dot(normal);
                let hit = o + distance * d;
                let inside =
                    [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| (q - p).cross(hit - p).dot(normal) >= 0.0);
                if inside && distance >= 0.0 { distance as f32 } else { f32::INFINITY }
            })
        };
        let want: Vec<u32> = directions.iter().map(|&d| one_by_one(d).unwrap_or(NOTHING)).collect();
        assert!(want.contains(&NOTHING) && want.iter().any(|&found| found != NOTHING));
        let mut wide = WideBvh::new(&mesh);
        for level in crate::simd::levels() {
            wide.level = level;
            assert_eq!(wide.first(origin, &directions), want);
            let hits: Vec<bool> = want.iter().map(|&found| found != NOTHING).collect();
            assert_eq!(wide.hits(origin, &directions), hits);
        }
    }

    #[test]
    fn no_ray_slips_through_an_edge_or_past_a_flat_box_and_nothing_is_hit_of_nothing() {
        // A floor of 16 x 16 squares whose edges and corners rays from above are aimed at.
        let at = |i: u32| vec3((i % 17) as f32 - 8.0, 0.0, (i / 17) as f32 - 8.0);
        let positions: Vec<Vec3> = (0..17 * 17).map(at).collect();
        let squares = (0..256).map(|i| i / 16 * 17 + i % 16);
        let triangles: Vec<[u32; 3]> =
            squares.flat_map(|a| [[a, a + 17, a + 1], [a + 1, a + 17, a + 18]]).collect();
        let wide = WideBvh::new(&RayMesh::new(&positions, &triangles));
        let origin = Vec3A::new(0.0, 3.0, 0.0);
        // Whole and half places, which lie on corners and edges.
        let aims =
            (0..31 * 31).map(|i| Vec3A::new((i % 31) as f32 * 0.5 - 7.5, 0.0, (i / 31) as f32 * 0.5 - 7.5));
        let directions: Vec<Vec3A> = aims.map(|aim| (aim - origin).normalize()).collect();
        assert!(wide.hits(origin, &directions).into_iter().all(|hit| hit));
        let none = WideBvh::new(&RayMesh::new(&[], &[]));
        assert!(!none.hits(origin, &directions)[0] && none.first(origin, &directions)[0] == NOTHING);
    }
}
