//! The rules by which a rasteriser looks up a map that a file of rules declares: a family's file, `rules/family/map.wgsl`,
//! of which each map is a member.

use super::declaration::{DeclaredField, parse};
use super::error::TermError;
use super::stamped;
use crate::model::registry::leaked;
use crate::shader::domain::Domain;
use crate::shader::rule::Rule;

/// Where `NAME` stands for the map, `TYPE` for its type, `CHANNELS` for those of a texel that it has, `NEUTRAL` for what
/// stands in for each, and `MEANING` for what it is.
const FAMILY: &str = include_str!("../rules/family/map.wgsl");

/// The rules of a map that is declared at `line`.
pub(super) fn rules(field: &DeclaredField, line: usize) -> Result<Vec<Rule>, TermError> {
    let &DeclaredField { name, wgsl, neutral, meaning, .. } = field;
    let text = stamped(FAMILY, name).unwrap_or_default();
    let channels = if wgsl == "f32" { "r" } else { "rgb" };
    let text = text.replace("TYPE", wgsl).replace("CHANNELS", channels);
    let text = text.replace("NEUTRAL", &format!("{neutral:?}")).replace("MEANING", meaning);
    let mut rules =
        parse(Domain::Fragment, name, leaked(&text)).map_err(|error| error.problem.at(line))?.rules;
    rules.iter_mut().for_each(|rule| rule.line = line);
    Ok(rules)
}
