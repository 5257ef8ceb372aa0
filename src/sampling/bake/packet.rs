//! Sixteen rays that go about the same way, against the boxes of a node and the triangles of a block of `wide_bvh`.
//!
//! What they share is worked out once: which of a node's eight boxes any of them may meet, and where they start from one
//! place, boxes and triangles relative to that. What is left is one box, or one triangle, against sixteen rays.

use fearless_simd::{Simd, f32x4, f32x8, f32x16, mask32x16, prelude::*};
use glam::Vec3A;

use super::cutouts::Cutouts;
use super::wide_bvh::{Block, NOTHING, Node};

/// Rays of a packet.
pub(crate) const LANES: usize = 16;
/// Rounding of a distance to a plane, three operations each; boxes are left that much later.
pub(super) const LATER: f32 = 1.0 + 1e-6;
/// The inverse of a component that is 0: not infinite, so that a plane through the origin is at 0.
const STEEPEST: f32 = 1e20;

/// A ray that ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) origin: Vec3A,
    /// Of unit length.
    pub(crate) direction: Vec3A,
    /// Where it ends; below 0 it is not traced.
    pub(crate) t_max: f32,
}

/// Rays, from `ONE` place or each from its own.
pub(super) struct Packet<const ONE: bool, S: Simd> {
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
    pub(super) found: [u32; LANES],
}

/// A node's boxes as a packet sees them.
pub(super) struct Boxes {
    /// Least and greatest corner by axis; of rays from one place, relative to that.
    bounds: [[[f32; 8]; 3]; 2],
    /// Those that the packet may meet.
    pub(super) ahead: u32,
    /// How far each is from the rays' origins, at least.
    pub(super) distance: [f32; 8],
}

impl<const ONE: bool, S: Simd> Packet<ONE, S> {
    /// Of at most [`LANES`] rays.
    #[inline(always)]
    pub(super) fn new(simd: S, rays: &[Segment]) -> Self {
        let (mut from, mut along, mut farthest) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [-1.0; LANES]);
        // Bounds of the origins, and of the directions.
        let mut places = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];
        let mut ways = places;
        for k in 0..rays.len() {
            let Segment { origin, direction, t_max } = rays[k];
            if !(origin.is_finite() && direction.is_finite()) || t_max.is_nan() {
                continue;
            }
            places = [places[0].min(origin), places[1].max(origin)];
            ways = [ways[0].min(direction), ways[1].max(direction)];
            for axis in 0..3 {
                from[axis][k] = origin[axis];
                along[axis][k] = direction[axis];
            }
            farthest[k] = t_max;
        }
        let all = |x: f32| f32x16::splat(simd, x);
        let (mut origin, mut direction, mut inverse) = ([all(0.0); 3], [all(0.0); 3], [all(0.0); 3]);
        let (mut entry, mut exit) = ([[0.0; 2]; 3], [None; 3]);
        for axis in 0..3 {
            let x = f32x16::from_slice(simd, &along[axis]);
            let flat = x.abs().simd_lt(all(1.0 / STEEPEST));
            origin[axis] = f32x16::from_slice(simd, &from[axis]);
            direction[axis] = x;
            inverse[axis] = flat.select(all(STEEPEST).copysign(x), all(1.0) / x);
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
    pub(super) fn farthest(&self) -> f32 {
        self.farthest.as_array().iter().copied().fold(-1.0, f32::max)
    }

    /// The boxes of a node. None of the rays enters one before the fastest could, nor leaves it after the slowest.
    #[inline(always)]
    pub(super) fn boxes(&self, node: &Node) -> Boxes {
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
    pub(super) fn meets(&self, boxes: &Boxes, i: usize) -> bool {
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
    /// test is the exact negative of its neighbour's, so no ray slips between two triangles. What a ray starts on it does
    /// not meet, nor what is cut out.
    #[inline(always)]
    pub(super) fn triangles<const FIRST: bool>(&mut self, block: &Block, cutouts: Option<&Cutouts>) -> bool {
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
        for k in 0..block.count as usize {
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
            let mut met = inside & distance.simd_gt(all(0.0)) & distance.simd_lt(self.farthest);
            if let Some(cutouts) = cutouts.filter(|_| block.cut >> k & 1 == 1) {
                let shares = [(v / determinant).into(), (w / determinant).into()];
                let stopped = cutouts.stopped(block.index[k], met.to_bitmask(), shares);
                met = mask32x16::from_bitmask(self.simd, stopped);
            }
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
