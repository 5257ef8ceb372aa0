//! Which of the rules that a search has found come before which, and what of them stands in levels.

use std::collections::{BTreeMap, BTreeSet};

use crate::shader::domain::Domain;
use crate::shader::rule::Rule;
use crate::shader::search::{Carried, Found};

/// How many blurs lie before each of the texels' quantities, itself with them.
pub(super) fn depths(texels: &[&'static Rule]) -> BTreeMap<&'static str, usize> {
    let mut depths = BTreeMap::new();
    // Each round settles at least one more.
    for _ in texels {
        for rule in texels {
            let before = rule.needs.iter().filter_map(|(need, _)| depths.get(need)).max().copied();
            let depth = before.unwrap_or(0) + usize::from(rule.blur.is_some());
            depths.extend(rule.gives.iter().map(|(quantity, _)| (*quantity, depth)));
        }
    }
    depths
}

/// The texels' quantities that stand in the atlas: what fragments look up, and what blurs and their kernels read.
pub(super) fn in_levels(texels: &[&'static Rule], carried: &[Carried]) -> BTreeSet<&'static str> {
    let sampled = carried.iter().filter(|on| on.edge.from == Domain::Texel).map(|on| on.quantity);
    let blurs = texels.iter().filter(|rule| rule.blur.is_some());
    let read = blurs.flat_map(|rule| rule.needs.iter().map(|(need, _)| *need));
    sampled.chain(read).collect()
}

/// The rules of `domain` among `rules` that yield `goals` there, in their order; what is in `stops` is there already.
pub(in crate::shader) fn upstream(
    rules: &[&'static Rule],
    domain: Domain,
    goals: &[&str],
    stops: &dyn Fn(&Rule) -> bool,
) -> Vec<&'static Rule> {
    let of_domain = || rules.iter().filter(|rule| rule.domain == domain && !stops(rule));
    let mut wanted: BTreeSet<&str> = goals.iter().copied().collect();
    loop {
        let before = wanted.len();
        for rule in of_domain() {
            if rule.gives.iter().any(|(quantity, _)| wanted.contains(quantity)) {
                wanted.extend(rule.needs.iter().map(|(need, _)| *need));
            }
        }
        if wanted.len() == before {
            let chosen = |rule: &&&Rule| rule.gives.iter().any(|(quantity, _)| wanted.contains(quantity));
            return of_domain().filter(chosen).copied().collect();
        }
    }
}

/// The vertices' rules that `goals` and the quantities on edges to `domain` take, then `shading`.
pub(in crate::shader) fn with_vertices(
    found: &Found,
    domain: Domain,
    goals: &[&'static str],
    shading: Vec<&'static Rule>,
) -> Vec<&'static Rule> {
    let needed =
        |quantity: &str| shading.iter().any(|rule| rule.needs.iter().any(|(need, _)| *need == quantity));
    let carried = found.carried.iter().filter(|on| on.edge.from == Domain::Vertex && on.edge.to == domain);
    let arriving = carried.map(|on| on.quantity).filter(|quantity| needed(quantity));
    let goals: Vec<&str> = goals.iter().copied().chain(arriving).collect();
    let mut rules = upstream(&found.rules, Domain::Vertex, &goals, &|_| false);
    rules.extend(shading);
    rules
}
