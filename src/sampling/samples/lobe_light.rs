//! The light that rays into a specular lobe bring, of the environment and of the skin: the reference of all lookups
//! (MODEL 9, `rays`).
//!
//! A ray that meets nothing looks the environment up as blurred as the solid angle is wide that it stands for
//! (Křivánek and Colbert 2008, *Real-time Shading with Filtered Importance Sampling*). Sums are divided by what the
//! rules' own split sum stands for, so that its error is mended too.

use std::sync::Arc;

use glam::Vec3A;

use super::lit_mesh::LitMesh;
use super::lobe::LobeRay;
use crate::bake::lobe_sky::LobeSky;
use crate::bake::rays::RayMesh;
use crate::bake::sky::{LOBE_NODES, LOBES, traces_lobes};
use crate::bake::wide_bvh::NOTHING;
use crate::model::choices::{SpecularMap, SpecularModel, SplitSum};
use crate::model::fields::{Field, Fields};
use crate::scene::Scene;
use crate::specular::brdf::{dielectric, schlick};
use crate::specular::roughness_of;

/// Roughnesses that are traced where a fit moves it: from gloss to a dull surface, about evenly in the lobe's width.
const SHARPEST_NODE: f64 = 0.2;
const WIDEST_NODE: f64 = 0.7;
/// The least ratio of the widest to the sharpest: a parabola through points that are nearer would magnify their noise.
const APART: f64 = 1.2;

/// What shines into lobes.
pub(super) struct LobeLight<'a> {
    fields: Vec<(Field, f64)>,
    /// The field of the three roughnesses, and these.
    nodes: (Option<Field>, [f64; 3]),
    sky: Option<Arc<LobeSky>>,
    /// The skin, where it shows itself.
    skin: Option<LitMesh<'a>>,
    model: SpecularModel,
    split_sum: SplitSum,
    f0: f64,
    /// The share of f0 where the specular map is black.
    f0_floor: f64,
}

impl<'a> LobeLight<'a> {
    /// Of a scene that asks for it.
    pub(super) fn new(
        scene: &Scene,
        fields: Fields,
        sky: impl FnOnce() -> Option<Arc<LobeSky>>,
        skin: Option<LitMesh<'a>>,
    ) -> Option<Self> {
        if !traces_lobes(scene, fields) {
            return None;
        }
        let f0_floor = match scene.choices.specular_map {
            SpecularMap::Weight => 1.0,
            SpecularMap::F0 => scene.params.scalar_named("f0_floor"),
        };
        let nodes = nodes(scene);
        let traced = LOBES.iter().zip(nodes).filter_map(|(name, m)| Some((fields.named(name)?, m)));
        Some(Self {
            fields: traced.collect(),
            nodes: (fields.named(LOBE_NODES), nodes),
            sky: sky(),
            skin,
            model: scene.choices.specular_model,
            split_sum: scene.choices.split_sum,
            f0: scene.params.scalar_named("f0"),
            f0_floor,
        })
    }

    /// The three roughnesses, where a field is that of them.
    pub(super) fn nodes(&self, field: Field) -> Option<[f32; 3]> {
        (self.nodes.0 == Some(field)).then(|| self.nodes.1.map(|m| m as f32))
    }

    /// The roughness that a field of light is of; `None` of any other.
    pub(super) fn roughness(&self, field: Field) -> Option<f64> {
        self.fields.iter().find(|(of, _)| *of == field).map(|&(_, m)| m)
    }

    /// The mean light along `lobe`, rays from `origin`, where the specular map has `s`.
    pub(super) fn mean(&self, rays: &RayMesh, origin: Vec3A, lobe: &[LobeRay], s: f64) -> [f32; 3] {
        let directions: Vec<Vec3A> = lobe.iter().map(|ray| ray.along).collect();
        let f0 = self.f0 * (self.f0_floor + (1.0 - self.f0_floor) * s);
        let (mut sum, mut share) = ([0.0_f64; 3], 0.0_f64);
        for (ray, met) in lobe.iter().zip(rays.wide().first(origin, &directions)) {
            let light = match met {
                NOTHING => self.sky.as_ref().map_or([0.0; 3], |sky| sky.along(ray.along, ray.solid_angle)),
                triangle => {
                    self.skin.as_ref().map_or([0.0; 3], |skin| skin.radiance(triangle, origin, ray.along))
                }
            };
            let fresnel = match self.model {
                SpecularModel::Kelemen => schlick(ray.half_view, f0),
                SpecularModel::Ggx => dielectric(ray.half_view, f0)[0],
            };
            let split = match self.split_sum {
                SplitSum::Schlick => schlick(ray.half_view, f0),
                SplitSum::Exact => fresnel,
            };
            (0..3).for_each(|c| sum[c] += ray.weight * fresnel * light[c]);
            share += ray.weight * split;
        }
        if share > 0.0 { sum.map(|sum| (sum / share) as f32) } else { [0.0; 3] }
    }
}

/// The roughnesses that a scene's lobes are traced at: the range that they have, and where a fit moves it a wide one.
fn nodes(scene: &Scene) -> [f64; 3] {
    let [roughness, gloss] = ["roughness", "gloss"].map(|name| scene.params.scalar_named(name));
    let free = |name: &str| scene.fit.free.iter().any(|column| column.param.name() == name);
    let [sharp, wide] = [1.0, 0.0].map(|s| roughness_of(roughness, gloss, s));
    let (sharp, wide) = match free("roughness") || free("gloss") {
        true => (sharp.min(SHARPEST_NODE), wide.max(WIDEST_NODE)),
        false => (sharp, wide),
    };
    let wide = wide.max(APART * sharp);
    [sharp, (sharp * wide).sqrt(), wide]
}
