//! Sums of what several rules give, whose number depends on the scene: a light map is of all lights.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use super::Rule;
use crate::model::effects::{Effect, Effects};
use crate::model::registry::leaked;
use crate::shader::domain::Domain;

/// What is summed, in which domain, and the summands.
type Key = (&'static str, Domain, Vec<(&'static str, &'static str)>);

/// For each sum that rules join where `effects` are on, the rule that adds it up. Equal sums are made once for as long as
/// the process runs.
pub(super) fn of(
    rules: impl Iterator<Item = &'static Rule>,
    effects: Effects,
) -> impl Iterator<Item = &'static Rule> {
    let mut sums: BTreeMap<(&'static str, Domain), Vec<(&'static str, &'static str)>> = BTreeMap::new();
    for rule in rules {
        let Some(sum) = rule.joins else { continue };
        let summands = sums.entry((sum, rule.domain)).or_default();
        let summand = (rule.gives[0].0, rule.returns);
        if !summands.contains(&summand) && holds(rule, effects) {
            summands.push(summand);
        }
    }
    sums.into_iter().map(|((sum, domain), summands)| made((sum, domain, summands)))
}

/// Whether the effects that a rule asks for are on, and those off that it asks to be.
fn holds(rule: &Rule, effects: Effects) -> bool {
    rule.when.iter().all(|condition| {
        let (name, wanted) = condition.strip_prefix('!').map_or((*condition, true), |name| (name, false));
        Effect::from_name(name).is_none_or(|effect| effects.has(effect) == wanted)
    })
}

fn made(key: Key) -> &'static Rule {
    static MADE: Mutex<BTreeMap<Key, &'static Rule>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(rule) = made.get(&key) {
        return rule;
    }
    let rule: &'static Rule = Box::leak(Box::new(rule(&key)));
    made.insert(key, rule);
    rule
}

fn rule((sum, domain, summands): &Key) -> Rule {
    let kind = summands.first().map_or("vec3f", |(_, kind)| *kind);
    let named = |(name, kind): &(&str, &str)| format!("{name}: {kind}");
    let parameters: Vec<String> = summands.iter().map(named).collect();
    let names: Vec<&str> = summands.iter().map(|(name, _)| *name).collect();
    let value = if names.is_empty() { format!("{kind}()") } else { names.join(" + ") };
    let body = leaked(&format!(
        "fn sum_of_{sum}({}) -> {kind} {{\n    return {value};\n}}\n",
        parameters.join(", ")
    ));
    Rule {
        name: leaked(&format!("sum_of_{sum}")),
        line: 1,
        domain: *domain,
        about: format!("The sum of all that joins {sum}."),
        gives: vec![(*sum, "")],
        adds: Vec::new(),
        shows: None,
        when: Vec::new(),
        cost: 3.0 * summands.len().saturating_sub(1) as f64,
        cost_a_morph: 0.0,
        cost_a_tap: 0.0,
        error: super::Error::Fixed(0.0),
        paper: false,
        named: false,
        sampled: None,
        blur: None,
        joins: None,
        uses: Vec::new(),
        reads: Vec::new(),
        fallback: Vec::new(),
        function: leaked(&format!("sum_of_{sum}")),
        needs: summands.clone(),
        returns: kind,
        body,
    }
}
