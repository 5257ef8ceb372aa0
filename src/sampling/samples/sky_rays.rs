//! The sky that each sample sees, by rays of its own: the reference of what is found at vertices (MODEL 10, `rays`).

use glam::{Vec3, Vec3A};

use super::lit_mesh::LitMesh;
use super::supply::Supply;
use super::trace::Hit;
use super::visibility::Shadows;
use crate::bake::panorama::Radiance;
use crate::bake::rays::RayMesh;
use crate::bake::shadowed::share_of_open;
use crate::bake::wide_bvh::NOTHING;

/// Rays over the hemisphere of the smooth normal, distributed as the cosine. Those that meet nothing bring the
/// panorama's light, the others the albedo where they end times the light there. Open light is that along all of them, so
/// that where none meets anything the share is 1.
pub(super) struct ByRays<'a> {
    pub(super) rays: &'a RayMesh,
    pub(super) shadows: Shadows<'a>,
    /// The panorama without its lights, as the scene turns it.
    pub(super) radiance: Radiance<'a>,
    /// Its mean.
    pub(super) mean: [f64; 3],
    /// What the mesh throws back.
    pub(super) skin: LitMesh<'a>,
}

impl Supply for ByRays<'_> {
    fn find(&self, hit: Hit, numbers: &mut [f32]) {
        let weights = hit.weights();
        let place = self.shadows.place(hit.triangle, weights.map(f64::from));
        let corners = self.skin.mesh.triangles[hit.triangle as usize];
        let normal: Vec3 = (0..3).map(|i| weights[i] * self.skin.mesh.normals[corners[i] as usize]).sum();
        let normal = Vec3A::from(normal).normalize_or_zero();
        if normal == Vec3A::ZERO {
            return numbers.fill(1.0);
        }
        let directions: Vec<Vec3A> = self.shadows.hemisphere(&place, normal).collect();
        let (mut arrived, mut open) = ([0.0; 3], [0.0; 3]);
        for (&d, met) in directions.iter().zip(self.rays.wide().first(place.origin, &directions)) {
            let sky = self.radiance.along(d.to_array().map(f64::from));
            let seen = match met {
                NOTHING => sky,
                triangle => self.skin.radiance(triangle, place.origin, d),
            };
            for c in 0..3 {
                open[c] += sky[c];
                arrived[c] += seen[c];
            }
        }
        let mean = self.mean.map(|mean| mean * directions.len() as f64);
        let share = share_of_open(arrived, open, mean).map(|share| share as f32);
        numbers.copy_from_slice(&share[..numbers.len()]);
    }
}
