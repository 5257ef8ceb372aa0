//! A mesh as rays see it: a wide BVH (`obvhs`) and a watertight intersection.

use std::collections::HashSet;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

/// Positions beyond this have boxes whose area has no place in f32.
const FARTHEST: f32 = 1e18;
/// Edges below this share of the mesh's size stand on so few f32 positions that many triangles may be equal.
const TINY: f32 = 1e-5;

/// Triangles and the hierarchy over them.
///
/// What no ray can hit is not in it: triangles that posing has left without an area, or that lie beyond every
/// picture. A bone scaled to nothing hides a part so; many boxes without a size would keep the hierarchy's builder
/// busy for the square of their number.
pub struct RayMesh {
    /// None without triangles.
    bvh: Option<CwBvh>,
    triangles: Vec<Triangle>,
    /// For each triangle, which one it is in the mesh.
    index: Vec<u32>,
}

/// Whether a ray can hit the triangle: its area is a number above 0 to f32, as the intersection computes it.
fn can_be_hit([a, b, c]: [Vec3; 3]) -> bool {
    let near = [a, b, c].iter().all(|corner| corner.abs().max_element() < FARTHEST);
    near && (b - a).cross(c - a).abs().max_element() > f32::MIN_POSITIVE
}

/// Whether a ray can hit any of `triangles` (indices into `positions`).
#[must_use]
pub fn any_can_be_hit(positions: &[Vec3], triangles: &[[u32; 3]]) -> bool {
    triangles.iter().any(|triangle| can_be_hit(triangle.map(|i| positions[i as usize])))
}

/// The triangles that can be hit, by index; of tiny ones that are equal, the first.
fn kept(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let corners = |index: u32| triangles[index as usize].map(|i| positions[i as usize]);
    let mut kept: Vec<u32> =
        (0..triangles.len() as u32).filter(|&index| can_be_hit(corners(index))).collect();
    let all = || kept.iter().flat_map(|&index| corners(index));
    let size =
        (all().fold(Vec3::NEG_INFINITY, Vec3::max) - all().fold(Vec3::INFINITY, Vec3::min)).max_element();
    let mut seen = HashSet::new();
    kept.retain(|&index| {
        let [a, b, c] = corners(index);
        let longest = (b - a).abs().max((c - b).abs()).max((a - c).abs()).max_element();
        longest > TINY * size || seen.insert([a, b, c].map(|corner| corner.to_array().map(f32::to_bits)))
    });
    kept
}

/// A ray from `least` on. For a component near 0, `Ray::new` takes that of a slope of 1e-7, which
/// leaves a box whose face the ray runs in: where a mirror-symmetric mesh is seen from its plane.
fn ray(origin: Vec3A, direction: Vec3A, least: f32) -> Ray {
    // The traversal takes -0 for a positive number: its inverse must be one, too.
    let inverse = |x: f32| if x.abs() < 1e-20 { 1e20_f32.copysign(x + 0.0) } else { 1.0 / x };
    let inv_direction = Vec3A::from(direction.to_array().map(inverse));
    Ray { origin, direction, inv_direction, tmin: least, tmax: f32::INFINITY }
}

