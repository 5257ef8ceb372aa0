//! The rules: what each gives, from what, where, at what cost and with what error.
//!
//! A rule is a WGSL function in a file under `rules/`, in the folder of its domain, or in a file of a scene
//! ([`term`]): comments that say what it is for, header lines, and the function.
//!
//! ```wgsl
//! // R = V - 2 n (n.V) (MODEL 3, corrected form).
//! //
//! // gives: reflected
//! // when: corrected
//! // cost: 7
//! fn mirror_direction(n: vec3f, view: vec3f) -> vec3f {
//!     return view - 2.0 * dot(n, view) * n;
//! }
//! ```
//!
//! Its parameters are the quantities that it needs, of its own domain; one of another domain comes there along an edge
//! ([`domain`](super::domain)): a vertex' quantity that a fragment rule names is interpolated. Other header lines:
//! `domain` (where it holds, in the place of the folder's; one function may be a rule of several), `reads` (resources
//! and constants that the body names), `uses` (files of `rules/lib`), `error` (relative to white; a number or
//! `tessellation`), `paper: yes` (the paper's own programs made this approximation), `named: yes`
//! (the scene file itself names this approximation, and no budget refuses it), `adds` (the quantity is a part of
//! the sum that the radiance is, and holds these terms), `shows` (it is that term alone), `fallback` (quantities that
//! it takes where others fail, and for which nothing needs to be stored), `sampled` (fragments may look a texel's
//! quantity up, which is off by so much), `pass` (a blur of a texel's quantity; the function is its kernel, see
//! [`Blur`]), `joins` (its quantity is a summand of another, which is the sum of all that the enabled effects' rules have).

mod sums;

use std::sync::LazyLock;

use super::domain::{DIRECTIONS, Domain, TAP_COST};
use super::facts::{Budget, Facts};
use super::term::{self, declaration, library};
use crate::model::effects::Effects;

/// One rule.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The file's name without its ending; the function's where a file has several.
    pub name: &'static str,
    /// The line of its function in its file.
    pub line: usize,
    /// Where it is evaluated; a function that is a rule of several domains is listed once for each.
    pub domain: Domain,
    /// What it is, in words.
    pub about: String,
    /// Quantities that it gives, each with the components of the function's value that hold it.
    pub gives: Vec<(&'static str, &'static str)>,
    /// Terms that its quantity holds, where it is a part of the sum.
    pub adds: Vec<&'static str>,
    /// The term that its quantity is.
    pub shows: Option<&'static str>,
    /// Conditions on the [`Facts`], all of which must hold.
    pub when: Vec<&'static str>,
    /// Operations, about; and how many more for each morph target, and each comparison with a shadow map.
    cost: f64,
    cost_a_morph: f64,
    cost_a_tap: f64,
    pub(super) error: Error,
    /// Whether the paper's own programs made this approximation.
    pub paper: bool,
    /// Whether the scene file itself names this approximation: no budget refuses it.
    pub named: bool,
    /// How far its quantities are off, relative to white, where a fragment looks them up in the atlas; `None` where
    /// none may.
    pub sampled: Option<f64>,
    /// The pass over the atlas whose kernel it is.
    pub blur: Option<Blur>,
    /// The sum that its quantity is a part of.
    pub joins: Option<&'static str>,
    /// Library files that it calls.
    pub uses: Vec<&'static str>,
    /// Resources and constants that the body names.
    pub reads: Vec<&'static str>,
    /// Quantities that it takes where others fail.
    pub fallback: Vec<&'static str>,
    /// The function's name.
    pub function: &'static str,
    /// The quantities that it needs, with their WGSL types: the function's parameters, and what a blur is of.
    pub needs: Vec<(&'static str, &'static str)>,
    /// The WGSL type of the function's value; of a blur, that of what is blurred.
    pub returns: &'static str,
    /// The function.
    pub body: &'static str,
}

