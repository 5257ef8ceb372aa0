//! Many rays against a mesh: the hierarchy of `rays`, walked by packets of sixteen (`packet`) that go about the same way.

use std::sync::Arc;

use fearless_simd::{Level, Simd};
use glam::Vec3A;
use obvhs::cwbvh::CwBvh;
use obvhs::triangle::Triangle;

use super::cutouts::Cutouts;
use super::packet::{LANES, LATER, Packet, Segment};
use crate::with_simd;

/// What a ray into the open meets.
pub(crate) const NOTHING: u32 = u32::MAX;
/// Marks a child that is a block of triangles, not a node.
const BLOCK: u32 = 1 << 31;
/// Boxes around eight children, the first `count` of which are there.
pub(super) struct Node {
    /// Least and greatest corner by axis.
    pub(super) bounds: [[[f32; 8]; 3]; 2],
    child: [u32; 8],
    pub(super) count: u32,
}

/// Up to four triangles.
pub(super) struct Block {
    /// By corner and axis.
    pub(super) corners: [[[f32; 4]; 3]; 3],
    /// Which triangle of the mesh each is.
    pub(super) index: [u32; 4],
    pub(super) count: u32,
    /// Those that rays go through in places, a bit each.
    pub(super) cut: u32,
}

/// A hierarchy of boxes over triangles.
pub(crate) struct WideBvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Where rays go through triangles; none where all are whole.
    cutouts: Option<Arc<Cutouts>>,
    pub(super) level: Level,
}

impl WideBvh {
    /// Of the triangles of `bvh`; which one of the mesh each is, `index` tells.
    pub(super) fn new(
        bvh: Option<&CwBvh>,
        triangles: &[Triangle],
        index: &[u32],
        cutouts: Option<Arc<Cutouts>>,
    ) -> Self {
        let mut wide = Self { nodes: Vec::new(), blocks: Vec::new(), cutouts, level: Level::new() };
        let Some(bvh) = bvh else { return wide };
        for node in &bvh.nodes {
            let mut own = Node { bounds: [[[0.0; 8]; 3]; 2], child: [NOTHING; 8], count: 0 };
            for i in (0..8).filter(|&i| !node.is_child_empty(i)) {
                let (aabb, to) = (node.child_aabb(i), own.count as usize);
                for axis in 0..3 {
                    own.bounds[0][axis][to] = aabb.min[axis];
                    own.bounds[1][axis][to] = aabb.max[axis];
                }
                own.child[to] = if node.is_leaf(i) {
                    let (first, count) = node.child_primitives(i);
                    let slots = &bvh.primitive_indices[first as usize..][..count as usize];
                    wide.blocks.push(Block::of(slots, triangles, index, wide.cutouts.as_deref()));
                    BLOCK | (wide.blocks.len() as u32 - 1)
                } else {
                    node.child_node_index(i)
                };
                own.count += 1;
            }
            wide.nodes.push(own);
        }
        wide
    }

    /// Whether each ray from `origin` along unit directions meets any triangle, from either side, where that is not cut
    /// out. Rays that go the same way should follow one another.
    pub(crate) fn hits(&self, origin: Vec3A, directions: &[Vec3A]) -> Vec<bool> {
        let mut found = vec![NOTHING; directions.len()];
        with_simd!(self.level, simd => self.trace_all::<false, _>(simd, origin, directions, &mut found));
        found.into_iter().map(|found| found != NOTHING).collect()
    }

    /// The first triangle that each ray from `origin` along unit directions meets, by its index in the mesh, or
    /// [`NOTHING`]. Rays that go the same way should follow one another.
    pub(crate) fn first(&self, origin: Vec3A, directions: &[Vec3A]) -> Vec<u32> {
        let mut found = vec![NOTHING; directions.len()];
        with_simd!(self.level, simd => self.trace_all::<true, _>(simd, origin, directions, &mut found));
        found
    }

