//! What a pass computes, as tapes: worked out once from the effects and the unknowns.

use std::collections::BTreeMap;

use super::ahead;
use super::fitted::Fitted;
use super::program::Program;
use super::streams::{NEUTRALS, StreamOf};
use crate::bake::stacks::Stack;
use crate::engine::Unknown;
use crate::engine::levels::LevelMaker;
use crate::model::params::{Channels, Param, Params};
use crate::program::cut::{KEPT, cut};
use crate::program::families::{Family, families};
use crate::program::graph::{Graph, Id, Input, Node};
use crate::program::levels::LevelProgram;
use crate::program::lower::Natives;
use crate::program::shading::{Shading, ShadingError, component};
use crate::program::tape::Tape;
use crate::samples::surface_records::{Places, neutral};
use crate::shader::Constant;
use crate::shader::facts::Facts;
use crate::shader::tangent::chain::Seed;
use crate::simd::Level;

/// A tape, and where it reads each of its fields.
#[derive(Debug)]
pub(super) struct Reading {
    pub(super) program: Program,
    /// For each field, its stream and its row there.
    pub(super) loads: Vec<(StreamOf, usize)>,
    /// For each input that all samples share, the rules' constant and its component.
    constants: Vec<(Option<Constant>, usize)>,
}

/// The columns of one channel.
#[derive(Clone, Debug, Default)]
pub(super) struct ChannelColumns {
    /// For each column its unknown; `None` for the view's gain of this channel.
    pub(super) unknowns: Vec<Option<usize>>,
    /// For each column the output that it is a multiple of: how the channel's value moves, or (of the gain) the value.
    pub(super) tangents: Vec<usize>,
}

/// All tapes of a fit.
#[derive(Debug)]
pub(super) struct Pass {
    /// Makes the kept numbers.
    pub(super) keep: Reading,
    /// Kept numbers a sample.
    pub(super) kept: usize,
    /// The stacks of cubes that these are looked up in.
    pub(super) kept_of: Vec<Stack>,
    /// Yields the channels' values.
    pub(super) value: Reading,
    /// Yields the channels' values, then how they move.
    pub(super) moved: Reading,
    pub(super) channels: Vec<ChannelColumns>,
    /// The outputs of `moved` that are read.
    pub(super) read: Vec<usize>,
    /// Makes what samples look up of the UV atlas.
    pub(super) levels: LevelMaker<f32>,
}

/// The tapes of a plan, before it is known who reads what of them.
pub(super) struct Tapes {
    pub(super) keep: Tape,
    pub(super) value: Tape,
    pub(super) moved: Tape,
    /// For each seed and channel the output of `moved`; `None` where the channel never moves.
    columns: Vec<Vec<Option<usize>>>,
    levels: LevelProgram,
}

impl Tapes {
    /// Of a plan that is compiled ahead, with all fields. Where its functions are not compiled the machine runs it, which
    /// prefers the order of outputs.
    fn of(plan: &ahead::Plan, facts: &Facts) -> Result<Self, ShadingError> {
        if ahead::compiled_for(Level::new()) {
            return Self::printed(plan, facts);
        }
        Self::in_order_of_outputs(plan, facts)
    }

    /// As the machine prefers them.
    pub(super) fn in_order_of_outputs(plan: &ahead::Plan, facts: &Facts) -> Result<Self, ShadingError> {
        Self::new(facts, &plan.free(), plan.channels(), |_| true, plan.keeps())
    }

    /// As they are printed: in an order in which the compiler finds registers for most numbers.
    pub(super) fn printed(plan: &ahead::Plan, facts: &Facts) -> Result<Self, ShadingError> {
        let held = |_: &str| true;
        Self::made(facts, &plan.free(), plan.channels(), held, plan.keeps(), Tape::with_few_registers)
    }

    /// Of the plan that `facts` call for, along `free`, for its first `channels` channels; `held` says which fields
    /// samples hold.
    pub(super) fn new(
        facts: &Facts,
        free: &[Param],
        channels: usize,
        held: impl Fn(&str) -> bool,
        keep: bool,
    ) -> Result<Self, ShadingError> {
        Self::made(facts, free, channels, held, keep, |graph, outputs, _| Tape::new(graph, outputs))
    }

    fn made(
        facts: &Facts,
        free: &[Param],
        channels: usize,
        held: impl Fn(&str) -> bool,
        keep: bool,
        tape: fn(&Graph, &[Id], &[Family]) -> Tape,
    ) -> Result<Self, ShadingError> {
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let stand_in = |field: &str| if held(field) { None } else { neutral(field) };
        let shading = Shading::new(facts, &seeds, stand_in, Natives::Called)?;
        let outputs: Vec<Id> = std::iter::once(&shading.value)
            .chain(&shading.tangents)
            .flat_map(|numbers| numbers[..channels].to_vec())
            .collect();
        let names = live_names(&seeds);
        // They are kept where they stand.
        let looked_up = |name: &str| shading.levels.looked_up.iter().any(|(found, _)| found == name);
        let moves = |graph: &Graph, id: Id| {
            !keep
                || match graph.node(id) {
                    Node::Uniform(at) => names.contains(&graph.uniforms[at as usize].name),
                    Node::Field(at) => looked_up(&graph.fields[at as usize].name),
                    _ => graph.looked_up(id).is_some_and(|name| names.iter().any(|known| known == name)),
                }
        };
        let (graph, outputs) = shading.graph.factored(&outputs, moves);
        let cut = cut(&graph, &outputs, moves);
        let mut moved = cut.outputs[..channels].to_vec();
        let mut columns = Vec::new();
        for tangent in cut.outputs[channels..].chunks(channels) {
            let mut column = |&id: &Id| {
                let stays = cut.graph.value(id) == Some(0.0);
                (!stays).then(|| {
                    moved.push(id);
                    moved.len() - 1
                })
            };
            columns.push(tangent.iter().map(&mut column).collect());
        }
        let of_all = families(&graph, &[]);
        let kept: Vec<Family> = cut.kept.iter().map(|&id| of_all[id.index()]).collect();
        Ok(Self {
            keep: tape(&graph, &cut.kept, &[]),
            value: tape(&cut.graph, &moved[..channels], &kept),
            moved: tape(&cut.graph, &moved, &kept),
            columns,
            levels: shading.levels,
        })
    }
}