/// A pass over the atlas in which texels read what others hold.
///
/// A blur goes along u and then along v: in each direction a texel becomes the weighted mean of places along it. Between
/// two texels both count by their nearness. Texels that hold nothing, or are of another chart, weigh nothing. `axis` is
/// (1, 0) or (0, 1) (`vec2f`).
#[derive(Clone, Debug, PartialEq)]
pub struct Blur {
    /// What is read.
    pub of: &'static str,
    /// Its WGSL type.
    pub kind: &'static str,
    /// Which texels are read, and what the rule's function is.
    pub kernel: Kernel,
    /// What is read of each texel beside, with WGSL types: of a sum [over the surface](Kernel::Surface) where texels lie
    /// (`vec3f`), which way they face (`vec3f`) and what area they have (`f32`).
    pub beside: Vec<(&'static str, &'static str)>,
    /// The function's parameters, in their order, with their WGSL types.
    pub parameters: Vec<(&'static str, &'static str)>,
}

/// What a pass does with the texels around one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// A blur of this number of taps, an odd one. Of the quantities that it needs at the texel, `axis`, and `tap`,
    /// from -(taps - 1) / 2 to (taps - 1) / 2 in whole steps (`f32`), the function makes how many texels away the place
    /// is, and what it weighs (`vec2f`).
    Taps(u32),
    /// A blur by a Gaussian, with as many taps as the scene chooses. The function makes its standard deviation along
    /// `axis`, in texels.
    Gaussian,
    /// Not a blur: of `apart` (`vec2f`), how far what is read lies from one of its neighbours to the next along u and
    /// along v, half the distance of the two that are of the same chart, the distance to the one that is, or 0, the
    /// function makes the pass' value.
    Neighbours,
    /// A blur by distance in space, of all texels at once that face the same way, whatever the chart, each weighed by its
    /// area and a Gaussian. The function makes the Gaussian's variance, in the square of the unit that places have. On the
    /// processor alone.
    Surface,
}

impl Kernel {
    /// What the function is called with beside quantities, with WGSL types.
    #[must_use]
    pub const fn arguments(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Taps(_) => &[("tap", "f32"), ("axis", "vec2f")],
            Self::Gaussian => &[("axis", "vec2f")],
            Self::Neighbours => &[("apart", "vec2f")],
            Self::Surface => &[],
        }
    }

    /// The WGSL type of the function's value; `None` where any will do.
    #[must_use]
    pub const fn returns(self) -> Option<&'static str> {
        match self {
            Self::Taps(_) => Some("vec2f"),
            Self::Gaussian | Self::Surface => Some("f32"),
            Self::Neighbours => None,
        }
    }

    /// Whether it is a blur along the atlas' axes.
    #[must_use]
    pub const fn is_along_axes(self) -> bool {
        matches!(self, Self::Taps(_) | Self::Gaussian)
    }

    /// Places that count along each axis, about, in a scene.
    fn places(self, facts: &Facts) -> f64 {
        match self {
            Self::Taps(taps) => f64::from(taps),
            Self::Gaussian => facts.setup.choices.diffusion.taps.count().map_or(USUAL_PLACES, f64::from),
            Self::Neighbours => 1.0,
            Self::Surface => USUAL_PLACES * USUAL_PLACES,
        }
    }
}

/// Texels that a Gaussian takes whose taps are whole texels: twelve deviations, of two texels each.
const USUAL_PLACES: f64 = 25.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Error {
    Fixed(f64),
    Tessellation,
}

impl Rule {
    /// Operations in a scene.
    #[must_use]
    pub fn cost(&self, facts: &Facts) -> f64 {
        let taps = facts.shadows.map_or(0, |shadows| shadows.taps);
        let once =
            self.cost + self.cost_a_morph * f64::from(facts.morphs) + self.cost_a_tap * f64::from(taps);
        self.blur.as_ref().map_or(once, |blur| DIRECTIONS * blur.kernel.places(facts) * (once + TAP_COST))
    }

    /// How far it is off in a scene, relative to white.
    #[must_use]
    pub fn error(&self, facts: &Facts) -> f64 {
        match self.error {
            Error::Fixed(error) => error,
            Error::Tessellation => facts.tessellation,
        }
    }

