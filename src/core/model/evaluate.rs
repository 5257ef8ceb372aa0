//! The whole model for one fragment: value and derivatives. The engine streams through samples with
//! the same pieces; this is the plain composition of them, for single fragments and for tests.

use super::compose::{Composition, Weights};
use super::effects::{Effect, Effects, Form, Silhouette};
use super::fragment::{Fragment, shading};
use super::lights::Lights;
use super::params::{Param, Params};
use super::real::Real;
use super::terms::{LookupParam, Wanted, terms, terms_tangent};

/// What is evaluated: the switches that are the same for every fragment of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Setup {
    /// Which reading of the listings.
    pub form: Form,
    /// Where S.z comes from.
    pub silhouette: Silhouette,
    /// What is switched on.
    pub effects: Effects,
}

/// An effect that an evaluator does not know which was written for the built-in ones alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the effect {} comes from a file of its own, which the hand-written evaluator on the CPU does not know. Use the \
     graphics adapter, or leave the effect out", .0.name()
)]
pub struct AddedEffect(pub Effect);

impl Setup {
    /// Refuse what evaluators that are written for the built-in effects alone do not know.
    ///
    /// # Errors
    /// When an effect is enabled that was added.
    pub fn built_in(&self) -> Result<(), AddedEffect> {
        self.effects.added().next().map_or(Ok(()), |effect| Err(AddedEffect(effect)))
    }
}

impl LookupParam {
    /// The parameter of the table, if its derivative needs lookups.
    #[must_use]
    pub const fn from_param(param: Param) -> Option<Self> {
        match param {
            Param::NormalStrength => Some(Self::NormalStrength),
            Param::SpecularLobe => Some(Self::SpecularLobe),
            Param::EnvironmentRotation => Some(Self::EnvironmentRotation),
            Param::KeyAzimuth => Some(Self::KeyAzimuth),
            Param::KeyElevation => Some(Self::KeyElevation),
            _ => None,
        }
    }
}

/// The colour and alpha of a fragment.
#[inline(always)]
pub fn shade<R: Real>(setup: Setup, lights: &Lights<'_, R>, f: &Fragment<R>, params: &Params) -> [R; 4] {
    let composition = compose(setup, lights, f, params);
    [composition.result(0), composition.result(1), composition.result(2), composition.alpha()]
}

/// The composition behind [`shade`]: its terms and cheap derivatives.
#[inline(always)]
pub fn compose<R: Real>(
    setup: Setup,
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    params: &Params,
) -> Composition<R> {
    let like = f.occlusion;
    let s = shading(setup.form, setup.silhouette, f, like.lit(params.scalar(Param::NormalStrength)));
    let terms = terms(lights, f, &s, Wanted::ALL);
    Composition::new(terms, f.occlusion, Weights::new(params, setup.effects, like))
}

/// How colour and alpha move with `param` (all of its channels together).
#[inline(always)]
pub fn derivative<R: Real>(
    setup: Setup,
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    params: &Params,
    param: Param,
) -> [R; 4] {
    let composition = compose(setup, lights, f, params);
    if let Some(lookup) = LookupParam::from_param(param) {
        let strength = f.occlusion.lit(params.scalar(Param::NormalStrength));
        let s = shading(setup.form, setup.silhouette, f, strength);
        let slope = terms_tangent(lights, f, &s, lookup);
        let along = |c| composition.along(&slope, c);
        return [along(0), along(1), along(2), composition.alpha_along(&slope)];
    }
    let by = |c| composition.derivative(param, c);
    let alpha = if param == Param::HazeWeight { composition.terms.haze } else { f.occlusion.lit(0.0) };
    [by(0), by(1), by(2), alpha]
}
