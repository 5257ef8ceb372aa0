//! Many rays against a mesh: the hierarchy of `rays`, walked by packets of sixteen that go about the same way.
//!
//! What the rays share is worked out once a packet: which of a node's eight boxes it may meet at all, and where rays start
//! from one place, boxes and triangles relative to that. What is left is one box, or one triangle, against sixteen rays.

use fearless_simd::{Level, Simd, f32x4, f32x8, f32x16, prelude::*};
use glam::Vec3A;

use obvhs::cwbvh::CwBvh;
use obvhs::triangle::Triangle;

use crate::with_simd;

/// What a ray into the open meets.
pub(crate) const NOTHING: u32 = u32::MAX;
/// Marks a child that is a block of triangles, not a node.
const BLOCK: u32 = 1 << 31;
/// Rounding of a distance to a plane, three operations each; boxes are left that much later.
const LATER: f32 = 1.0 + 1e-6;
/// Rays of a packet.
pub(crate) const LANES: usize = 16;
/// The inverse of a component that is 0: not infinite, so that a plane through the origin is at 0.
const STEEPEST: f32 = 1e20;

/// Boxes around eight children, the first `count` of which are there.
struct Node {
    /// Least and greatest corner by axis; an empty place has its least above its greatest.
    bounds: [[[f32; 8]; 3]; 2],
    child: [u32; 8],
    count: u32,
}

/// Up to four triangles.
struct Block {
    /// By corner and axis.
    corners: [[[f32; 4]; 3]; 3],
    /// Which triangle of the mesh each is.
    index: [u32; 4],
    count: usize,
}

/// A hierarchy of boxes over triangles.
pub(crate) struct WideBvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    pub(super) level: Level,
}

/// A ray that is as long as that.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) origin: Vec3A,
    /// Of unit length.
    pub(crate) direction: Vec3A,
    pub(crate) length: f32,
}

/// Rays, from `ONE` place or each from its own.
struct Packet<const ONE: bool, S: Simd> {
    simd: S,
    /// The least and greatest place that rays start from.
    from: [Vec3A; 2],
    origin: [f32x16<S>; 3],
    direction: [f32x16<S>; 3],
    inverse: [f32x16<S>; 3],
    /// For each axis, 1 / the greatest component, at least 0, and 1 / the least one, at most 0.
    entry: [[f32; 2]; 3],
    /// For each axis along which all rays go one way: whether that is down, and 1 / the component of the slowest.
    exit: [Option<(bool, f32)>; 3],
    /// Up to where each ray looks; below 0 it is done.
    farthest: f32x16<S>,
    /// What each has met.
    found: [u32; LANES],
}

/// A node's boxes as a packet sees them.
struct Boxes {
    /// Least and greatest corner by axis; of rays from one place, relative to that.
    bounds: [[[f32; 8]; 3]; 2],
    /// Those that the packet may meet.
    ahead: u32,
    /// How far each is from the rays' origins, at least.
    distance: [f32; 8],
}

impl WideBvh {
    /// Of the triangles of `bvh`; which one of the mesh each is, `index` tells.
    pub(super) fn new(bvh: Option<&CwBvh>, triangles: &[Triangle], index: &[u32]) -> Self {
        let mut wide = Self { nodes: Vec::new(), blocks: Vec::new(), level: Level::new() };
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
                    wide.blocks.push(Block::of(slots, triangles, index));
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

    /// Whether each ray from `origin` along unit directions meets any triangle, from either side. Rays that go the same
    /// way should follow one another.
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
    pub(crate) fn blocked(&self, rays: &[Segment]) -> [bool; LANES] {
        let found = with_simd!(self.level, simd => {
            let mut packet = Packet::<false, _>::new(simd, rays);
            self.trace::<false, false, _>(&mut packet, &mut Vec::new());
            packet.found
        });
        found.map(|found| found != NOTHING)
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
        let mut rays = [Segment { origin, direction: Vec3A::ZERO, length: f32::INFINITY }; LANES];
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
        let mut farthest = packet.farthest();
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
                } else if packet.triangles::<FIRST>(&self.blocks[(child & !BLOCK) as usize]) {
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
    fn of(slots: &[u32], triangles: &[Triangle], index: &[u32]) -> Self {
        let mut block = Self { corners: [[[0.0; 4]; 3]; 3], index: [NOTHING; 4], count: slots.len().min(4) };
        for (k, &slot) in slots.iter().enumerate().take(4) {
            let Triangle { v0, v1, v2 } = triangles[slot as usize];
            block.index[k] = index[slot as usize];
            for (own, corner) in block.corners.iter_mut().zip([v0, v1, v2]) {
                (0..3).for_each(|axis| own[axis][k] = corner[axis]);
            }
        }
        block
    }
}

impl<const ONE: bool, S: Simd> Packet<ONE, S> {
    /// Of at most [`LANES`] rays.
    #[inline(always)]
    fn new(simd: S, rays: &[Segment]) -> Self {
        let (mut from, mut along, mut farthest) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [-1.0; LANES]);
        let mut ways = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];
        let mut places = ways;
        for k in 0..rays.len() {
            let Segment { origin, direction, length } = rays[k];
            places = [places[0].min(origin), places[1].max(origin)];
            ways = [ways[0].min(direction), ways[1].max(direction)];
            for axis in 0..3 {
                from[axis][k] = origin[axis];
                along[axis][k] = direction[axis];
            }
            farthest[k] = length;
        }
        let all = |x: f32| f32x16::splat(simd, x);
        let (mut origin, mut direction, mut inverse) = ([all(0.0); 3], [all(0.0); 3], [all(0.0); 3]);
        let (mut entry, mut exit) = ([[0.0; 2]; 3], [None; 3]);
        for axis in 0..3 {
            let x = f32x16::from_slice(simd, &along[axis]);
            let level = x.abs().simd_lt(all(1.0 / STEEPEST));
            origin[axis] = f32x16::from_slice(simd, &from[axis]);
            direction[axis] = x;
            inverse[axis] = level.select(all(STEEPEST).copysign(x), all(1.0) / x);
            let [least, greatest] = ways.map(|way| way[axis]);
            entry[axis] = [1.0 / greatest.max(1.0 / STEEPEST), 1.0 / least.min(-1.0 / STEEPEST)];
            if least > 1.0 / STEEPEST {
                exit[axis] = Some((false, 1.0 / least));
            } else if greatest < -1.0 / STEEPEST {
                exit[axis] = Some((true, 1.0 / greatest));
            }
        }
        let farthest = f32x16::from_slice(simd, &farthest);
        let found = [NOTHING; LANES];
        Self { simd, from: places, origin, direction, inverse, entry, exit, farthest, found }
    }

