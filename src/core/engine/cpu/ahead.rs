//! Plans whose tapes are compiled ahead, each by itself, as Rust that is printed from the rules.
//!
//! A machine that reads a list of instructions keeps every number in memory between two of them; the compiler keeps them
//! in registers. So the plans that most fits ask for ([`PLANS`]) are printed as Rust ([`crate::program::print`]) into
//! `ahead/tapes.rs`, which is part of the sources. Nobody writes there: a test prints them anew and compares. A fit runs
//! the plan with its effects that moves the same lookups; what has none, and what has changed since they were printed,
//! runs on the [machine](super::machine).

#[rustfmt::skip]
#[allow(unused_mut, unused_variables, clippy::all, clippy::pedantic, clippy::nursery, reason = "it is printed")]
mod tapes;

use std::marker::PhantomData;

use fearless_simd::SimdBase;

use super::block::Block;
use super::fitted::Fitted;
use crate::engine::lanes::{HalfLanes, Lanes};
use crate::engine::part::shorter_than_rows;
use crate::model::choices::{Choices, SpecularMap, SpecularModel, SpecularVisibility};
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::Param;
use crate::program::print::statements;
use crate::program::tape::Tape;
use crate::shader::facts::{FaceSizes, Facts};
use crate::simd::{Level, Simd};
use crate::with_simd;

/// Parameters that move what is looked up. The others cost a product or two, and are free in every plan that does not hold
/// them; roughness and gloss, which move lookups too, are free where there is a lobe. Lights' own numbers are held.
const MOVING: [Param; 3] = [Param::NormalStrength, Param::SpecularLobe, Param::EnvironmentRotation];

/// A plan that is compiled ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    #[cfg_attr(not(test), allow(dead_code, reason = "functions are printed by it"))]
    name: &'static str,
    form: Form,
    silhouette: Silhouette,
    effects: Effects,
    /// Effects that became known later, by their names.
    added: &'static [&'static str],
    /// Parameters that fits seldom free, by their names: held here, so that no pass computes how anything moves with them.
    held: &'static [&'static str],
    choices: Choices,
    /// Those of [`MOVING`] that are free.
    moving: &'static [Param],
    /// Whether what does not move is kept from pass to pass.
    keeps: bool,
}

const fn plan(
    name: &'static str,
    form: Form,
    silhouette: Silhouette,
    effects: Effects,
    moving: &'static [Param],
) -> Plan {
    let choices = Setup::new(form, silhouette, effects).choices;
    Plan { name, form, silhouette, effects, added: &[], held: &[], choices, moving, keeps: true }
}

/// The paper's effects and its haze, as scenes and the race beside other programs have them.
const HAZY: Effects = Effects::SURFACE.with(Effect::Haze);
/// Of a mesh without a normal map.
const SMOOTH: Effects = Effects::of(&[
    Effect::Diffuse,
    Effect::Occlusion,
    Effect::Rim,
    Effect::SideSpecular,
    Effect::Hilite,
    Effect::Reflection,
]);

/// Of a scene whose panorama's four brightest spots are lights.
const LIT: Effects = Effects::of(&[
    Effect::Diffuse,
    Effect::NormalMap,
    Effect::Occlusion,
    Effect::Rim,
    Effect::Lights,
    Effect::Shadows,
]);
const LIT_TOO: [&str; 7] = [
    "light_specular",
    "fresnel",
    "directional_occlusion",
    "light_sky_1",
    "light_sky_2",
    "light_sky_3",
    "light_sky_4",
];
const LIT_HELD: [&str; 3] = ["occlusion", "f0_floor", "fresnel_loss"];
const LIT_BY: Choices = Choices {
    specular_model: SpecularModel::Ggx,
    specular_visibility: SpecularVisibility::Cone,
    specular_map: SpecularMap::F0,
    glossy: true,
    ..Setup::new(Corrected, Fragment, LIT).choices
};

/// What moves a mesh or comes after shading, and is nothing that a sample's radiance knows of.
const ELSEWHERE: [Effect; 3] = [Effect::Morph, Effect::Skin, Effect::Bloom];

use self::{Form::Corrected, Form::Listing, Silhouette::Bumped, Silhouette::Fragment, Silhouette::Vertex};
use Param as P;

