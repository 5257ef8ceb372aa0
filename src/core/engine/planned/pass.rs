//! What a pass computes, as tapes: worked out once from the effects and the unknowns.

use std::collections::BTreeMap;

use super::machine::Program;
use crate::engine::Unknown;
use crate::engine::residual::loss_text;
use crate::engine::view::ObservedView;
use crate::model::evaluate::Setup;
use crate::model::params::{Channels, Param};
use crate::program::cut::{KEPT, cut};
use crate::program::graph::{Binary, Graph, Id, Node};
use crate::program::lower::{LowerError, Natives, Source, Value};
use crate::program::shading::{Shading, ShadingError};
use crate::program::tape::Tape;
use crate::samples::surface_records::{Places, neutral};
use crate::scene::Loss;
use crate::shader::facts::{Budget, FaceSizes, Facts, MapFacts, Source as FactsSource};
use crate::shader::tangent::chain::Seed;

/// The streams that tapes read: samples, kept numbers, sums of a pixel's samples, targets, pixels' weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StreamOf {
    Samples = 0,
    Kept,
    Pixels,
    Targets,
    Weights,
}

/// What is the same for every view of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) setup: Setup,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) loss: Loss,
    /// Colours, and the haze where it is compared.
    pub(super) channels: usize,
    pub(super) faces: FaceSizes,
    /// Where a sample's numbers stand.
    pub(super) places: Places,
    /// Whether a pixel may have several samples.
    pub(super) several: bool,
    /// Whether pixels count differently.
    pub(super) weighted: bool,
    pub(super) clipped: bool,
    /// Whether what no free parameter moves is kept.
    pub(super) keep: bool,
}

/// What of a point is written into the tapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Written {
    /// Whether the environment is turned, or will be.
    pub(super) turned: bool,
    /// Whether a view's gain is not 1, or will not be.
    pub(super) gained: bool,
}

impl Fitted {
    /// Of views of one kind.
    pub(super) fn new(setup: Setup, unknowns: Vec<Unknown>, loss: Loss, views: &[ObservedView]) -> Self {
        let channels = if views.iter().any(ObservedView::compares_alpha) { 4 } else { 3 };
        let places = views
            .iter()
            // One that holds nothing says nothing of where numbers stand.
            .find(|view| view.samples.groups() > 0)
            .map(|view| *view.samples.surface.places())
            .unwrap_or_default();
        Self {
            setup,
            unknowns,
            loss,
            channels,
            faces: FaceSizes::default(),
            several: views.iter().any(|view| {
                view.samples.records() != view.samples.groups()
                    || view.samples.surface.places().weight.is_some()
            }),
            weighted: views.iter().any(|view| !view.weight.is_empty()),
            clipped: views.iter().any(|view| view.clip.is_some()),
            places,
            keep: true,
        }
    }

    /// The parameters that are free and that an effect asks for, each once.
    fn free(&self) -> Vec<Param> {
        let mut free = Vec::new();
        for unknown in &self.unknowns {
            let Unknown::Param(column) = unknown else { continue };
            if column.param.asked_for(self.setup.effects) && !free.contains(&column.param) {
                free.push(column.param);
            }
        }
        free
    }

    fn gains(&self) -> bool {
        self.unknowns.iter().any(|unknown| matches!(unknown, Unknown::Gain(_)))
    }
}

/// A tape, and where it reads each of its fields.
#[derive(Debug)]
pub(super) struct Reading {
    pub(super) program: Program,
    /// For each field, its stream and its row there.
    pub(super) loads: Vec<(usize, usize)>,
}

/// The columns of one channel: outputs of the last tape.
#[derive(Clone, Debug, Default)]
pub(super) struct ChannelColumns {
    /// For each column its unknown; `None` for the view's gain.
    pub(super) unknowns: Vec<Option<usize>>,
    /// The outputs of the columns, and after them the residual's.
    pub(super) outputs: Vec<usize>,
}

/// What one kind of pass runs for a block.
#[derive(Debug)]
pub(super) struct Stages {
    /// Over samples: what is added up to a pixel; `None` where a pixel is one sample.
    pub(super) sample: Option<Reading>,
    /// Over pixels.
    pub(super) pixel: Reading,
}

/// All tapes of a fit.
#[derive(Debug)]
pub(super) struct Pass {
    /// Makes the kept numbers.
    pub(super) keep: Reading,
    /// Kept numbers a sample.
    pub(super) kept: usize,
    /// Yields the channels' values, the gain applied.
    pub(super) image: Stages,
    /// Yields the loss.
    pub(super) loss: Stages,
    /// Yields the loss, then what `channels` names.
    pub(super) normal: Stages,
    pub(super) channels: Vec<ChannelColumns>,
}

