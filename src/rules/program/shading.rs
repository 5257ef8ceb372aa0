//! The value of a plan over stored samples, and how it moves along seeds, as a graph of numbers.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

pub use super::error::ShadingError;
use super::graph::{Binary, Graph, Id, Input, Node};
use super::levels::LevelProgram;
use super::lower::{Natives, Source, Value};
use crate::model::key_light::KeyLight;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::model::turn::turn;
use crate::shader::Domain;
use crate::shader::atlas::stored;
use crate::shader::emit::{Plan, sample_fields, shown, with_haze};
use crate::shader::module::{sample_struct, uniform};
use crate::shader::search::components;
use crate::shader::tangent::chain::{Chain, Seed};
use crate::shader::{Constant, Facts, plan};
use crate::specular::glossy_paces;

/// Radiance and haze of a sample, and how they move.
#[derive(Debug)]
pub struct Shading {
    /// All of it.
    pub graph: Graph,
    /// Radiance, and the haze.
    pub value: [Id; 4],
    /// How they move along each seed.
    pub tangents: Vec<[Id; 4]>,
    /// What samples hold and rules give on the way, by name.
    pub quantities: Quantities,
    /// How rules' quantities move along each seed; those that stay are not there.
    pub moved: Vec<Quantities>,
    /// What makes the levels that samples look up.
    pub levels: LevelProgram,
}

/// The numbers of quantities, by their names in the rules.
pub type Quantities = BTreeMap<&'static str, Vec<Id>>;

/// The radiance of each term, and the haze, in one graph.
#[derive(Debug)]
pub struct TermShading {
    /// All of it.
    pub graph: Graph,
    /// The enabled terms, in the order of the sum.
    pub terms: Vec<(TermName, [Id; 3])>,
    /// The haze.
    pub haze: Id,
    /// What makes the levels that samples look up.
    pub levels: LevelProgram,
}

/// How the names of directions end that cubes are looked up along.
const DIRECTION: &str = "_in_environment";
/// How the names of the radiance's parts end.
const PART: &str = "_part";

/// The entry point's name.
const ENTRY: &str = "skinfit_shaded";

impl Shading {
    /// Of what `facts` call for, along `seeds`. `stand_in` gives the number that stands in for a field that no sample
    /// holds.
    ///
    /// # Errors
    /// When no rules yield it, or one of them cannot be lowered or has no derivative.
    pub fn new(
        facts: &Facts,
        seeds: &[Seed],
        stand_in: impl Fn(&str) -> Option<f32>,
        natives: Natives,
    ) -> Result<Self, ShadingError> {
        let plan = plan(facts)?;
        let chain = Chain::new(&plan, seeds)?;
        let listed = Listed::new(&plan, &chain);
        let source = Source::new(&module(&plan, &chain, &listed), natives)?;
        let mut graph = Graph::default();
        let (sample, fields) = sample(&mut graph, &plan, &chain, stand_in);
        let shaded = source.call(&mut graph, ENTRY, vec![Value::Numbers(sample)])?;
        let mut numbers = shaded.into_iter();
        let mut take = |count: usize| -> Vec<Id> { numbers.by_ref().take(count).collect() };
        let mut four = || {
            let four = take(4);
            [four[0], four[1], four[2], four[3]]
        };
        let value = four();
        let tangents = seeds.iter().map(|_| four()).collect();
        let mut named = |list: &[(&'static str, &'static str)]| -> Quantities {
            list.iter().map(|&(name, kind)| (name, take(components(kind)))).collect()
        };
        let mut quantities = named(&listed.given);
        let moved = listed.moved.iter().map(|list| named(list)).collect();
        quantities.extend(fields);
        let levels = LevelProgram::new(&plan, &chain)?;
        Ok(Self { graph, value, tangents, quantities, moved, levels })
    }