const STRENGTH_AND_LOBE: &[Param] = &[P::NormalStrength, P::SpecularLobe];
const ALL_MOVE: &[Param] = &[P::NormalStrength, P::SpecularLobe, P::EnvironmentRotation];

/// The plans, of those with the same effects the ones with less that moves first.
static PLANS: [Plan; 27] = [
    plan("surface", Corrected, Fragment, Effects::SURFACE, &[]),
    plan("surface_lobe", Corrected, Fragment, Effects::SURFACE, &[P::SpecularLobe]),
    plan("surface_strength", Corrected, Fragment, Effects::SURFACE, &[P::NormalStrength]),
    plan("surface_strength_lobe", Corrected, Fragment, Effects::SURFACE, STRENGTH_AND_LOBE),
    plan("surface_all", Corrected, Fragment, Effects::SURFACE, ALL_MOVE),
    plan("bumped", Corrected, Bumped, Effects::SURFACE, &[]),
    plan("bumped_lobe", Corrected, Bumped, Effects::SURFACE, &[P::SpecularLobe]),
    plan("bumped_strength", Corrected, Bumped, Effects::SURFACE, &[P::NormalStrength]),
    plan("bumped_strength_lobe", Corrected, Bumped, Effects::SURFACE, STRENGTH_AND_LOBE),
    plan("smooth", Corrected, Fragment, SMOOTH, &[]),
    plan("smooth_lobe", Corrected, Fragment, SMOOTH, &[P::SpecularLobe]),
    plan("hazy", Corrected, Fragment, HAZY, &[]),
    plan("hazy_lobe", Corrected, Fragment, HAZY, &[P::SpecularLobe]),
    plan("hazy_strength", Corrected, Fragment, HAZY, &[P::NormalStrength]),
    plan("hazy_strength_lobe", Corrected, Fragment, HAZY, STRENGTH_AND_LOBE),
    plan("hazy_bumped", Corrected, Bumped, HAZY, &[]),
    plan("hazy_bumped_lobe", Corrected, Bumped, HAZY, &[P::SpecularLobe]),
    plan("hazy_bumped_strength", Corrected, Bumped, HAZY, &[P::NormalStrength]),
    plan("hazy_bumped_strength_lobe", Corrected, Bumped, HAZY, STRENGTH_AND_LOBE),
    // What benchmarks time that look everything up in each pass.
    plan("hazy_bumped_anew", Corrected, Bumped, HAZY, &[P::NormalStrength]).keeping_nothing(),
    plan("surface_anew", Corrected, Fragment, Effects::SURFACE, STRENGTH_AND_LOBE).keeping_nothing(),
    plan("listing", Listing, Vertex, Effects::SURFACE, &[]),
    plan("listing_lobe", Listing, Vertex, Effects::SURFACE, &[P::SpecularLobe]),
    plan("listing_strength", Listing, Vertex, Effects::SURFACE, &[P::NormalStrength]),
    plan("listing_strength_lobe", Listing, Vertex, Effects::SURFACE, STRENGTH_AND_LOBE),
    plan("lit", Corrected, Fragment, LIT, &[]).with(&LIT_TOO, LIT_BY).holding(&LIT_HELD),
    plan("lit_strength", Corrected, Fragment, LIT, &[P::NormalStrength])
        .with(&LIT_TOO, LIT_BY)
        .holding(&LIT_HELD),
];

impl Plan {
    const fn keeping_nothing(self) -> Self {
        Self { keeps: false, ..self }
    }

