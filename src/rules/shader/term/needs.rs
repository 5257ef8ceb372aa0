//! What an added effect asks of the stages before the model: what the rules that show it read.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use crate::model::choices::SpecularVisibility;
use crate::model::effects::{Effect, Effects, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fields::{Field, Fields};
use crate::model::needs::Needs;
use crate::model::transmission::Method;
use crate::shader::domain::{CHART, Domain, UV};
use crate::shader::emit::{SAMPLE, UNMADE, parts};
use crate::shader::facts::{Facts, Source};
use crate::shader::quantity::Resource;
use crate::shader::rule::{Rule, rules};
use crate::shader::search::search;

use super::fields;
use super::library;

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
    let on = |rule: &&'static Rule| {
        let mut conditions = rule.when.iter().filter_map(|condition| Effect::from_name(condition));
        !rule.adds.is_empty() && conditions.all(|effect| setup.effects.has(effect))
    };
    let mut goals: Vec<&'static str> = own.filter(on).map(|rule| rule.gives[0].0).collect();
    if effect.info().shares_light {
        // It changes what other effects' rules read.
        goals.extend(parts(&Facts { setup: *setup, source: Source::Samples, ..Facts::default() }));
    }
    goals.dedup();
    let mut needs = of_goals(&goals, setup);
    if setup.choices.specular_visibility == SpecularVisibility::Rays {
        // A rasteriser, which has no rays, looks cubes up instead. What it reads of vertices is found when it is made.
        let mut of_raster = *setup;
        of_raster.choices.specular_visibility = SpecularVisibility::Lagarde;
        needs.reflected |= of_goals(&goals, &of_raster).reflected;
    }
    known().insert(key, needs);
    needs
}

/// What the rules that yield quantities of stored samples ask for.
pub(super) fn of_goals(goals: &[&'static str], setup: &Setup) -> Needs {
    let facts = Facts { setup: *setup, source: Source::Samples, ..Facts::default() };
    // What a sample can hold. The smooth normal is left to the rule that puts the base in its place, so that it is
    // wanted by those alone that cannot do with that.
    let stand_in = !setup.effects.has(Effect::KeyLight) && !setup.smooth_lookups() && !by_far_side(setup);
    let bumped = setup.silhouette == Silhouette::Bumped;
    let held = |name: &str| !(name == "normal" && stand_in || name == "silhouette" && bumped);
    let held = |name: &str| held(name) && !(name == "silhouette" && setup.rim_of_corners());
    let fields = fields(setup.effects);
    let built_in = SAMPLE.iter().chain(&UNMADE).map(|(name, _)| *name).filter(|name| held(name));
    let given: Vec<&'static str> = built_in.chain(fields.iter().map(Field::name)).collect();
    // Texels are asked for where nothing can be planned without them. What cannot be planned at all is told when it is.
    let looking_up = [&given[..], &[UV, CHART]].concat();
    let textured = Facts { atlas: Some(1), ..facts };
    let found = search(&facts, &[], goals, &given).or_else(|_| search(&textured, &[], goals, &looking_up));
    let chosen = found.unwrap_or_default().rules;
    let needed_in = |domains: &[Domain], name: &str| {
        let mut rules = chosen.iter().filter(|rule| !rule.fallback.contains(&name));
        rules.any(|rule| domains.contains(&rule.domain) && rule.needs.iter().any(|(need, _)| *need == name))
    };
    let needed = |name: &str| needed_in(&Domain::ALL, name);
    let bumped = needed("bump") || needed("normal_texel");
    let framed = needed("bump") || needed("vertex_tangent") || needed("vertex_bitangent");
    let read = |resource: Resource| chosen.iter().any(|rule| rule.reads.contains(&resource.name()));
    Needs {
        color_map: needed("albedo"),
        normal_map: bumped,
        specular_map: needed("specular"),
        attenuator_map: needed("attenuator"),
        tangents: framed,
        irradiance: read(Resource::IrradianceFaces),
        lobes: read(Resource::SpecularFaces),
        hilite: read(Resource::HiliteFaces),
        reflected: read(Resource::ReflectedFaces) || read(Resource::GlossyFaces),
        occlusion: needed("open") || needed("vertex_occlusion"),
        rim: needed("silhouette") || needed("corner_silhouettes"),
        dapple: needed("dapple"),
        haze: false,
        smooth_normal: needed_in(&[Domain::Fragment], "normal"),
        key_light: false,
        atlas: chosen.iter().any(|rule| rule.domain == Domain::Texel),
        fields: Fields::of(fields.iter().filter(|field| needed(field.name()))),
    }
}

/// Whether light that comes through is looked up along -N.
fn by_far_side(setup: &Setup) -> bool {
    library::transmits(setup.effects) && setup.choices.transmission.method != Method::Gathered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::{Form, Lookups};
    use crate::shader::emit::hazy;

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
