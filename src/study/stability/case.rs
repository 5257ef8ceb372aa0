//! What evaluators are given: fragments and vertices as plain numbers, with the setting that they share.

use super::lights::LightKind;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fragment::{Fragment, decode_normal, guarded, unit_view};
use crate::model::params::{Param, Params};
use crate::model::real::Real;
use crate::model::vector::normalize_or;
use crate::model::vertex::Vertex;
use crate::scene::Loss;

/// What a fragment is shaded from: interpolated values and texels, before any guard. Each number is one that
/// an f32 holds, so that every evaluator starts from the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FragmentInputs {
    /// The normal map's texel, in [0, 1] where it is sound.
    pub texel: [f64; 3],
    /// T, as interpolated.
    pub tangent: [f64; 3],
    /// B, as interpolated.
    pub bitangent: [f64; 3],
    /// N, as interpolated.
    pub normal: [f64; 3],
    /// From the eye to the surface, of any length.
    pub view: [f64; 3],
    /// S.x, the open share of the hemisphere.
    pub occlusion: f64,
    /// S.z, unless the silhouette follows the bumped normal.
    pub silhouette: f64,
    /// S.w.
    pub dapple: f64,
    /// Albedo, linear.
    pub albedo: [f64; 3],
    /// Specular map s.
    pub specular: f64,
    /// Attenuator map a.
    pub attenuator: f64,
}

impl FragmentInputs {
    /// Nothing hard about it: a surface seen at some angle, with a slight bump.
    pub const ORDINARY: Self = Self {
        texel: [0.5625, 0.453_125, 0.96875],
        tangent: [1.0, 0.0, 0.0],
        bitangent: [0.0, 1.0, 0.0],
        normal: [0.0, 0.0, 1.0],
        view: [0.375, -0.5, -0.75],
        occlusion: 0.75,
        silhouette: 0.25,
        dapple: 0.5,
        albedo: [0.75, 0.5, 0.375],
        specular: 0.5,
        attenuator: 0.75,
    };

    /// Every number, in the order of declaration.
    pub fn numbers_mut(&mut self) -> [&mut f64; 23] {
        let Self {
            texel: [x0, x1, x2],
            tangent: [t0, t1, t2],
            bitangent: [b0, b1, b2],
            normal: [n0, n1, n2],
            view: [v0, v1, v2],
            occlusion,
            silhouette,
            dapple,
            albedo: [a0, a1, a2],
            specular,
            attenuator,
        } = self;
        [
            x0, x1, x2, t0, t1, t2, b0, b1, b2, n0, n1, n2, v0, v1, v2, occlusion, silhouette, dapple, a0,
            a1, a2, specular, attenuator,
        ]
    }

    /// As the model reads it, in the scalar of `like`: what samples hold of such a point.
    pub fn fragment<R: Real>(&self, setup: Setup, like: R) -> Fragment<R> {
        let lit = |v: [f64; 3]| v.map(|x| like.lit(x));
        let (normal, given) = (lit(self.normal), lit(self.view));
        let view = if setup.form == Form::Corrected { unit_view(given) } else { given };
        let smooth = normalize_or(normal, view.map(|x| -x)).0;
        let (base, bump) = if setup.effects.has(Effect::NormalMap) {
            let (tangent, bitangent) = (lit(self.tangent), lit(self.bitangent));
            decode_normal(setup.form, lit(self.texel), tangent, bitangent, normal)
        } else {
            let unbumped = if setup.form == Form::Corrected { smooth } else { normal };
            (unbumped, [like.lit(0.0); 3])
        };
        let (base, bump) = guarded(base, bump, view);
        Fragment {
            base,
            bump,
            normal: smooth,
            view,
            occlusion: like.lit(self.occlusion),
            silhouette: like.lit(self.silhouette),
            dapple: like.lit(self.dapple(setup.form)),
            albedo: lit(self.albedo),
            specular: like.lit(self.specular),
            attenuator: like.lit(self.attenuator),
        }
    }

    /// S.w as `form` reads it.
    #[must_use]
    pub fn dapple(&self, form: Form) -> f64 {
        if form == Form::Corrected { self.dapple.max(0.0) } else { self.dapple }
    }
}

/// A vertex at rest, whose frame is to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexInputs {
    /// Normal, of any length.
    pub normal: [f64; 3],
    /// Tangent, of any length.
    pub tangent: [f64; 3],
    /// 1 or -1.
    pub handedness: f64,
}

impl VertexInputs {
    /// As the model reads it.
    pub fn vertex<R: Real>(&self, like: R) -> Vertex<R> {
        let lit = |v: [f64; 3]| v.map(|x| like.lit(x));
        Vertex {
            position: lit([0.0; 3]),
            normal: lit(self.normal),
            tangent: lit(self.tangent),
            handedness: like.lit(self.handedness),
            occlusion: like.lit(1.0),
        }
    }
}

/// What the fragments of a batch share.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The switches of the model.
    pub setup: Setup,
    /// Its parameters.
    pub params: Params,
    /// What shines.
    pub lights: LightKind,
    /// What engines minimise.
    pub loss: Loss,
}

/// Everything that a fragment can have.
pub const EVERYTHING: Effects = Effects::SURFACE.with(Effect::Haze).with(Effect::KeyLight);

impl Setting {
    /// Every term switched on, each with a weight of its own.
    #[must_use]
    pub fn ordinary() -> Self {
        let mut params = Params::defaults(Form::Corrected);
        params.set_rgb(Param::RimWeight, [0.875, 0.5, 0.25]);
        params.set(Param::RimExponent, 2.5);
        params.set(Param::Reflection, 0.25);
        params.set(Param::SpecularLobe, 40.0);
        params.set(Param::EnvironmentRotation, 20.0);
        params.set(Param::KeyAzimuth, 30.0);
        params.set_rgb(Param::KeyColor, [0.5, 0.375, 0.25]);
        let setup = Setup::new(Form::Corrected, Silhouette::Fragment, EVERYTHING);
        Self { setup, params, lights: LightKind::Wavy, loss: Loss::L2 }
    }
}

/// Fragments in one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// What they share.
    pub setting: Setting,
    /// The fragments.
    pub fragments: Vec<FragmentInputs>,
}
