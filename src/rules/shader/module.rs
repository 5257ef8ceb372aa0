//! The modules that a plan's rules make up: shaders for the rasteriser, a function over stored samples, and
//! the fragment stage as a function to be built into another engine.

use std::fmt::Write as _;

use super::atlas::stored;
use super::atlas::text::{sample_level, sampled};
use super::domain::Domain;
use super::emit::{Plan, Step, hazy, parts, sample_fields};
use super::quantity::{Constant, Resource};
use super::tangent::chain::Chain;
use crate::model::key_light::KeyLight;
use crate::model::params::{Param, Params};
use crate::model::turn::turn;

impl Plan {
    /// Declarations, and the vertex stage; its position has these attributes.
    pub fn vertex_module(&self, position: &str) -> String {
        self.vertex_module_at(position, "clip")
    }

    /// As [`vertex_module`](Self::vertex_module), the position being `clip`, a `vec4f`.
    pub(super) fn vertex_module_at(&self, position: &str, clip: &str) -> String {
        self.vertex_text(position, clip, "@vertex\nfn vs_main")
    }

    /// As [`vertex_module`](Self::vertex_module), the vertex stage being a function of that name, for entry points that
    /// hand over more.
    #[must_use]
    pub fn vertex_function(&self, name: &str) -> String {
        self.vertex_text("", "clip", &format!("fn {name}"))
    }

    fn vertex_text(&self, position: &str, clip: &str, function: &str) -> String {
        let mut wgsl = self.declarations(true);
        wgsl.push_str("\nstruct Vertex {\n    @builtin(vertex_index) vertex_index: u32,\n");
        for (i, attribute) in self.attributes.iter().enumerate() {
            let _ = writeln!(wgsl, "    @location({i}) {}: {},", attribute.name(), attribute.wgsl());
        }
        let _ = write!(wgsl, "}}\n\nstruct Varyings {{\n    {position}@builtin(position) clip: vec4f,\n");
        for (i, (name, kind)) in self.varyings.iter().enumerate() {
            let _ = writeln!(wgsl, "    @location({i}) {name}: {kind},");
        }
        let _ = write!(wgsl, "}}\n\n{function}(vertex: Vertex) -> Varyings {{\n");
        wgsl.push_str(&self.calls(Domain::Vertex, uniform, |name| format!("vertex.{name}")));
        let varyings: String = self.varyings.iter().map(|(name, _)| format!(", {name}")).collect();
        let _ = write!(wgsl, "    return Varyings({clip}{varyings});\n}}\n");
        wgsl
    }

    pub(super) fn raster_module(&self) -> String {
        let (location, coverage) = ("@location(0) ", "@location(1) ");
        let mut wgsl = self.vertex_module("");
        wgsl.push_str(&self.fragment_function("@fragment\nfn fs_main", [location, coverage]));
        wgsl
    }

