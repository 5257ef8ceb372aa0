//! Whether the names, types and needs of a declared term fit the built-in rules.

use std::collections::{BTreeMap, BTreeSet};

use super::declaration::{Declaration, DeclaredEffect};
use super::error::{Problem, TermError};
use super::texels::LEVEL_TYPES;
use super::there::{is_uniform, there};
use super::{Origin, terms};
use crate::model::choices::Choices;
use crate::model::effects::Effect;
use crate::model::fields::Found;
use crate::model::params::Param;
use crate::model::terms::TermName;
use crate::shader::emit::{SAMPLE, UNMADE};
use crate::shader::facts::Facts;
use crate::shader::quantity::{Attribute, Constant, Resource};
use crate::shader::rule::{LIBRARY, RULES, Rule};
use crate::shader::search::components;

/// Words that the modules which rules are built into give a meaning of their own.
const TAKEN: [&str; 55] = [
    "adjoint",
    "mean",
    "weighs",
    "whole",
    "change",
    "slope",
    "at",
    "part",
    "samples",
    "constants",
    "group",
    "lane",
    "slot",
    "share",
    "shown",
    "now",
    "next",
    "weight",
    "observed",
    "step",
    "thread",
    "workgroup",
    "workgroups",
    "targets",
    "loss",
    "scale",
    "residual",
    "value",
    "wanted",
    "beyond",
    "weighed",
    "record",
    "count",
    "terms",
    "vertex",
    "given",
    "image",
    "read",
    "slots",
    "i",
    "tap",
    "axis",
    "here",
    "middle",
    "sum",
    "place",
    "side",
    "size",
    "texel",
    "clip",
    "deviation",
    "deviation_moves",
    "reach",
    "narrow",
    "apart",
];

/// Functions of the modules, and what else these declare outside of functions.
const FUNCTIONS: [&str; 59] = [
    "level_corners",
    "level_at",
    "sample_level",
    "vs_main",
    "fs_main",
    "cs_main",
    "cs_vertices",
    "cs_shade",
    "shaded",
    "shadow_fetch",
    "interpolated",
    "handed_over",
    "place_in_tile",
    "first_numbers",
    "clip_of",
    "areas_of_corners",
    "shares_of",
    "step_of",
    "mean_of_corners",
    "varyings",
    "corners",
    "triangles",
    "drawn",
    "colors",
    "coverages",
    "uv_steps_here",
    "cs_texels",
    "texels",
    "tiles",
    "staged",
    "own",
    "texel_at",
    "texel_near",
    "blurred",
    "dilated",
    "mean_around",
    "corner_in_texels",
    "share_steps",
    "attributes",
    "level_size",
    "level_texel",
    "levels",
    "leave",
    "records",
    "is_inside",
    "filled",
    "covered_texel",
    "gained",
    "give",
    "adjoints",
    "largest",
    "sums",
    "unit_exponent",
    "power_of_two",
    "add_exactly",
    "exact_sum",
    "add_fast",
    "fast_sum",
    "by_columns",
];

/// Whether a name is one of those that the passes over the atlas make of others': `NAME_level` is a level as it is bound,
/// `NAME_along_u` what the first direction of a blur leaves, `NAME_dilated` what fills empty texels, `d_NAME` how a level moves,
/// `NAME_gradient` what an input of tensors gets.
fn is_made(name: &str) -> bool {
    name.starts_with("d_")
        || ["_level", "_along_u", "_dilated", "_gradient"].iter().any(|ending| name.ends_with(ending))
}

/// The declaration, where it fits.
pub(super) fn checked(origin: Origin, declaration: Declaration) -> Result<Declaration, TermError> {
    names(origin, &declaration)?;
    adds(origin, &declaration.rules)?;
    for rule in &declaration.rules {
        references(rule, &declaration)?;
    }
    types(&declaration)?;
    circles(&declaration.rules)?;
    there(origin, &declaration)?;
    Ok(declaration)
}

/// The name of something in shaders: lower-case words with single `_` between them.
fn is_word(name: &str) -> bool {
    let word =
        |word: &str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    name.starts_with(|c: char| c.is_ascii_lowercase()) && name.split('_').all(word)
}