    /// Whether a triangle stands in the way of each of at most [`LANES`] rays, seen from either side.
    pub(crate) fn occluded(&self, rays: &[Segment]) -> [bool; LANES] {
        let found = with_simd!(self.level, simd => {
            let mut packet = Packet::<false, _>::new(simd, rays);
            self.trace::<false, false, _>(&mut packet, &mut Vec::new());
            packet.found
        });
        found.map(|found| found != NOTHING)
    }

    /// The first triangle that each of at most [`LANES`] rays meets, by its index in the mesh, or [`NOTHING`].
    pub(crate) fn first_of_each(&self, rays: &[Segment]) -> [u32; LANES] {
        with_simd!(self.level, simd => {
            let mut packet = Packet::<false, _>::new(simd, rays);
            self.trace::<true, false, _>(&mut packet, &mut Vec::new());
            packet.found
        })
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
        let mut rays = [Segment { origin, direction: Vec3A::ZERO, t_max: f32::INFINITY }; LANES];
        for (directions, found) in directions.chunks(LANES).zip(found.chunks_mut(LANES)) {
            for k in 0..directions.len() {
                rays[k].direction = directions[k];
            }
            let mut packet = Packet::<true, _>::new(simd, &rays[..directions.len()]);
            self.trace::<FIRST, true, S>(&mut packet, &mut stack);
            found.copy_from_slice(&packet.found[..found.len()]);
        }
    }

    /// Find a triangle that each ray meets: the first, or any one.
    #[inline(always)]
    fn trace<const FIRST: bool, const ONE: bool, S: Simd>(
        &self,
        packet: &mut Packet<ONE, S>,
        stack: &mut Vec<(u32, f32)>,
    ) {
        let (mut farthest, cutouts) = (packet.farthest(), self.cutouts.as_deref());
        stack.clear();
        if !self.nodes.is_empty() {
            stack.push((0, 0.0));
        }
        while let Some((node, distance)) = stack.pop() {
            // Rounding of either.
            if distance > farthest * LATER {
                continue;
            }
            let node = &self.nodes[node as usize];
            let mut boxes = packet.boxes(node);
            let bottom = stack.len();
            while boxes.ahead != 0 {
                let i = boxes.ahead.trailing_zeros() as usize;
                boxes.ahead &= boxes.ahead - 1;
                let (child, distance) = (node.child[i], boxes.distance[i]);
                if distance > farthest * LATER || !packet.meets(&boxes, i) {
                    continue;
                }
                if child & BLOCK == 0 {
                    let mut at = stack.len();
                    stack.push((child, distance));
                    // The nearest last, which is the first to be taken.
                    while at > bottom && stack[at - 1].1 < stack[at].1 {
                        stack.swap(at - 1, at);
                        at -= 1;
                    }
                } else if packet.triangles::<FIRST>(&self.blocks[(child & !BLOCK) as usize], cutouts) {
                    farthest = packet.farthest();
                    if farthest < 0.0 {
                        return;
                    }
                }
            }
        }
    }
}

