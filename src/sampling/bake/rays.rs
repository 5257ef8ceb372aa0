//! A mesh as rays see it: a wide BVH (`obvhs`), whose nearest triangle the caller intersects, or packets of rays
//! (`wide_bvh`).

use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use super::cutouts::Cutouts;
use super::wide_bvh::WideBvh;
use crate::scene::mesh::PosedMesh;

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
    /// Those that packets of rays go through in places.
    cutouts: Option<Arc<Cutouts>>,
    /// The hierarchy for packets of rays, made when the first of them comes.
    wide: OnceLock<WideBvh>,
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

/// A ray. For a component near 0, `Ray::new` takes that of a slope of 1e-7, which
/// leaves a box whose face the ray runs in: where a mirror-symmetric mesh is seen from its plane.
fn ray(origin: Vec3A, direction: Vec3A) -> Ray {
    // The traversal takes -0 for a positive number: its inverse must be one, too.
    let inverse = |x: f32| if x.abs() < 1e-20 { 1e20_f32.copysign(x + 0.0) } else { 1.0 / x };
    let inv_direction = Vec3A::from(direction.to_array().map(inverse));
    Ray { origin, direction, inv_direction, tmin: 0.0, tmax: f32::INFINITY }
}

/// As obvhs' `build_cwbvh_from_tris`, which asks for the time, and a browser's standard library panics then.
fn hierarchy(triangles: &[Triangle]) -> CwBvh {
    let parameters = BvhBuildParams::medium_build();
    let mut binary = PlocBuilder::with_capacity(triangles.len()).build(
        parameters.ploc_search_distance,
        triangles,
        (0..triangles.len() as u32).collect(),
        parameters.sort_precision,
        parameters.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut binary, parameters.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&binary, parameters.max_prims_per_leaf.clamp(1, 3), true, false)
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
        let bvh = (!triangles.is_empty()).then(|| hierarchy(&triangles));
        Self { bvh, triangles, index, cutouts: None, wide: OnceLock::new() }
    }

    /// That of a mesh in its pose; packets of rays go through what its materials' alpha cuts out of it.
    #[must_use]
    pub fn of(mesh: &PosedMesh) -> Self {
        let cutouts = Cutouts::of(mesh).map(Arc::new);
        Self { cutouts, ..Self::new(&mesh.positions, &mesh.triangles) }
    }

    /// The triangles that can be hit, by their indices in the mesh, which rise.
    pub(crate) fn triangles(&self) -> &[u32] {
        &self.index
    }

    /// The hierarchy for packets of rays.
    pub(crate) fn wide(&self) -> &WideBvh {
        self.wide.get_or_init(|| self.widened())
    }

    fn widened(&self) -> WideBvh {
        WideBvh::new(self.bvh.as_ref(), &self.triangles, &self.index, self.cutouts.clone())
    }

    /// The same with the instructions of `level`.
    #[cfg(test)]
    pub(crate) fn wide_at(&self, level: fearless_simd::Level) -> WideBvh {
        let mut wide = self.widened();
        wide.level = level;
        wide
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
        let (mut hit, ray) = (RayHit::none(), ray(origin, direction));
        let triangle = |slot: usize| self.index[bvh.primitive_indices[slot] as usize];
        bvh.ray_traverse(ray, &mut hit, |_, slot| intersect(triangle(slot)))
            .then(|| triangle(hit.primitive_id as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle across the z axis at `z`.
    fn across(z: f32) -> [Vec3; 3] {
        [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.0, z)]
    }

    /// `hidden`, `count` times, and behind it a triangle across the z axis.
    fn before_the_last(hidden: [Vec3; 3], count: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let positions = [hidden, across(2.0)].concat();
        let mut triangles = vec![[0, 1, 2]; count];
        triangles.push([3, 4, 5]);
        (positions, triangles)
    }

    #[test]
    fn a_part_that_posing_has_hidden_takes_no_time_and_what_is_left_keeps_its_number() {
        // The builder would take hours for them.
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
            assert_eq!(mesh.wide().hits(Vec3A::ZERO, &[Vec3A::Z, Vec3A::X]), [true, false]);
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
            for (depth, direction) in [(0.0, direction), (3.0, -direction)] {
                let origin = Vec3A::new(0.01, -0.02, depth);
                assert!(mesh.nearest(origin, direction, |_| 1.0).is_some(), "{direction}");
                assert_eq!(mesh.wide().hits(origin, &[direction]), [true], "{direction}");
            }
        }
    }

    #[test]
    fn of_nothing_nothing_is_hit() {
        let collapsed = [Vec3::ONE; 3];
        for (positions, triangles) in [(&collapsed[..], &[[0, 1, 2]][..]), (&[], &[])] {
            let mesh = RayMesh::new(positions, triangles);
            assert_eq!(mesh.wide().hits(Vec3A::ZERO, &[Vec3A::ONE.normalize()]), [false]);
            assert_eq!(mesh.nearest(Vec3A::ZERO, Vec3A::ONE.normalize(), |_| 1.0), None);
            assert!(!any_can_be_hit(positions, triangles));
        }
        assert!(any_can_be_hit(&across(1.0), &[[0, 1, 2]]));
    }
}