/// Whether a name counts up, as the modules' own do: `sum3`, `c0`, `d12_n`.
fn counts_up(name: &str) -> bool {
    ["sum", "c", "d"].iter().any(|head| {
        name.strip_prefix(head).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    })
}

fn quantity_name(name: &str, line: usize) -> Result<(), TermError> {
    if !is_word(name) || counts_up(name) || TAKEN.contains(&name) || name.ends_with("_and_more") {
        return Err(Problem::Name(name.to_owned()).at(line));
    }
    if is_made(name) || FUNCTIONS.contains(&name) {
        return Err(Problem::Reserved(name.to_owned()).at(line));
    }
    Ok(())
}

fn effect_name(
    line: usize,
    effect: &DeclaredEffect,
    before: &[(usize, DeclaredEffect)],
) -> Result<(), TermError> {
    if !is_word(effect.name) || effect.meaning.is_empty() {
        return Err(Problem::Value {
            key: "effect",
            given: effect.name.to_owned(),
            wanted: "NAME, what it shows: the name in lower-case letters, digits and single `_`",
        }
        .at(line));
    }
    let own = |name: &str| before.iter().any(|(_, effect)| effect.name == name);
    let known = |name: &str| own(name) || Effect::from_name(name).is_some();
    let mut others = [effect.within, effect.upon].into_iter().flatten();
    if let Some(other) = others.find(|other| !known(other)) {
        let known = Effect::all().map(|effect| effect.name().to_owned()).collect();
        return Err(Problem::NotThere { key: "effect", name: other.to_owned(), known }.at(line));
    }
    if Facts::default().holds(effect.name).is_some() {
        let name = effect.name.to_owned();
        return Err(Problem::Taken { kind: "effect or condition", name }.at(line));
    }
    Ok(())
}

fn names(origin: Origin, declaration: &Declaration) -> Result<(), TermError> {
    let taken = |kind, name: &str, line| Err(Problem::Taken { kind, name: name.to_owned() }.at(line));
    if declaration.effects.is_empty() {
        return Err(Problem::NoEffect.at(1));
    }
    for (place, (line, effect)) in declaration.effects.iter().enumerate() {
        effect_name(*line, effect, &declaration.effects[..place])?;
    }
    let known: BTreeSet<&str> = RULES
        .iter()
        .chain(terms().into_iter().flat_map(|term| &term.rules))
        .flat_map(|rule| rule.gives.iter().map(|(quantity, _)| *quantity))
        .chain(SAMPLE.iter().chain(&UNMADE).map(|(name, _)| *name))
        .chain(Attribute::BUILT_IN.iter().map(|attribute| attribute.name()))
        .chain(Resource::all().map(Resource::name))
        .chain(Constant::OWN.iter().map(|constant| constant.name()))
        .chain(["vertex_index"])
        .collect();
    let of_terms: BTreeSet<&str> = terms()
        .into_iter()
        .flat_map(|term| &term.rules)
        .flat_map(|rule| rule.gives.iter().map(|(quantity, _)| *quantity))
        .collect();
    let mut own = BTreeSet::new();
    for &(line, parameter) in &declaration.parameters {
        quantity_name(parameter.identifier, line)?;
        let of_another = |name: &&str| !declaration.effects.iter().any(|(_, effect)| effect.name == *name);
        if let Some(of) = parameter.of.iter().chain(parameter.weighs).copied().find(of_another) {
            let known = declaration.effects.iter().map(|(_, effect)| effect.name.to_owned()).collect();
            return Err(Problem::NotThere { key: "parameter", name: of.to_owned(), known }.at(line));
        }
        let there =
            known.contains(parameter.identifier) || Param::from_identifier(parameter.identifier).is_some();
        if there || !own.insert(parameter.identifier) {
            return taken("parameter or quantity", parameter.name, line);
        }
    }
    for &(line, field) in &declaration.fields {
        quantity_name(field.name, line)?;
        let there = |name: &str| known.contains(name) || Param::from_identifier(name).is_some();
        let mapped = match field.of {
            Found::Map(names) => {
                let mut taken = |name: &'static str| there(name) || !own.insert(name);
                taken(names.texels) || taken(names.filtered)
            }
            Found::Vertices | Found::Samples => false,
        };
        if there(field.name) || mapped || !own.insert(field.name) {
            return taken("field or quantity", field.name, line);
        }
    }
    let params = own.clone();
    for rule in &declaration.rules {
        for (quantity, swizzle) in &rule.gives {
            quantity_name(quantity, rule.line)?;
            if !is_swizzle(swizzle, rule.returns) {
                let given = format!("{quantity}.{swizzle}");
                let wanted = "QUANTITY or QUANTITY.COMPONENTS, of the components that the function returns";
                return Err(Problem::Value { key: "gives", given, wanted }.at(rule.line));
            }
            // The library may give in another way what the built-in rules give, but nothing that a term does.
            let known = match origin {
                Origin::File => known.contains(quantity),
                Origin::Library => of_terms.contains(quantity),
            };
            let there = known || Param::from_identifier(quantity).is_some();
            if there || params.contains(quantity) {
                return taken("quantity", quantity, rule.line);
            }
        }
        let functions = RULES.iter().chain(terms().into_iter().flat_map(|term| &term.rules));
        let mut functions = functions.map(|rule| rule.function);
        let library = LIBRARY.iter().any(|(_, text)| text.contains(&format!("fn {}(", rule.function)));
        let twice = declaration
            .rules
            .iter()
            .filter(|other| other.function == rule.function && other.line != rule.line)
            .count()
            > 0;
        if library || twice || functions.any(|function| function == rule.function) {
            return taken("function", rule.function, rule.line);
        }
        // What exports call their passes and lookups, and what looks the file's own maps up.
        let of_levels = ["_pass", "_level_at", "_level_near", "_level_around"];
        let of_maps = ["_from_texels", "_from_map", "_from_mip_texels", "_from_mip_map", "_neutral"];
        let mut maps = declaration.fields.iter().filter(|(_, field)| matches!(field.of, Found::Map(_)));
        let of_maps = maps.any(|(_, field)| {
            rule.function.strip_prefix(field.name).is_some_and(|ending| of_maps.contains(&ending))
        });
        if of_maps || of_levels.iter().any(|ending| rule.function.ends_with(ending)) {
            return Err(Problem::Reserved(rule.function.to_owned()).at(rule.line));
        }
        if FUNCTIONS.contains(&rule.function) {
            return Err(Problem::Reserved(rule.function.to_owned()).at(rule.line));
        }
    }
    Ok(())
}

