//! What the skin throws back of a scene's own lights: fields of samples, found at the vertices (MODEL 10).
//!
//! A light's shadowed irradiance at each vertex is gathered over the mesh, in two rounds, as the environment's is. The
//! panorama's lights are part of the whole panorama there.

use std::f64::consts::PI;

use glam::Vec3;

use super::posed::hits_of_vertices;
use super::sky::OfVertices;
use super::supply::{Supplies, Supply};
use super::visibility::Shadows;
use crate::bake::interreflection::{Albedo, VertexGather};
use crate::bake::rays::RayMesh;
use crate::bake::sky::SKY_RATIO;
use crate::model::choices::{Bounces, Visibility};
use crate::model::effects::Effect;
use crate::model::fields::{Field, Fields};
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// What the vertices of a scene's mesh gather of one another as it is posed, where what is found of its samples is found
/// from that: whoever makes samples of one pose again and again keeps it.
#[must_use]
pub fn gather_of(scene: &Scene, mesh: &PosedMesh) -> Option<VertexGather> {
    let fields = scene.needs().fields;
    let gathered = scene.choices.bounces == Bounces::Gathered;
    let asks = |name: &str| Field::from_name(name).is_some_and(|field| fields.iter().any(|of| of == field));
    let by_rays = scene.choices.visibility == Visibility::Rays && asks(SKY_RATIO);
    let of_lamps = scene.lights.iter().any(|light| asks(&field_name(light)));
    (gathered && (by_rays || of_lamps)).then(|| new_gather(scene, mesh))
}

/// What the vertices gather of one another.
pub(super) fn new_gather(scene: &Scene, mesh: &PosedMesh) -> VertexGather {
    let albedo = Albedo { map: scene.maps.color.as_ref() };
    VertexGather::new(mesh, scene.quality.occlusion_rays, &albedo)
}

fn field_name(light: &Light) -> String {
    format!("light_{}_bounced", light.member())
}

/// What finds those of `fields` that are of light thrown back. A light that a parameter has moved stands there; what is
/// found is held while the parameter moves.
pub(super) fn supplies<'a>(
    scene: &Scene,
    mesh: &'a PosedMesh,
    rays: &RayMesh,
    gather: Option<&VertexGather>,
    fields: Fields,
) -> Supplies<'a> {
    let asked = |light: &Light| {
        let field = Field::from_name(&field_name(light))?;
        fields.iter().any(|of| of == field).then(|| (field, light.moved(&scene.params)))
    };
    let lights: Vec<(Field, Light)> = scene.lights.iter().filter_map(asked).collect();
    if lights.is_empty() {
        return Vec::new();
    }
    let shadows = Shadows::new(mesh, rays, scene.quality.shadow_rays);
    let shadowed = scene.effects.has(Effect::Shadows);
    let own = gather.is_none().then(|| new_gather(scene, mesh));
    let Some(gather) = gather.or(own.as_ref()) else { return Vec::new() };
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
