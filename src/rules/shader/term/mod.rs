//! Terms: effects with parameters and rules of their own, each declared in one file.
//!
//! ```wgsl
//! // Schlick's Fresnel factor on the mirrored environment (Schlick 1994).
//! //
//! // effect: fresnel_reflection, the mirrored environment grows towards grazing angles
//! // parameter: fresnel_weight = 0.5 in [0, inf), rgb, linear; weight of the reflected environment; Schlick 1994
//! // parameter: fresnel_f0 = 0.028 in [0, 0.2]; reflectance when facing; Schlick 1994
//! //
//! // gives: fresnel_part
//! // adds: fresnel_reflection
//! // cost: 14
//! fn fresnel_light(n: vec3f, view: vec3f, mirror_light: vec4f, fresnel_weight: vec3f, fresnel_f0: f32) -> vec3f {
//!     let grazing: f32 = 1.0 - min(abs(dot(n, view)), 1.0);
//!     let square: f32 = grazing * grazing;
//!     let fresnel: f32 = fresnel_f0 + (1.0 - fresnel_f0) * (square * square * grazing);
//!     return fresnel_weight * (fresnel * mirror_light.rgb);
//! }
//! ```
//!
//! After its name an effect may say of itself what `suggest` and warnings go by: `upon lights` (without which it does
//! nothing), `asks atlas` (what a scene must have for it), `bakes environment` (a panorama cannot be fitted beside it).
//!
//! Each rule of the file holds only where its effect is enabled; of a file with several effects, where one of them is,
//! or those that its `when` line names. What `adds` is a part of the radiance, and an image
//! layer of that name. What the effect asks of the stages before (maps, cubes, fields of samples) follows from what
//! its rules need.
//!
//! A rule is of fragments, of texels of the UV atlas, or both (`domain: texel, fragment`); a blur of a texel's quantity is
//! a rule, too, whose function is the kernel (`pass: light_map: vec3f, 7 taps`, see [`Blur`](super::rule::Blur)).
//! Fragments look up what a rule of texels gives where it says how far that is off (`sampled: 0`).
//!
//! - `declaration`: the file's text, `texels`: what it says of texels; [`error`]: what is wrong with it
//! - `check`: whether its names and types fit the built-in rules, `there`: whether what it needs is there; `wgsl`:
//!   whether its functions are valid and have derivatives
//! - `map`: the rules that look its maps up; `needs`: what its effect asks for
//! - [`library`]: the files that come with the library; `light`: those that each light of a scene is a member of

mod check;
pub(crate) mod declaration;
pub mod error;
pub mod library;
mod light;
mod map;
mod needs;
mod parameter;
mod texels;
mod there;
mod wgsl;

use std::sync::{Mutex, PoisonError};

use self::declaration::{Declaration, DeclaredEffect, DeclaredField};
pub use self::error::{Problem, TermError};
pub use self::light::{LightFamily, light};
use super::domain::Domain;
use super::rule::Rule;
use super::search::components;
use crate::model::effects::{Effect, EffectInfo, Effects};
use crate::model::fields::{Field, FieldInfo, Fields, Found};
use crate::model::params::{Param, ParamInfo};
use crate::model::registry::{Added, RegistryError, leaked};
use crate::model::terms::{TermInfo, TermName};

/// A term that was registered.
#[derive(Debug)]
pub struct Term {
    /// Its effect; of several the first.
    pub effect: Effect,
    /// All of its effects: it is there where one of them is on.
    pub effects: &'static [Effect],
    /// Its parameters.
    pub params: Vec<Param>,
    /// Numbers of vertices, maps and samples that it reads.
    pub fields: Fields,
    /// Which of its effects show nothing where a parameter is 0 in every channel.
    pub weighed: Vec<(Effect, Param)>,
    /// Its image layers.
    pub layers: Vec<TermName>,
    /// Its rules.
    pub rules: Vec<Rule>,
    /// The text that declares it.
    pub text: &'static str,
    pub(super) origin: Origin,
}

impl Term {
    /// Whether it comes from a file that a scene or a program brings, and is none of the library's own.
    #[must_use]
    pub fn is_by_file(&self) -> bool {
        self.origin == Origin::File
    }
}

