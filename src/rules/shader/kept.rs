//! What is kept of stored samples where no free parameter moves it: then it is all that a pass reads of them.
//!
//! Of the built-in effects that is the light of each term before its weights. Of an added one it is what the rules that its
//! own parameters move need, and those parameters do not move; or what that is made of, where a pass takes less time to read
//! that and to compute the rest anew (`minimum_cut`).

use std::collections::BTreeSet;

use super::domain::Domain;
use super::emit::{Fields, Plan, hazy, parts, sample_fields};
use super::facts::{Facts, Source};
use super::quantity::{Constant, Resource};
use super::rule::Rule;
use super::search::{PlanError, components};
use crate::minimum_cut::{Costs, NEVER, cheapest};
use crate::model::params::Param;

/// What a pass spends to read a number, in operations: an estimate, as adapters differ.
const READ: u64 = 16;
/// What it spends on a lookup.
const LOOKUP: u64 = 200;

/// What is kept of the built-in effects, with WGSL types.
const TERMS: [(&str, &str); 10] = [
    ("diffuse_term", "vec3f"),
    ("side_term", "vec3f"),
    ("hilite_term", "vec3f"),
    ("mirror_term", "vec3f"),
    ("haze_term", "f32"),
    ("key_term", "vec3f"),
    ("silhouette", "f32"),
    ("corner_silhouettes", "vec3f"),
    ("corner_shares", "vec3f"),
    ("open", "f32"),
];

/// The fields that are kept of a stored sample. Where its rules cannot be planned, those of the built-in effects:
/// that they cannot is told when they are.
pub(super) fn kept_fields(facts: &Facts) -> Fields {
    // What is kept does not depend on what is made of it.
    let facts = &Facts { output: None, ..*facts };
    let mut fields = of_built_in(facts);
    if facts.setup.effects.added().next().is_some() {
        let frontier = frontier(facts, &fields).unwrap_or_default();
        fields.extend(frontier);
    }
    fields
}

fn of_built_in(facts: &Facts) -> Fields {
    let needs = facts.needs();
    let parts = parts(facts);
    let part = |name: &str| parts.contains(&name);
    let corners = facts.setup.rim_of_corners();
    let wanted = |name: &str| match name {
        "diffuse_term" => part("diffuse_part"),
        "side_term" => part("side_part"),
        "hilite_term" => part("hilite_part"),
        "mirror_term" => part("mirror_part"),
        "key_term" => part("key_part"),
        "haze_term" => hazy(facts),
        "silhouette" => needs.rim && !corners,
        "corner_silhouettes" | "corner_shares" => needs.rim && corners,
        _ => needs.occlusion,
    };
    TERMS.iter().copied().filter(|(name, _)| wanted(name)).collect()
}

/// The rules that yield what is kept of a stored sample: a plan whose goals are the fields of [`Source::Terms`].
///
/// # Errors
/// When no rules yield them.
pub fn plan_terms(facts: &Facts) -> Result<(Plan, Fields), PlanError> {
    let kept = sample_fields(&Facts { source: Source::Terms, ..*facts });
    Ok((plan_of(facts, &kept)?, kept))
}

/// The parameters that what is kept depends on. A fit that frees one of them keeps nothing.
///
/// # Errors
/// When no rules yield what is kept.
pub fn held(facts: &Facts) -> Result<Vec<Param>, PlanError> {
    let (plan, _) = plan_terms(facts)?;
    Ok(Param::all().filter(|&param| reads(&plan, param)).collect())
}

fn plan_of(facts: &Facts, kept: &Fields) -> Result<Plan, PlanError> {
    let facts = Facts { source: Source::Samples, ..*facts };
    let given = names(&sample_fields(&facts));
    let goals: Vec<&'static str> = names(kept).into_iter().filter(|name| !given.contains(name)).collect();
    Plan::search(&facts, &[], &goals, &given)
}

fn names(fields: &Fields) -> Vec<&'static str> {
    fields.iter().map(|(name, _)| *name).collect()
}

