//! Passes over stored texels, as operations on numbers: what draws leave, and the taps of blurs.

use super::error::ShadingError;
use super::graph::{Graph, Id, Input};
use super::lower::{LowerError, Natives, STEP_ALONG_U, STEP_ALONG_V, Source, Value};
use super::steps::{Rounding, Steps};
use crate::model::terms::TermName;
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
}

/// One pass.
#[derive(Clone, Debug)]
pub struct LevelPass {
    /// What it computes of each texel.
    pub steps: Steps,
    /// What it leaves, each with how many numbers it has.
    pub leaves: Vec<(String, usize)>,
    /// Of a blur what is done with the taps that the steps yield.
    pub blur: Option<BlurOf>,
    /// Of a pass over neighbours, the level whose steps from one to the other are the steps' field [`APART_FIELD`].
    pub neighbours: Option<String>,
}

/// One direction of a blur.
#[derive(Clone, Debug)]
pub struct BlurOf {
    /// Along which axis.
    pub axis: Axis,
    /// Which texels count.
    pub kernel: Taps,
    /// The level that is blurred.
    pub source: String,
    /// Where the kernel moves: the level that holds how the source moves, if it does.
    pub moving: Option<Option<String>>,
}

/// Which texels a blur counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taps {
    /// Those of taps that the steps yield, so many to either side: where each lies, and what it weighs.
    Given(usize),
    /// Taps a standard deviation apart, so many to either side; the steps yield the deviation, in texels.
    Gaussian(usize),
    /// Every texel within six deviations.
    WholeGaussian,
}

impl LevelProgram {
    /// Of a plan over stored samples, along a chain's seeds; empty where nothing is computed in texels.
    ///
    /// # Errors
    /// When a pass cannot be computed on the processor.
    pub fn new(plan: &Plan, chain: &Chain) -> Result<Self, LowerError> {
        let mut program = Self::default();
        let mut add = |pass: &Pass, rename: &dyn Fn(&str) -> String| -> Result<(), LowerError> {
            program.passes.push(LevelPass::new(pass, rename)?);
            Ok(())
        };
        plan.passes.iter().try_for_each(|pass| add(pass, &str::to_owned))?;
        for (k, along) in chain.along.iter().enumerate() {
            // Each seed has tangents of its own; what does not move is the plan's.
            let moved = |name: &str| along.moved.values().any(|level| level.name == name);
            let rename = |name: &str| if moved(name) { tangent_of(k, name) } else { name.to_owned() };
            along.passes.iter().try_for_each(|pass| add(pass, &rename))?;
        }
        let found = plan.looked_up(chain).into_iter();
        program.looked_up = found.map(|(name, kind)| (name, components(kind))).collect();
        Ok(program)
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
        let mut fields: Vec<Input> = Vec::new();
        for input in self.passes.iter().flat_map(|pass| pass.steps.fields()) {
            if !left(&input.name) && !fields.contains(input) {
                fields.push(input.clone());
            }
        }
        fields
    }
}

/// Along the `k`-th seed: a level that holds how another moves.
fn tangent_of(k: usize, name: &str) -> String {
    format!("d{k}{}", name.strip_prefix('d').unwrap_or(name))
}

impl LevelPass {
    fn new(pass: &Pass, rename: &dyn Fn(&str) -> String) -> Result<Self, LowerError> {
        let (entry, blur) = match pass.kind {
            PassKind::Draw => (TEXEL, None),
            PassKind::Blur(axis) => (TAPS, Some(axis)),
            PassKind::Neighbours => (APART, None),
        };
        let source = Source::new(&pass.plan.wgsl, Natives::Written)?;
        let mut graph = Graph::default();
        let sample = source.argument(entry)?;
        let mut numbers: Vec<Id> = Vec::new();
        for (name, width) in sample {
            let held = pass.plan.varyings.iter().any(|(held, _)| *held == name);
            let is_level = pass.plan.levels.iter().any(|level| level.name == name)
                || (pass.kind == PassKind::Neighbours && name == APART_FIELD);
            let name = if is_level { rename(&name) } else { name };
            // What is neither fills a structure that would be empty.
            let number = |component| match held || is_level {
                true => graph.field(&name, component),
                false => graph.constant(0.0),
            };
            numbers.extend((0..width).map(number));
        }
        let outputs = source.call(&mut graph, entry, vec![Value::Numbers(numbers)])?;
        check_steps(pass, &graph)?;
        let level = |level: &Level| (rename(&level.name), components(level.kind));
        let blur = blur.map(|axis| BlurOf {
            axis,
            kernel: counted(pass),
            source: level(&pass.plan.levels[0]).0,
            moving: pass.moving.as_ref().map(|kernel| kernel.blurred.as_ref().map(|moved| level(moved).0)),
        });
        Ok(Self {
            steps: Steps::new(&graph, &outputs, |_| Rounding::Plain),
            leaves: pass.leaves.iter().map(level).collect(),
            blur,
            neighbours: (pass.kind == PassKind::Neighbours).then(|| level(&pass.plan.levels[0]).0),
        })
    }
}

/// What a texel's neighbours are apart, of a pass over them.
pub const APART_FIELD: &str = "apart";

/// Which texels the blur of a pass counts.
fn counted(pass: &Pass) -> Taps {
    let kernel = pass.plan.steps[0].rule.blur.as_ref().map_or(Kernel::Taps(1), |blur| blur.kernel);
    let count = pass.plan.facts.setup.choices.diffusion.taps.count();
    match (kernel, count) {
        (Kernel::Taps(taps), _) => Taps::Given(taps as usize / 2),
        (_, Some(taps)) => Taps::Gaussian(taps as usize / 2),
        (_, None) => Taps::WholeGaussian,
    }
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
