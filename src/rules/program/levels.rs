//! Passes over stored texels, as operations on numbers: what draws leave, and the taps of blurs.

use super::error::ShadingError;
use super::graph::{Graph, Id, Input, Node};
pub use super::level_then::{BlurOf, GaussianColumn, GaussianOf, SurfaceOf, Then};
use super::lower::{LowerError, Natives, STEP_ALONG_U, STEP_ALONG_V, Source, Value};
use super::steps::{Rounding, Steps};
use crate::model::diffusion::Lookup;
use crate::model::terms::TermName;
use crate::shader::atlas::named::{Named, groups};
use crate::shader::atlas::{APART, Axis, Level, Pass, PassKind, TAPS, TEXEL};
use crate::shader::emit::Plan;
use crate::shader::rule::Kernel;
use crate::shader::search::components;
use crate::shader::tangent::chain::Chain;
use crate::shader::{Facts, plan};

/// The passes that leave what samples look up, and how that moves.
#[derive(Clone, Debug, Default)]
pub struct LevelProgram {
    /// In their order.
    pub passes: Vec<LevelPass>,
    /// The levels that samples look up, each with how many numbers it has; what was found is a field of that name.
    pub looked_up: Vec<(String, usize)>,
    /// Whether some of them move along a seed.
    pub moves: bool,
    /// Whether samples look them up by one fetch, whatever the chart, empty texels being filled.
    pub dilated: bool,
}

/// One pass.
#[derive(Clone, Debug)]
pub struct LevelPass {
    /// What it computes of each texel.
    pub steps: Steps,
    /// What it leaves, each with how many numbers it has.
    pub leaves: Vec<(String, usize)>,
    /// What is done with what the steps yield.
    pub then: Then,
    /// Whether what it leaves moves along a seed.
    pub moves: bool,
}

impl LevelProgram {
    /// Of a plan over stored samples, along a chain's seeds; empty where nothing is computed in texels.
    ///
    /// # Errors
    /// When a pass cannot be computed on the processor.
    pub fn new(plan: &Plan, chain: &Chain) -> Result<Self, LowerError> {
        let dilated = plan.facts.setup.choices.diffusion.lookup == Lookup::Dilated;
        let mut program = Self { dilated, ..Self::default() };
        for passes in groups(plan, chain) {
            program.add(&passes)?;
        }
        let found = plan.looked_up(chain).into_iter();
        program.moves = chain.along.iter().any(|along| !along.passes.is_empty());
        program.looked_up = found.map(|(name, kind)| (name, components(kind))).collect();
        Ok(program)
    }

