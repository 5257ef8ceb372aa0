//! Whether the functions of a file of rules are valid, each with what its header names, and have derivatives.

use std::error::Error as _;
use std::fmt::Write as _;

use naga::front::wgsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

use super::error::{Problem, TermError};
use crate::shader::domain::Domain;
use crate::shader::quantity::{Kind, Resource};
use crate::shader::rule::{LIBRARY, Rule};
use crate::shader::tangent::{TangentError, Tangents};

pub(super) fn check(rules: &[Rule]) -> Result<(), TermError> {
    rules.iter().try_for_each(check_rule)
}

fn check_rule(rule: &Rule) -> Result<(), TermError> {
    let before = surroundings(rule);
    let head = before.lines().count();
    let text = format!("{before}{}", rule.body);
    // A fault in what stands before the function is one of its head.
    let line = |at: Option<u32>| rule.line + at.map_or(0, |at| (at as usize).saturating_sub(head + 1));
    let module = wgsl::parse_str(&text).map_err(|error| {
        let at = error.location(&text).map(|location| location.line_number);
        Problem::Wgsl(one_line(error.message())).at(line(at))
    })?;
    Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).map_err(|error| {
        let at = error.location(&text).map(|location| location.line_number);
        let mut words = error.as_inner().to_string();
        let mut cause = error.as_inner().source();
        while let Some(inner) = cause {
            let _ = write!(words, ": {inner}");
            cause = inner.source();
        }
        Problem::Wgsl(one_line(&words)).at(line(at))
    })?;
    let slopes = |(_, function): (_, &naga::Function)| {
        function.expressions.iter().any(|(_, e)| matches!(e, naga::Expression::Derivative { .. }))
    };
    if rule.domain != Domain::Texel && module.functions.iter().any(slopes) {
        // A stored sample knows no neighbours.
        return Err(Problem::Derivative("what lies between neighbouring fragments".to_owned()).at(rule.line));
    }
    if !rule.is_exact() {
        // No fit runs it.
        return Ok(());
    }
    let underivable = |error: TangentError| match error {
        TangentError::Unsupported { what, .. } => Problem::Derivative(what).at(rule.line),
        other => Problem::Wgsl(one_line(&other.to_string())).at(rule.line),
    };
    let moving: Vec<bool> =
        rule.parameters().iter().map(|(_, kind)| *kind == "f32" || kind.ends_with('f')).collect();
    let mut tangents = Tangents::new(&text).map_err(underivable)?;
    tangents.of(rule.function, &moving).map_err(underivable)?;
    // What was written has to be valid beside it.
    let both = format!("{text}\n{}", tangents.text());
    Tangents::new(&both).map(drop).map_err(underivable)
}

/// What a rule's header brings into its module.
fn surroundings(rule: &Rule) -> String {
    let mut text = String::new();
    let resources = Resource::all().filter(|resource| rule.reads.contains(&resource.name()));
    for (binding, resource) in resources.enumerate() {
        let ((space, kind), name) = (resource.kind().wgsl(), resource.name());
        let _ = writeln!(text, "@group(0) @binding({binding}) {space} {name}: {kind};");
        if resource.kind() == Kind::Faces {
            let _ =
                writeln!(text, "fn {name}_size() -> f32 {{ return f32(textureDimensions({name}).x - 2u); }}");
        }
    }
    if rule.uses.contains(&"shadow") {
        text.push_str("fn shadow_taps() -> u32 { return 1u; }\n");
    }
    for (_, library) in LIBRARY.iter().filter(|(name, _)| rule.uses.contains(name)) {
        text.push_str(library);
    }
    text
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}
