//! What is left out.

use serde::Serialize;

use crate::model::effects::{Effect, Effects};
use crate::model::params::{Column, Param, Params};
use crate::subject::hold;

/// A part of the model that can be left out.
///
/// The terms of the sum are effects of their own but for one: the diffuse light seen from any angle, which the
/// effect `diffuse` has together with the rim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// An effect: nothing of it is loaded, baked or computed.
    Effect(Effect),
    /// The term `base_weight` of the diffuse factor, the rim staying.
    Base,
}

impl Part {
    /// The parts of a model with `effects`, in the order of documentation.
    #[must_use]
    pub fn of(effects: Effects) -> Vec<Self> {
        let base = effects.has(Effect::Diffuse) && effects.has(Effect::Rim);
        let with_base = |effect| {
            let base = (base && effect == Effect::Diffuse).then_some(Self::Base);
            [Some(Self::Effect(effect)), base].into_iter().flatten()
        };
        // What leaves the only one of its kind out leaves all of the kind out.
        let alone = |effect: &Effect| {
            let within = effect.info().within;
            within.is_some() && effects.iter().filter(|other| other.info().within == within).count() == 1
        };
        effects.iter().filter(|effect| !alone(effect)).flat_map(with_base).collect()
    }

    /// The name in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Effect(effect) => effect.name(),
            Self::Base => "base_weight",
        }
    }

    /// Whether nothing is left of `other` without this part.
    fn holds(self, other: Self) -> bool {
        self == Self::Effect(Effect::Diffuse) && matches!(other, Self::Base | Self::Effect(Effect::Rim))
    }
}

/// A model with some of its parts left out.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Case {
    /// What is left out; nothing: the whole model.
    pub left_out: Vec<Part>,
}

impl Case {
    /// Every case: each part alone and, with `pairs`, two at a time. Pairs of which one holds the other are
    /// no other model, and are not among them.
    #[must_use]
    pub fn all(effects: Effects, pairs: bool) -> Vec<Self> {
        let parts = Part::of(effects);
        let mut cases: Vec<Self> = parts.iter().map(|&part| Self { left_out: vec![part] }).collect();
        if pairs {
            for (i, &a) in parts.iter().enumerate() {
                let others = parts[i + 1..].iter().filter(|&&b| !a.holds(b) && !b.holds(a));
                cases.extend(others.map(|&b| Self { left_out: vec![a, b] }));
            }
        }
        cases
    }

    /// The effects that are left.
    #[must_use]
    pub fn effects(&self, full: Effects) -> Effects {
        self.left_out.iter().fold(full, |effects, part| match part {
            Part::Effect(effect) => effects.without(*effect),
            Part::Base => effects,
        })
    }

    /// Set what is left out by its weight, and take from the unknowns what nothing asks for any more.
    pub fn apply(&self, effects: Effects, params: &mut Params, free: &mut Vec<Column>) {
        if self.left_out.contains(&Part::Base) {
            hold(params, free, Param::BaseWeight, 0.0);
        }
        free.retain(|column| column.param.asked_for(effects));
    }

    /// The parts' names: `rim`, `rim + hilite`, or `nothing`.
    #[must_use]
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.left_out.iter().map(|part| part.name()).collect();
        if names.is_empty() { "nothing".to_owned() } else { names.join(" + ") }
    }
}

impl Serialize for Case {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(self.left_out.iter().map(|part| part.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_is_left_out_once_and_each_pair_that_is_another_model() {
        let names = |pairs| -> Vec<String> {
            let effects = Effects::of(&[Effect::Diffuse, Effect::Rim, Effect::Hilite]);
            Case::all(effects, pairs).iter().map(Case::name).collect()
        };
        assert_eq!(names(false), ["diffuse", "base_weight", "rim", "hilite"]);
        let pairs = ["diffuse + hilite", "base_weight + rim", "base_weight + hilite", "rim + hilite"];
        assert_eq!(names(true)[4..], pairs);
        // Without a rim the effect and its one term are the same.
        assert_eq!(Part::of(Effects::of(&[Effect::Diffuse])), [Part::Effect(Effect::Diffuse)]);
        assert_eq!(Case::default().name(), "nothing");
    }
}
