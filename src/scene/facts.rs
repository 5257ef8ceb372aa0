//! What a scene calls for of the shader planner.

use super::mesh::Mesh;
use super::{Scene, ShadowMaps};
use crate::model::effects::Effect;
use crate::model::fields::Fields;
use crate::model::params::Params;
use crate::model::shadow_filter::ShadowFilter;
use crate::shader::domain::{Domain, Work};
use crate::shader::facts::{Budget, FaceSizes, Facts, MapFacts, ShadowFacts, Source};

impl Scene {
    /// What it calls for at `params`, within `budget`, on an adapter with or without 16-bit arithmetic.
    #[must_use]
    pub fn facts(&self, params: &Params, budget: Budget, f16: bool) -> Facts {
        let Self { maps, mesh, .. } = self;
        let atlas = self.needs().atlas && !mesh.uvs.is_empty();
        let same = |a: Option<(usize, usize)>, b: Option<(usize, usize)>| a.is_some() && a == b;
        let color = maps.color.as_ref().map(|map| (map.width, map.height));
        let normal = maps.normal.as_ref().map(|map| (map.width, map.height));
        let specular = maps.specular.as_ref().map(|map| (map.width, map.height));
        let attenuator = maps.attenuator.as_ref().map(|map| (map.width, map.height));
        Facts {
            setup: self.setup(),
            source: Source::Raster,
            maps: MapFacts {
                color: color.is_some(),
                normal: normal.is_some(),
                specular: specular.is_some(),
                attenuator: attenuator.is_some(),
                color_specular: same(color, specular),
                normal_attenuator: same(normal, attenuator),
                filter: self.quality.texture_filter,
                own: Fields::of(maps.own.iter().map(|(field, _)| *field)),
            },
            faces: FaceSizes::default(),
            morphs: mesh.morphs.iter().filter(|morph| morph.weight != 0.0).count() as u32,
            bones: !mesh.bones.is_empty() && !mesh.joints.is_empty(),
            turned: false,
            square_rim: false,
            f16,
            tessellation: tessellation_error(self),
            atlas: atlas.then_some(self.diffusion.light_map_size),
            own_atlas_uvs: atlas && !mesh.own_atlas_uvs.is_empty(),
            stored_texels: false,
            shadows: shadows(self),
            work: if atlas { work(self) } else { Work::default() },
            budget,
            output: None,
        }
        .at(params)
    }
}

/// Shadow maps, where lights shine that have shadows.
fn shadows(scene: &Scene) -> Option<ShadowFacts> {
    let ShadowMaps { filter, taps, .. } = scene.shadow_maps;
    let shaded = scene.effects.has(Effect::Lights) && scene.effects.has(Effect::Shadows);
    (shaded && filter != ShadowFilter::Vertices).then_some(ShadowFacts { filter, taps })
}

/// How many vertices, texels of the atlas and fragments an image of the first view takes. Where the charts overlap,
/// texels are counted again.
fn work(scene: &Scene) -> Work {
    let Mesh { positions, triangles, .. } = &scene.mesh;
    let uvs = scene.mesh.atlas_uvs();
    let corner = |i: u32| uvs.get(i as usize).copied().unwrap_or_default();
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(corner);
        f64::from((b - a).perp_dot(c - a).abs()) / 2.0
    };
    let covered: f64 = triangles.iter().copied().map(area).sum();
    let vertices = positions.len() as f64;
    // Without a view, as many as a character's mesh has beside its vertices.
    let usual = vertices / Work::default().share(Domain::Vertex);
    let fragments = scene
        .views
        .first()
        .map_or(usual, |view| f64::from(view.camera.width) * f64::from(view.camera.height));
    Work { vertices, texels: covered.min(1.0) * f64::from(scene.diffusion.light_map_size).powi(2), fragments }
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