    /// Numbers on the way from directions to texels: what lookups are addressed with, back to the quantities that are
    /// directions in the environment, these left out.
    #[must_use]
    pub fn addresses(&self) -> BTreeSet<Id> {
        let graph = &self.graph;
        let directions: BTreeSet<Id> = self
            .quantities
            .iter()
            .filter(|(name, _)| name.ends_with(DIRECTION))
            .flat_map(|(_, numbers)| numbers.iter().copied())
            .collect();
        let lookups = graph.ids().filter(|&id| graph.looked_up(id).is_some());
        let mut open: Vec<Id> = lookups.flat_map(|id| graph.operands(id)).collect();
        let mut addresses = BTreeSet::new();
        while let Some(id) = open.pop() {
            if !directions.contains(&id) && addresses.insert(id) {
                open.extend(graph.operands(id));
            }
        }
        addresses
    }

    /// The sums of the radiance's parts: nodes that only add up two others, from the value downwards.
    #[must_use]
    pub fn sums(&self) -> BTreeSet<Id> {
        let mut parts: BTreeSet<Id> = BTreeSet::new();
        let given = self.quantities.iter().filter(|(name, _)| name.ends_with(PART));
        parts.extend(given.flat_map(|(_, numbers)| numbers.iter().copied()));
        let mut open = self.value[..3].to_vec();
        let mut sums = BTreeSet::new();
        while let Some(id) = open.pop() {
            if let Node::Binary(Binary::Add, a, b) = self.graph.node(id)
                && !parts.contains(&id)
                && sums.insert(id)
            {
                open.extend([a, b]);
            }
        }
        sums
    }
}

impl TermShading {
    /// Of the terms that `facts` call for.
    ///
    /// # Errors
    /// As [`Shading::new`].
    pub fn new(facts: &Facts) -> Result<Self, ShadingError> {
        let (mut graph, mut levels, still) = (Graph::default(), LevelProgram::default(), Chain::default());
        let mut shaded = |output: Option<TermName>| -> Result<Vec<Id>, ShadingError> {
            let facts = Facts { output, ..*facts };
            let plan = plan(&facts)?;
            let source = Source::new(&module(&plan, &still, &Listed::default()), Natives::Written)?;
            let (sample, _) = sample(&mut graph, &plan, &still, |_| None);
            levels.extend(LevelProgram::new(&plan, &still)?);
            Ok(source.call(&mut graph, ENTRY, vec![Value::Numbers(sample)])?)
        };
        let haze = shaded(None)?[3];
        let mut terms = Vec::new();
        for term in TermName::of(facts.setup.effects) {
            let value = shaded(Some(term))?;
            terms.push((term, [value[0], value[1], value[2]]));
        }
        Ok(Self { graph, terms, haze, levels })
    }
}

/// The numbers of a stored sample, and the fields that they are.
fn sample(
    graph: &mut Graph,
    plan: &Plan,
    chain: &Chain,
    stand_in: impl Fn(&str) -> Option<f32>,
) -> (Vec<Id>, Quantities) {
    let (mut sample, mut fields) = (Vec::new(), Quantities::new());
    for (name, kind) in sample_fields(&plan.facts) {
        let number = |component| match stand_in(name) {
            Some(value) => graph.constant(value.into()),
            None => graph.field(name, component),
        };
        let numbers: Vec<Id> = (0..components(kind)).map(number).collect();
        sample.extend(&numbers);
        fields.insert(name, numbers);
    }
    for (name, kind) in plan.looked_up(chain) {
        sample.extend((0..components(kind)).map(|component| graph.field(&name, component)));
    }
    if sample.is_empty() {
        // WGSL knows no empty structures.
        sample.push(graph.constant(0.0));
    }
    (sample, fields)
}

/// Quantities that an entry point returns beside the value and its tangents, with their WGSL types.
#[derive(Default)]
struct Listed {
    given: Vec<(&'static str, &'static str)>,
    /// For each seed.
    moved: Vec<Vec<(&'static str, &'static str)>>,
}

