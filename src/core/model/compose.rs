//! The weighted sum of the light's terms (MODEL 3), and its derivatives.
//!
//! ```text
//! occ    = 1 - occlusion (1 - S.x)
//! rim    = S.z ^ rim_exponent
//! result = diffuse occ (base_weight + rim_weight rim) + side_specular side
//!        + hilite occ rim hilite_term + reflection mirror + key_color key
//! alpha  = haze_weight haze
//! ```

use super::effects::{Effect, Effects};
use super::params::{Param, Params};
use super::real::Real;
use super::rim::{Rim, rim};
use super::terms::Terms;
use super::vector::V3;

/// The parameters of the sum, in the scalar of the evaluator. A weight whose effect is off is 0.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "named as the parameters")]
pub struct Weights<R> {
    pub base: V3<R>,
    pub rim: V3<R>,
    pub rim_exponent: R,
    pub hilite: V3<R>,
    pub reflection: V3<R>,
    pub side_specular: V3<R>,
    pub occlusion: R,
    pub haze: R,
    pub key: V3<R>,
}

impl<R: Real> Weights<R> {
    /// The weights of `params` with `effects` on; `like` is any number of the evaluator's scalar.
    #[inline(always)]
    pub fn new(params: &Params, effects: Effects, like: R) -> Self {
        let on = |enabled: bool, param: Param| -> V3<R> {
            params.rgb(param).map(|x| like.lit(if enabled { x } else { 0.0 }))
        };
        let has = |effect| effects.has(effect);
        Self {
            base: on(has(Effect::Diffuse), Param::BaseWeight),
            rim: on(has(Effect::Diffuse) && has(Effect::Rim), Param::RimWeight),
            rim_exponent: like.lit(params.scalar(Param::RimExponent)),
            hilite: on(has(Effect::Hilite), Param::Hilite),
            reflection: on(has(Effect::Reflection), Param::Reflection),
            side_specular: on(has(Effect::SideSpecular), Param::SideSpecular),
            occlusion: on(has(Effect::Occlusion), Param::Occlusion)[0],
            haze: on(has(Effect::Haze) || has(Effect::Bloom), Param::HazeWeight)[0],
            key: on(has(Effect::KeyLight), Param::KeyColor),
        }
    }
}

/// A fragment's terms with what the sum and all its derivatives share.
#[derive(Clone, Copy, Debug)]
pub struct Composition<R> {
    /// The terms.
    pub terms: Terms<R>,
    /// 1 - S.x
    blocked: R,
    /// 1 - occlusion (1 - S.x)
    occ: R,
    rim: Rim<R>,
    /// occ rim
    occ_rim: R,
    /// occ d rim / d rim_exponent
    occ_rim_slope: R,
    weights: Weights<R>,
}

impl<R: Real> Composition<R> {
    /// Of a fragment's terms and its open share `S.x`.
    #[inline(always)]
    pub fn new(terms: Terms<R>, open: R, weights: Weights<R>) -> Self {
        let rim = rim(terms.silhouette, weights.rim_exponent);
        Self::with_rim(terms, rim, open, weights)
    }

    /// As [`Self::new`], with the rim of `terms.silhouette` worked out elsewhere.
    #[inline(always)]
    pub fn with_rim(terms: Terms<R>, rim: Rim<R>, open: R, weights: Weights<R>) -> Self {
        let one = open.lit(1.0);
        let blocked = one - open;
        let occ = one - weights.occlusion * blocked;
        let (occ_rim, occ_rim_slope) = (occ * rim.value, occ * rim.by_exponent);
        Self { terms, blocked, occ, rim, occ_rim, occ_rim_slope, weights }
    }

    /// The rim S.z ^ rim_exponent.
    #[inline(always)]
    pub fn rim(&self) -> R {
        self.rim.value
    }

    /// base_weight + rim_weight rim
    #[inline(always)]
    fn facing(&self, c: usize) -> R {
        self.weights.rim[c].mul_add(self.rim.value, self.weights.base[c])
    }

    /// What occ rim multiplies: the rim's share of both effects.
    #[inline(always)]
    fn rim_light(&self, c: usize) -> R {
        let hilite = self.weights.hilite[c] * self.terms.hilite[c];
        self.terms.diffuse[c].mul_add(self.weights.rim[c], hilite)
    }

    /// What occ multiplies: all that ambient occlusion darkens.
    #[inline(always)]
    fn occluded(&self, c: usize) -> R {
        let base = self.weights.base[c] * self.terms.diffuse[c];
        self.rim_light(c).mul_add(self.rim.value, base)
    }

    /// The result in channel `c`, 0 to 2.
    #[inline(always)]
    pub fn result(&self, c: usize) -> R {
        if R::DECLARED {
            return self.declared(c);
        }
        let (t, w) = (&self.terms, &self.weights);
        let side = w.side_specular[c] * t.side[c];
        let rest = w.reflection[c].mul_add(t.mirror[c], side);
        self.occ.mul_add(self.occluded(c), w.key[c].mul_add(t.key[c], rest))
    }

