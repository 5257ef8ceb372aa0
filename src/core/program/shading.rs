//! The value of a plan over stored samples, and how it moves along seeds, as a graph of numbers.

use std::fmt::Write as _;

use super::graph::{Graph, Id, Input};
use super::lower::{LowerError, Source, Value};
use crate::model::lights::KeyLight;
use crate::model::params::{Param, Params};
use crate::shader::emit::{Plan, hazy, parts, sample_fields};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::rule::Stage;
use crate::shader::search::{PlanError, components};
use crate::shader::tangent::TangentError;
use crate::shader::tangent::chain::{Chain, Seed};
use crate::shader::{Constant, Facts, plan};

/// The functions of the losses, each with a `weighted_residual` of its own.
pub type LossText<'a> = &'a str;

/// A scene whose shading cannot be put as a graph.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error(transparent)]
pub enum ShadingError {
    /// No rules yield it.
    Plan(#[from] PlanError),
    /// A rule has no derivative.
    Tangent(#[from] TangentError),
    /// A rule cannot be computed on the processor.
    Lower(#[from] LowerError),
}

/// Radiance and haze of a sample, and how they move.
#[derive(Debug)]
pub struct Shading {
    /// All of it.
    pub graph: Graph,
    /// Radiance, and the haze.
    pub value: [Id; 4],
    /// How they move along each seed.
    pub tangents: Vec<[Id; 4]>,
    source: Source,
}

/// The entry point's name.
const ENTRY: &str = "skinfit_shaded";

impl Shading {
    /// Of what `facts` call for, along `seeds`. `stand_in` gives the number that stands in for a field that no sample
    /// holds. `more` is WGSL to be called beside the rules.
    ///
    /// # Errors
    /// When no rules yield it, or one of them cannot be lowered or has no derivative.
    pub fn new(
        facts: &Facts,
        seeds: &[Seed],
        stand_in: impl Fn(&str) -> Option<f32>,
        more: &str,
    ) -> Result<Self, ShadingError> {
        let plan = plan(facts)?;
        let chain = Chain::new(&plan, seeds)?;
        let source = Source::new(&module(&plan, &chain, more))?;
        let mut graph = Graph::default();
        let mut sample = Vec::new();
        for (name, kind) in sample_fields(facts) {
            for component in 0..components(kind) {
                sample.push(match stand_in(name) {
                    Some(value) => graph.constant(value.into()),
                    None => graph.field(name, component),
                });
            }
        }
        if sample.is_empty() {
            // WGSL knows no empty structures.
            sample.push(graph.constant(0.0));
        }
        let shaded = source.call(&mut graph, ENTRY, vec![Value::Numbers(sample)])?;
        let four = |at: usize| [shaded[at], shaded[at + 1], shaded[at + 2], shaded[at + 3]];
        let (value, tangents) = (four(0), (1..=seeds.len()).map(|k| four(4 * k)).collect());
        Ok(Self { graph, value, tangents, source })
    }

    /// A call of one of the functions that were given beside the rules.
    ///
    /// # Errors
    /// When there is no such function, or it cannot be lowered.
    pub fn call(&mut self, function: &str, arguments: &[Id]) -> Result<Vec<Id>, ShadingError> {
        let arguments = arguments.iter().map(|&id| Value::Numbers(vec![id])).collect();
        Ok(self.source.call(&mut self.graph, function, arguments)?)
    }
}

/// The rules, their tangents, and an entry point that returns the value and each seed's tangent.
fn module(plan: &Plan, chain: &Chain, more: &str) -> String {
    let mut with_slopes = plan.clone();
    with_slopes.resources.extend(&chain.resources);
    for constant in [Constant::KeyByAzimuth, Constant::KeyByElevation] {
        let named = chain.lines.iter().any(|lines| lines.contains(&format!("constants.{}", constant.name())));
        if named && !with_slopes.constants.contains(&constant) {
            with_slopes.constants.push(constant);
        }
    }
    let mut wgsl = with_slopes.declarations(true);
    wgsl.push_str(&chain.functions);
    wgsl.push_str(&sample_struct(&sample_fields(&plan.facts)));
    wgsl.push_str(more);
    wgsl.push_str("\nstruct Shaded {\n    value: vec4f,\n");
    for k in 0..chain.lines.len() {
        let _ = writeln!(wgsl, "    d{k}: vec4f,");
    }
    let _ = writeln!(wgsl, "}}\n\nfn {ENTRY}(at: Sample) -> Shaded {{");
    wgsl.push_str(&plan.calls(Stage::Fragment, uniform, |name| format!("at.{name}")));
    chain.lines.iter().for_each(|lines| wgsl.push_str(lines));
    let parts = parts(&plan.facts);
    let radiance = if parts.is_empty() { "vec3f()".to_owned() } else { parts.join(" + ") };
    let haze = if hazy(&plan.facts) { "haze" } else { "0.0" };
    let _ = write!(wgsl, "    return Shaded(vec4f({radiance}, {haze})");
    for k in 0..chain.lines.len() {
        let radiance = chain.radiance[k].as_deref().unwrap_or("vec3f()");
        let haze = chain.haze[k].as_deref().unwrap_or("0.0");
        let _ = write!(wgsl, ", vec4f({radiance}, {haze})");
    }
    wgsl.push_str(");\n}\n");
    wgsl
}

/// The value of a constant of the rules at `params`; `None` for one that no parameter gives.
#[must_use]
pub fn constant(input: &Input, params: &Params) -> Option<f64> {
    let key = || KeyLight::new(params, 0.0_f64);
    let value = match Constant::from_name(&input.name)? {
        Constant::Param(param) => params.rgb(param),
        Constant::Turn => {
            let (sin, cos) = params.scalar(Param::EnvironmentRotation).to_radians().sin_cos();
            [cos, sin, 0.0]
        }
        Constant::KeyDirection => key().direction,
        Constant::KeyByAzimuth => key().by_azimuth,
        Constant::KeyByElevation => key().by_elevation,
        Constant::Eye | Constant::ViewProjection | Constant::MorphWeights => return None,
    };
    Some(value.get(input.component).copied().unwrap_or(0.0))
}