/// Parts of the radiance: new names, one vec3f each.
fn adds(origin: Origin, rules: &[Rule]) -> Result<(), TermError> {
    for rule in rules {
        for name in rule.adds.iter().chain(&rule.shows) {
            // The library may show a built-in term in another way.
            let allowed = |term: TermName| origin == Origin::Library && term.is_built_in();
            if TermName::from_name(name).is_some_and(|term| !allowed(term)) {
                return Err(Problem::Taken { kind: "term", name: (*name).to_owned() }.at(rule.line));
            }
            quantity_name(name, rule.line)?;
            let [(quantity, components)] = rule.gives.as_slice() else {
                let given = "one of several".to_owned();
                return Err(Problem::NoRadiance { quantity: rule.gives[0].0.to_owned(), given }.at(rule.line));
            };
            let given = rule.given_type(components);
            if given != "vec3f" {
                let (quantity, given) = ((*quantity).to_owned(), given.to_owned());
                return Err(Problem::NoRadiance { quantity, given }.at(rule.line));
            }
        }
    }
    if origin == Origin::File && rules.iter().all(|rule| rule.adds.is_empty()) {
        return Err(Problem::NothingAdded.at(rules.first().map_or(1, |rule| rule.line)));
    }
    Ok(())
}

/// The conditions, library files and resources that a rule names.
fn references(rule: &Rule, declaration: &Declaration) -> Result<(), TermError> {
    let missing = |key, name: &str, known: Vec<String>| {
        Err(Problem::NotThere { key, name: name.to_owned(), known }.at(rule.line))
    };
    let own = |condition: &str| declaration.effects.iter().any(|(_, effect)| effect.name == condition);
    for condition in &rule.when {
        let fact = condition.strip_prefix('!').unwrap_or(condition);
        if !own(fact) && Facts::default().holds(fact).is_none() {
            let known = Effect::all().map(|effect| effect.name().to_owned());
            return missing(
                "when",
                condition,
                known
                    .chain(Facts::CONDITIONS.iter().chain(&Choices::CONDITIONS).map(|&c| c.to_owned()))
                    .collect(),
            );
        }
    }
    for name in &rule.uses {
        if !LIBRARY.iter().any(|(known, _)| known == name) {
            return missing("uses", name, LIBRARY.map(|(known, _)| known.to_owned()).to_vec());
        }
    }
    for name in &rule.reads {
        if !Resource::all().any(|resource| resource.name() == *name) {
            return missing("reads", name, Resource::all().map(|known| known.name().to_owned()).collect());
        }
    }
    Ok(())
}

