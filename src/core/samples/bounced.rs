//! What the skin throws back of a scene's own lights: fields of samples, found at the vertices (MODEL 10).
//!
//! A light's shadowed irradiance at each vertex is gathered over the mesh, in two rounds, as the environment's is. The
//! panorama's lights are part of the whole panorama there.

use std::f64::consts::PI;

use glam::Vec3;

use super::posed::hits_of_vertices;
use super::sky::OfVertices;
use super::supply::Supply;
use super::visibility::Shadows;
use crate::bake::interreflection::{Albedo, VertexGather};
use crate::bake::rays::RayMesh;
use crate::model::effects::Effect;
use crate::model::fields::{Field, Fields};
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// What finds those of `fields` that are of light thrown back. A light that a parameter has moved stands there; what is
/// found is held while the parameter moves.
pub(super) fn supplies<'a>(
    scene: &Scene,
    mesh: &'a PosedMesh,
    rays: &RayMesh,
    fields: Fields,
) -> Vec<(Field, Box<dyn Supply + 'a>)> {
    let asked = |light: &Light| {
        let field = Field::from_name(&format!("light_{}_bounced", light.member()))?;
        fields.iter().any(|of| of == field).then(|| (field, light.moved(&scene.params)))
    };
    let lights: Vec<(Field, Light)> = scene.lights.iter().filter_map(asked).collect();
    if lights.is_empty() {
        return Vec::new();
    }
    let shadows = Shadows::new(mesh, rays, scene.quality.shadow_rays);
    let shadowed = scene.effects.has(Effect::Shadows);
    let albedo = Albedo { map: scene.maps.color.as_ref() };
    let gather = VertexGather::new(mesh, scene.quality.occlusion_rays, &albedo);
    let hits = hits_of_vertices(mesh);
    // Irradiance over pi, of a light of strength 1.
    let direct = |light: &Light, vertex: usize| {
        let Some(hit) = hits[vertex] else { return 0.0 };
        let place = shadows.place(hit.triangle, hit.weights().map(f64::from));
        let normal = mesh.normals.get(vertex).map_or(Vec3::ZERO, |normal| normal.normalize_or_zero());
        let facing = normal.as_dvec3().dot(light.towards(place.position)).max(0.0);
        if facing == 0.0 {
            return 0.0;
        }
        let arriving = match shadowed {
            true => f64::from(shadows.arriving(&place, light)),
            false => light.attenuation(place.position),
        };
        (facing * arriving / PI) as f32
    };
    let found = |(field, light): (Field, Light)| {
        let numbers = gather.bounced(|vertex| [direct(&light, vertex); 3]);
        (field, Box::new(OfVertices { triangles: &mesh.triangles, numbers }) as Box<dyn Supply + 'a>)
    };
    lights.into_iter().map(found).collect()
}
