//! Whether all that a declared term's rules need is there: for fragments, for stored samples, for texels.

use std::collections::BTreeSet;

use super::declaration::Declaration;
use super::error::{Problem, TermError};
use super::{Origin, terms};
use crate::model::params::Param;
use crate::shader::domain::Domain;
use crate::shader::emit::{SAMPLE, TEXEL};
use crate::shader::graph::is_of_the_eye;
use crate::shader::quantity::{Attribute, Constant};
use crate::shader::rule::{RULES, Rule};

/// The fields of stored samples, and all that rules give of them.
fn of_samples<'a>(
    rules: &(impl Iterator<Item = &'a Rule> + Clone),
    own: &BTreeSet<&'static str>,
) -> BTreeSet<&'static str> {
    let mut there: BTreeSet<&'static str> = SAMPLE.iter().map(|(name, _)| *name).collect();
    there.extend(own);
    // What fragments look up.
    let looked_up = rules.clone().filter(|rule| rule.domain == Domain::Texel && rule.sampled.is_some());
    there.extend(looked_up.flat_map(|rule| rule.gives.iter().map(|(quantity, _)| *quantity)));
    loop {
        let before = there.len();
        for rule in
            rules.clone().filter(|rule| rule.domain == Domain::Fragment && !rule.when.contains(&"raster"))
        {
            let met = |name: &str| {
                there.contains(name) || Param::from_identifier(name).is_some() || is_constant(name)
            };
            if rule.needs.iter().all(|(name, _)| met(name)) {
                there.extend(rule.gives.iter().map(|(quantity, _)| *quantity));
            }
        }
        if there.len() == before {
            return there;
        }
    }
}

/// What rules give of texels: all that no eye moves.
fn of_texels() -> BTreeSet<&'static str> {
    let of_vertices = || RULES.iter().filter(|rule| rule.domain == Domain::Vertex);
    // What a mesh has before it is posed, stored texels do not hold.
    let stored = |name: &&'static str| TEXEL.iter().any(|(held, _)| held == name);
    let unmet = |name: &str| is_of_the_eye(name);
    let mut seen: BTreeSet<&'static str> = BTreeSet::new();
    let mut there: BTreeSet<&'static str> = BTreeSet::new();
    loop {
        let before = seen.len() + there.len();
        for rule in of_vertices() {
            let moved = rule.needs.iter().any(|(name, _)| unmet(name) || seen.contains(name));
            let given = rule.gives.iter().map(|(name, _)| *name);
            if moved {
                seen.extend(given);
            } else {
                there.extend(given.filter(stored));
            }
        }
        there.retain(|name| !seen.contains(name));
        for rule in RULES.iter().filter(|rule| rule.domain == Domain::Texel) {
            if rule.needs.iter().all(|(name, _)| there.contains(name) || is_uniform(name)) {
                there.extend(rule.gives.iter().map(|(name, _)| *name));
            }
        }
        if seen.len() + there.len() == before {
            return there;
        }
    }
}

/// Whether a constant that is no parameter is there for stored samples.
fn is_constant(name: &str) -> bool {
    [Constant::Turn, Constant::KeyDirection].iter().any(|constant| constant.name() == name)
}

/// Everything that the rules need is there, for fragments and for samples, or for texels; every parameter is needed.
pub(super) fn there(origin: Origin, declaration: &Declaration) -> Result<(), TermError> {
    let parameters =
        declaration.parameters.iter().map(|(line, parameter)| (*line, parameter.identifier, parameter.name));
    let fields = declaration.fields.iter().map(|(line, field)| (*line, field.name, field.name));
    let declared: Vec<(usize, &str, &str)> = parameters.chain(fields).collect();
    let own: BTreeSet<&str> = declared.iter().map(|(_, identifier, _)| *identifier).collect();
    // The library's own files know one another.
    let known =
        terms().into_iter().filter(|term| origin == Origin::Library && term.origin == Origin::Library);
    let all = RULES.iter().chain(known.flat_map(|term| &term.rules));
    let all: Vec<&Rule> = all.chain(&declaration.rules).collect();
    let (samples, texels) = (of_samples(&all.iter().copied(), &own), of_texels());
    // The library's own may have rules for rasterised fragments beside those for samples.
    let for_both = |rule: &&Rule| origin == Origin::File || !rule.when.contains(&"raster");
    let gives = |giver: &Rule, need: &str| giver.gives_quantity(need) || giver.joins == Some(need);
    for rule in declaration.rules.iter().filter(for_both) {
        let there = if rule.domain == Domain::Texel { &texels } else { &samples };
        for &(need, _) in &rule.needs {
            let mut givers = declaration.rules.iter().filter(|giver| gives(giver, need)).peekable();
            let ours = |param: Param| param.is_built_in() || origin == Origin::Library;
            let constant = Param::from_identifier(need).is_some_and(ours) || is_constant(need);
            let quantity = need.to_owned();
            if givers.peek().is_some() {
                // Only texels of one file feed its texels; fragments look up what may be sampled.
                let feeds = |giver: &Rule| giver.domain == rule.domain || giver.sampled.is_some();
                let feeds = |giver: &Rule| feeds(giver) && giver.domain <= rule.domain;
                if givers.any(feeds) {
                    continue;
                }
                let problem = match rule.domain {
                    Domain::Texel => Problem::NotOfTexels { quantity },
                    _ => Problem::TexelsAlone { quantity },
                };
                return Err(problem.at(rule.line));
            }
            if own.contains(need) || there.contains(need) || constant {
                continue;
            }
            let somewhere = RULES.iter().any(|rule| rule.gives_quantity(need))
                || Constant::from_name(need).is_some()
                || Attribute::BUILT_IN.iter().any(|attribute| attribute.name() == need);
            if somewhere && rule.domain == Domain::Texel {
                return Err(Problem::NotOfTexels { quantity }.at(rule.line));
            }
            if somewhere {
                return Err(Problem::RasterOnly { quantity }.at(rule.line));
            }
            let given = declaration.rules.iter().flat_map(|rule| rule.gives.iter().map(|(name, _)| *name));
            let all = own.iter().copied().chain(given).chain(there.iter().copied());
            let near = nearest(need, all.chain(Param::built_in().map(Param::name)));
            return Err(Problem::Unknown { quantity, near }.at(rule.line));
        }
    }
    let idle = declared.iter().find(|(_, identifier, _)| {
        !declaration.rules.iter().any(|rule| rule.needs.iter().any(|(need, _)| need == identifier))
    });
    idle.map_or(Ok(()), |&(line, _, name)| Err(Problem::Idle(name.to_owned()).at(line)))
}

/// The nearest of the known names, where any is near.
fn nearest<'a>(given: &str, known: impl Iterator<Item = &'a str>) -> Vec<String> {
    let distance = |name: &str| strsim::damerau_levenshtein(given, name);
    let near = known.map(|name| (distance(name), name)).min();
    near.filter(|(distance, name)| *distance <= 1 + name.len() / 3)
        .map(|(_, name)| name.to_owned())
        .into_iter()
        .collect()
}

/// Whether a quantity is a constant: a parameter, or one that is there for stored samples.
pub(super) fn is_uniform(name: &str) -> bool {
    Param::from_identifier(name).is_some() || is_constant(name)
}
