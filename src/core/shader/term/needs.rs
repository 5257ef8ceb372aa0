//! What an added effect asks of the stages before the model: what the rules that show it read.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use crate::model::effects::{Effect, Effects, Needs, Silhouette};
use crate::model::evaluate::Setup;
use crate::shader::domain::Domain;
use crate::shader::emit::{SAMPLE, UNMADE};
use crate::shader::facts::{Facts, Source};
use crate::shader::quantity::Resource;
use crate::shader::rule::rules;
use crate::shader::search::search;

/// What `effect` asks for beside the others of `setup`.
pub(super) fn of_effect(effect: Effect, setup: &Setup) -> Needs {
    type Known = HashMap<(Effect, Setup), Needs>;
    static KNOWN: LazyLock<Mutex<Known>> = LazyLock::new(Mutex::default);
    let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (effect, *setup);
    if let Some(needs) = known().get(&key) {
        return *needs;
    }
    let own = rules(Effects::of(&[effect])).filter(|rule| rule.when.contains(&effect.name()));
    let mut goals: Vec<&'static str> =
        own.filter(|rule| !rule.adds.is_empty()).map(|rule| rule.gives[0].0).collect();
    goals.dedup();
    let needs = of_goals(&goals, setup);
    known().insert(key, needs);
    needs
}

/// What the rules that yield quantities of stored samples ask for.
pub(super) fn of_goals(goals: &[&'static str], setup: &Setup) -> Needs {
    let facts = Facts { setup: *setup, source: Source::Samples, ..Facts::default() };
    // What a sample can hold. The smooth normal is left to the rule that puts the base in its place, so that it is
    // wanted by those alone that cannot do with that.
    let stand_in = !setup.effects.has(Effect::KeyLight) && !setup.smooth_lookups();
    let bumped = setup.silhouette == Silhouette::Bumped;
    let held = |name: &str| !(name == "normal" && stand_in || name == "silhouette" && bumped);
    let held = |name: &str| held(name) && !(name == "silhouette" && setup.rim_of_corners());
    let given: Vec<&'static str> =
        SAMPLE.iter().chain(&UNMADE).map(|(name, _)| *name).filter(|name| held(name)).collect();
    // What is computed in texels is of no stored sample: it is asked for as the renderer asks. What cannot be planned is
    // told when it is.
    let drawn = Facts { source: Source::Raster, atlas: Some(1), ..facts };
    let found = search(&facts, &[], goals, &given).map(|found| (found, true));
    let found = found.or_else(|_| search(&drawn, &[], goals, &[]).map(|found| (found, false)));
    let (found, stored) = found.unwrap_or_default();
    let chosen = found.rules;
    let needed = |name: &str| {
        let mut rules = chosen.iter().filter(|rule| !rule.fallback.contains(&name));
        rules.any(|rule| rule.needs.iter().any(|(need, _)| *need == name))
    };
    let read = |resource: Resource| chosen.iter().any(|rule| rule.reads.contains(&resource.name()));
    Needs {
        color_map: needed("albedo"),
        normal_map: needed("bump"),
        specular_map: needed("specular"),
        attenuator_map: needed("attenuator"),
        tangents: needed("bump"),
        irradiance: read(Resource::IrradianceFaces),
        lobes: read(Resource::SpecularFaces),
        hilite: read(Resource::HiliteFaces),
        occlusion: needed("open"),
        rim: needed("silhouette") || needed("corner_silhouettes"),
        dapple: needed("dapple"),
        haze: false,
        smooth_normal: stored && needed("normal"),
        key_light: false,
        atlas: chosen.iter().any(|rule| rule.domain == Domain::Texel),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::{Form, Lookups};
    use crate::shader::emit::{hazy, parts};

    #[test]
    fn what_the_built_in_rules_read_is_what_the_built_in_effects_ask_for() {
        // 37 divides no power of two: every effect is met with every other, on and off.
        for bits in (0..1_u32 << Effect::BUILT_IN.len()).step_by(37) {
            let on = |(i, _): &(usize, Effect)| bits & (1 << i) != 0;
            let effects: Effects =
                Effect::BUILT_IN.into_iter().enumerate().filter(on).map(|(_, e)| e).collect();
            let lookups = Lookups::ALL.into_iter();
            for (silhouette, lookups) in
                lookups.flat_map(|lookups| Silhouette::ALL.map(|silhouette| (silhouette, lookups)))
            {
                let setup = Setup { lookups, ..Setup::new(Form::Corrected, silhouette, effects) };
                let facts = Facts { setup, source: Source::Samples, ..Facts::default() };
                let mut goals = parts(&facts);
                if hazy(&facts) {
                    goals.push("haze");
                }
                let (read, asked) = (of_goals(&goals, &setup), setup.needs());
                let asked = Needs { haze: false, key_light: false, ..asked };
                assert_eq!(read, asked, "{effects:?} {silhouette:?} {lookups:?}");
            }
        }
    }
}