    /// The value of a rule that hands on its only parameter (an empty text), or gives a fixed number: no
    /// function needs to be written for it.
    #[must_use]
    pub fn plain_value(&self) -> Option<&'static str> {
        if self.blur.is_some() {
            return None;
        }
        let value = self.body.trim_end().strip_suffix(";\n}")?.split_once("{\n    return ")?.1;
        match self.needs.as_slice() {
            [] => Some(value),
            [(only, _)] if *only == value => Some(""),
            _ => None,
        }
    }

    /// Why it cannot be used in a scene; `None` when it can.
    #[must_use]
    pub fn refusal(&self, facts: &Facts) -> Option<String> {
        if self.domain == Domain::Texel && facts.holds("atlas") != Some(true) {
            return Some("only with atlas".to_owned());
        }
        let there = if self.domain == Domain::Texel { facts.of_texels() } else { *facts };
        if let Some(condition) = self.when.iter().find(|c| there.holds(c) != Some(true)) {
            let (only, fact) = condition.strip_prefix('!').map_or(("only", *condition), |fact| ("not", fact));
            return Some(format!(
                "{only} with {}",
                fact.strip_prefix("has_").unwrap_or(fact).replace('_', " ")
            ));
        }
        if self.error == Error::Fixed(0.0) || self.named {
            return None;
        }
        let error = self.error(facts);
        match facts.budget {
            Budget::Exact => Some(format!("error {error:.1e}, where none is allowed")),
            Budget::Paper if self.paper => None,
            Budget::Paper => Some("not what the paper did".to_owned()),
            Budget::Within(most) if error <= most => None,
            Budget::Within(most) => Some(format!("error {error:.1e}, above {most:.1e}")),
        }
    }

    /// The function's parameters, with their WGSL types.
    #[must_use]
    pub fn parameters(&self) -> &[(&'static str, &'static str)] {
        self.blur.as_ref().map_or(&self.needs, |blur| &blur.parameters)
    }

    /// Whether it gives a quantity.
    #[must_use]
    pub fn gives_quantity(&self, quantity: &str) -> bool {
        self.gives.iter().any(|(given, _)| *given == quantity)
    }

    /// A function without what its header says; `None` where its head is not that of one. `line` is its first.
    pub(super) fn bare(domain: Domain, line: usize, body: &'static str) -> Option<Self> {
        let (function, rest) = body.strip_prefix("fn ")?.split_once('(')?;
        let (parameters, rest) = rest.split_once(')')?;
        let (returns, _) = rest.trim_start().strip_prefix("->")?.split_once('{')?;
        let parameters = parameters.split(',').map(str::trim).filter(|p| !p.is_empty());
        let typed = |p: &'static str| p.split_once(':').map(|(name, kind)| (name.trim(), kind.trim()));
        Some(Self {
            name: function.trim(),
            domain,
            line,
            about: String::new(),
            gives: Vec::new(),
            adds: Vec::new(),
            shows: None,
            when: Vec::new(),
            cost: f64::NAN,
            cost_a_morph: 0.0,
            cost_a_tap: 0.0,
            error: Error::Fixed(0.0),
            paper: false,
            named: false,
            sampled: None,
            blur: None,
            joins: None,
            uses: Vec::new(),
            reads: Vec::new(),
            fallback: Vec::new(),
            function: function.trim(),
            needs: parameters.map(typed).collect::<Option<_>>()?,
            returns: returns.trim(),
            body,
        })
    }

    /// The same rule in another domain.
    pub(super) fn in_domain(&self, domain: Domain) -> Self {
        Self { domain, ..self.clone() }
    }

    /// Set the operations that it takes, and those for each morph target.
    pub(super) const fn set_cost(&mut self, (fixed, each): (f64, f64)) {
        (self.cost, self.cost_a_morph) = (fixed, each);
    }

    /// Set the operations that it takes for each comparison with a shadow map.
    pub(super) const fn set_cost_a_tap(&mut self, each: f64) {
        self.cost_a_tap = each;
    }

    pub(super) const fn has_cost(&self) -> bool {
        self.cost.is_finite()
    }

    /// Whether it is off by nothing but rounding.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.error == Error::Fixed(0.0)
    }

    /// The WGSL type of a quantity that it gives.
    #[must_use]
    pub fn given_type(&self, components: &str) -> &'static str {
        match components.len() {
            0 => self.returns,
            1 => "f32",
            2 => "vec2f",
            3 => "vec3f",
            _ => "vec4f",
        }
    }
}

