//! The mesh as a source of light: what reaches its vertices, whatever it comes from, and what they throw back towards one
//! another.

use std::f64::consts::PI;

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::LANES;
use super::posed::hits_of_vertices;
use super::trace::Hit;
use super::visibility::{Places, Shadows};
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

    /// Irradiance over pi of a light of strength 1 at each vertex. All cores.
    pub(super) fn direct(&self, light: &Light) -> Vec<f32> {
        let mut direct = vec![0.0; self.hits.len()];
        let lanes = direct.par_chunks_mut(LANES).enumerate();
        lanes.for_each(|(chunk, direct)| self.direct_at(light, chunk * LANES, direct));
        direct
    }

    /// That of the vertices from `first` on, at most [`LANES`].
    fn direct_at(&self, light: &Light, first: usize, direct: &mut [f32]) {
        let (mut lanes, mut places, mut facing) = (Vec::new(), Vec::new(), Vec::new());
        for lane in 0..direct.len() {
            let Some(hit) = self.hits[first + lane] else { continue };
            let place = self.shadows.place(hit.triangle, hit.weights().map(f64::from));
            let normal = self.mesh.normals.get(first + lane).map_or(Vec3::ZERO, |n| n.normalize_or_zero());
            let faces = normal.as_dvec3().dot(light.towards(place.position));
            if faces > 0.0 {
                lanes.push(lane);
                places.push(place);
                facing.push(faces);
            }
        }
        let arriving = match self.shadowed {
            true => self.shadows.arriving(&Places::new(&places), light).map(f64::from),
            false => std::array::from_fn(|k| places.get(k).map_or(0.0, |p| light.attenuation(p.position))),
        };
        for (k, lane) in lanes.into_iter().enumerate() {
            direct[lane] = (facing[k] * arriving[k] / PI) as f32;
        }
    }

    /// That of all of a scene's lights in their colours, rgb.
    pub(super) fn of_scene(&self, scene: &Scene) -> Vec<[f32; 3]> {
        let shining = scene.effects.has(Effect::Lights);
        let lights = if shining { scene.lights_at(&scene.params) } else { Vec::new() };
        let mut sum = vec![[0.0; 3]; self.hits.len()];
        for light in lights {
            let color = Param::from_name(&format!("light.{}.color", light.member()));
            let color = color.map_or([1.0; 3], |color| scene.params.rgb(color));
            let strength = light.strength();
            let color = [0, 1, 2].map(|c| (strength[c] * color[c]) as f32);
            for (sum, direct) in sum.iter_mut().zip(self.direct(&light)) {
                (0..3).for_each(|c| sum[c] += direct * color[c]);
            }
        }
        sum
    }
}