    /// Up to where any ray looks; below 0 all are done.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        self.farthest.as_array().iter().copied().fold(-1.0, f32::max)
    }

    /// The boxes of a node. None of the rays enters one before the fastest could, nor leaves it after the slowest.
    #[inline(always)]
    fn boxes(&self, node: &Node) -> Boxes {
        let zero = f32x8::splat(self.simd, 0.0);
        let (mut enter, mut leave) = (zero, f32x8::splat(self.simd, f32::INFINITY));
        let (mut bounds, mut square) = ([[[0.0; 8]; 3]; 2], zero);
        for axis in 0..3 {
            let least = f32x8::from_slice(self.simd, &node.bounds[0][axis]) - self.from[1][axis];
            let greatest = f32x8::from_slice(self.simd, &node.bounds[1][axis]) - self.from[0][axis];
            let [up, down] = self.entry[axis];
            enter = enter.max(least * up).max(greatest * down);
            if let Some((down, slowest)) = self.exit[axis] {
                leave = leave.min(if down { least } else { greatest } * slowest);
            }
            let off = least.max(-greatest).max(zero);
            square = off.mul_add(off, square);
            if ONE {
                (bounds[0][axis], bounds[1][axis]) = (least.into(), greatest.into());
            }
        }
        let bounds = if ONE { bounds } else { node.bounds };
        let ahead = enter.simd_le(leave * LATER).to_bitmask() as u32 & ((1 << node.count) - 1);
        Boxes { bounds, ahead, distance: square.sqrt().into() }
    }

    /// Whether a ray that is not done meets the `i`th box.
    #[inline(always)]
    fn meets(&self, boxes: &Boxes, i: usize) -> bool {
        let simd = self.simd;
        let (mut enter, mut leave) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, f32::INFINITY));
        for axis in 0..3 {
            let mut least = f32x16::splat(simd, boxes.bounds[0][axis][i]);
            let mut greatest = f32x16::splat(simd, boxes.bounds[1][axis][i]);
            if !ONE {
                (least, greatest) = (least - self.origin[axis], greatest - self.origin[axis]);
            }
            (least, greatest) = (least * self.inverse[axis], greatest * self.inverse[axis]);
            enter = enter.max(least.min(greatest));
            leave = leave.min(least.max(greatest));
        }
        enter.simd_le((leave * LATER).min(self.farthest)).any_true()
    }

    /// Take note of the block's triangles that rays meet before anything else, and say whether there are any. An edge's
    /// test is the exact negative of its neighbour's, so no ray slips between two triangles.
    #[inline(always)]
    fn triangles<const FIRST: bool>(&mut self, block: &Block) -> bool {
        let all = |x: f32| f32x16::splat(self.simd, x);
        let mut shared = [[f32x4::splat(self.simd, 0.0); 3]; 3];
        let mut heights = shared[0][0];
        if ONE {
            for corner in 0..3 {
                for axis in 0..3 {
                    let place = f32x4::from_slice(self.simd, &block.corners[corner][axis]);
                    shared[corner][axis] = place - self.from[0][axis];
                }
            }
            (shared, heights) = planes(shared);
        }
        let mut any = false;
        for k in 0..block.count {
            let (mut edges, mut height) = ([[all(0.0); 3]; 3], all(heights.as_array()[k]));
            for edge in 0..3 {
                for axis in 0..3 {
                    edges[edge][axis] = match ONE {
                        true => all(shared[edge][axis].as_array()[k]),
                        false => all(block.corners[edge][axis][k]) - self.origin[axis],
                    };
                }
            }
            if !ONE {
                (edges, height) = planes(edges);
            }
            let u = dot(self.direction, edges[0]);
            let v = dot(self.direction, edges[1]);
            let w = dot(self.direction, edges[2]);
            let determinant = u + v + w;
            let one_side = u.min(v).min(w).simd_ge(all(0.0)) | u.max(v).max(w).simd_le(all(0.0));
            let inside = one_side & !determinant.simd_eq(all(0.0));
            if !inside.any_true() {
                continue;
            }
            let distance = height / determinant;
            let met = inside & distance.simd_ge(all(0.0)) & distance.simd_lt(self.farthest);
            self.farthest = met.select(if FIRST { distance } else { all(-1.0) }, self.farthest);
            let mut met = met.to_bitmask();
            any |= met != 0;
            while met != 0 {
                self.found[met.trailing_zeros() as usize] = block.index[k];
                met &= met - 1;
            }
        }
        any
    }
}