    /// A function of what fragments are handed that returns their colour, or colour and coverage; `at` are the
    /// attributes of these.
    pub(super) fn fragment_function(&self, name: &str, at: [&str; 2]) -> String {
        let (hazy, mut wgsl) = (hazy(&self.facts), String::new());
        if !self.levels.is_empty() {
            let _ = write!(wgsl, "\n{}", sample_level(&self.facts));
        }
        if self.only_fetches {
            wgsl.push_str(&self.shadow_fetch());
        }
        if hazy {
            let [color, coverage] = at;
            let _ = write!(
                wgsl,
                "\nstruct Fragment {{\n    {color}color: vec4f,\n    {coverage}coverage: f32,\n}}\n"
            );
        }
        let returns = if hazy { "Fragment".to_owned() } else { format!("{}vec4f", at[0]) };
        let _ = write!(wgsl, "\n{name}(at: Varyings) -> {returns} {{\n");
        let color = if self.only_fetches {
            self.fetches()
        } else {
            wgsl.push_str(&sampled(&self.facts, &self.levels));
            wgsl.push_str(&self.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
            format!("vec4f({}, {})", sum(&parts(&self.facts)), if hazy { "haze" } else { "1.0" })
        };
        let returned = if hazy { format!("Fragment({color}, 1.0)") } else { color };
        let _ = write!(wgsl, "    return {returned};\n}}\n");
        wgsl
    }

    pub(super) fn sample_module(&self, parts: &[&str]) -> String {
        let mut wgsl = self.declarations(true);
        wgsl.push_str(&sample_struct(&self.sample_inputs(&Chain::default())));
        wgsl.push_str("\n// Radiance, and the haze in alpha.\nfn shade(at: Sample) -> vec4f {\n");
        wgsl.push_str(&stored(&self.levels));
        wgsl.push_str(&self.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
        let haze = if hazy(&self.facts) { "haze" } else { "0.0" };
        let _ = write!(wgsl, "    return vec4f({}, {haze});\n}}\n", sum(parts));
        wgsl
    }

    /// The fields of a stored sample, with their WGSL types: what samples hold, what was looked up of levels, and how that
    /// moves along each of the chain's seeds.
    #[must_use]
    pub fn sample_inputs(&self, chain: &Chain) -> Vec<(String, &'static str)> {
        let fields = sample_fields(&self.facts).into_iter().map(|(name, kind)| (name.to_owned(), kind));
        fields.chain(self.looked_up(chain)).collect()
    }

    /// Those of [`Self::sample_inputs`] that were looked up of levels.
    #[must_use]
    pub fn looked_up(&self, chain: &Chain) -> Vec<(String, &'static str)> {
        let levels = self.levels.iter().map(|level| (level.name.clone(), level.kind));
        levels.chain(chain.looked_up(self).into_iter().map(|(field, level)| (field, level.kind))).collect()
    }

    /// The fragment stage as a function `skinfit_shade` of what the vertex stage hands over (and the eye).
    /// It names parameters in capitals ([`literals`](Self::literals)) and resources as they are.
    #[must_use]
    pub fn function(&self) -> String {
        let mut wgsl = self.merged().functions(&[Domain::Texel, Domain::Fragment]).trim_start().to_owned();
        wgsl.push_str(&self.pass_functions());
        let eye = self.in_fragment(Constant::Eye);
        wgsl.push_str(
            "\n// What the vertex stage hands over: world space, interpolated.\nstruct Surface {\n",
        );
        for (name, kind) in self.surface() {
            let _ = writeln!(wgsl, "    {name}: {kind},");
        }
        let alpha = if hazy(&self.facts) { "haze" } else { "1.0" };
        let what = if hazy(&self.facts) { "the haze" } else { "1" };
        let _ = write!(
            wgsl,
            "}}\n\n// Linear Rec.709 radiance, and {what} in alpha.\nfn skinfit_shade(at: Surface) -> vec4f {{\n"
        );
        let constant = |constant: Constant, _: &str| match constant {
            Constant::Eye if eye => "at.eye".to_owned(),
            other => literal_name(other),
        };
        wgsl.push_str(&self.looked_up_lines());
        wgsl.push_str(&self.calls(Domain::Fragment, constant, |name| format!("at.{name}")));
        let _ = write!(wgsl, "    return vec4f({}, {alpha});\n}}\n", sum(&parts(&self.facts)));
        wgsl
    }

    /// The plan with the passes' rules among its own, each function once, and with what they read.
    #[must_use]
    pub fn merged(&self) -> Self {
        let plans = || self.passes.iter().map(|pass| &pass.plan).chain([self]);
        let mut steps: Vec<Step> = Vec::new();
        for step in plans().flat_map(|plan| &plan.steps) {
            if !steps.iter().any(|known| known.rule.function == step.rule.function) {
                steps.push(*step);
            }
        }
        let read = |resource: &Resource| plans().any(|plan| plan.resources.contains(resource));
        let resources = Resource::all().filter(read).collect();
        let asked = |constant: &Constant| plans().any(|plan| plan.constants.contains(constant));
        let constants =
            Constant::OWN.into_iter().chain(Param::all().map(Constant::Param)).filter(asked).collect();
        Self { steps, resources, constants, ..self.clone() }
    }

    /// The fields of the function's `Surface`, with their WGSL types.
    #[must_use]
    pub fn surface(&self) -> Vec<(&'static str, &'static str)> {
        let eye = self.in_fragment(Constant::Eye).then_some(("eye", "vec3f"));
        self.varyings.iter().copied().chain(eye).collect()
    }

    /// The constants of the function: name in capitals, WGSL type, and value.
    #[must_use]
    pub fn literals(&self, params: &Params) -> Vec<(String, &'static str, Vec<f64>)> {
        let merged = self.merged();
        let used = merged.constants.iter().filter(|constant| merged.is_shading(**constant));
        used.filter_map(|&constant| {
            let (kind, value) = literal(constant, params)?;
            Some((literal_name(constant), kind, value))
        })
        .collect()
    }

    /// Whether a rule of fragments or texels reads a constant.
    fn is_shading(&self, constant: Constant) -> bool {
        let mut shading = self.steps.iter().filter(|step| step.rule.domain != Domain::Vertex);
        shading.any(|step| step.rule.needs.iter().any(|(name, _)| *name == constant.name()))
    }

    /// Whether a rule of the fragment stage reads a constant.
    fn in_fragment(&self, constant: Constant) -> bool {
        let fragment = self.steps.iter().filter(|step| step.rule.domain == Domain::Fragment);
        fragment.map(|step| step.rule).any(|rule| rule.needs.iter().any(|(name, _)| *name == constant.name()))
    }
}

/// The name of a constant that is written into the text.
pub(super) fn literal_name(constant: Constant) -> String {
    constant.name().to_uppercase()
}

/// WGSL type and value of a constant that is known before a frame is drawn.
fn literal(constant: Constant, params: &Params) -> Option<(&'static str, Vec<f64>)> {
    match constant {
        Constant::Param(param) if param.info().rgb => Some(("vec3f", params.rgb(param).to_vec())),
        Constant::Param(param) => Some(("f32", vec![params.scalar(param)])),
        Constant::Turn => Some(("vec2f", turn(params).to_vec())),
        Constant::KeyDirection => Some(("vec3f", KeyLight::new(params).direction.to_vec())),
        Constant::Eye
        | Constant::ViewProjection
        | Constant::KeyByAzimuth
        | Constant::KeyByElevation
        | Constant::GlossyPaces
        | Constant::MorphWeights => None,
    }
}

/// The declaration of a stored sample.
pub fn sample_struct<N: std::fmt::Display>(fields: &[(N, &str)]) -> String {
    let mut wgsl = String::from("\nstruct Sample {\n");
    for (name, kind) in fields {
        let _ = writeln!(wgsl, "    {name}: {kind},");
    }
    if fields.is_empty() {
        // WGSL knows no empty structures.
        wgsl.push_str("    nothing: f32,\n");
    }
    wgsl.push_str("}\n");
    wgsl
}

fn sum(parts: &[&str]) -> String {
    if parts.is_empty() { "vec3f(0.0)".to_owned() } else { parts.join(" + ") }
}

/// A member of the uniform block as a value of the type that a rule's parameter has.
pub fn uniform(constant: Constant, kind: &str) -> String {
    let swizzle = match kind {
        "f32" => ".x",
        "vec2f" => ".xy",
        "vec3f" => ".xyz",
        _ => "",
    };
    format!("constants.{}{swizzle}", constant.name())
}