impl Block {
    fn of(slots: &[u32], triangles: &[Triangle], index: &[u32], cutouts: Option<&Cutouts>) -> Self {
        let count = slots.len().min(4) as u32;
        let mut block = Self { corners: [[[0.0; 4]; 3]; 3], index: [NOTHING; 4], count, cut: 0 };
        for (k, &slot) in slots.iter().enumerate().take(4) {
            let Triangle { v0, v1, v2 } = triangles[slot as usize];
            block.index[k] = index[slot as usize];
            let cut = cutouts.is_some_and(|cutouts| cutouts.has(block.index[k]));
            block.cut |= u32::from(cut) << k;
            for (own, corner) in block.corners.iter_mut().zip([v0, v1, v2]) {
                (0..3).for_each(|axis| own[axis][k] = corner[axis]);
            }
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;
    use crate::bake::low_discrepancy::mix;
    use crate::bake::rays::RayMesh;

    /// A number in [-1, 1) of a seed.
    fn number(seed: u32) -> f32 {
        (mix(seed) >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn place(seed: u32) -> Vec3 {
        vec3(number(3 * seed), number(3 * seed + 1), number(3 * seed + 2))
    }

    /// Triangles anywhere, and for each what a ray meets of it, in f64.
    struct Heap {
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
    }

    impl Heap {
        fn new(count: u32) -> Self {
            let corner = |i: u32| place(i / 3 + 10_000) + 0.2 * place(i);
            Self {
                positions: (0..3 * count).map(corner).collect(),
                triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            }
        }

        /// The first triangle that a ray meets, and where.
        fn first(&self, origin: Vec3A, direction: Vec3A) -> Option<(u32, f64)> {
            let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
            let met = |triangle: &[u32; 3]| {
                let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
                let normal = (b - a).cross(c - a);
                let distance = (a - o).dot(normal) / d.dot(normal);
                let hit = o + distance * d;
                let inside =
                    [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| (q - p).cross(hit - p).dot(normal) >= 0.0);
                (inside && distance >= 0.0).then_some(distance)
            };
            let all = (0..).zip(&self.triangles).filter_map(|(i, triangle)| Some((i, met(triangle)?)));
            all.min_by(|(_, a), (_, b)| a.total_cmp(b))
        }
    }

    /// Narrow packets along each axis, both ways, and along a diagonal: from outside of the heap and from within.
    fn cones() -> impl Iterator<Item = (Vec3A, Vec<Vec3A>)> {
        let ways = [Vec3A::X, Vec3A::Y, Vec3A::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let ways = ways.chain([Vec3A::new(0.5, -0.6, 0.7).normalize()]);
        ways.enumerate().flat_map(|(way, axis)| {
            [-2.5, -0.3].map(|from| {
                let near =
                    |i: u32| (axis + 0.4 * Vec3A::from(place(50_000 + 100 * way as u32 + i))).normalize();
                (from * axis, (0..96).map(near).collect())
            })
        })
    }

    #[test]
    fn rays_meet_what_they_meet_triangle_by_triangle_with_every_instruction_set() {
        let heap = Heap::new(300);
        let mesh = RayMesh::new(&heap.positions, &heap.triangles);
        let directions: Vec<Vec3A> =
            (0..200).map(|i| Vec3A::from(place(20_000 + i)).normalize_or(Vec3A::X)).collect();
        for (origin, directions) in [(Vec3A::new(0.05, -0.1, 0.02), directions)].into_iter().chain(cones()) {
            let want: Vec<u32> =
                directions.iter().map(|&d| heap.first(origin, d).map_or(NOTHING, |(i, _)| i)).collect();
            assert!(want.contains(&NOTHING) && want.iter().any(|&found| found != NOTHING), "{origin}");
            let hits: Vec<bool> = want.iter().map(|&found| found != NOTHING).collect();
            for level in crate::simd::levels() {
                let wide = mesh.wide_at(level);
                assert_eq!(wide.first(origin, &directions), want, "{origin}");
                assert_eq!(wide.hits(origin, &directions), hits, "{origin}");
            }
        }
    }

    #[test]
    fn rays_of_any_length_from_anywhere_are_blocked_by_what_is_nearer_than_they_are_long() {
        let heap = Heap::new(300);
        let mesh = RayMesh::new(&heap.positions, &heap.triangles);
        let ray = |i: u32| {
            // Towards a corner's surroundings, so that many meet something.
            let aim = Vec3A::from(heap.positions[i as usize % heap.positions.len()]);
            let origin = Vec3A::from(place(30_000 + i));
            let direction = (aim + 0.05 * Vec3A::from(place(40_000 + i)) - origin).normalize_or(Vec3A::X);
            let met = heap.first(origin, direction).map_or(1.0, |(_, distance)| distance as f32);
            // A thousandth longer or shorter than to what stands there, or as long as you like.
            let length = [0.999 * met, 1.001 * met, f32::INFINITY, -1.0][i as usize % 4];
            Segment { origin, direction, t_max: length }
        };
        // Packets of every number of rays.
        for count in 0..=LANES as u32 {
            let rays: Vec<Segment> = (0..count).map(|i| ray(100 * count + i)).collect();
            let want = rays.iter().map(|ray| {
                heap.first(ray.origin, ray.direction).is_some_and(|(_, d)| d < f64::from(ray.t_max))
            });
            let mut want: Vec<bool> = want.collect();
            want.resize(LANES, false);
            assert!(count < 8 || want.contains(&true));
            for level in crate::simd::levels() {
                assert_eq!(mesh.wide_at(level).occluded(&rays).to_vec(), want, "{count}");
            }
        }
        // Narrow packets from places beside one another.
        for (origin, directions) in cones() {
            let ray = |(i, &direction): (u32, &Vec3A)| {
                let origin = origin + 0.05 * Vec3A::from(place(60_000 + i));
                Segment { origin, direction, t_max: 0.5 + 0.03 * i as f32 }
            };
            let rays: Vec<Segment> = (0..).zip(&directions).map(ray).collect();
            let mut met = 0;
            for rays in rays.chunks(LANES) {
                let occluded = mesh.wide().occluded(rays);
                for (ray, occluded) in rays.iter().zip(occluded) {
                    let first = heap.first(ray.origin, ray.direction);
                    assert_eq!(occluded, first.is_some_and(|(_, d)| d < f64::from(ray.t_max)), "{ray:?}");
                    met += u32::from(occluded);
                }
            }
            assert!(met > 0 && met < 96, "{origin}: {met}");
        }
        // One that is no number leaves its neighbours what they are.
        let sound = Segment { origin: Vec3A::ZERO, direction: Vec3A::X, t_max: f32::INFINITY };
        let alone = mesh.wide().occluded(&[sound])[0];
        for broken in [
            Segment { direction: Vec3A::NAN, ..sound },
            Segment { origin: Vec3A::NAN, ..sound },
            Segment { t_max: f32::NAN, ..sound },
        ] {
            assert_eq!(mesh.wide().occluded(&[sound, broken])[..2], [alone, false], "{broken:?}");
            assert_eq!(mesh.wide().occluded(&[broken, sound])[..2], [false, alone], "{broken:?}");
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
        let floor = RayMesh::new(&positions, &triangles);
        let origin = Vec3A::new(0.0, 3.0, 0.0);
        // Whole and half places, which lie on corners and edges.
        let aims =
            (0..31 * 31).map(|i| Vec3A::new((i % 31) as f32 * 0.5 - 7.5, 0.0, (i / 31) as f32 * 0.5 - 7.5));
        let toward = |aim: Vec3A| (aim - origin).normalize();
        let directions: Vec<Vec3A> = aims.clone().map(toward).collect();
        assert!(floor.wide().hits(origin, &directions).into_iter().all(|hit| hit));
        // The same from places that are not one, at edges alone: where six meet, roundings may all fall to one side.
        let edges = aims.filter(|aim| aim.x.fract() != 0.0 || aim.z.fract() != 0.0);
        let edges: Vec<Vec3A> = edges.map(toward).collect();
        for directions in edges.chunks(LANES) {
            let ray = |(k, &direction): (usize, &Vec3A)| {
                let origin = origin - 0.125 * k as f32 * direction;
                Segment { origin, direction, t_max: f32::INFINITY }
            };
            let rays: Vec<Segment> = directions.iter().enumerate().map(ray).collect();
            assert!(floor.wide().occluded(&rays)[..rays.len()].iter().all(|&blocked| blocked));
        }
        let none = RayMesh::new(&[], &[]);
        assert!(!none.wide().hits(origin, &directions)[0]);
        assert_eq!(none.wide().first(origin, &directions)[0], NOTHING);
    }
}
