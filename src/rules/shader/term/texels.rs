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

/// What a sum over the surface reads of texels: where they lie, which way they face, what area they have.
const SURFACE: [&str; 3] = ["vec3f", "vec3f", "f32"];

/// `glow_light: vec3f, 7 taps`, `glow_light: vec3f, gaussian`, `glow_light: vec3f, neighbours`, or
/// `glow_light: vec3f, surface of glow_place, glow_facing, glow_area`.
pub(super) fn blur(value: &'static str) -> Option<Blur> {
    let (source, kernel) = value.split_once(',')?;
    let (of, kind) = source.split_once(':').map(|(of, kind)| (of.trim(), kind.trim()))?;
    let mut beside = Vec::new();
    let kernel = match (kernel.trim(), kernel.trim().strip_prefix("surface of ")) {
        (_, Some(read)) => {
            beside.extend(list(read).zip(SURFACE));
            if list(read).count() != SURFACE.len() {
                return None;
            }
            Kernel::Surface
        }
        ("gaussian", None) => Kernel::Gaussian,
        ("neighbours", None) => Kernel::Neighbours,
        (taps, None) => Kernel::Taps(taps.strip_suffix(" taps")?.trim().parse().ok()?),
    };
    let counted = match kernel {
        Kernel::Taps(taps) => taps % 2 == 1 && (3..=255).contains(&taps),
        _ => true,
    };
    let fits = LEVEL_TYPES.contains(&kind) && counted;
    fits.then(|| Blur { of, kind, kernel, beside, parameters: Vec::new() })
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
    let called = arguments.first().is_none_or(|first| rule.needs.contains(first));
    if own || blur.kernel.returns().is_some_and(|kind| kind != returns) || !called {
        return Err(Problem::Kernel);
    }
    if blur.kernel != Kernel::Neighbours {
        rule.returns = blur.kind;
    }
    blur.parameters.clone_from(&rule.needs);
    rule.needs.retain(|need| !arguments.contains(need));
    rule.needs.retain(|need| !blur.beside.contains(need));
    rule.needs.splice(0..0, std::iter::once((blur.of, blur.kind)).chain(blur.beside.iter().copied()));
    Ok(())
}