/// The WGSL types of all quantities that known rules know.
fn known_types() -> BTreeMap<&'static str, &'static str> {
    let rules = || RULES.iter().chain(terms().into_iter().flat_map(|term| &term.rules));
    let given = rules().flat_map(|rule| {
        rule.gives.iter().map(move |(quantity, components)| (*quantity, rule.given_type(components)))
    });
    let needed = rules().flat_map(|rule| rule.needs.iter().copied());
    SAMPLE.iter().copied().chain(given).chain(needed).collect()
}

fn types(declaration: &Declaration) -> Result<(), TermError> {
    let mut types = known_types();
    types.extend(Param::all().map(|param| (param.identifier(), param_type(param.info().rgb))));
    types.extend(declaration.parameters.iter().map(|(_, p)| (p.identifier, param_type(p.rgb))));
    types.extend(declaration.fields.iter().map(|(_, field)| (field.name, field.wgsl)));
    for rule in &declaration.rules {
        let given = rule.gives.iter().map(|(quantity, components)| (*quantity, rule.given_type(components)));
        for (quantity, kind) in given.clone().chain(rule.needs.iter().copied()) {
            let wanted = *types.entry(quantity).or_insert(kind);
            if wanted != kind {
                let (quantity, given, wanted) = (quantity.to_owned(), kind.to_owned(), wanted.to_owned());
                return Err(Problem::Type { quantity, given, wanted }.at(rule.line));
            }
        }
        // What a pass' kernel or a fragment reads stands in the atlas.
        let of_kernel =
            rule.needs.iter().copied().filter(|(name, _)| rule.blur.is_some() && !is_uniform(name));
        let mut stands = given.filter(|_| rule.sampled.is_some()).chain(of_kernel);
        if let Some((quantity, kind)) = stands.find(|(_, kind)| !LEVEL_TYPES.contains(kind)) {
            let (quantity, kind) = (quantity.to_owned(), kind.to_owned());
            return Err(Problem::NoLevel { quantity, kind }.at(rule.line));
        }
    }
    Ok(())
}

const fn param_type(rgb: bool) -> &'static str {
    if rgb { "vec3f" } else { "f32" }
}

/// Rules of the file that need what they give.
fn circles(rules: &[Rule]) -> Result<(), TermError> {
    for start in rules {
        let mut path = vec![start];
        if let Some(circle) = circle(rules, &mut path, 0) {
            return Err(Problem::Circle(circle).at(start.line));
        }
    }
    Ok(())
}

/// The quantities of a circle that leads from the last rule of a path back to its first. (Built-in rules need nothing
/// that a file gives.)
fn circle<'a>(rules: &'a [Rule], path: &mut Vec<&'a Rule>, depth: usize) -> Option<String> {
    let (first, last) = (*path.first()?, *path.last()?);
    for (need, _) in &last.needs {
        if first.gives.iter().any(|(quantity, _)| quantity == need) {
            return Some(path.iter().map(|rule| rule.gives[0].0).collect::<Vec<_>>().join(", "));
        }
        // A path that is longer has been somewhere twice.
        let next = rules.iter().filter(|rule| rule.gives.iter().any(|(quantity, _)| quantity == need));
        for rule in next.filter(|_| depth < rules.len()) {
            path.push(rule);
            if let Some(found) = circle(rules, path, depth + 1) {
                return Some(found);
            }
            path.pop();
        }
    }
    None
}

/// Whether these are components of a number or vector of that type; none are all of it.
fn is_swizzle(swizzle: &str, of: &str) -> bool {
    let width = components(of);
    let within = |names: &str| swizzle.chars().all(|c| names[..width.min(4)].contains(c));
    swizzle.is_empty() || (width > 1 && swizzle.len() <= 4 && (within("xyzw") || within("rgba")))
}