/// Every file of rules: domain, name and text.
const FILES: &[(&str, &str, &str)] = &include!(concat!(env!("OUT_DIR"), "/rules.rs"));

/// Functions that several rules call, in the order of their dependence.
pub const LIBRARY: [(&str, &str); 13] = [
    ("vector", include_str!("rules/lib/vector.wgsl")),
    ("frame", include_str!("rules/lib/frame.wgsl")),
    ("cube", include_str!("rules/lib/cube.wgsl")),
    ("texels", include_str!("rules/lib/texels.wgsl")),
    ("mip_texels", include_str!("rules/lib/mip_texels.wgsl")),
    ("power", include_str!("rules/lib/power.wgsl")),
    ("rim", include_str!("rules/lib/rim.wgsl")),
    ("specular", include_str!("rules/lib/specular.wgsl")),
    ("split_sum_kelemen", include_str!("rules/lib/split_sum_kelemen.wgsl")),
    ("split_sum_ggx", include_str!("rules/lib/split_sum_ggx.wgsl")),
    ("dielectric_sum_ggx", include_str!("rules/lib/dielectric_sum_ggx.wgsl")),
    ("shadow", include_str!("rules/lib/shadow.wgsl")),
    ("transmission", include_str!("rules/lib/transmission.wgsl")),
];

/// The built-in rules.
pub static RULES: LazyLock<Vec<Rule>> = LazyLock::new(|| {
    let read = |&(folder, name, text): &(&str, &'static str, &'static str)| {
        let domain = Domain::from_name(folder).unwrap_or(Domain::Fragment);
        let read = declaration::parse(domain, name, text);
        read.unwrap_or_else(|error| panic!("rules/{folder}/{name}.wgsl: {error}")).rules
    };
    FILES.iter().flat_map(read).collect()
});

/// The rules that a scene with these effects has: the built-in ones, and those of the terms that its effects are of.
///
/// What rules [join](Rule::joins) has a rule of its own, their sum.
pub fn rules(effects: Effects) -> impl Iterator<Item = &'static Rule> {
    library::register_all();
    let own = || RULES.iter().chain(term::enabled(effects).flat_map(|term| &term.rules));
    own().chain(sums::of(own(), effects))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::quantity::{Attribute, Constant, Resource};

    #[test]
    fn whatever_a_rule_names_exists() {
        let facts = Facts::default();
        for rule in RULES.iter() {
            for condition in &rule.when {
                assert!(facts.holds(condition).is_some(), "{}: when {condition}", rule.name);
            }
            for library in &rule.uses {
                assert!(LIBRARY.iter().any(|(name, _)| name == library), "{}: uses {library}", rule.name);
            }
            for read in &rule.reads {
                let resource = Resource::BUILT_IN.iter().any(|r| r.name() == *read);
                assert!(resource || Constant::from_name(read).is_some(), "{}: reads {read}", rule.name);
                assert!(rule.body.contains(read), "{} does not read {read}", rule.name);
            }
            for (quantity, _) in &rule.needs {
                let given = RULES.iter().any(|r| r.gives.iter().any(|(q, _)| q == quantity));
                let leaf = Constant::from_name(quantity).is_some()
                    || Attribute::BUILT_IN.iter().any(|a| a.name() == *quantity)
                    || *quantity == "vertex_index";
                assert!(given || leaf, "{}: nothing gives {quantity}", rule.name);
            }
        }
    }

    #[test]
    fn a_quantity_has_one_type() {
        let mut types = std::collections::BTreeMap::new();
        for (quantity, kind) in RULES.iter().flat_map(|rule| rule.needs.iter().copied()) {
            assert_eq!(*types.entry(quantity).or_insert(kind), kind, "{quantity}");
        }
        for rule in RULES.iter() {
            for (quantity, components) in &rule.gives {
                let given = rule.given_type(components);
                assert_eq!(*types.get(quantity).unwrap_or(&given), given, "{}: {quantity}", rule.name);
            }
        }
    }
}