/// A pixel's value and tangents, and the graph that holds them.
struct Shown {
    graph: Graph,
    value: Vec<Id>,
    tangents: Vec<Vec<Id>>,
}

/// The outputs of the columns of a pixel.
struct Compared {
    loss: Id,
    numbers: Vec<Id>,
    channels: Vec<ChannelColumns>,
}

impl Pass {
    pub(super) fn new(fitted: &Fitted, written: Written) -> Result<Self, ShadingError> {
        let free = fitted.free();
        let seeds: Vec<Seed> = free.iter().map(|&param| Seed::of_param(param)).collect();
        let facts = facts(fitted, written);
        let held = held_fields(&fitted.places);
        let stand_in = |field: &str| if held.contains_key(field) { None } else { neutral(field) };
        let shading = Shading::new(&facts, &seeds, stand_in, Natives::Called)?;
        let losses = Source::new(&loss_text(fitted.loss), Natives::Called)?;
        let channels = fitted.channels;
        let outputs: Vec<Id> = std::iter::once(&shading.value)
            .chain(&shading.tangents)
            .flat_map(|numbers| numbers[..channels].to_vec())
            .collect();
        let names = live_names(&seeds);
        let moves = |graph: &Graph, id: Id| {
            !fitted.keep
                || match graph.node(id) {
                    Node::Uniform(at) => names.contains(&graph.uniforms[at as usize].name),
                    _ => graph.looked_up(id).is_some_and(|name| names.iter().any(|known| known == name)),
                }
        };
        let cut = cut(&shading.graph, &outputs, moves);
        let keep = Reading::new(fitted, &shading.graph, &cut.kept);
        let shown = Shown {
            graph: cut.graph,
            value: cut.outputs[..channels].to_vec(),
            tangents: cut.outputs[channels..].chunks(channels).map(<[Id]>::to_vec).collect(),
        };
        let (sample, mut shown) = if fitted.several { shown.summed() } else { (None, shown) };
        let compared = shown.compared(fitted, written, &free, &losses)?;
        let image: Vec<Id> = (0..channels).map(|c| shown.gained(shown.value[c], written)).collect();
        let all: Vec<Id> = std::iter::once(compared.loss).chain(compared.numbers).collect();
        let stages = |outputs: &[Id], tangents: bool| Stages {
            sample: sample.as_ref().map(|shown| {
                let mut sums = shown.value.clone();
                if tangents {
                    sums.extend(shown.tangents.concat());
                }
                Reading::new(fitted, &shown.graph, &sums)
            }),
            pixel: Reading::new(fitted, &shown.graph, outputs),
        };
        Ok(Self {
            keep,
            kept: cut.kept.len(),
            image: stages(&image, false),
            loss: stages(&all[..1], false),
            normal: stages(&all, true),
            channels: compared.channels,
        })
    }
}

impl Reading {
    fn new(fitted: &Fitted, graph: &Graph, outputs: &[Id]) -> Self {
        let held = held_fields(&fitted.places);
        let tape = Tape::new(graph, outputs);
        let load = |input: &crate::program::graph::Input| match input.name.as_str() {
            KEPT => (StreamOf::Kept as usize, input.component),
            SHOWN => (StreamOf::Pixels as usize, input.component),
            OBSERVED => (StreamOf::Targets as usize, input.component),
            WEIGHT => (StreamOf::Weights as usize, 0),
            field => (StreamOf::Samples as usize, held.get(field).map_or(0, |place| place + input.component)),
        };
        let loads = tape.fields.iter().map(load).collect();
        Self { program: Program::new(tape), loads }
    }
}

/// Names of what pixels hold beside samples.
const SHOWN: &str = "shown";
const OBSERVED: &str = "observed";
const WEIGHT: &str = "weight";
/// Names of what views hold.
pub(super) const GAIN: &str = "gain";
pub(super) const CLIP_LOW: &str = "clip_low";
pub(super) const CLIP_HIGH: &str = "clip_high";

impl Shown {
    /// What is added up over samples, and pixels that read the sums.
    fn summed(self) -> (Option<Self>, Self) {
        let mut graph = Graph::default();
        let mut next = 0..;
        let mut read = |graph: &mut Graph| graph.field(SHOWN, next.next().unwrap_or(0));
        let value = self.value.iter().map(|_| read(&mut graph)).collect();
        let mut tangents = Vec::new();
        for tangent in &self.tangents {
            let read = |&id: &Id| {
                let sum = read(&mut graph);
                // What never moves needs no column.
                self.graph.value(id).filter(|&x| x == 0.0).map_or(sum, |zero| graph.constant(zero))
            };
            tangents.push(tangent.iter().map(read).collect());
        }
        (Some(self), Self { graph, value, tangents })
    }

