//! What a scene calls for of the shader planner.

use super::Scene;
use crate::model::params::{Param, Params};
use crate::shader::domain::Work;
use crate::shader::facts::{Budget, FaceSizes, Facts, MapFacts, Source};

impl Facts {
    /// Of a scene at `params`, within `budget`, on an adapter with or without 16-bit arithmetic.
    #[must_use]
    pub fn of_scene(scene: &Scene, params: &Params, budget: Budget, f16: bool) -> Self {
        let Scene { maps, mesh, .. } = scene;
        let same = |a: Option<(usize, usize)>, b: Option<(usize, usize)>| a.is_some() && a == b;
        let color = maps.color.as_ref().map(|map| (map.width, map.height));
        let normal = maps.normal.as_ref().map(|map| (map.width, map.height));
        let specular = maps.specular.as_ref().map(|map| (map.width, map.height));
        let attenuator = maps.attenuator.as_ref().map(|map| (map.width, map.height));
        Self {
            setup: scene.setup(),
            source: Source::Raster,
            maps: MapFacts {
                color: color.is_some(),
                normal: normal.is_some(),
                specular: specular.is_some(),
                attenuator: attenuator.is_some(),
                color_specular: same(color, specular),
                normal_attenuator: same(normal, attenuator),
            },
            faces: FaceSizes::default(),
            morphs: mesh.morphs.iter().filter(|morph| morph.weight != 0.0).count() as u32,
            bones: !mesh.bones.is_empty() && !mesh.joints.is_empty(),
            turned: params.scalar(Param::EnvironmentRotation) != 0.0,
            square_rim: params.scalar(Param::RimExponent) == 2.0,
            f16,
            tessellation: tessellation_error(scene),
            atlas: None,
            work: Work::default(),
            budget,
            output: None,
        }
    }
}

/// The 99th percentile over a mesh's triangles of how far an interpolated 1 - |N.V| is off: where the
/// normals of a triangle differ by an angle a, a cosine between two vertices sags by up to a^2 / 8.
#[must_use]
pub fn tessellation_error(scene: &Scene) -> f64 {
    let normals = &scene.mesh.normals;
    let sag = |a: u32, b: u32| {
        let (a, b) = (normals[a as usize].as_dvec3(), normals[b as usize].as_dvec3());
        let angle = a.cross(b).length().atan2(a.dot(b));
        angle * angle / 8.0
    };
    let mut sags: Vec<f64> =
        scene.mesh.triangles.iter().map(|&[a, b, c]| sag(a, b).max(sag(b, c)).max(sag(c, a))).collect();
    if sags.is_empty() {
        return 0.0;
    }
    let at = (sags.len() - 1) * 99 / 100;
    *sags.select_nth_unstable_by(at, f64::total_cmp).1
}
