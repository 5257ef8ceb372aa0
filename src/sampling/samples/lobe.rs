//! Rays into a sample's specular lobe: what share of it is open, or the light that they bring.
//!
//! Half vectors are drawn from the BRDF's distribution of slopes, so that rays go where the lobe is, and weigh what
//! is left of BRDF times cosine (Walter et al. 2007). An open share is that of the constants that a scene starts
//! from; light is traced at three roughnesses, between which the rules take it. Either is held while the constants
//! move.

use std::f64::consts::PI;

use glam::{Vec3, Vec3A};

use super::lobe_light::LobeLight;
use super::visibility::{Place, Shadows, seed};
use crate::bake::low_discrepancy::Sobol;
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::frame;
use crate::model::choices::SpecularModel;
use crate::model::fields::{Field, Fields};
use crate::model::fragment::Fragment;
use crate::model::params::Param;
use crate::scene::Scene;
use crate::scene::mesh::PosedMesh;
use crate::specular::brdf::{beckmann, ggx_distribution, ggx_visibility};
use crate::specular::roughness_of;

/// The field of the lobe's open share.
const LOBE_SEEN: &str = "lobe_seen";
/// A view along the surface or from below it is taken as this cosine: the lobe has no direction there.
const LEAST_VIEW: f32 = 1e-3;

/// The lobes of a scene's samples.
pub(super) struct Lobes<'a> {
    open: Option<Field>,
    light: Option<LobeLight<'a>>,
    shadows: Shadows<'a>,
    rays: &'a RayMesh,
    model: SpecularModel,
    roughness: f64,
    gloss: f64,
    strength: f32,
    spread: Sobol,
}

/// A ray into a lobe.
pub(super) struct LobeRay {
    /// Its unit direction.
    pub(super) along: Vec3A,
    /// BRDF times cosine over the rays' density, before Fresnel.
    pub(super) weight: f64,
    /// H.V'.
    pub(super) half_view: f64,
    /// The solid angle that it stands for, steradians.
    pub(super) solid_angle: f64,
}

impl<'a> Lobes<'a> {
    /// Those of a scene whose samples are to have one of `fields`.
    pub(super) fn new(
        scene: &Scene,
        mesh: &'a PosedMesh,
        rays: &'a RayMesh,
        light: Option<LobeLight<'a>>,
        fields: Fields,
    ) -> Option<Self> {
        let open = fields.named(LOBE_SEEN);
        (open.is_some() || light.is_some()).then(|| Self {
            open,
            light,
            shadows: Shadows::new(mesh, rays, 1),
            rays,
            model: scene.choices.specular_model,
            roughness: scene.params.scalar_named("roughness"),
            gloss: scene.params.scalar_named("gloss"),
            strength: scene.params.scalar(Param::NormalStrength) as f32,
            spread: Sobol::new(scene.quality.lobe_rays),
        })
    }

    /// Whether a field is found so.
    pub(super) fn finds(&self, field: Field) -> bool {
        let of_light =
            |light: &LobeLight<'_>| light.roughness(field).is_some() || light.nodes(field).is_some();
        self.open == Some(field) || self.light.as_ref().is_some_and(of_light)
    }

    /// A field at a place of the mesh.
    pub(super) fn find(
        &self,
        field: Field,
        (triangle, weights): (u32, [f32; 3]),
        at: &Fragment<f32>,
        numbers: &mut [f32],
    ) {
        if let Some(nodes) = self.light.as_ref().and_then(|light| light.nodes(field)) {
            return numbers.copy_from_slice(&nodes[..numbers.len()]);
        }
        let place = self.shadows.place(triangle, weights.map(f64::from));
        let n = Vec3::from(at.base) + self.strength * Vec3::from(at.bump);
        let n = n.try_normalize().unwrap_or_else(|| Vec3::from(at.normal)).into();
        let eye = -Vec3A::from(at.view);
        let traced = self.light.as_ref().and_then(|light| Some((light, light.roughness(field)?)));
        let Some((light, m)) = traced else {
            let m = roughness_of(self.roughness, self.gloss, f64::from(at.specular));
            return numbers.fill(self.open_share(&place, n, eye, m));
        };
        // Past the horizon the view is drawn back to it.
        let along = n.dot(eye);
        let n = if along < LEAST_VIEW { (n + (LEAST_VIEW - along) * eye).normalize_or(eye) } else { n };
        let rays: Vec<LobeRay> = self.lobe_rays(&place, n, eye, m).collect();
        let found = light.mean(self.rays, place.origin, &rays, f64::from(at.specular));
        numbers.copy_from_slice(&found[..numbers.len()]);
    }

    /// The open share of the lobe, in \[0, 1\]; 1 where there is no lobe.
    fn open_share(&self, place: &Place, n: Vec3A, eye: Vec3A, m: f64) -> f32 {
        let rays: Vec<LobeRay> = self.lobe_rays(place, n, eye, m).collect();
        let directions: Vec<Vec3A> = rays.iter().map(|ray| ray.along).collect();
        let hits = self.rays.wide().hits(place.origin, &directions);
        let (mut open, mut all) = (0.0_f64, 0.0_f64);
        for (ray, hit) in rays.iter().zip(hits) {
            all += ray.weight;
            if !hit {
                open += ray.weight;
            }
        }
        if all > 0.0 { (open / all) as f32 } else { 1.0 }
    }

    /// Rays into the lobe about the unit normal `n` as `eye` sees it; those below the surface are left out.
    fn lobe_rays(&self, place: &Place, n: Vec3A, eye: Vec3A, m: f64) -> impl Iterator<Item = LobeRay> {
        let (frame, count) = (frame(n), f64::from(self.spread.count()));
        self.spread.disc(seed(place)).filter_map(move |(radius, [sin, cos])| {
            // The squared radius is even in [0, 1].
            let even = f64::from(radius * radius).min(1.0 - 1e-7);
            let tangent2 = match self.model {
                SpecularModel::Kelemen => -m * m * (1.0 - even).ln(),
                SpecularModel::Ggx => m.powi(4) * even / (1.0 - even),
            };
            let cosine2 = 1.0 / (1.0 + tangent2);
            let (cosine, sine2) = (cosine2.sqrt(), tangent2 * cosine2);
            let sine = ((1.0 - cosine * cosine).max(0.0).sqrt() as f32).copysign(radius);
            let half = frame * Vec3A::new(sine * cos, sine * sin, cosine as f32);
            let along = 2.0 * eye.dot(half) * half - eye;
            let [view, light, half_view] = [n.dot(eye), n.dot(along), eye.dot(half)].map(f64::from);
            if view <= 0.0 || light <= 0.0 || half_view <= 0.0 {
                return None;
            }
            let (weight, distribution) = match self.model {
                SpecularModel::Kelemen => (light / (half_view * cosine), beckmann(sine2, cosine2, m) / PI),
                SpecularModel::Ggx => {
                    let alpha = m * m;
                    let weight = 4.0 * ggx_visibility(light, view, alpha) * light * half_view / cosine;
                    (weight, ggx_distribution(sine2, cosine2, alpha))
                }
            };
            // Of half vectors D cos; the mirrored direction turns four times as fast over H.V' (Walter et al. 2007, 14).
            let solid_angle = 4.0 * half_view / (distribution * cosine).max(1e-12) / count;
            Some(LobeRay { along, weight, half_view, solid_angle })
        })
    }
}