/// The text of a family's file for one of its members, terms alike but for their names, such as the lamps of a scene:
/// `NAME`, as a word or a part of one between `_` and `.`, stands for the member. `None` where it does not stand in it.
#[must_use]
pub fn stamped(text: &str, member: &str) -> Option<String> {
    const MEMBER: &str = "NAME";
    let (mut stamped, mut rest, mut found) = (String::with_capacity(text.len()), text, false);
    while let Some(at) = rest.find(MEMBER) {
        let (before, after) = (&rest[..at], &rest[at + MEMBER.len()..]);
        stamped += before;
        // A longer word, as FILENAME, is none.
        let whole = !before.ends_with(|c: char| c.is_alphanumeric())
            && !after.starts_with(|c: char| c.is_alphanumeric());
        stamped += if whole { member } else { MEMBER };
        found |= whole;
        rest = after;
    }
    found.then(|| stamped + rest)
}

static TERMS: Added<Term> = Added::new();

/// Every term that was registered.
pub fn terms() -> Vec<&'static Term> {
    TERMS.rows()
}

/// The terms of which an effect is on.
pub fn enabled(effects: Effects) -> impl Iterator<Item = &'static Term> {
    terms().into_iter().filter(move |term| effects.has_any(term.effects))
}

/// An added effect of a set that is computed in texels of the atlas: one of its rules holds nowhere else.
pub fn of_texels(effects: Effects) -> Option<Effect> {
    let on = |name: &&str| Effect::from_name(name).is_none_or(|effect| effects.has(effect));
    let there_alone = |term: &Term, rule: &Rule| {
        let elsewhere = |other: &Rule| other.domain != Domain::Texel && other.function == rule.function;
        rule.domain == Domain::Texel && rule.when.iter().all(on) && !term.rules.iter().any(elsewhere)
    };
    let mut terms = enabled(effects);
    terms.find(|term| term.rules.iter().any(|rule| there_alone(term, rule))).map(|term| term.effect)
}

/// The fields that the rules of added effects read.
pub fn fields(effects: Effects) -> Fields {
    enabled(effects).fold(Fields::default(), |all, term| all.or(term.fields))
}

/// Make a term known to this process for as long as it runs, from the text of the file that declares it; `name` is
/// what the file is called. A text that was registered before is not registered again.
///
/// # Errors
/// When the text is not as the module's documentation says, or does not fit the other rules.
pub fn register(name: &str, text: &str) -> Result<&'static Term, TermError> {
    library::register_all();
    register_from(Origin::File, name, text)
}

/// Where a term's text comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// From a file of the user's.
    File,
    /// It is the library's own, which finds its fields of samples.
    Library,
}

/// As [`register`].
pub(crate) fn register_from(origin: Origin, name: &str, text: &str) -> Result<&'static Term, TermError> {
    // One at a time, so that nothing is taken between the check and the entry.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = terms().into_iter().find(|term| term.text == text) {
        return Ok(known);
    }
    let text = leaked(text);
    let declaration = declaration::parse(Domain::Fragment, leaked(name), text)?;
    let own = declaration.fields.iter().find(|(_, field)| field.of == Found::Samples);
    if let Some((line, field)) = own.filter(|_| origin == Origin::File) {
        return Err(Problem::Unfound(field.name.to_owned()).at(*line));
    }
    let of_scene = declaration.parameters.iter().find(|(_, parameter)| parameter.held || parameter.found);
    if let Some((line, parameter)) = of_scene.filter(|_| origin == Origin::File) {
        return Err(Problem::Unfound(parameter.name.to_owned()).at(*line));
    }
    let declaration = check::checked(origin, declaration)?;
    // Those of the library are the same in every run: this member's tests have checked them.
    if origin == Origin::File || cfg!(test) {
        wgsl::check(&declaration.rules)?;
    }
    enter(origin, declaration, text)
}

