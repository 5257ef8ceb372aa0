//! Light that is gathered inside the mesh (MODEL 11), as fields of samples: found at the vertices, and interpolated between
//! them. Stored samples have it told apart by how far it comes; a rasteriser's vertices have it weakened by that, at the
//! constants that are set.

use super::lit_mesh::VertexLamps;
use super::sky::{OfVertices, Sky};
use super::supply::{Supplies, Supply};
use crate::bake::inward::{FAR_LIGHT, InwardRays, OfNodes};
use crate::bake::rays::RayMesh;
use crate::model::effects::Effect;
use crate::model::fields::{Field, Fields};
use crate::model::params::Param;
use crate::model::transmission::NODES;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::mesh::PosedMesh;

/// Nodes of a light's that one field holds.
const TOGETHER: usize = 3;

/// The fields of one source's light: those of nodes, each with its first, and their sum.
struct Asked {
    nodes: Vec<(Field, usize)>,
    sum: Option<Field>,
}

impl Asked {
    /// Those of `fields` whose names begin with `source`, `together` nodes in one.
    fn of(fields: Fields, source: &str, together: usize) -> Self {
        let node = |part: usize| {
            let field = fields.named(&format!("{source}{FAR_LIGHT}_{part}"))?;
            Some((field, together * part))
        };
        let nodes: Vec<(Field, usize)> = (0..NODES.len() / together).filter_map(node).collect();
        let sum = format!("{source}{FAR_LIGHT}");
        // Who exports samples' fields asks for their sum.
        let wanted = !nodes.is_empty() || fields.named(&sum).is_some();
        Self { nodes, sum: Field::from_name(&sum).filter(|_| wanted) }
    }

    const fn is_none(&self) -> bool {
        self.nodes.is_empty() && self.sum.is_none()
    }
}

/// What finds those of `fields` that are of gathered light; `sky` is what arrives of the environment. A light that a parameter
/// has moved stands there; what is found is held while parameters move. Without a sky none of it comes through; `known` are rays
/// that have been traced already.
pub(super) fn supplies<'a>(
    scene: &Scene,
    (mesh, rays): (&'a PosedMesh, &RayMesh),
    sky: Option<&Sky<'a>>,
    known: Option<&InwardRays>,
    fields: Fields,
) -> Supplies<'a> {
    let environment = Asked::of(fields, "", 1);
    let sky = sky.filter(|_| !environment.is_none());
    let shining = scene.effects.has(Effect::Lights);
    let lights = if shining { scene.lights_at(&scene.params) } else { Vec::new() };
    let of_light = |light: &Light| Asked::of(fields, &format!("light_{}_", light.member()), TOGETHER);
    let lights: Vec<(Light, Asked)> =
        lights.into_iter().map(|light| (light.clone(), of_light(&light))).collect();
    if sky.is_none() && lights.iter().all(|(_, asked)| asked.is_none()) {
        return Vec::new();
    }
    let own = if known.is_none() { InwardRays::of_scene(scene, mesh) } else { None };
    let Some(inward) = known.or(own.as_ref()) else { return Vec::new() };
    let of_vertices = |numbers: Vec<[f32; 3]>| -> Box<dyn Supply + 'a> {
        Box::new(OfVertices { triangles: &mesh.triangles, numbers })
    };
    let weakened = weakened(scene);
    let mut supplies: Supplies<'a> = Vec::new();
    if let Some(sky) = sky {
        let gathered = inward.gathered(|vertex| sky.light(vertex).map(|light| light.max(0.0) as f32));
        let node = |node: usize| of_vertices(gathered.iter().map(|of| of[node]).collect());
        supplies.extend(environment.nodes.into_iter().map(|(field, first)| (field, node(first))));
        let sum =
            |of: &OfNodes<3>| [0, 1, 2].map(|c| (0..NODES.len()).map(|k| weakened[k][c] * of[k][c]).sum());
        supplies
            .extend(environment.sum.map(|field| (field, of_vertices(gathered.iter().map(sum).collect()))));
    }
    let lamps = VertexLamps::new(scene, mesh, rays);
    for (light, asked) in lights.into_iter().filter(|(_, asked)| !asked.is_none()) {
        let direct = lamps.direct(&light);
        let gathered = inward.gathered(|vertex| [direct[vertex]]);
        let three = |of: &OfNodes<1>, first: usize| [0, 1, 2].map(|k| of[first + k][0]);
        let from = |first: usize| of_vertices(gathered.iter().map(|of| three(of, first)).collect());
        supplies.extend(asked.nodes.into_iter().map(|(field, first)| (field, from(first))));
        let sum =
            |of: &OfNodes<1>| [0, 1, 2].map(|c| (0..NODES.len()).map(|k| weakened[k][c] * of[k][0]).sum());
        supplies.extend(asked.sum.map(|field| (field, of_vertices(gathered.iter().map(sum).collect()))));
    }
    supplies
}

/// How light of each node is weakened, a channel.
fn weakened(scene: &Scene) -> [[f32; 3]; NODES.len()] {
    let lengths = Param::from_name("transmission_length").map(|length| scene.params.rgb(length));
    NODES.map(|node| lengths.map_or([0.0; 3], |lengths| lengths.map(|length| (-node / length).exp() as f32)))
}
