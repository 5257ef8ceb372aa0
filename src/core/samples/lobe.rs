//! How much of a sample's specular lobe is open, by rays: the reference of `specular_visibility`.
//!
//! Half vectors are drawn from the BRDF's distribution of slopes, so that rays go where the lobe is, and weigh what is left of
//! BRDF times cosine (Walter et al. 2007). The lobe is that of the constants that a scene starts from; it is held while
//! they move.

use glam::{Vec3, Vec3A};

use super::visibility::{Place, Shadows, seed};
use crate::bake::low_discrepancy::Sobol;
use crate::bake::rays::RayMesh;
use crate::bake::vertex_rays::frame;
use crate::model::choices::{SpecularModel, SpecularVisibility};
use crate::model::fields::Field;
use crate::model::fragment::Fragment;
use crate::model::params::Param;
use crate::scene::Scene;
use crate::scene::mesh::PosedMesh;
use crate::specular::brdf::ggx_visibility;
use crate::specular::roughness_of;

/// The field that holds it.
const LOBE_SEEN: &str = "lobe_seen";

/// The lobes of a scene's samples.
pub(super) struct Lobes<'a> {
    /// The field that they are.
    pub(super) field: Field,
    shadows: Shadows<'a>,
    rays: &'a RayMesh,
    model: SpecularModel,
    roughness: f64,
    gloss: f64,
    strength: f32,
    spread: Sobol,
}

impl<'a> Lobes<'a> {
    /// Those of a scene that asks for them.
    pub(super) fn new(scene: &Scene, mesh: &'a PosedMesh, rays: &'a RayMesh) -> Option<Self> {
        if scene.choices.specular_visibility != SpecularVisibility::Lobe {
            return None;
        }
        let field = Field::from_name(LOBE_SEEN)?;
        let asked = scene.needs().fields.iter().any(|asked| asked == field);
        let own = |name: &str| Param::from_identifier(name).map_or(0.0, |param| scene.params.scalar(param));
        asked.then(|| Self {
            field,
            shadows: Shadows::new(mesh, rays, 1),
            rays,
            model: scene.choices.specular_model,
            roughness: own("roughness"),
            gloss: own("gloss"),
            strength: scene.params.scalar(Param::NormalStrength) as f32,
            spread: Sobol::new(scene.quality.lobe_rays),
        })
    }

    /// The open share of the lobe at a place of the mesh, in \[0, 1\]; 1 where there is no lobe.
    pub(super) fn open(&self, triangle: u32, weights: [f32; 3], at: &Fragment<f32>) -> f32 {
        let place = self.shadows.place(triangle, weights.map(f64::from));
        let n = Vec3::from(at.base) + self.strength * Vec3::from(at.bump);
        let n = n.try_normalize().unwrap_or_else(|| Vec3::from(at.normal));
        let m = roughness_of(self.roughness, self.gloss, f64::from(at.specular));
        self.share(&place, n.into(), -Vec3A::from(at.view), m)
    }

    fn share(&self, place: &Place, n: Vec3A, eye: Vec3A, m: f64) -> f32 {
        let frame = frame(n);
        let (mut open, mut all) = (0.0_f64, 0.0_f64);
        for (radius, [sin, cos]) in self.spread.disc(seed(place)) {
            // The squared radius is even in [0, 1].
            let even = f64::from(radius * radius).min(1.0 - 1e-7);
            let tangent2 = match self.model {
                SpecularModel::Kelemen => -m * m * (1.0 - even).ln(),
                SpecularModel::Ggx => m.powi(4) * even / (1.0 - even),
            };
            let cosine = 1.0 / (1.0 + tangent2).sqrt();
            let sine = ((1.0 - cosine * cosine).max(0.0).sqrt() as f32).copysign(radius);
            let half = frame * Vec3A::new(sine * cos, sine * sin, cosine as f32);
            let along = 2.0 * eye.dot(half) * half - eye;
            let [view, light, half_view] = [n.dot(eye), n.dot(along), eye.dot(half)].map(f64::from);
            if view <= 0.0 || light <= 0.0 || half_view <= 0.0 {
                continue;
            }
            let weight = match self.model {
                SpecularModel::Kelemen => light / (half_view * cosine),
                SpecularModel::Ggx => 4.0 * ggx_visibility(light, view, m * m) * light * half_view / cosine,
            };
            all += weight;
            if !self.rays.hits(place.origin, along, 0.0) {
                open += weight;
            }
        }
        if all > 0.0 { (open / all) as f32 } else { 1.0 }
    }
}
