//! What the skin throws back of a scene's own lights: fields of samples, found at the vertices (MODEL 10).
//!
//! A light's shadowed irradiance at each vertex is gathered over the mesh, in two rounds, as the environment's is. The
//! panorama's lights are part of the whole panorama there.

use std::path::Path;

use super::lit_mesh::VertexLamps;
use super::sky::OfVertices;
use super::supply::{Supplies, Supply};
use crate::bake::interreflection::{Albedo, VertexGather};
use crate::bake::rays::RayMesh;
use crate::bake::sky::{SKY_RATIO, sees_skin};
use crate::model::choices::{Bounces, Visibility};
use crate::model::fields::{Field, Fields};
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// What the vertices of a scene's mesh gather of one another as it is posed, where what is found of its samples is found
/// from that: whoever makes samples of one pose again and again keeps it.
#[must_use]
pub fn gather_of(scene: &Scene, mesh: &PosedMesh) -> Option<VertexGather> {
    gather_for(scene, mesh, scene.needs().fields, None)
}

/// As [`gather_of`], where `fields` are to be found; kept among the bakes of `cache`.
pub(super) fn gather_for(
    scene: &Scene,
    mesh: &PosedMesh,
    fields: Fields,
    cache: Option<&Path>,
) -> Option<VertexGather> {
    let gathered = scene.choices.bounces == Bounces::Gathered;
    let asks = |name: &str| fields.named(name).is_some();
    let by_rays = scene.choices.visibility == Visibility::Rays && asks(SKY_RATIO);
    let of_lamps = scene.lights.iter().any(|light| asks(&field_name(light)));
    let of_skin = sees_skin(scene, fields);
    let gather = || {
        let albedo = Albedo { map: scene.maps.color.as_ref() };
        VertexGather::kept(mesh, scene.quality.occlusion_rays, &albedo, cache)
    };
    (gathered && (by_rays || of_lamps) || of_skin).then(gather)
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
    let asked =
        |light: &Light| fields.named(&field_name(light)).map(|field| (field, light.moved(&scene.params)));
    let lights: Vec<(Field, Light)> = scene.lights.iter().filter_map(asked).collect();
    let Some(gather) = gather.filter(|_| !lights.is_empty()) else { return Vec::new() };
    let lamps = VertexLamps::new(scene, mesh, rays);
    let found = |(field, light): (Field, Light)| {
        let direct = lamps.direct(&light);
        let numbers = gather.bounced(|vertex| [direct[vertex]; 3]);
        (field, Box::new(OfVertices { triangles: &mesh.triangles, numbers }) as Box<dyn Supply + 'a>)
    };
    lights.into_iter().map(found).collect()
}