    fn gained(&mut self, id: Id, written: Written) -> Id {
        if !written.gained {
            return id;
        }
        let gain = self.graph.uniform(GAIN, 0);
        self.graph.binary(Binary::Multiply, gain, id)
    }

    /// What a pixel counts in a channel: a clipped target only says "at least" or "at most" (docs/model.md).
    fn counted(&mut self, fitted: &Fitted, value: Id, wanted: Id) -> Id {
        let graph = &mut self.graph;
        let weight = if fitted.weighted { graph.field(WEIGHT, 0) } else { graph.constant(1.0) };
        if !fitted.clipped {
            return weight;
        }
        let (low, high) = (self.graph.uniform(CLIP_LOW, 0), self.graph.uniform(CLIP_HIGH, 0));
        let graph = &mut self.graph;
        let at_least = |graph: &mut Graph, a, b| graph.binary(Binary::GreaterEqual, a, b);
        let (is_low, below) = (at_least(graph, low, wanted), at_least(graph, wanted, value));
        let (is_high, above) = (at_least(graph, wanted, high), at_least(graph, value, wanted));
        let (below, above) = (graph.and(is_low, below), graph.and(is_high, above));
        let (beyond, nothing) = (graph.or(below, above), graph.constant(0.0));
        graph.select(beyond, nothing, weight)
    }

    /// Loss, residuals and columns.
    fn compared(
        &mut self,
        fitted: &Fitted,
        written: Written,
        free: &[Param],
        losses: &Source,
    ) -> Result<Compared, LowerError> {
        let mut compared =
            Compared { loss: self.graph.constant(0.0), numbers: Vec::new(), channels: Vec::new() };
        for c in 0..fitted.channels {
            let (value, wanted) = (self.gained(self.value[c], written), self.graph.field(OBSERVED, c));
            let counted = self.counted(fitted, value, wanted);
            let arguments = [value, wanted, counted].map(|id| Value::Numbers(vec![id])).to_vec();
            let weighed = losses.call(&mut self.graph, "weighted_residual", arguments)?;
            compared.loss = self.graph.binary(Binary::Add, compared.loss, weighed[0]);
            let mut channel = ChannelColumns::default();
            let mut put = |channel: &mut ChannelColumns, id: Id| {
                compared.numbers.push(id);
                // The loss is the first output.
                channel.outputs.push(compared.numbers.len());
            };
            for (index, unknown) in fitted.unknowns.iter().enumerate() {
                let Unknown::Param(column) = unknown else { continue };
                let seed = free.iter().position(|&param| param == column.param);
                let other = matches!(column.channels, Channels::One(own) if c < 3 && own != c);
                let Some(tangent) = seed.filter(|_| !other).map(|seed| self.tangents[seed][c]) else {
                    continue;
                };
                if self.graph.value(tangent) == Some(0.0) {
                    continue;
                }
                let moved = self.gained(tangent, written);
                let column = self.graph.binary(Binary::Multiply, weighed[1], moved);
                channel.unknowns.push(Some(index));
                put(&mut channel, column);
            }
            if fitted.gains() {
                let column = self.graph.binary(Binary::Multiply, weighed[1], self.value[c]);
                channel.unknowns.push(None);
                put(&mut channel, column);
            }
            put(&mut channel, weighed[2]);
            compared.channels.push(channel);
        }
        Ok(compared)
    }
}

/// The first row of each field that samples hold.
fn held_fields(places: &Places) -> BTreeMap<&'static str, usize> {
    places.fields().map(|(name, place, _)| (name, place)).collect()
}

/// Constants and resources that free parameters move.
fn live_names(seeds: &[Seed]) -> Vec<String> {
    let mut names = Vec::new();
    for seed in seeds {
        match seed {
            Seed::Named { name, tangent } => {
                names.push((*name).to_owned());
                // Constants that tell how it moves, move as well.
                let told = tangent.split("constants.").skip(1);
                names.extend(told.filter_map(|rest| rest.split('.').next()).map(str::to_owned));
            }
            Seed::Resource { resource, slope } => {
                names.extend([resource.name().to_owned(), slope.name().to_owned()]);
            }
        }
    }
    names
}

fn facts(fitted: &Fitted, written: Written) -> Facts {
    Facts {
        setup: fitted.setup,
        source: FactsSource::Samples,
        maps: MapFacts::default(),
        faces: fitted.faces,
        turned: written.turned,
        square_rim: false,
        budget: Budget::Exact,
        ..Facts::default()
    }
}
