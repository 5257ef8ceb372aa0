//! A file of rules: what its comments declare, and its functions.

use super::error::{Problem, TermError};
use super::parameter::{DeclaredParameter, PARAMETER_LINE, parameter};
use super::texels::{LEVEL_TYPES, blur, domains_of, kernel};
use crate::model::effects::Prerequisite;
use crate::model::fields::{Found, MapNames};
use crate::shader::domain::Domain;
use crate::shader::rule::{Error, Rule};

/// What a file of rules holds.
#[derive(Clone, Debug, Default)]
pub(crate) struct Declaration {
    /// The effects, and their lines.
    pub(super) effects: Vec<(usize, DeclaredEffect)>,
    /// Its parameters, and their lines.
    pub(super) parameters: Vec<(usize, DeclaredParameter)>,
    /// Numbers of vertices, maps and samples that it reads, and their lines.
    pub(super) fields: Vec<(usize, DeclaredField)>,
    /// Its rules, in their order.
    pub(crate) rules: Vec<Rule>,
}

/// `effect: NAME, what it shows`; after the name what it says of itself, two words each: `upon lights`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DeclaredEffect {
    pub(super) name: &'static str,
    /// The effect that switches it.
    pub(super) within: Option<&'static str>,
    /// The effect without which it does nothing.
    pub(super) upon: Option<&'static str>,
    pub(super) asks: Option<Prerequisite>,
    pub(super) shares_light: bool,
    pub(super) bakes_environment: bool,
    pub(super) meaning: &'static str,
}

/// `field: NAME: TYPE = NEUTRAL; what it is`, or `map:`
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DeclaredField {
    pub(super) name: &'static str,
    pub(super) of: Found,
    pub(super) wgsl: &'static str,
    pub(super) neutral: f32,
    pub(super) meaning: &'static str,
}

/// The keys that a header may have.
const KEYS: [&str; 20] = [
    "effect",
    "parameter",
    "field",
    "map",
    "sample_field",
    "gives",
    "adds",
    "shows",
    "when",
    "cost",
    "error",
    "paper",
    "named",
    "uses",
    "reads",
    "fallback",
    "domain",
    "sampled",
    "pass",
    "joins",
];

/// Read a file of rules, which is called `name`. They are of `domain` but where they declare another.
///
/// # Errors
/// When it is not as [`super`] says.
pub(crate) fn parse(
    domain: Domain,
    name: &'static str,
    text: &'static str,
) -> Result<Declaration, TermError> {
    let mut declaration = Declaration::default();
    let mut header: Vec<(usize, &'static str)> = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((at, line)) = lines.next() {
        if let Some(comment) = line.strip_prefix("//") {
            header.push((at + 1, comment.trim_start_matches('/').trim()));
        } else if line.starts_with("fn ") {
            let last = lines.by_ref().find(|(_, line)| line.trim_end() == "}").map(|(_, line)| line);
            let last = last.ok_or(Problem::Endless.at(at + 1))?;
            let body = between(text, line, last);
            let (rule, domains) = declaration.rule(domain, at + 1, &header, body)?;
            declaration.rules.extend(domains.into_iter().map(|domain| rule.in_domain(domain)));
            header.clear();
        } else if !line.trim().is_empty() {
            return Err(Problem::Stray(line.trim().to_owned()).at(at + 1));
        }
    }
    let alone = declaration.rules.iter().all(|rule| rule.line == declaration.rules[0].line);
    for rule in &mut declaration.rules {
        rule.name = if alone { name } else { rule.function };
    }
    Ok(declaration)
}

