//! A mesh as rays see it: a wide BVH (`obvhs`) and a watertight intersection.

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

/// Triangles and the hierarchy over them.
pub struct RayMesh {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
}

/// A ray from `least` on. For a component near 0, `Ray::new` takes that of a slope of 1e-7, which
/// leaves a box whose face the ray runs in: where a mirror-symmetric mesh is seen from its plane.
fn ray(origin: Vec3A, direction: Vec3A, least: f32) -> Ray {
    let inverse = |x: f32| if x.abs() < 1e-20 { 1e20_f32.copysign(x) } else { 1.0 / x };
    let inv_direction = Vec3A::from(direction.to_array().map(inverse));
    Ray { origin, direction, inv_direction, tmin: least, tmax: f32::INFINITY }
}

impl RayMesh {
    /// The hierarchy over `triangles` (indices into `positions`). Deterministic.
    #[must_use]
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corner = |i: u32| Vec3A::from(positions[i as usize]);
        let triangles: Vec<Triangle> = triangles
            .iter()
            .map(|&[a, b, c]| Triangle { v0: corner(a), v1: corner(b), v2: corner(c) })
            .collect();
        let parameters = BvhBuildParams::medium_build();
        let bvh = build_cwbvh_from_tris(&triangles, parameters, &mut std::time::Duration::default());
        Self { bvh, triangles }
    }

    /// Whether the ray meets any triangle, from either side, beyond `least` times its direction.
    #[must_use]
    pub fn hits(&self, origin: Vec3A, direction: Vec3A, least: f32) -> bool {
        let ray = ray(origin, direction, least);
        !self.bvh.ray_traverse_miss(ray, |ray, slot| self.intersect(ray, slot))
    }

    /// The nearest triangle along the ray, by `intersect`: the distance at which the ray meets a
    /// triangle (by index), or infinity.
    pub fn nearest(
        &self,
        origin: Vec3A,
        direction: Vec3A,
        mut intersect: impl FnMut(u32) -> f32,
    ) -> Option<u32> {
        let (mut hit, ray) = (RayHit::none(), ray(origin, direction, 0.0));
        let triangle = |slot: usize| self.bvh.primitive_indices[slot];
        self.bvh
            .ray_traverse(ray, &mut hit, |_, slot| intersect(triangle(slot)))
            .then(|| triangle(hit.primitive_id as usize))
    }

    /// The distance to a triangle, or infinity. An edge's test is the exact negative of its
    /// neighbour's, so no ray slips between two triangles.
    #[inline(always)]
    fn intersect(&self, ray: &Ray, slot: usize) -> f32 {
        let triangle = &self.triangles[self.bvh.primitive_indices[slot] as usize];
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
