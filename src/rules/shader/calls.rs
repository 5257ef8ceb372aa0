//! What the modules of a plan share: declarations, its rules' functions, and their calls.

use std::fmt::Write as _;

use super::domain::Domain;
use super::emit::Plan;
use super::facts::Source;
use super::quantity::{Constant, Kind, Resource};
use super::rule::{LIBRARY, Rule};

impl Plan {
    /// Declarations that every module shares: extensions, constants, resources, functions. The block of
    /// uniform constants is left out where they stand in the text.
    pub fn declarations(&self, uniform: bool) -> String {
        self.bindings(uniform) + &self.functions(&Domain::ALL)
    }

    /// Of these, extensions, constants and resources.
    pub(super) fn bindings(&self, uniform: bool) -> String {
        let mut wgsl = String::new();
        if self.uses_f16() {
            wgsl.push_str("enable f16;\n\n");
        }
        if self.facts.morphs > 0 && self.constants.contains(&Constant::MorphWeights) {
            let _ = writeln!(wgsl, "const MORPHS = {}u;\n", self.facts.morphs);
        }
        if uniform && !self.constants.is_empty() {
            wgsl.push_str("struct Constants {\n");
            for constant in &self.constants {
                let kind = match constant {
                    Constant::ViewProjection => "mat4x4f",
                    Constant::MorphWeights => "array<vec4f, MORPHS>",
                    _ => "vec4f",
                };
                let _ = writeln!(wgsl, "    {}: {kind},", constant.name());
            }
            wgsl.push_str("}\n\n@group(0) @binding(0) var<uniform> constants: Constants;\n");
        }
        for (i, resource) in self.resources.iter().enumerate() {
            let (space, kind) = resource.kind().wgsl();
            let _ = writeln!(wgsl, "@group(0) @binding({}) {space} {}: {kind};", i + 1, resource.name());
        }
        let textures = if self.facts.source == Source::Raster { &self.levels[..] } else { &[] };
        for (i, level) in textures.iter().enumerate() {
            let binding = 1 + self.resources.len() + i;
            let _ = writeln!(wgsl, "@group(0) @binding({binding}) var {}: texture_2d<f32>;", level.bound());
        }
        wgsl
    }

    /// The functions of the domains' rules, and those that they call.
    pub(super) fn functions(&self, domains: &[Domain]) -> String {
        let mut wgsl = String::new();
        let steps = || self.steps.iter().filter(|step| domains.contains(&step.rule.domain));
        let used = |name: &str| steps().any(|step| step.rule.uses.contains(&name));
        for (_, text) in LIBRARY.iter().filter(|(name, _)| used(name)) {
            let _ = write!(wgsl, "\n{text}");
        }
        if domains.contains(&Domain::Fragment) {
            wgsl.push_str(&self.face_sizes());
            wgsl.push_str(&self.shadow_taps());
            wgsl.push_str(&self.dapple_axis());
        }
        for step in steps().filter(|step| step.rule.plain_value().is_none()) {
            if !step.rule.about.is_empty() {
                wgsl.push('\n');
                wrapped_comment(&mut wgsl, &step.rule.about);
                wgsl.push_str(step.rule.body);
            } else {
                let _ = write!(wgsl, "\n{}", step.rule.body);
            }
        }
        wgsl
    }

    /// `NAME_size()` for each resource of faces, which rules hand to `sample_faces`: texels along a side, without the
    /// border.
    fn face_sizes(&self) -> String {
        let faces = self.resources.iter().filter(|resource| resource.kind() == Kind::Faces);
        let function = |resource: &Resource| {
            let name = resource.name();
            let size = match self.facts.faces.of(*resource) {
                Some(size) => format!("{:?}", size as f32),
                None => format!("f32(textureDimensions({name}).x - 2u)"),
            };
            format!("\nfn {name}_size() -> f32 {{\n    return {size};\n}}\n")
        };
        faces.map(function).collect()
    }

    /// `shadow_taps()`, where a rule compares with shadow maps.
    fn shadow_taps(&self) -> String {
        let compares = self.steps.iter().any(|step| step.rule.uses.contains(&"shadow"));
        let taps = self.facts.shadows.filter(|_| compares).map(|shadows| shadows.taps);
        let function = |taps| format!("\nfn shadow_taps() -> u32 {{\n    return {taps}u;\n}}\n");
        taps.map(function).unwrap_or_default()
    }

    /// `axis_of_dapple()`, where a rule asks for it.
    fn dapple_axis(&self) -> String {
        if !self.steps.iter().any(|step| step.rule.body.contains("axis_of_dapple()")) {
            return String::new();
        }
        let [x, y, z] = self.facts.setup.dapple.axis();
        format!(
            "\n// The third row of DappleXf in the world, before environment_rotation (MODEL 2).\n\
             fn axis_of_dapple() -> vec3f {{\n    return vec3f({x:?}, {y:?}, {z:?});\n}}\n"
        )
    }

    /// The rules of a domain, in the order of their evaluation.
    pub(super) fn rules(&self, domain: Domain) -> impl Iterator<Item = &'static Rule> {
        self.steps.iter().map(|step| step.rule).filter(move |rule| rule.domain == domain)
    }

    /// What a rule's function is called with; see [`Self::calls`].
    pub(super) fn arguments(
        &self,
        rule: &Rule,
        constant: &impl Fn(Constant, &str) -> String,
        leaf: &impl Fn(&'static str) -> String,
    ) -> Vec<String> {
        let level =
            |q: &str| rule.domain != Domain::Vertex && self.levels.iter().any(|level| level.quantity() == q);
        let local = |q: &str| self.rules(rule.domain).any(|r| r.gives_quantity(q)) || level(q);
        let argument = |&(name, kind): &(&'static str, &'static str)| match Constant::from_name(name) {
            Some(known) => constant(known, kind),
            None if local(name) => name.to_owned(),
            None => leaf(name),
        };
        rule.needs.iter().map(argument).collect()
    }

    /// The calls of a domain's rules, one a line; `constant` and `leaf` write what is there without a rule,
    /// by its name and WGSL type.
    pub fn calls(
        &self,
        domain: Domain,
        constant: impl Fn(Constant, &str) -> String,
        leaf: impl Fn(&'static str) -> String,
    ) -> String {
        let mut wgsl = String::new();
        for rule in self.rules(domain) {
            let arguments = self.arguments(rule, &constant, &leaf);
            let call = match rule.plain_value() {
                Some("") => arguments.concat(),
                Some(value) => value.to_owned(),
                None => format!("{}({})", rule.function, arguments.join(", ")),
            };
            match rule.gives.as_slice() {
                [(quantity, "")] => {
                    let _ = writeln!(wgsl, "    let {quantity}: {} = {call};", rule.returns);
                }
                several => {
                    let both = format!("{}_and_more", several[0].0);
                    let _ = writeln!(wgsl, "    let {both}: {} = {call};", rule.returns);
                    for (quantity, swizzle) in several {
                        let kind = rule.given_type(swizzle);
                        let _ = writeln!(wgsl, "    let {quantity}: {kind} = {both}.{swizzle};");
                    }
                }
            }
        }
        wgsl
    }
}

fn wrapped_comment(wgsl: &mut String, words: &str) {
    let mut line = String::from("//");
    for word in words.split_whitespace() {
        if line.len() + word.len() > 108 {
            wgsl.push_str(&line);
            wgsl.push('\n');
            line = String::from("//");
        }
        line.push(' ');
        line.push_str(word);
    }
    wgsl.push_str(&line);
    wgsl.push('\n');
}
