//! S.z, from facing to grazing.

use super::{HardCase, Holds, ORDINARY, case, only, with};
use crate::model::effects::{Effect, Effects, Silhouette};
use crate::model::params::Param;
use crate::stability::case::FragmentInputs;

/// Exponents from bound to bound.
const EXPONENTS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 16.0];

pub(super) fn rims() -> Vec<HardCase> {
    let rim = |silhouette: f64| vec![FragmentInputs { silhouette, ..ORDINARY }];
    let at = |exponent: f64| {
        let mut setting = only(&[Effect::Hilite, Effect::Diffuse, Effect::Rim]);
        setting.params.set(Param::RimExponent, exponent);
        setting
    };
    // Without a base nothing but the rim is left.
    let bare = |exponent: f64| {
        let mut setting = at(exponent);
        setting.params.set(Param::BaseWeight, 0.0);
        setting
    };
    let mut all = Vec::new();
    for exponent in EXPONENTS {
        all.push(case(
            "facing",
            "S.z = 0 has no logarithm: rim = 0, and no derivative by the exponent",
            bare(exponent),
            [0.0, -0.0].into_iter().flat_map(rim).collect(),
            &[Holds::Zero, Holds::Flat(Param::RimExponent)],
        ));
        all.push(case(
            "grazing",
            "S.z = 1: rim = 1 for any exponent, and no derivative by it",
            at(exponent),
            rim(1.0),
            &[Holds::Flat(Param::RimExponent)],
        ));
        all.push(case(
            "nearly facing",
            "S.z down to where f32 ends: its power under- and its slope overflows",
            with(|s| {
                s.params.set(Param::RimExponent, exponent);
                s.setup.silhouette = Silhouette::Bumped;
            }),
            [1e-3, 1e-6, 1e-7, 1e-10].map(nearly_facing).to_vec(),
            &[],
        ));
        all.push(case(
            "vanishing S.z",
            "numbers around the smallest normal f32",
            at(exponent),
            [1e-30, 1.2e-38, 1.1e-38, 1e-40, 1e-45].into_iter().flat_map(rim).collect(),
            &[],
        ));
    }
    all.push(case(
        "seen edge-on",
        "|N.V| has a corner at 0: the derivative there is 0",
        with(|s| {
            s.setup.silhouette = Silhouette::Bumped;
            s.setup.effects = Effects::of(&[Effect::Hilite, Effect::NormalMap]);
        }),
        vec![FragmentInputs { texel: [0.75, 0.5, 1.0], view: [0.0, 1.0, 0.0], ..ORDINARY }],
        &[Holds::Flat(Param::NormalStrength)],
    ));
    all
}

/// V is `angle` off -N.
fn nearly_facing(angle: f64) -> FragmentInputs {
    let view = [f64::from(angle.sin() as f32), 0.0, f64::from(-angle.cos() as f32)];
    FragmentInputs { view, ..ORDINARY }
}