/// Enter a checked declaration into the tables.
fn enter(origin: Origin, declaration: Declaration, text: &'static str) -> Result<&'static Term, TermError> {
    let Declaration { effects: declared, parameters, fields, mut rules } = declaration;
    let mut effects = Vec::new();
    for &(line, DeclaredEffect { name, within, upon, asks, shares_light, bakes_environment, meaning }) in
        &declared
    {
        let (within, upon) = (within.and_then(Effect::from_name), upon.and_then(Effect::from_name));
        let row = EffectInfo {
            name,
            meaning,
            needs: Some(needs::of_effect),
            within,
            upon,
            asks,
            shares_light,
            bakes_environment,
        };
        effects.push(Effect::register(row).map_err(|error| problem(error).at(line))?);
    }
    let line = declared.first().map_or(1, |(line, _)| *line);
    let effects: &'static [Effect] = effects.leak();
    let &effect = effects.first().ok_or(Problem::NoEffect.at(1))?;
    let (mut params, mut weighed) = (Vec::new(), Vec::new());
    for (line, declared) in parameters {
        let row = ParamInfo {
            param: Param::BaseWeight,
            name: declared.name,
            identifier: declared.identifier,
            listing: declared.default,
            corrected: declared.default,
            channels: declared.channels,
            lower: declared.lower,
            upper: declared.upper,
            unit: declared.unit,
            rgb: declared.rgb,
            linear: declared.linear,
            scale: declared.scale,
            owner: declared.owner,
            held: declared.held,
            found: declared.found,
            share: declared.share,
            effects: asking(effects, declared.of),
            source: declared.source,
            meaning: declared.meaning,
        };
        let param = Param::register(row).map_err(|error| problem(error).at(line))?;
        weighed.extend(declared.weighs.iter().filter_map(|name| Some((Effect::from_name(name)?, param))));
        params.push(param);
    }
    let mut read = Vec::new();
    for (line, declared) in fields {
        let DeclaredField { name, of, wgsl, neutral, meaning } = declared;
        let attribute = leaked(&format!("rest_{name}"));
        let row = FieldInfo { name, attribute, of, numbers: components(wgsl), neutral, meaning };
        read.push(Field::register(row).map_err(|error| problem(error).at(line))?);
        match of {
            Found::Map(_) => rules.extend(map::rules(&declared, line)?),
            Found::Vertices | Found::Samples => rules.extend(of_vertex(&declared, attribute, line)),
        }
    }
    let mut layers = Vec::new();
    for rule in &mut rules {
        // Where it names none of the file's effects, it is there with each of them.
        let named = declared.iter().any(|(_, effect)| rule.when.contains(&effect.name));
        if let ([(_, only)], false) = (declared.as_slice(), named) {
            rule.when.push(only.name);
        }
        // A layer is there where the effects are on that its rule asks for.
        let asked = rule.when.iter().filter_map(|condition| Effect::from_name(condition));
        let asked: Vec<Effect> = asked.collect();
        let refused =
            rule.when.iter().filter_map(|condition| Effect::from_name(condition.strip_prefix('!')?));
        let refused: Vec<Effect> = refused.collect();
        for &name in rule.adds.iter().chain(&rule.shows) {
            // The library may show a built-in term in another way.
            if let Some(term) = TermName::from_name(name).filter(|term| term.is_built_in()) {
                if rule.shows.is_some() {
                    term.also_with(asked.clone().leak());
                }
                continue;
            }
            let (effects, without) = (asked.clone().leak(), refused.clone().leak());
            let layer = TermName::register(TermInfo { name, effects, without })
                .map_err(|error| problem(error).at(rule.line))?;
            if !layers.contains(&layer) {
                layers.push(layer);
            }
        }
    }
    let term =
        Term { effect, effects, params, fields: Fields::of(read), weighed, layers, rules, text, origin };
    let never = || Problem::Full { kind: "term", most: 0 }.at(line);
    TERMS.add(|_| false, |_| false, |_| Ok(term), never)
}

/// The effects of a file that ask for a parameter: all of them, or the one that it names.
fn asking(effects: &'static [Effect], of: Option<&str>) -> &'static [Effect] {
    let place = of.and_then(|name| effects.iter().position(|effect| effect.name() == name));
    place.map_or(effects, |place| &effects[place..=place])
}

/// The rule by which a field comes from its attribute, interpolated from there to fragments and texels of a rasteriser. A
/// field of samples is found at the vertices then.
fn of_vertex(field: &DeclaredField, attribute: &'static str, line: usize) -> Option<Rule> {
    let &DeclaredField { name, wgsl, meaning, .. } = field;
    let text =
        format!("fn {name}_of_vertex({attribute}: {wgsl}) -> {wgsl} {{\n    return {attribute};\n}}\n");
    let mut rule = Rule::bare(Domain::Vertex, line, leaked(&text))?;
    rule.set_cost((0.0, 0.0));
    (rule.about, rule.gives, rule.when) = (format!("{meaning}."), vec![(name, "")], vec!["raster"]);
    Some(rule)
}

fn problem(error: RegistryError) -> Problem {
    match error {
        RegistryError::Taken { kind, name } => Problem::Taken { kind, name },
        RegistryError::Full { kind, most } => Problem::Full { kind, most },
    }
}