impl RayMesh {
    /// The hierarchy over `triangles` (indices into `positions`). Deterministic.
    #[must_use]
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let index = kept(positions, triangles);
        let corner = |i: u32| Vec3A::from(positions[i as usize]);
        let triangle = |&index: &u32| {
            let [v0, v1, v2] = triangles[index as usize].map(corner);
            Triangle { v0, v1, v2 }
        };
        let triangles: Vec<Triangle> = index.iter().map(triangle).collect();
        let build = || {
            let parameters = BvhBuildParams::medium_build();
            build_cwbvh_from_tris(&triangles, parameters, &mut std::time::Duration::default())
        };
        let bvh = (!triangles.is_empty()).then(build);
        Self { bvh, triangles, index }
    }

    /// Whether the ray meets any triangle, from either side, beyond `least` times its direction.
    #[must_use]
    pub fn hits(&self, origin: Vec3A, direction: Vec3A, least: f32) -> bool {
        let Some(bvh) = &self.bvh else { return false };
        let ray = ray(origin, direction, least);
        !bvh.ray_traverse_miss(ray, |ray, slot| self.intersect(ray, bvh.primitive_indices[slot]))
    }

    /// The hierarchy; none without triangles.
    pub(super) fn bvh(&self) -> Option<&CwBvh> {
        self.bvh.as_ref()
    }

    /// A triangle by its place among those that can be hit: its corners, and which one it is in the mesh.
    pub(super) fn triangle(&self, place: u32) -> ([Vec3A; 3], u32) {
        let Triangle { v0, v1, v2 } = self.triangles[place as usize];
        ([v0, v1, v2], self.index[place as usize])
    }

    /// Whether a triangle stands between two points, seen from either side.
    #[must_use]
    pub fn between(&self, from: Vec3A, to: Vec3A) -> bool {
        let distance = (to - from).length();
        let (Some(bvh), Some(direction)) = (&self.bvh, (to - from).try_normalize()) else { return false };
        let ray = Ray { tmax: distance, ..ray(from, direction, 0.0) };
        !bvh.ray_traverse_miss(ray, |ray, slot| self.intersect(ray, bvh.primitive_indices[slot]))
    }

    /// The nearest triangle along the ray, by its index in the mesh, from either side.
    #[must_use]
    pub fn first(&self, origin: Vec3A, direction: Vec3A) -> Option<u32> {
        let bvh = self.bvh.as_ref()?;
        let (mut hit, ray) = (RayHit::none(), ray(origin, direction, 0.0));
        let intersect = |ray: &Ray, slot: usize| self.intersect(ray, bvh.primitive_indices[slot]);
        let found = bvh.ray_traverse(ray, &mut hit, intersect);
        found.then(|| self.index[bvh.primitive_indices[hit.primitive_id as usize] as usize])
    }

    /// The nearest triangle along the ray, by `intersect`: the distance at which the ray meets a
    /// triangle (by its index in the mesh), or infinity.
    pub fn nearest(
        &self,
        origin: Vec3A,
        direction: Vec3A,
        mut intersect: impl FnMut(u32) -> f32,
    ) -> Option<u32> {
        let bvh = self.bvh.as_ref()?;
        let (mut hit, ray) = (RayHit::none(), ray(origin, direction, 0.0));
        let triangle = |slot: usize| self.index[bvh.primitive_indices[slot] as usize];
        bvh.ray_traverse(ray, &mut hit, |_, slot| intersect(triangle(slot)))
            .then(|| triangle(hit.primitive_id as usize))
    }

    /// The distance to a triangle, or infinity. An edge's test is the exact negative of its
    /// neighbour's, so no ray slips between two triangles.
    #[inline(always)]
    fn intersect(&self, ray: &Ray, triangle: u32) -> f32 {
        let triangle = &self.triangles[triangle as usize];
        let (a, b, c) = (triangle.v0 - ray.origin, triangle.v1 - ray.origin, triangle.v2 - ray.origin);
        let (bc, ca, ab) = (b.cross(c), c.cross(a), a.cross(b));
        let (u, v, w) = (ray.direction.dot(bc), ray.direction.dot(ca), ray.direction.dot(ab));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let determinant = u + v + w;
        if !inside || determinant == 0.0 {
            return f32::INFINITY;
        }
        let t = (b - a).cross(c - a).dot(a) / determinant;
        if t >= ray.tmin && t <= ray.tmax { t } else { f32::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle across the z axis at `z`.
    fn across(z: f32) -> [Vec3; 3] {
        [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.0, z)]
    }

    /// `hidden`, so many times, and behind it a triangle across the z axis.
    fn before_the_last(hidden: [Vec3; 3], count: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let positions = [hidden, across(2.0)].concat();
        let mut triangles = vec![[0, 1, 2]; count];
        triangles.push([3, 4, 5]);
        (positions, triangles)
    }

    #[test]
    fn a_part_that_posing_has_hidden_takes_no_time_and_what_is_left_keeps_its_number() {
        // The builder would take hours for so many.
        const MANY: usize = 200_000;
        let point = Vec3::new(0.25, 0.5, 1.0);
        let grid = |k: u32| f32::from_bits(1.0_f32.to_bits() + k);
        for hidden in [
            [point; 3],
            [point, point, -point],
            [point, Vec3::splat(f32::NAN), Vec3::Y],
            [point, Vec3::splat(1e30), Vec3::Y],
            [Vec3::ZERO, 1e-25 * Vec3::X, 1e-25 * Vec3::Y],
            // As small as f32 has it there.
            [Vec3::ONE, Vec3::new(grid(1), 1.0, 1.0), Vec3::new(1.0, grid(2), 1.0)],
        ] {
            let (positions, triangles) = before_the_last(hidden, MANY);
            let mesh = RayMesh::new(&positions, &triangles);
            assert!(mesh.hits(Vec3A::ZERO, Vec3A::Z, 0.0) && !mesh.hits(Vec3A::ZERO, Vec3A::X, 0.0));
            let found =
                mesh.nearest(
                    Vec3A::ZERO,
                    Vec3A::Z,
                    |index| {
                        if index as usize == MANY { 2.0 } else { f32::INFINITY }
                    },
                );
            assert_eq!(found, Some(MANY as u32), "{hidden:?}");
        }
    }

    #[test]
    fn zeros_of_either_sign_are_one_direction() {
        let (positions, triangles) = before_the_last(across(1.0), 1);
        let mesh = RayMesh::new(&positions, &triangles);
        for (x, y) in [(0.0, 0.0), (-0.0, 0.0), (0.0, -0.0), (-0.0, -0.0)] {
            let direction = Vec3A::new(x, y, 1.0);
            assert!(mesh.hits(Vec3A::new(0.01, -0.02, 0.0), direction, 0.0), "{direction}");
            assert!(mesh.hits(Vec3A::new(0.01, -0.02, 3.0), -direction, 0.0), "{direction}");
        }
    }

    #[test]
    fn what_stands_behind_the_further_point_is_not_between() {
        let mesh = RayMesh::new(&across(2.0), &[[0, 1, 2]]);
        // The hierarchy's boxes are a little larger than what is in them, the triangle is not.
        for (to, want) in [(1.999, false), (2.001, true), (1e9, true), (-1e9, false), (0.0, false)] {
            assert_eq!(mesh.between(Vec3A::ZERO, to * Vec3A::Z), want, "{to}");
        }
    }

    #[test]
    fn of_nothing_nothing_is_hit() {
        let collapsed = [Vec3::ONE; 3];
        for (positions, triangles) in [(&collapsed[..], &[[0, 1, 2]][..]), (&[], &[])] {
            let mesh = RayMesh::new(positions, triangles);
            assert!(!mesh.hits(Vec3A::ZERO, Vec3A::ONE.normalize(), 0.0));
            assert_eq!(mesh.nearest(Vec3A::ZERO, Vec3A::ONE.normalize(), |_| 1.0), None);
            assert!(!any_can_be_hit(positions, triangles));
        }
        assert!(any_can_be_hit(&across(1.0), &[[0, 1, 2]]));
    }
}
