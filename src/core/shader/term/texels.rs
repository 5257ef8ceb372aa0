//! What a header says of texels: the domains that a rule is of, and the pass whose kernel it is.

use super::declaration::list;
use super::error::Problem;
use crate::shader::domain::Domain;
use crate::shader::rule::{Blur, Kernel, Rule};

/// WGSL types of what a texel of the atlas can hold: beside it stands whether it holds anything.
pub(super) const LEVEL_TYPES: [&str; 3] = ["f32", "vec2f", "vec3f"];

/// `texel`, `fragment`, or both: vertices have no rules but the built-in ones.
pub(super) fn domains_of(value: &'static str) -> Result<Vec<Domain>, Problem> {
    let wanted = "`texel`, `fragment`, or `texel, fragment`";
    let unread = || Problem::Value { key: "domain", given: value.to_owned(), wanted };
    let known = |name| Domain::from_name(name).filter(|domain| *domain != Domain::Vertex).ok_or_else(unread);
    let mut domains = list(value).map(known).collect::<Result<Vec<_>, _>>()?;
    domains.sort_unstable();
    domains.dedup();
    if domains.is_empty() { Err(unread()) } else { Ok(domains) }
}

/// `glow_light: vec3f, 7 taps`, `glow_light: vec3f, gaussian`, or `glow_light: vec3f, neighbours`.
pub(super) fn blur(value: &'static str) -> Option<Blur> {
    let (source, kernel) = value.split_once(',')?;
    let (of, kind) = source.split_once(':').map(|(of, kind)| (of.trim(), kind.trim()))?;
    let kernel = match kernel.trim() {
        "gaussian" => Kernel::Gaussian,
        "neighbours" => Kernel::Neighbours,
        taps => Kernel::Taps(taps.strip_suffix(" taps")?.trim().parse().ok()?),
    };
    let counted = match kernel {
        Kernel::Taps(taps) => taps % 2 == 1 && (3..=255).contains(&taps),
        _ => true,
    };
    let fits = LEVEL_TYPES.contains(&kind) && counted;
    fits.then(|| Blur { of, kind, kernel, parameters: Vec::new() })
}

/// Of a rule whose function is a kernel: what it is called with, and what it needs.
pub(super) fn kernel(rule: &mut Rule, domains: &[Domain]) -> Result<(), Problem> {
    let Some(blur) = &mut rule.blur else { return Ok(()) };
    if domains != [Domain::Texel] {
        return Err(Problem::OfTexels { key: "pass" });
    }
    let head = rule.body.split('{').next().unwrap_or_default();
    let returns = head.rsplit("->").next().unwrap_or_default().trim();
    let [(_, "")] = rule.gives.as_slice() else { return Err(Problem::Kernel) };
    // Weights that depended on what they weigh would make no linear pass.
    let own = rule.needs.iter().any(|(need, _)| *need == blur.of);
    let arguments = blur.kernel.arguments();
    if own || blur.kernel.returns().is_some_and(|kind| kind != returns) || !rule.needs.contains(&arguments[0])
    {
        return Err(Problem::Kernel);
    }
    if blur.kernel != Kernel::Neighbours {
        rule.returns = blur.kind;
    }
    blur.parameters.clone_from(&rule.needs);
    rule.needs.retain(|need| !arguments.contains(need));
    rule.needs.insert(0, (blur.of, blur.kind));
    Ok(())
}