    /// The sum in the listing's order, each of its variables of the type that it declares. (The attenuator is
    /// in the hilite's term already, which is thus rounded once where the listing rounds twice.)
    #[inline(always)]
    fn declared(&self, c: usize) -> R {
        let (t, w) = (&self.terms, &self.weights);
        let diffuse = (t.diffuse[c] * self.occ).fixed();
        let lit = diffuse.mul_add(self.facing(c), w.side_specular[c] * t.side[c]).fixed();
        let mirrored = (t.mirror[c] * w.reflection[c].fixed()).fixed();
        let hilite = (w.hilite[c] * self.occ_rim * t.hilite[c]).fixed();
        ((lit + mirrored).fixed() + hilite).fixed() + (w.key[c] * t.key[c]).fixed()
    }

    /// What each term adds to channel `c`.
    #[inline(always)]
    pub fn each_term(&self, c: usize) -> [(TermName, R); 6] {
        let (t, w) = (&self.terms, &self.weights);
        let light = t.diffuse[c] * self.occ;
        [
            (TermName::Diffuse, light * w.base[c]),
            (TermName::Rim, w.rim[c] * t.diffuse[c] * self.occ_rim),
            (TermName::SideSpecular, w.side_specular[c] * t.side[c]),
            (TermName::Hilite, w.hilite[c] * t.hilite[c] * self.occ_rim),
            (TermName::Reflection, w.reflection[c] * t.mirror[c]),
            (TermName::KeyLight, w.key[c] * t.key[c]),
        ]
    }

    /// The haze written to alpha.
    #[inline(always)]
    pub fn alpha(&self) -> R {
        (self.weights.haze * self.terms.haze).fixed()
    }

    /// d result / d param in channel `c`, for a parameter that needs no lookup.
    #[inline(always)]
    pub fn derivative(&self, param: Param, c: usize) -> R {
        let t = &self.terms;
        match param {
            Param::BaseWeight => t.diffuse[c] * self.occ,
            Param::RimWeight => t.diffuse[c] * self.occ_rim,
            Param::Hilite => t.hilite[c] * self.occ_rim,
            Param::Reflection => t.mirror[c],
            Param::SideSpecular => t.side[c],
            Param::KeyColor => t.key[c],
            Param::RimExponent => self.rim_light(c) * self.occ_rim_slope,
            Param::Occlusion => -self.blocked * self.occluded(c),
            Param::HazeWeight
            | Param::NormalStrength
            | Param::SpecularLobe
            | Param::EnvironmentRotation
            | Param::KeyAzimuth
            | Param::KeyElevation => self.occ.lit(0.0),
        }
    }

    /// How the result moves in channel `c` when the terms move along `slope`.
    #[inline(always)]
    pub fn along(&self, slope: &Terms<R>, c: usize) -> R {
        let w = &self.weights;
        let hilite = w.hilite[c] * self.rim.value * slope.hilite[c];
        let occluded = slope.diffuse[c].mul_add(self.facing(c), hilite);
        let silhouette = self.rim_light(c) * self.rim.by_silhouette * slope.silhouette;
        (occluded + silhouette) * self.occ
            + w.side_specular[c] * slope.side[c]
            + w.reflection[c] * slope.mirror[c]
            + w.key[c] * slope.key[c]
    }

    /// How alpha moves when the terms move along `slope`.
    #[inline(always)]
    pub fn alpha_along(&self, slope: &Terms<R>) -> R {
        self.weights.haze * slope.haze
    }
}

/// The parts that add up to the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as the effects")]
pub enum TermName {
    Diffuse,
    Rim,
    SideSpecular,
    Hilite,
    Reflection,
    KeyLight,
}

impl TermName {
    /// Every term, in the order of the sum.
    pub const ALL: [Self; 6] =
        [Self::Diffuse, Self::Rim, Self::SideSpecular, Self::Hilite, Self::Reflection, Self::KeyLight];

    /// The terms that `effects` have.
    #[must_use]
    pub fn of(effects: Effects) -> Vec<Self> {
        let has = |effect| effects.has(effect);
        let enabled = |name: &Self| match name {
            Self::Diffuse => has(Effect::Diffuse),
            Self::Rim => has(Effect::Diffuse) && has(Effect::Rim),
            Self::SideSpecular => has(Effect::SideSpecular),
            Self::Hilite => has(Effect::Hilite),
            Self::Reflection => has(Effect::Reflection),
            Self::KeyLight => has(Effect::KeyLight),
        };
        Self::ALL.into_iter().filter(enabled).collect()
    }

    /// The name of the term's layer in image files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Rim => "rim",
            Self::SideSpecular => "side_specular",
            Self::Hilite => "hilite",
            Self::Reflection => "reflection",
            Self::KeyLight => "key_light",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Form;

    #[test]
    fn the_terms_add_up_to_the_result() {
        let terms = Terms {
            diffuse: [0.31, 0.52, 0.73],
            side: [0.11, 0.23, 0.37],
            hilite: [1.9, 0.7, 0.4],
            mirror: [2.3, 1.1, 0.6],
            haze: 0.3,
            key: [0.4, -0.2, 0.1],
            silhouette: 0.6,
        };
        let effects = Effects::SURFACE.with(Effect::KeyLight);
        let mut params = Params::defaults(Form::Corrected);
        params.set(Param::Occlusion, 0.7);
        let composition = Composition::new(terms, 0.4, Weights::new(&params, effects, 0.0));
        for c in 0..3 {
            let sum: f64 = composition.each_term(c).iter().map(|(_, value)| value).sum();
            // A few roundings of f64.
            assert!((sum - composition.result(c)).abs() < 1e-15, "{c}: {sum} {}", composition.result(c));
        }
    }
}
