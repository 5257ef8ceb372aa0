//! The mesh as a source of light: what reaches its vertices, whatever it comes from, and what they throw back towards one
//! another.

use std::f64::consts::PI;

use glam::{Vec3, Vec3A};

use super::posed::hits_of_vertices;
use super::trace::Hit;
use super::visibility::Shadows;
use crate::bake::interreflection::{Albedo, Met};
use crate::bake::rays::RayMesh;
use crate::model::effects::Effect;
use crate::model::params::Param;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// The mesh, and the light at each vertex of which it throws its albedo's share back.
pub(super) struct LitMesh<'a> {
    pub(super) mesh: &'a PosedMesh,
    pub(super) albedo: Albedo<'a>,
    /// Irradiance over pi, rgb; none where nothing is thrown back.
    pub(super) light: Vec<[f32; 3]>,
}

impl LitMesh<'_> {
    /// The radiance of the mesh where the ray meets that triangle of it; 0 from behind, where no light is known.
    pub(super) fn radiance(&self, triangle: u32, origin: Vec3A, d: Vec3A) -> [f64; 3] {
        let met = if self.light.is_empty() { None } else { self.albedo.met(self.mesh, triangle, origin, d) };
        let Some(Met { corners, weights, albedo }) = met else { return [0.0; 3] };
        let light =
            |c: usize| -> f32 { (0..3).map(|i| weights[i] * self.light[corners[i] as usize][c]).sum() };
        [0, 1, 2].map(|c| f64::from(albedo[c] * light(c)))
    }
}

/// Lamps as the vertices of a mesh receive them, with their shadows where the scene has these.
pub(super) struct VertexLamps<'a> {
    mesh: &'a PosedMesh,
    shadows: Shadows<'a>,
    shadowed: bool,
    hits: Vec<Option<Hit>>,
}

impl<'a> VertexLamps<'a> {
    pub(super) fn new(scene: &Scene, mesh: &'a PosedMesh, rays: &'a RayMesh) -> Self {
        let shadows = Shadows::new(mesh, rays, scene.quality.shadow_rays);
        Self { mesh, shadows, shadowed: scene.effects.has(Effect::Shadows), hits: hits_of_vertices(mesh) }
    }

    /// Irradiance over pi of a light of strength 1.
    pub(super) fn direct(&self, light: &Light, vertex: usize) -> f32 {
        let Some(hit) = self.hits[vertex] else { return 0.0 };
        let place = self.shadows.place(hit.triangle, hit.weights().map(f64::from));
        let normal = self.mesh.normals.get(vertex).map_or(Vec3::ZERO, |normal| normal.normalize_or_zero());
        let facing = normal.as_dvec3().dot(light.towards(place.position)).max(0.0);
        if facing == 0.0 {
            return 0.0;
        }
        let arriving = match self.shadowed {
            true => f64::from(self.shadows.arriving(&place, light)),
            false => light.attenuation(place.position),
        };
        (facing * arriving / PI) as f32
    }

    /// That of all of a scene's lights in their colours, rgb.
    pub(super) fn of_scene(&self, scene: &Scene) -> impl Fn(usize) -> [f32; 3] + Sync {
        let shining = scene.effects.has(Effect::Lights);
        let lights = if shining { scene.lights_at(&scene.params) } else { Vec::new() };
        let colored: Vec<(Light, [f32; 3])> = lights
            .into_iter()
            .map(|light| {
                let color = Param::from_name(&format!("light.{}.color", light.member()));
                let color = color.map_or([1.0; 3], |color| scene.params.rgb(color));
                let strength = light.strength();
                let color = [0, 1, 2].map(|c| (strength[c] * color[c]) as f32);
                (light, color)
            })
            .collect();
        move |vertex| {
            let mut sum = [0.0; 3];
            for (light, color) in &colored {
                let direct = self.direct(light, vertex);
                (0..3).for_each(|c| sum[c] += direct * color[c]);
            }
            sum
        }
    }
}
