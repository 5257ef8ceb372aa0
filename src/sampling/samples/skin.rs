//! The skin that the skin sees: the mean radiance of the mesh from each vertex, and the mesh as rays into a specular lobe
//! meet it (MODEL 9, skin in the skin's reflection).
//!
//! Its light is the environment's past the mesh and that of all lamps with their shadows, thrown back twice. It is held
//! while parameters move.

use super::lit_mesh::{LitMesh, VertexLamps};
use super::sky::{OfVertices, Sky};
use super::supply::Supply;
use crate::bake::interreflection::{Albedo, VertexGather};
use crate::bake::rays::RayMesh;
use crate::model::effects::Effect;
use crate::scene::Scene;
use crate::scene::mesh::PosedMesh;

/// As much of a hemisphere as a vertex' own surroundings count for beside what its rays met: a ray or two. So the mean goes
/// over into these where nothing is met, and no vertex beside a hollow is black.
const SURROUNDINGS: f32 = 0.01;

/// The skin of a scene as it is lit.
pub(super) struct Skin<'s, 'a> {
    scene: &'a Scene,
    mesh: &'a PosedMesh,
    gather: &'s VertexGather,
    /// Irradiance over pi at each vertex, straight from the environment and the lamps.
    direct: Vec<[f32; 3]>,
}

impl<'s, 'a> Skin<'s, 'a> {
    pub(super) fn new(
        scene: &'a Scene,
        mesh: &'a PosedMesh,
        rays: &'a RayMesh,
        sky: &Sky<'a>,
        gather: &'s VertexGather,
    ) -> Self {
        let lamps = scene.effects.has(Effect::Lights).then(|| VertexLamps::new(scene, mesh, rays));
        let lit = lamps.as_ref().map(|lamps| lamps.of_scene(scene));
        let direct = sky.each(|vertex| {
            let (sky, lamps) = (sky.light(vertex), lit.as_ref().map_or([0.0; 3], |lit| lit[vertex]));
            [0, 1, 2].map(|c| sky[c].max(0.0) as f32 + lamps[c])
        });
        Self { scene, mesh, gather, direct }
    }

    /// The mean radiance of what each vertex sees of the mesh, weighted by the cosine.
    pub(super) fn seen(&self) -> Box<dyn Supply + 'a> {
        let thrown_back = self.gather.bounced(|vertex| self.direct[vertex]);
        let (lit, met) = (self.gather.lit(|vertex| self.direct[vertex]), self.gather.met());
        let mean = |vertex: usize| -> [f32; 3] {
            let albedo = match (&self.scene.maps.color, self.mesh.uvs.get(vertex)) {
                (Some(map), Some(uv)) if !map.texels.is_empty() => map.sample(uv.x, uv.y),
                _ => [1.0; 3],
            };
            let own = |c: usize| SURROUNDINGS * albedo[c] * lit[vertex][c];
            [0, 1, 2].map(|c| (thrown_back[vertex][c] + own(c)) / (met[vertex] + SURROUNDINGS))
        };
        let numbers = (0..self.mesh.positions.len()).map(mean).collect();
        Box::new(OfVertices { triangles: &self.mesh.triangles, numbers })
    }

    /// The mesh as it shines.
    pub(super) fn lit(&self) -> LitMesh<'a> {
        let light = self.gather.lit(|vertex| self.direct[vertex]);
        LitMesh { mesh: self.mesh, albedo: Albedo { map: self.scene.maps.color.as_ref() }, light }
    }
}