    /// Add a pass with those that leave how its leaves move.
    fn add(&mut self, passes: &[Named<'_>]) -> Result<(), LowerError> {
        let first = self.passes.len();
        self.add_each(passes)?;
        for at in first..self.passes.len() {
            self.passes[at].moves = passes.len() > 1 && !self.stays(at);
        }
        Ok(())
    }

    /// Whether a level of the passes so far moves.
    fn moves(&self, name: &str) -> bool {
        self.passes.iter().any(|pass| pass.moves && pass.leaves.iter().any(|(leaf, _)| leaf == name))
    }

    /// Whether a draw leaves the same whatever is free.
    fn stays(&self, at: usize) -> bool {
        let pass = &self.passes[at];
        matches!(pass.then, Then::Leave)
            && pass.steps.inputs().is_empty()
            && pass.steps.resources().is_empty()
            && !pass.steps.fields().iter().any(|field| self.moves(&field.name))
    }

    fn add_each(&mut self, passes: &[Named<'_>]) -> Result<(), LowerError> {
        let alone = |pass: &Named<'_>, then| LevelPass::new(std::slice::from_ref(pass), then);
        let together = match passes[0].pass.kind {
            PassKind::Draw => Some(Then::Leave),
            PassKind::Blur(axis) if kernel(passes[0].pass) == Kernel::Gaussian => {
                Some(Then::Gaussian(gaussian(axis, passes)))
            }
            PassKind::Blur(_) | PassKind::Surface | PassKind::Neighbours | PassKind::Dilate => None,
        };
        if let Some(then) = together {
            let added = LevelPass::together(passes, &then, &|name| self.moves(name))?;
            self.passes.extend(added);
            return Ok(());
        }
        for pass in passes {
            let read = |i: usize| pass.name(&pass.pass.plan.levels[i].name);
            let source = || read(0);
            let moving = pass.pass.moving.as_ref();
            let moving = moving.map(|kernel| kernel.blurred.as_ref().map(|moved| pass.name(&moved.name)));
            let then = match pass.pass.kind {
                // Where texels lie stands behind what is summed up.
                PassKind::Surface => {
                    Then::Surface(SurfaceOf { source: source(), texels: [1, 2, 3].map(read), moving })
                }
                PassKind::Blur(axis) => {
                    let reach = match kernel(pass.pass) {
                        Kernel::Taps(taps) => taps as usize / 2,
                        _ => 0,
                    };
                    Then::Blur(BlurOf { axis, reach, source: source(), moving })
                }
                PassKind::Neighbours => Then::Neighbours(source()),
                // The processor fills empty texels itself: no plan over samples has a pass that does.
                PassKind::Draw | PassKind::Dilate => Then::Leave,
            };
            self.passes.push(alone(pass, then)?);
        }
        Ok(())
    }

    /// Whether nothing is computed in texels.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.passes.is_empty()
    }

    /// Take over the passes and lookups of another program of the same rules that this one lacks.
    pub fn extend(&mut self, other: Self) {
        // A pass of which something is lacking is taken whole: to leave a level twice does no harm.
        let left = |passes: &[LevelPass], pass: &LevelPass| {
            pass.leaves.iter().all(|leaf| passes.iter().any(|known| known.leaves.contains(leaf)))
        };
        self.moves |= other.moves;
        self.dilated |= other.dilated;
        for pass in other.passes {
            if !left(&self.passes, &pass) {
                self.passes.push(pass);
            }
        }
        for found in other.looked_up {
            if !self.looked_up.contains(&found) {
                self.looked_up.push(found);
            }
        }
    }

    /// What is read of a stored texel, levels left out.
    #[must_use]
    pub fn fields(&self) -> Vec<Input> {
        let left = |name: &str| self.passes.iter().any(|pass| pass.leaves.iter().any(|leaf| leaf.0 == name));
        let made = |pass: &LevelPass, name: &str| {
            matches!(pass.then, Then::Neighbours(_)) && name == APART_FIELD || left(name)
        };
        let mut fields: Vec<Input> = Vec::new();
        for (pass, input) in
            self.passes.iter().flat_map(|pass| pass.steps.fields().iter().map(move |i| (pass, i)))
        {
            if !made(pass, &input.name) && !fields.contains(input) {
                fields.push(input.clone());
            }
        }
        fields
    }
}

/// What a texel's neighbours are apart, of a pass over them.
pub const APART_FIELD: &str = "apart";

/// A level of a pass in the program, with how many numbers it has.
fn level_of(named: &Named<'_>, level: &Level) -> (String, usize) {
    (named.name(&level.name), components(level.kind))
}

/// The kernel of a blur's pass.
fn kernel(pass: &Pass) -> Kernel {
    pass.plan.steps[0].rule.blur.as_ref().map_or(Kernel::Taps(1), |blur| blur.kernel)
}

/// What the passes of one direction of a Gaussian are of: the level's, and those of how it moves.
fn gaussian(axis: Axis, passes: &[Named<'_>]) -> GaussianOf {
    let mut movers = 0;
    let column = |pass: &Named<'_>| match &pass.pass.moving {
        None => GaussianColumn { source: Some(level_of(pass, &pass.pass.plan.levels[0]).0), moved: None },
        Some(kernel) => {
            movers += 1;
            let source = kernel.blurred.as_ref().map(|moved| level_of(pass, moved).0);
            GaussianColumn { source, moved: Some(movers - 1) }
        }
    };
    let taps = passes[0].pass.plan.facts.setup.choices.diffusion.taps.count();
    GaussianOf {
        axis,
        reach: taps.map(|taps| taps as usize / 2),
        columns: passes.iter().map(column).collect(),
    }
}

impl LevelPass {
    /// Of passes whose steps are made together: what they have in common is computed once. Of a draw what no parameter reaches
    /// is a pass of its own, which runs once: the others' texels lie closer together without it.
    fn together(
        passes: &[Named<'_>],
        then: &Then,
        moves: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Self>, LowerError> {
        let (graph, whole) = Yielded::of(passes, then)?;
        let of = |part: Yielded| {
            let (graph, outputs) = graph.rebuilt(&part.outputs, |_| None);
            part.pass(&graph, &outputs, then.clone())
        };
        if !matches!(then, Then::Leave) {
            return Ok(vec![of(whole)]);
        }
        let shared = |graph: &Graph, id: Id| match graph.node(id) {
            Node::Uniform(_) => true,
            Node::Field(at) => moves(&graph.fields[at as usize].name),
            _ => graph.looked_up(id).is_some(),
        };
        let of_parameters = graph.made_of(shared);
        let mut parts = [Yielded::default(), Yielded::default()];
        let mut next = whole.outputs.into_iter();
        for leaf in whole.leaves {
            let numbers: Vec<Id> = next.by_ref().take(leaf.1).collect();
            let part = &mut parts[usize::from(numbers.iter().any(|id| of_parameters[id.index()]))];
            part.outputs.extend(numbers);
            part.leaves.push(leaf);
        }
        Ok(parts.into_iter().filter(|part| !part.leaves.is_empty()).map(of).collect())
    }

    /// Of passes that leave what they leave one after another.
    fn new(passes: &[Named<'_>], then: Then) -> Result<Self, LowerError> {
        let (graph, whole) = Yielded::of(passes, &then)?;
        let outputs = whole.outputs.clone();
        Ok(whole.pass(&graph, &outputs, then))
    }

    /// The levels that it reads, and what it reads of a texel, by name.
    pub fn reads(&self) -> impl Iterator<Item = &str> {
        let fields = self.steps.fields().iter().map(|field| field.name.as_str());
        let mut sources: Vec<&str> = Vec::new();
        match &self.then {
            Then::Leave => {}
            Then::Neighbours(source) => sources.push(source),
            Then::Blur(BlurOf { source, moving, .. }) => {
                sources.push(source);
                sources.extend(moving.iter().flatten().map(String::as_str));
            }
            Then::Surface(SurfaceOf { source, texels, moving }) => {
                sources.push(source);
                sources.extend(texels.iter().chain(moving.iter().flatten()).map(String::as_str));
            }
            Then::Gaussian(of) => {
                sources.extend(of.columns.iter().filter_map(|column| column.source.as_deref()));
            }
        }
        fields.chain(sources)
    }
}

/// What passes yield.
#[derive(Default)]
struct Yielded {
    outputs: Vec<Id>,
    /// What they are of, each with how many of them.
    leaves: Vec<(String, usize)>,
}

impl Yielded {
    /// Of passes, and the graph that they are of.
    fn of(passes: &[Named<'_>], then: &Then) -> Result<(Graph, Self), LowerError> {
        let mut graph = Graph::default();
        let mut outputs: Vec<Id> = Vec::new();
        let mut deviation = false;
        for pass in passes {
            let moves = pass.pass.moving.is_some();
            let numbers = lowered(pass, &mut graph)?;
            match then {
                // The deviation once, and then how it moves.
                Then::Gaussian(_) => {
                    let own = usize::from(deviation);
                    outputs.extend(&numbers[own..if moves { 2 } else { 1 }]);
                    deviation = true;
                }
                _ => outputs.extend(numbers),
            }
        }
        let leaves = passes.iter().flat_map(|pass| pass.pass.leaves.iter().map(|leaf| level_of(pass, leaf)));
        Ok((graph, Self { outputs, leaves: leaves.collect() }))
    }

    /// A pass that leaves this; its outputs in a graph.
    fn pass(self, graph: &Graph, outputs: &[Id], then: Then) -> LevelPass {
        let steps = Steps::new(graph, outputs, |_| Rounding::Plain);
        LevelPass { steps, leaves: self.leaves, then, moves: false }
    }
}

/// The pass' function in a graph, and what it yields.
fn lowered(named: &Named<'_>, graph: &mut Graph) -> Result<Vec<Id>, LowerError> {
    let pass = named.pass;
    let entry = match pass.kind {
        PassKind::Draw => TEXEL,
        PassKind::Blur(_) | PassKind::Surface => TAPS,
        PassKind::Neighbours | PassKind::Dilate => APART,
    };
    let source = Source::new(&pass.plan.wgsl, Natives::Written)?;
    let sample = source.argument(entry)?;
    let mut numbers: Vec<Id> = Vec::new();
    for (name, width) in sample {
        let held = pass.plan.varyings.iter().any(|(held, _)| *held == name);
        let is_level = pass.plan.levels.iter().any(|level| level.name == name)
            || (pass.kind == PassKind::Neighbours && name == APART_FIELD);
        let name = if is_level { named.name(&name) } else { name };
        // What is neither fills a structure that would be empty.
        let number = |component| match held || is_level {
            true => graph.field(&name, component),
            false => graph.constant(0.0),
        };
        numbers.extend((0..width).map(number));
    }
    let outputs = source.call(graph, entry, vec![Value::Numbers(numbers)])?;
    check_steps(pass, graph)?;
    Ok(outputs)
}

/// Refuse `dpdx` and `dpdy` of what no vertex holds: how that goes from texel to texel is not known.
fn check_steps(pass: &Pass, graph: &Graph) -> Result<(), LowerError> {
    let steps = |name: &str| {
        let of = name.strip_prefix(STEP_ALONG_U).or_else(|| name.strip_prefix(STEP_ALONG_V));
        of.filter(|of| !of.starts_with("vertex_")).map(str::to_owned)
    };
    match graph.fields.iter().find_map(|field| steps(&field.name)) {
        Some(name) => Err(LowerError::Unsupported {
            function: pass.plan.steps.first().map_or("", |step| step.rule.function).to_owned(),
            what: format!("dpdx or dpdy of {name}, which is no vertex' quantity,"),
        }),
        None => Ok(()),
    }
}

/// What stored texels have to hold for all that `facts` call for, the whole and each of its terms.
///
/// # Errors
/// When no rules yield it, or the processor cannot compute one of them.
pub fn texel_inputs(facts: &Facts) -> Result<Vec<Input>, ShadingError> {
    let mut program = LevelProgram::default();
    let terms = TermName::of(facts.setup.effects).into_iter().map(Some);
    for output in std::iter::once(None).chain(terms) {
        let plan = plan(&Facts { output, ..*facts })?;
        program.extend(LevelProgram::new(&plan, &Chain::default())?);
    }
    Ok(program.fields())
}