    const fn holding(self, held: &'static [&'static str]) -> Self {
        Self { held, ..self }
    }

    const fn with(self, added: &'static [&'static str], choices: Choices) -> Self {
        Self { added, choices, ..self }
    }

    /// `None` where this process does not know all of its effects.
    fn setup(&self) -> Option<Setup> {
        let mut effects = self.effects;
        for name in self.added {
            effects = effects.with(Effect::from_name(name)?);
        }
        let setup = Setup::new(self.form, self.silhouette, effects);
        Some(Setup { choices: self.choices, ..setup })
    }

    /// What its tapes yield the movement of.
    pub(super) fn free(&self) -> Vec<Param> {
        let effects = self.setup().map_or(self.effects, |setup| setup.effects);
        let free = |param: &Param| {
            (!MOVING.contains(param) || self.moving.contains(param))
                && !param.name().starts_with("light.")
                && !self.held.contains(&param.name())
        };
        Param::all().filter(|param| param.asked_for(effects)).filter(free).collect()
    }

    fn turned(&self) -> bool {
        self.moving.contains(&Param::EnvironmentRotation)
    }

    pub(super) const fn keeps(&self) -> bool {
        self.keeps
    }

    pub(super) fn channels(&self) -> usize {
        if self.effects.has(Effect::Haze) { 4 } else { 3 }
    }

    /// `None` where this process does not know all of its effects.
    pub(super) fn facts(&self) -> Option<Facts> {
        // Lookups take the size from the cube; the rules' text wants some number.
        let any = FaceSizes { irradiance: Some(1), specular: Some(1), hilite: Some(1), reflected: Some(1) };
        Some(Facts::of_samples(self.setup()?, any, self.turned()))
    }
}

/// The plan for what moves along `free`, if one is compiled ahead.
pub(super) fn plan_for(fitted: &Fitted, free: &[Param], turned: bool) -> Option<&'static Plan> {
    let effects = ELSEWHERE.into_iter().fold(fitted.setup.effects, Effects::without);
    let setup = Setup { effects, ..fitted.setup };
    let yields = |plan: &&Plan| {
        if plan.setup() != Some(setup) {
            return false;
        }
        let yielded = plan.free();
        plan.keeps == fitted.keep && plan.channels() >= fitted.channels
            && plan.turned() == turned
            // Else lookups would be made anew that could be kept.
            && plan.moving.iter().all(|param| free.contains(param))
            && free.iter().all(|param| yielded.contains(param))
    };
    PLANS.iter().find(yields)
}

/// A tape's statements and outputs as they are printed, and what they are known by.
fn printed(tape: &Tape) -> (String, Vec<String>, u64) {
    let put = |k: usize, output: &str| format!("put({k}, i, {output});");
    let (statements, outputs) = statements(tape, "            ", put);
    // FNV-1a: what differs has another key but once in 2^64.
    let mut key = 0xcbf2_9ce4_8422_2325_u64;
    for byte in statements.bytes().chain(outputs.iter().flat_map(|output| output.bytes().chain([b';']))) {
        key = (key ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
    (statements, outputs, key)
}

/// The place of a tape among those that are compiled.
pub(super) fn find(tape: &Tape) -> Option<usize> {
    let key = printed(tape).2;
    tapes::KEYS.iter().position(|known| *known == key)
}

/// Whether functions are compiled for `S`: not for SSE2, as that would be half as many again for processors without AVX2,
/// whose tapes run on the machine; nor for a browser, which would have to load them. The member's own tests leave AVX-512 out,
/// so that they are compiled sooner: tests of whole fits run it where the processor has it.
struct Functions<S>(PhantomData<S>);

impl<S: Simd> Functions<S> {
    const COMPILED: bool = !cfg!(any(target_arch = "x86_64", target_family = "wasm"))
        || Self::LANES > 4 && !(cfg!(test) && Self::LANES > 8);
    const LANES: usize = <S::f32s as SimdBase<S>>::LEN;
}

/// Whether functions are compiled for the instructions of `level`.
pub(super) fn compiled_for(level: Level) -> bool {
    const fn of<S: Simd>(_: S) -> bool {
        Functions::<S>::COMPILED
    }
    with_simd!(level, simd => of(simd))
}

/// Run a compiled tape over a block; `false` where none is compiled for `S`.
#[inline(always)]
pub(super) fn run<S: Simd>(tape: usize, simd: S, block: Block<'_>) -> bool {
    if Functions::<S>::COMPILED {
        // Functions with a loop are long: numbers in several registers would leave too few.
        if shorter_than_rows::<S>() {
            tapes::run::<S, HalfLanes<S>>(tape, simd, block);
        } else {
            tapes::run::<S, Lanes<S>>(tape, simd, block);
        }
    }
    Functions::<S>::COMPILED
}

#[cfg(test)]
mod tests;