/// The text from the start of a line to the end of another, its line break with it.
fn between(text: &'static str, first: &str, last: &str) -> &'static str {
    let offset = |line: &str| line.as_ptr() as usize - text.as_ptr() as usize;
    let end = offset(last) + last.len();
    let end = text[end..].find('\n').map_or(text.len(), |at| end + at + 1);
    &text[offset(first)..end]
}

impl Declaration {
    /// The rule of a function under its header, and where it holds; declarations of the file stand in the first rule's.
    fn rule(
        &mut self,
        domain: Domain,
        line: usize,
        header: &[(usize, &'static str)],
        body: &'static str,
    ) -> Result<(Rule, Vec<Domain>), TermError> {
        let mut domains = vec![domain];
        let mut rule = Rule::bare(domain, line, body).ok_or(Problem::Head.at(line))?;
        for &(at, words) in header {
            let (key, value) = words.split_once(": ").map_or(("", words), |(key, value)| (key, value.trim()));
            match KEYS.iter().find(|known| **known == key) {
                Some(&"effect" | &"parameter" | &"field" | &"map" | &"sample_field") => {
                    self.declare(at, key, value)?;
                    // What stood before belongs to the file.
                    rule.about.clear();
                }
                Some(&"domain") => domains = domains_of(value).map_err(|problem| problem.at(at))?,
                Some(&key) => rule_line(&mut rule, key, value).map_err(|problem| problem.at(at))?,
                None => {
                    if is_key(key) {
                        let nearest = KEYS.iter().find(|known| misspelt(key, known)).copied();
                        return Err(Problem::Key { given: key.to_owned(), nearest, known: &KEYS }.at(at));
                    }
                    if !words.is_empty() {
                        rule.about.push_str(if rule.about.is_empty() { "" } else { " " });
                        rule.about.push_str(words);
                    }
                }
            }
        }
        let lacks = |key| Problem::Lacks { function: rule.function.to_owned(), key }.at(line);
        if rule.gives.is_empty() {
            return Err(lacks("gives"));
        }
        if !rule.has_cost() {
            return Err(lacks("cost"));
        }
        kernel(&mut rule, &domains).map_err(|problem| problem.at(line))?;
        let astray = rule.sampled.is_some() && !domains.contains(&Domain::Texel);
        if astray {
            return Err(Problem::OfTexels { key: "sampled" }.at(line));
        }
        Ok((rule, domains))
    }

    fn declare(&mut self, line: usize, key: &str, value: &'static str) -> Result<(), TermError> {
        if key == "effect" {
            let early = self.parameters.is_empty() && self.fields.is_empty() && self.rules.is_empty();
            if !early {
                return Err(Problem::Misplaced { key: "effect" }.at(line));
            }
            let wanted = EFFECT_LINE;
            let effect = effect(value)
                .ok_or_else(|| Problem::Value { key: "effect", given: value.to_owned(), wanted }.at(line))?;
            self.effects.push((line, effect));
            return Ok(());
        }
        let misplaced = |key| Problem::Misplaced { key }.at(line);
        if let Some(key) = ["field", "sample_field", "map"].into_iter().find(|known| *known == key) {
            if !self.rules.is_empty() {
                return Err(misplaced(key));
            }
            let wanted = if key == "map" { MAP_LINE } else { FIELD_LINE };
            let field = field(key, value)
                .ok_or_else(|| Problem::Value { key, given: value.to_owned(), wanted }.at(line))?;
            self.fields.push((line, field));
            return Ok(());
        }
        if !self.rules.is_empty() {
            return Err(misplaced("parameter"));
        }
        let wanted = PARAMETER_LINE;
        let parameter = parameter(value)
            .ok_or_else(|| Problem::Value { key: "parameter", given: value.to_owned(), wanted }.at(line))?;
        self.parameters.push((line, parameter));
        Ok(())
    }
}

/// Whether what stands before a colon is written as keys are: one word of small letters. Prose begins with a capital.
fn is_key(word: &str) -> bool {
    !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_')
}

/// Whether a word is nearly a key.
fn misspelt(word: &str, key: &str) -> bool {
    word.len() > 2 && strsim::damerau_levenshtein(word, key) == 1
}

pub(super) fn list(value: &'static str) -> impl Iterator<Item = &'static str> {
    value.split(',').map(str::trim).filter(|word| !word.is_empty())
}

pub(super) fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|number| number.is_finite())
}

/// A line of a rule's header into the rule.
fn rule_line(rule: &mut Rule, key: &'static str, value: &'static str) -> Result<(), Problem> {
    let unread = |wanted| Problem::Value { key, given: value.to_owned(), wanted };
    let amount = |text: &str| number(text).filter(|number| *number >= 0.0);
    match key {
        "gives" => rule.gives = list(value).map(|q| q.split_once('.').unwrap_or((q, ""))).collect(),
        "adds" => rule.adds = list(value).collect(),
        "shows" => rule.shows = Some(value),
        "when" => rule.when = list(value).collect(),
        "uses" => rule.uses = list(value).collect(),
        "reads" => rule.reads = list(value).collect(),
        "fallback" => rule.fallback = list(value).collect(),
        "joins" => rule.joins = Some(value),
        "paper" => rule.paper = value == "yes",
        "named" => rule.named = value == "yes",
        "error" if value == "tessellation" => rule.error = Error::Tessellation,
        "sampled" => {
            rule.sampled = Some(amount(value).ok_or_else(|| unread("a number, relative to white"))?);
        }
        "pass" => {
            let wanted = "QUANTITY: TYPE, TAPS taps: what is blurred, an f32, vec2f or vec3f, and how many places count, \
                          an odd number from 3 to 255; or `gaussian`, `neighbours` or `surface of PLACE, FACING, AREA` in the \
                          place of these";
            rule.blur = Some(blur(value).ok_or_else(|| unread(wanted))?);
        }
        "error" => {
            rule.error = Error::Fixed(amount(value).ok_or_else(|| unread("a number, relative to white"))?);
        }
        _ => {
            let (value, tap) = match value.strip_suffix(" a tap") {
                Some(costs) => costs.split_once(" and ").unwrap_or(("0", costs)),
                None => (value, "0"),
            };
            let (fixed, each) = match value.strip_suffix(" a morph") {
                Some(costs) => costs.split_once(" and ").unwrap_or(("0", costs)),
                None => (value, "0"),
            };
            let costs = amount(fixed).zip(amount(each));
            let unread = || unread("how many operations it takes, about");
            rule.set_cost(costs.ok_or_else(unread)?);
            rule.set_cost_a_tap(amount(tap).ok_or_else(unread)?);
        }
    }
    Ok(())
}

/// How an effect is declared.
const EFFECT_LINE: &str = "NAME, then two words each where they hold: `within EFFECT`, `upon EFFECT`, `asks normal_map`, \
                           `asks environment`, `asks lights`, `asks atlas`, `asks hand`, `shares light`, \
                           `bakes environment`; then `, what it shows`";

fn effect(value: &'static str) -> Option<DeclaredEffect> {
    let (head, meaning) = value.split_once(',').unwrap_or((value, ""));
    let mut words = head.split_whitespace();
    let mut effect = DeclaredEffect {
        name: words.next().unwrap_or_default(),
        within: None,
        upon: None,
        asks: None,
        shares_light: false,
        bakes_environment: false,
        meaning: meaning.trim(),
    };
    while let Some(word) = words.next() {
        match (word, words.next()?) {
            ("within", whole) => effect.within = Some(whole),
            ("upon", other) => effect.upon = Some(other),
            ("asks", name) if effect.asks.is_none() => {
                effect.asks = Some(Prerequisite::NAMED.into_iter().find(|(known, _)| *known == name)?.1);
            }
            ("shares", "light") => effect.shares_light = true,
            ("bakes", "environment") => effect.bakes_environment = true,
            _ => return None,
        }
    }
    Some(effect)
}

/// How a field is declared.
const FIELD_LINE: &str = "NAME: TYPE = NEUTRAL; what it is. The type is f32, vec2f or vec3f, and the number what stands in \
                          for each of a mesh that lacks it";
/// How a map is.
const MAP_LINE: &str = "NAME: TYPE = NEUTRAL; what it is. The type is f32, an image's first channel, or vec3f, its colour, and \
                        the number what stands in for each where the scene has none";

fn field(key: &str, value: &'static str) -> Option<DeclaredField> {
    let (typed, meaning) = value.split_once(';')?;
    let (name, rest) = typed.split_once(':')?;
    let (wgsl, neutral) = rest.split_once('=')?;
    let (name, wgsl, meaning) = (name.trim(), wgsl.trim(), meaning.trim());
    let neutral = number(neutral)? as f32;
    let known = LEVEL_TYPES.contains(&wgsl) && neutral.is_finite() && !meaning.is_empty();
    let of = match key {
        "map" => Found::Map(MapNames::of(name)),
        "sample_field" => Found::Samples,
        _ => Found::Vertices,
    };
    // Images have one channel or three.
    let held = key != "map" || wgsl != "vec2f";
    (known && held).then_some(DeclaredField { name, of, wgsl, neutral, meaning })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::params::Scale;
    use crate::model::registry::leaked;

    const TEXT: &str = "// Of the file.\n//\n// effect: sheen, light of fine hair\n\
        // parameter: sheen_weight = 0.5 in [0, inf), rgb, linear; how much; a paper\n\
        // parameter: sheen_width = 20 in [1, 90], log, unit degrees; how wide\n//\n// Of the rule.\n//\n\
        // gives: sheen_part\n// adds: sheen\n// cost: 12\n\
        fn sheen(n: vec3f, sheen_weight: vec3f) -> vec3f {\n    return sheen_weight * n;\n}\n\n\
        // gives: sheen_a.x, sheen_b.y\n// cost: 3\nfn both() -> vec2f {\n    return vec2f(1.0);\n}\n";

    fn read(text: &str) -> Result<Declaration, TermError> {
        parse(Domain::Fragment, "file", leaked(text))
    }

    #[test]
    fn effects_parameters_and_several_rules_are_read() {
        let read = read(TEXT).unwrap();
        assert_eq!(read.effects, [(3, effect("sheen, light of fine hair").unwrap())]);
        let [(4, weight), (5, width)] = read.parameters.as_slice() else { panic!("{:?}", read.parameters) };
        assert!(weight.rgb && weight.linear && weight.upper == f64::INFINITY && weight.source == "a paper");
        assert!(width.scale == Scale::Log && width.unit == "degrees" && width.default == 20.0);
        let [sheen, both] = read.rules.as_slice() else { panic!("{:?}", read.rules) };
        assert_eq!((sheen.name, sheen.line, sheen.about.as_str()), ("sheen", 12, "Of the rule."));
        assert_eq!((sheen.adds.as_slice(), sheen.needs.len()), (&["sheen"][..], 2));
        assert_eq!(both.gives, [("sheen_a", "x"), ("sheen_b", "y")]);
        assert!(both.body.starts_with("fn both") && both.body.ends_with("}\n"));
    }

    #[test]
    fn an_effect_says_what_it_asks_for() {
        let read = effect("glints within all upon lights asks lights shares light bakes environment, spots")
            .unwrap();
        let (within, upon) = (Some("all"), Some("lights"));
        let asks = Some(Prerequisite::Lights);
        let (name, meaning) = ("glints", "spots");
        let wanted =
            DeclaredEffect { name, within, upon, asks, shares_light: true, bakes_environment: true, meaning };
        assert_eq!(read, wanted);
        let plain = DeclaredEffect { name, within: None, upon: None, asks: None, meaning: "", ..wanted };
        let plain = DeclaredEffect { shares_light: false, bakes_environment: false, ..plain };
        assert_eq!(effect("glints"), Some(plain));
        for wrong in [
            "a within",
            "a upon",
            "a asks sun",
            "a asks lights asks atlas",
            "a shares",
            "a shares heat",
            "a b c",
            "a b",
        ] {
            assert_eq!(effect(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_told_with_its_line() {
        let swap = |old: &str, new: &str| {
            assert!(TEXT.contains(old), "{old}");
            read(&TEXT.replacen(old, new, 1)).unwrap_err()
        };
        assert_eq!(swap("cost: 12", "cost: much").line, 11);
        assert!(matches!(
            swap("adds: sheen", "add: sheen").problem,
            Problem::Key { nearest: Some("adds"), .. }
        ));
        assert!(matches!(swap("adds: sheen", "resource: sheen").problem, Problem::Key { nearest: None, .. }));
        assert!(matches!(swap("// gives: sheen_part\n", "").problem, Problem::Lacks { key: "gives", .. }));
        assert!(matches!(swap("// cost: 3\n", "").problem, Problem::Lacks { key: "cost", .. }));
        assert_eq!(swap("-> vec2f {", "{").problem, Problem::Head);
        assert_eq!(
            swap("fn both()", "const A = 1.0;\nfn both()").problem,
            Problem::Stray("const A = 1.0;".to_owned())
        );
        assert_eq!(swap("1.0);\n}\n", "1.0);\n").problem, Problem::Endless);
        for (old, new) in [
            ("= 0.5 in", "= -0.5 in"),
            ("[0, inf), rgb", "[0, inf, rgb"),
            ("rgb, linear", "rgb, linaer"),
            ("[1, 90]", "[0, 90]"),
            ("; how wide", ""),
            ("in [1, 90], log", "in [1, 90], log, share of sheen"),
            ("rgb, linear;", "rgb, linear, share of;"),
            ("rgb, linear;", "rgb, linear, scene, share of sheen;"),
            ("rgb, linear;", "rgb, share of sheen;"),
            ("[0, inf), rgb", "[-1, inf), rgb, share of sheen"),
            ("[1, 90]", "[90, 1]"),
        ] {
            assert!(matches!(swap(old, new).problem, Problem::Value { key: "parameter", .. }), "{new}");
        }
        assert_eq!(swap("// gives: sheen_a", "// effect: b, c\n// gives: sheen_a").line, 16);
    }
}