/// The normals of the planes through the origin and each edge of triangles, which are as long as the edges' parts of the
/// determinant, and the triangles' distance from the origin along their normals.
#[inline(always)]
fn planes<S: Simd, V: SimdFloat<S>>([a, b, c]: [[V; 3]; 3]) -> ([[V; 3]; 3], V) {
    let normal = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    ([cross(b, c), cross(c, a), cross(a, b)], dot(normal, a))
}

#[inline(always)]
fn dot<S: Simd, V: SimdFloat<S>>(p: [V; 3], q: [V; 3]) -> V {
    p[0].mul_add(q[0], p[1].mul_add(q[1], p[2] * q[2]))
}

/// Differences of two rounded products: with the vectors exchanged, the exact negative.
#[inline(always)]
fn cross<S: Simd, V: SimdFloat<S>>(p: [V; 3], q: [V; 3]) -> [V; 3] {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
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

    #[test]
    fn rays_meet_what_they_meet_triangle_by_triangle_with_every_instruction_set() {
        let heap = Heap::new(300);
        let mesh = RayMesh::new(&heap.positions, &heap.triangles);
        let directions: Vec<Vec3A> =
            (0..200).map(|i| Vec3A::from(place(20_000 + i)).normalize_or(Vec3A::X)).collect();
        let origin = Vec3A::new(0.05, -0.1, 0.02);
        let want: Vec<u32> =
            directions.iter().map(|&d| heap.first(origin, d).map_or(NOTHING, |(i, _)| i)).collect();
        assert!(want.contains(&NOTHING) && want.iter().any(|&found| found != NOTHING));
        let hits: Vec<bool> = want.iter().map(|&found| found != NOTHING).collect();
        for level in crate::simd::levels() {
            let wide = mesh.wide_at(level);
            assert_eq!(wide.first(origin, &directions), want);
            assert_eq!(wide.hits(origin, &directions), hits);
        }
    }

    #[test]
    fn rays_of_any_length_from_anywhere_are_blocked_by_what_is_nearer_than_they_are_long() {
        let heap = Heap::new(300);
        let mesh = RayMesh::new(&heap.positions, &heap.triangles);
        let ray = |i: u32| {
            let (origin, direction) = (Vec3A::from(place(30_000 + i)), Vec3A::from(place(40_000 + i)));
            let direction = direction.normalize_or(Vec3A::X);
            let met = heap.first(origin, direction).map_or(1.0, |(_, distance)| distance as f32);
            // A thousandth longer or shorter than to what stands there, or as long as you like.
            let length = [0.999 * met, 1.001 * met, f32::INFINITY, -1.0][i as usize % 4];
            Segment { origin, direction, length }
        };
        // Packets of every number of rays.
        for count in 0..=LANES as u32 {
            let rays: Vec<Segment> = (0..count).map(|i| ray(100 * count + i)).collect();
            let want = rays.iter().map(|ray| {
                heap.first(ray.origin, ray.direction).is_some_and(|(_, d)| d < f64::from(ray.length))
            });
            let mut want: Vec<bool> = want.collect();
            want.resize(LANES, false);
            assert!(count < 8 || want.contains(&true));
            for level in crate::simd::levels() {
                assert_eq!(mesh.wide_at(level).blocked(&rays).to_vec(), want, "{count}");
            }
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
        let directions: Vec<Vec3A> = aims.map(|aim| (aim - origin).normalize()).collect();
        assert!(floor.wide().hits(origin, &directions).into_iter().all(|hit| hit));
        // The same from places that are not one.
        for directions in directions.chunks(LANES) {
            let ray = |(k, &direction): (usize, &Vec3A)| {
                let origin = origin - 0.125 * k as f32 * direction;
                Segment { origin, direction, length: f32::INFINITY }
            };
            let rays: Vec<Segment> = directions.iter().enumerate().map(ray).collect();
            assert!(floor.wide().blocked(&rays)[..rays.len()].iter().all(|&blocked| blocked));
        }
        let none = RayMesh::new(&[], &[]);
        assert!(!none.wide().hits(origin, &directions)[0]);
        assert_eq!(none.wide().first(origin, &directions)[0], NOTHING);
    }
}