/// Whether a plan reads a parameter, or what is made of it.
fn reads(plan: &Plan, param: Param) -> bool {
    let made = match param {
        Param::EnvironmentRotation => Some(Constant::Turn),
        Param::KeyAzimuth | Param::KeyElevation => Some(Constant::KeyDirection),
        _ => None,
    };
    let lobe = param == Param::SpecularLobe && plan.resources.contains(&Resource::SpecularFaces);
    lobe || plan.constants.contains(&Constant::Param(param))
        || made.is_some_and(|made| plan.constants.contains(&made))
}

/// What must be kept beside `kept` so that the sum can be made of what is kept alone, at the least cost: of quantities that
/// move with no parameter but those that `kept` depends on, and are needed by rules that move with another, or what these are
/// made of.
fn frontier(facts: &Facts, kept: &Fields) -> Result<Fields, PlanError> {
    let samples = Facts { source: Source::Samples, ..*facts };
    let mut goals = parts(&samples);
    if hazy(&samples) {
        goals.push("haze");
    }
    let whole = Plan::search(&samples, &[], &goals, &names(&sample_fields(&samples)))?;
    let still = plan_of(facts, kept)?;
    let graph = Quantities::new(&samples, &whole, &still, names(kept));
    let cut = cheapest(&graph.met(&goals), |thing| graph.costs(thing));
    let quantity = |thing| match thing {
        Thing::Quantity(name) => Some((name, graph.kind(name))),
        Thing::Rule(_) => None,
    };
    Ok(cut.into_iter().filter_map(quantity).collect())
}

/// What may be kept or made anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Thing {
    Quantity(&'static str),
    /// A rule, by its place: of several quantities that it gives a pass makes all at once.
    Rule(usize),
}

/// The graph of quantities between samples and the sum.
struct Quantities<'a> {
    facts: &'a Facts,
    rules: Vec<&'static Rule>,
    /// Makes the terms of the built-in effects.
    still: &'a Plan,
    /// These terms.
    terms: Vec<&'static str>,
    /// What moves with a parameter that does not move them.
    moving: BTreeSet<&'static str>,
}

impl<'a> Quantities<'a> {
    fn new(facts: &'a Facts, whole: &Plan, still: &'a Plan, terms: Vec<&'static str>) -> Self {
        let rules = whole.rules(Domain::Fragment).collect();
        let mut graph = Self { facts, rules, still, terms, moving: BTreeSet::new() };
        for rule in graph.rules.clone() {
            let moves = |name: &str| {
                graph.moving.contains(name) || Constant::from_name(name).is_some_and(|c| !graph.is_held(c))
            };
            if rule.needs.iter().any(|(name, _)| moves(name)) {
                graph.moving.extend(rule.gives.iter().map(|(name, _)| *name));
            }
        }
        graph
    }

    fn is_held(&self, constant: Constant) -> bool {
        match constant {
            Constant::Param(param) => reads(self.still, param),
            _ => true,
        }
    }

    /// Whether a quantity does not move, and is not there anyway.
    fn stays(&self, name: &str) -> bool {
        Constant::from_name(name).is_none() && !self.terms.contains(&name) && !self.moving.contains(name)
    }

    /// What stays and is needed by what moves, and the parts of the sum that nothing moves.
    fn met(&self, parts: &[&'static str]) -> Vec<Thing> {
        let moved = |rule: &&&Rule| rule.gives.iter().any(|(name, _)| self.moving.contains(name));
        let needs = self.rules.iter().filter(moved).flat_map(|rule| &rule.needs).map(|(name, _)| *name);
        needs.chain(parts.iter().copied()).filter(|name| self.stays(name)).map(Thing::Quantity).collect()
    }

    fn kind(&self, name: &str) -> &'static str {
        let mut needs = self.rules.iter().flat_map(|rule| &rule.needs);
        needs.find(|(needed, _)| *needed == name).map_or("vec3f", |(_, kind)| *kind)
    }

    fn costs(&self, thing: Thing) -> Costs<Thing> {
        match thing {
            Thing::Quantity(name) => {
                let gives = |rule: &&Rule| rule.gives.iter().any(|(given, _)| *given == name);
                let by = self.rules.iter().position(gives).map(Thing::Rule);
                Costs {
                    kept: READ * components(self.kind(name)) as u64,
                    // What no rule gives is a field.
                    made: if by.is_some() { 0 } else { NEVER },
                    of: by.into_iter().collect(),
                }
            }
            Thing::Rule(at) => {
                let needs = self.rules[at].needs.iter().map(|(name, _)| *name);
                let of = needs.filter(|name| self.stays(name)).map(Thing::Quantity).collect();
                Costs { kept: NEVER, made: self.made(self.rules[at]), of }
            }
        }
    }

