//! The sky that each sample sees, by rays of its own: the reference of what is found at vertices (MODEL 10, `rays`).

use glam::{Vec3, Vec3A};

use super::supply::Supply;
use super::trace::Hit;
use super::visibility::Shadows;
use crate::bake::interreflection::{Albedo, Met};
use crate::bake::panorama::Radiance;
use crate::bake::rays::RayMesh;
use crate::bake::shadowed::share_of_open;
use crate::scene::mesh::PosedMesh;

/// Rays over the hemisphere of the smooth normal, distributed as the cosine. Those that meet nothing bring the
/// panorama's light, the others the albedo where they end times the light there. Open light is that along all of them, so
/// that where none meets anything the share is 1.
pub(super) struct ByRays<'a> {
    pub(super) mesh: &'a PosedMesh,
    pub(super) rays: &'a RayMesh,
    pub(super) shadows: Shadows<'a>,
    /// The panorama without its lights, as the scene turns it.
    pub(super) radiance: Radiance<'a>,
    /// Its mean.
    pub(super) mean: [f64; 3],
    pub(super) albedo: Albedo<'a>,
    /// The light at each vertex of which the mesh throws its albedo's share back; none where nothing is.
    pub(super) light: Vec<[f32; 3]>,
}

impl Supply for ByRays<'_> {
    fn find(&self, hit: Hit, numbers: &mut [f32]) {
        let weights = hit.weights();
        let place = self.shadows.place(hit.triangle, weights.map(f64::from));
        let corners = self.mesh.triangles[hit.triangle as usize];
        let normal: Vec3 = (0..3).map(|i| weights[i] * self.mesh.normals[corners[i] as usize]).sum();
        let normal = Vec3A::from(normal).normalize_or_zero();
        if normal == Vec3A::ZERO {
            return numbers.fill(1.0);
        }
        let (mut arrived, mut open, mut count) = ([0.0; 3], [0.0; 3], 0_u32);
        for d in self.shadows.hemisphere(&place, normal) {
            let sky = self.radiance.along(d.to_array().map(f64::from));
            let seen = match self.rays.first(place.origin, d) {
                None => sky,
                Some(triangle) => self.thrown_back(triangle, place.origin, d),
            };
            for c in 0..3 {
                open[c] += sky[c];
                arrived[c] += seen[c];
            }
            count += 1;
        }
        let mean = self.mean.map(|mean| mean * f64::from(count));
        let share = share_of_open(arrived, open, mean).map(|share| share as f32);
        numbers.copy_from_slice(&share[..numbers.len()]);
    }
}

impl ByRays<'_> {
    /// The radiance of the mesh where the ray meets that triangle of it.
    fn thrown_back(&self, triangle: u32, origin: Vec3A, d: Vec3A) -> [f64; 3] {
        let met = if self.light.is_empty() { None } else { self.albedo.met(self.mesh, triangle, origin, d) };
        let Some(Met { corners, weights, albedo }) = met else { return [0.0; 3] };
        let light =
            |c: usize| -> f32 { (0..3).map(|i| weights[i] * self.light[corners[i] as usize][c]).sum() };
        [0, 1, 2].map(|c| f64::from(albedo[c] * light(c)))
    }
}