impl Pass {
    /// The tapes of a fit whose environment is `turned`, or will be: those of a plan that is compiled ahead where there
    /// is one that yields all outputs of the fit.
    pub(super) fn new(fitted: &Fitted, turned: bool) -> Result<Self, ShadingError> {
        let free = fitted.free();
        let held = |field: &str| fitted.places.fields().any(|(name, ..)| name == field);
        let ahead = ahead::plan_for(fitted, &free, turned);
        let tapes = match ahead.and_then(|plan| Some((plan, plan.facts()?))) {
            // It reads every field; what samples lack stands in a stream of its own.
            Some((plan, facts)) => Tapes::of(plan, &facts)?,
            None => Tapes::new(
                &Facts::of_samples(fitted.setup, fitted.faces, turned),
                &free,
                fitted.channels,
                held,
                fitted.keep,
            )?,
        };
        let seeds = ahead.map_or(free, ahead::Plan::free);
        let channels: Vec<ChannelColumns> =
            (0..fitted.channels).map(|c| ChannelColumns::new(fitted, &seeds, &tapes, c)).collect();
        let mut read: Vec<usize> = (0..fitted.channels).collect();
        read.extend(channels.iter().flat_map(|channel| &channel.tangents));
        read.sort_unstable();
        read.dedup();
        let levels = LevelMaker::new(tapes.levels);
        let reading = |tape| Reading::new(&fitted.places, &levels, tape, ahead.is_some());
        Ok(Self {
            kept: tapes.keep.outputs.len(),
            kept_of: Stack::read(&tapes.keep.looked_up()),
            keep: reading(tapes.keep),
            value: reading(tapes.value),
            moved: reading(tapes.moved),
            channels,
            read,
            levels,
        })
    }
}

impl ChannelColumns {
    fn new(fitted: &Fitted, seeds: &[Param], tapes: &Tapes, c: usize) -> Self {
        let mut channel = Self::default();
        for (index, unknown) in fitted.unknowns.iter().enumerate() {
            let Unknown::Param(column) = unknown else { continue };
            let other = matches!(column.channels, Channels::One(own) if c < 3 && own != c);
            let seed = seeds.iter().position(|&param| param == column.param).filter(|_| !other);
            if let Some(tangent) = seed.and_then(|seed| tapes.columns[seed][c]) {
                channel.unknowns.push(Some(index));
                channel.tangents.push(tangent);
            }
        }
        if fitted.gains() {
            channel.unknowns.push(None);
            channel.tangents.push(c);
        }
        channel
    }
}

impl Reading {
    fn new(places: &Places, levels: &LevelMaker<f32>, tape: Tape, ahead: bool) -> Self {
        let held: BTreeMap<&str, usize> = places.fields().map(|(name, place, _)| (name, place)).collect();
        let load = |input: &Input| match (input.name.as_str(), held.get(input.name.as_str())) {
            (KEPT, _) => (StreamOf::Kept, input.component),
            (_, Some(place)) => (StreamOf::Samples, place + input.component),
            (field, None) => {
                if let Some(row) = levels.row(input) {
                    return (StreamOf::Levels, row);
                }
                let value = neutral(field).unwrap_or(0.0);
                (StreamOf::Neutral, NEUTRALS.iter().position(|&x| x == value).unwrap_or(0))
            }
        };
        let loads = tape.fields.iter().map(load).collect();
        let constant = |input: &Input| (Constant::from_name(&input.name), input.component);
        let constants = tape.inputs().iter().map(constant).collect();
        Self { program: Program::new(tape, ahead), loads, constants }
    }

    /// The numbers that all samples share.
    pub(super) fn uniforms(&self, params: &Params) -> Vec<f64> {
        let value = |at: usize| {
            let (constant, place) = self.constants[at];
            constant.and_then(|constant| component(constant, place, params)).unwrap_or(0.0)
        };
        self.program.tape.uniform_values_by(value)
    }
}

/// Constants and resources that free parameters move.
fn live_names(seeds: &[Seed]) -> Vec<String> {
    let mut names = Vec::new();
    for seed in seeds {
        if let Some(named) = &seed.named {
            names.push(named.name.to_owned());
        }
        // Constants that tell how it moves, move as well.
        names.extend(seed.constants().map(|constant| constant.name().to_owned()));
        let looked = seed.resources.iter().flat_map(|looked| [looked.resource, looked.slope]);
        names.extend(looked.map(|resource| resource.name().to_owned()));
    }
    names
}