    /// What a rule costs in each pass. What reads a parameter that the terms depend on is never made of what is kept.
    fn made(&self, rule: &Rule) -> u64 {
        let needs = rule.needs.iter().map(|(name, _)| *name);
        let constants: Vec<Constant> =
            needs.chain(rule.reads.iter().copied()).filter_map(Constant::from_name).collect();
        if constants.into_iter().any(|constant| self.is_held(constant)) {
            return NEVER;
        }
        let lookups = rule.reads.iter().filter(|name| Constant::from_name(name).is_none()).count();
        rule.cost(self.facts) as u64 + LOOKUP * lookups as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::{Effect, Effects, Form, Silhouette};
    use crate::model::evaluate::Setup;
    use crate::shader::term::{self, LightFamily, library};

    #[test]
    fn terms_are_all_that_the_built_in_rules_need_kept() {
        // 37 divides no power of two: every effect is met with every other, on and off.
        for bits in (0..1_u32 << Effect::BUILT_IN.len()).step_by(37) {
            let on = |(i, _): &(usize, Effect)| bits & (1 << i) != 0;
            let effects: Effects =
                Effect::BUILT_IN.into_iter().enumerate().filter(on).map(|(_, e)| e).collect();
            for silhouette in Silhouette::ALL {
                let facts = Facts {
                    setup: Setup::new(Form::Corrected, silhouette, effects),
                    source: Source::Terms,
                    ..Facts::default()
                };
                assert_eq!(frontier(&facts, &of_built_in(&facts)).unwrap(), [], "{effects:?} {silhouette:?}");
            }
        }
    }

    #[test]
    fn what_moves_lookups_is_held() {
        let facts = |effects| Facts {
            setup: Setup::new(Form::Corrected, Silhouette::Fragment, effects),
            turned: true,
            ..Facts::default()
        };
        let all = Effects::SURFACE.with(Effect::KeyLight);
        let lookups = [
            Param::NormalStrength,
            Param::SpecularLobe,
            Param::EnvironmentRotation,
            Param::KeyAzimuth,
            Param::KeyElevation,
        ];
        assert_eq!(held(&facts(all)).unwrap(), lookups);
        let diffuse = Effects::of(&[Effect::Diffuse]);
        assert_eq!(held(&facts(diffuse)).unwrap(), [Param::EnvironmentRotation]);
    }

    #[test]
    fn of_each_light_on_skin_one_number_is_kept_and_what_it_makes_of_normal_and_view_is_made_anew() {
        library::register_all();
        for number in 1..=4 {
            term::light(LightFamily::SkyBeam, &format!("sky_{number}")).unwrap();
        }
        let built_in = [Effect::Diffuse, Effect::NormalMap, Effect::Occlusion, Effect::Rim];
        let named = ["lights", "shadows", "light_specular", "fresnel", "directional_occlusion"];
        let lights = ["light_sky_1", "light_sky_2", "light_sky_3", "light_sky_4"];
        let more = named.into_iter().chain(lights).map(|name| Effect::from_name(name).unwrap());
        let effects: Effects = built_in.into_iter().chain(more).collect();
        let facts = Facts {
            setup: Setup::new(Form::Corrected, Silhouette::Fragment, effects),
            source: Source::Terms,
            ..Facts::default()
        };
        let kept = sample_fields(&facts);
        for light in lights {
            let of_light: Vec<_> = kept.iter().filter(|(name, _)| name.starts_with(light)).collect();
            assert!(matches!(of_light[..], [(_, "f32")]), "{kept:?}");
        }
        // Two vectors serve all lights and the sky.
        for vector in ["n", "view"] {
            assert!(kept.contains(&(vector, "vec3f")), "{kept:?}");
        }
        // Nothing that a pass is to make of what is kept is out of its reach.
        let goals = parts(&facts);
        Plan::search(&facts, &[], &goals, &names(&kept)).unwrap();
    }
}