impl Listed {
    fn new(plan: &Plan, chain: &Chain) -> Self {
        let mut given = Vec::new();
        for rule in plan.steps.iter().map(|step| step.rule).filter(|rule| rule.domain == Domain::Fragment) {
            for &(quantity, swizzle) in &rule.gives {
                let kind = if swizzle.is_empty() { rule.returns } else { VECTORS[swizzle.len() - 1] };
                given.push((quantity, kind));
            }
        }
        let moved = chain.moved.iter().map(|moved| {
            given.iter().copied().filter(|(quantity, _)| moved.contains_key(quantity)).collect()
        });
        Self { moved: moved.collect(), given }
    }
}

/// WGSL types of one to four numbers.
const VECTORS: [&str; 4] = ["f32", "vec2f", "vec3f", "vec4f"];

/// The rules, their tangents, and an entry point that returns the value, each seed's tangent, and what is listed.
fn module(plan: &Plan, chain: &Chain, listed: &Listed) -> String {
    let mut with_slopes = plan.clone();
    with_slopes.resources.extend(&chain.resources);
    with_slopes.constants.extend(&chain.constants);
    let mut wgsl = with_slopes.declarations(true);
    wgsl.push_str(&chain.functions);
    wgsl.push_str(&sample_struct(&plan.sample_inputs(chain)));
    // A member's name, its type, and what it is.
    let mut members = vec![("value".to_owned(), "vec4f", shown(&plan.facts))];
    for k in 0..chain.lines.len() {
        let moved = with_haze(chain.radiance[k].as_deref(), chain.haze[k].as_deref());
        members.push((format!("d{k}"), "vec4f", moved));
    }
    members.extend(listed.given.iter().map(|&(name, kind)| (format!("of_{name}"), kind, name.to_owned())));
    for (k, moved) in listed.moved.iter().enumerate() {
        let member = |&(name, kind): &(&str, &'static str)| {
            (format!("d{k}_of_{name}"), kind, chain.moved[k].get(name).cloned().unwrap_or_default())
        };
        members.extend(moved.iter().map(member));
    }
    wgsl.push_str("\nstruct Shaded {\n");
    for (name, kind, _) in &members {
        let _ = writeln!(wgsl, "    {name}: {kind},");
    }
    let _ = writeln!(wgsl, "}}\n\nfn {ENTRY}(at: Sample) -> Shaded {{");
    wgsl.push_str(&stored(&plan.levels));
    wgsl.push_str(&plan.calls(Domain::Fragment, uniform, |name| format!("at.{name}")));
    wgsl.push_str(&chain.shared);
    chain.lines.iter().for_each(|lines| wgsl.push_str(lines));
    let values: Vec<&str> = members.iter().map(|(_, _, value)| value.as_str()).collect();
    let _ = write!(wgsl, "    return Shaded({});\n}}\n", values.join(", "));
    wgsl
}

/// The value of a constant of the rules at `params`; `None` for one that no parameter gives.
#[must_use]
pub fn constant(input: &Input, params: &Params) -> Option<f64> {
    component(Constant::from_name(&input.name)?, input.component, params)
}

/// A component of a constant of the rules at `params`; `None` for one that no parameter gives.
#[must_use]
pub fn component(constant: Constant, component: usize, params: &Params) -> Option<f64> {
    Some(numbers(constant, params)?.get(component).copied().unwrap_or(0.0))
}

/// The numbers of a constant of the rules at `params`, 0 beyond those that it has; `None` for one that no parameter
/// gives, but a camera or a mesh.
#[must_use]
pub fn numbers(constant: Constant, params: &Params) -> Option<[f64; 3]> {
    let key = || KeyLight::new(params);
    Some(match constant {
        Constant::Param(param) => params.rgb(param),
        Constant::Turn => {
            let [cos, sin] = turn(params);
            [cos, sin, 0.0]
        }
        Constant::KeyDirection => key().direction,
        Constant::KeyByAzimuth => key().by_azimuth,
        Constant::KeyByElevation => key().by_elevation,
        Constant::GlossyPaces => {
            let [roughness, gloss] = glossy_paces(params);
            [roughness, gloss, 0.0]
        }
        Constant::Eye | Constant::ViewProjection | Constant::MorphWeights => return None,
    })
}
