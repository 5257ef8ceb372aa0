//! The weighted sum of the light's terms (MODEL 3), and its derivatives.
//!
//! ```text
//! occ    = 1 - occlusion (1 - S.x)
//! rim    = S.z ^ rim_exponent
//! result = diffuse occ (base_weight + rim_weight rim) + side_specular side
//!        + hilite occ rim hilite_term + reflection mirror + key_color key
//! alpha  = haze_weight haze
//! ```

use std::fmt;

use super::effects::{Effect, Effects};
use super::params::{Param, Params};
use super::real::Real;
use super::registry::{Added, RegistryError};
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
        let (t, w) = (&self.terms, &self.weights);
        let side = w.side_specular[c] * t.side[c];
        let rest = w.reflection[c].mul_add(t.mirror[c], side);
        self.occ.mul_add(self.occluded(c), w.key[c].mul_add(t.key[c], rest))
    }

    /// The haze written to alpha.
    #[inline(always)]
    pub fn alpha(&self) -> R {
        self.weights.haze * self.terms.haze
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
            // The haze's weight, what moves lookups, and what was added to the table.
            _ => self.occ.lit(0.0),
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

/// A part of the result, an image layer of its own: the place of its row among the built-in ones, which stand first in
/// the order of the sum, and those that [`register`](TermName::register) has added.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TermName(u16);

/// One row of the table of terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermInfo {
    /// The name of the term's layer in image files.
    pub name: &'static str,
    /// It is there when all of these effects are enabled.
    pub effects: &'static [Effect],
}

/// The built-in terms, named as the effects that they belong to.
#[allow(missing_docs, reason = "named as the effects")]
#[allow(non_upper_case_globals, reason = "they are the values that a term may have, as variants would be")]
impl TermName {
    pub const Diffuse: Self = Self(0);
    pub const Rim: Self = Self(1);
    pub const SideSpecular: Self = Self(2);
    pub const Hilite: Self = Self(3);
    pub const Reflection: Self = Self(4);
    pub const KeyLight: Self = Self(5);
}

static TABLE: [TermInfo; TermName::BUILT_IN.len()] = [
    TermInfo { name: "diffuse", effects: &[Effect::Diffuse] },
    TermInfo { name: "rim", effects: &[Effect::Diffuse, Effect::Rim] },
    TermInfo { name: "side_specular", effects: &[Effect::SideSpecular] },
    TermInfo { name: "hilite", effects: &[Effect::Hilite] },
    TermInfo { name: "reflection", effects: &[Effect::Reflection] },
    TermInfo { name: "key_light", effects: &[Effect::KeyLight] },
];

/// What was added to the table.
static ADDED: Added<TermInfo> = Added::new();

impl TermName {
    /// The built-in terms, in the order of the sum.
    pub const BUILT_IN: [Self; 6] =
        [Self::Diffuse, Self::Rim, Self::SideSpecular, Self::Hilite, Self::Reflection, Self::KeyLight];

    /// Add a row. A row that is there already is not added again.
    ///
    /// # Errors
    /// When another term has its name.
    pub fn register(row: TermInfo) -> Result<Self, RegistryError> {
        let taken = || RegistryError::Taken { kind: "term", name: row.name.to_owned() };
        if TABLE.iter().any(|other| other.name == row.name) {
            return Err(taken());
        }
        let full = |_| RegistryError::Full { kind: "term", most: 1 << 16 };
        let make = |place: usize| u16::try_from(TABLE.len() + place).map(|_| row).map_err(full);
        ADDED.add(|other| other.name == row.name, |other| *other == row, make, taken)?;
        Self::from_name(row.name).ok_or_else(taken)
    }

    /// Every term: the built-in ones, then what was added.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..TABLE.len() + ADDED.len()).map(|place| Self(place as u16))
    }

    /// The terms that `effects` have.
    #[must_use]
    pub fn of(effects: Effects) -> Vec<Self> {
        Self::all().filter(|term| term.info().effects.iter().all(|&effect| effects.has(effect))).collect()
    }

    /// The term of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|term| term.name() == name)
    }

    /// Its place in the table.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    fn info(self) -> &'static TermInfo {
        TABLE.get(self.index()).unwrap_or_else(|| ADDED.row(self.index() - TABLE.len()))
    }

    /// The name of the term's layer in image files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

impl fmt::Debug for TermName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
