//! A graph evaluated node by node, in any kind of number: f64 is what engines are held against.
//!
//! Unlike a [`tape`](super::tape), every operation stands as the rules wrote it: none is taken together with another,
//! and no quotient becomes a product. A number format can therefore be emulated operation by operation.

use super::evaluate::{binary, unary};
use super::graph::{Binary, Graph, Id, Input, Native, Node, Unary, apply_binary, apply_unary};
use crate::model::cube::Cube;
use crate::model::real::Real;

/// How a node's value is rounded, in number formats that round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rounding {
    /// As the result of any operation.
    #[default]
    Plain,
    /// Not at all: it addresses texels, for which processors have numbers of their own.
    Address,
    /// As assigned to a variable that is declared `half`.
    Half,
    /// As assigned to a variable that is declared `fixed`.
    Fixed,
}

/// What all samples share, in one kind of number.
pub struct Setting<'a, R: Real> {
    numbers: Vec<R::Wide>,
    cubes: Vec<&'a Cube<R::Texel>>,
}

/// Where an operand stands.
#[derive(Clone, Copy, Debug)]
enum Slot {
    /// A number for each sample.
    Own(usize),
    /// A number for all of them.
    Shared(usize),
}

/// One operation; its last member is the register that it writes.
#[derive(Clone, Copy, Debug)]
enum Step {
    Field(usize, usize),
    Unary(Unary, Slot, usize),
    Binary(Binary, [Slot; 2], usize),
    Select([Slot; 3], usize),
    /// A lookup whose channels are written from that register on, or how they move as its place does.
    Lookup(usize, [Slot; 3], Option<[Slot; 2]>, usize),
}

/// What outputs are made of, in its order.
#[derive(Clone, Debug)]
pub struct Steps {
    steps: Vec<(Step, Rounding)>,
    registers: usize,
    outputs: Vec<Slot>,
    /// Nodes that all samples share.
    shared: Vec<(Id, Rounding)>,
    graph: Graph,
}

impl Steps {
    /// The operations that compute `outputs`, each rounded as `rounding` says of its node. The graph is of functions
    /// [as they are written](super::lower::Natives::Written).
    #[must_use]
    pub fn new(graph: &Graph, outputs: &[Id], rounding: impl Fn(Id) -> Rounding) -> Self {
        Writer::new(graph, outputs).finish(outputs, rounding)
    }

    /// What is read of a sample.
    #[must_use]
    pub fn fields(&self) -> &[Input] {
        &self.graph.fields
    }

    /// What all samples share.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.graph.uniforms
    }

    /// Faces that are looked up.
    #[must_use]
    pub fn resources(&self) -> &[String] {
        &self.graph.resources
    }

    /// How many operations a sample takes.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.steps.len()
    }

    /// What all samples share, computed in f64: `value` gives the numbers that have names, `cubes` the faces.
    #[must_use]
    pub fn setting<'a, R: Real>(
        &self,
        like: R,
        value: impl Fn(&Input) -> f64,
        cubes: impl Fn(&str) -> &'a Cube<R::Texel>,
    ) -> Setting<'a, R> {
        let mut known = vec![0.0; self.shared.last().map_or(0, |(id, _)| id.index() + 1)];
        for &(id, _) in &self.shared {
            let of = |id: Id| known[id.index()];
            known[id.index()] = match self.graph.node(id) {
                Node::Constant(bits) => f64::from_bits(bits),
                Node::Uniform(at) => value(&self.graph.uniforms[at as usize]),
                Node::Unary(op, a) => apply_unary(op, of(a)),
                Node::Binary(op, a, b) => apply_binary(op, of(a), of(b)),
                Node::Select { condition, yes, no } => of(if of(condition) == 0.0 { no } else { yes }),
                Node::Field(_) | Node::Call(_) | Node::Part(..) => {
                    unreachable!("it differs between samples")
                }
            };
        }
        let kept = |&(id, rounding): &(Id, Rounding)| {
            let number = known[id.index()];
            if rounding == Rounding::Address {
                like.widen().lit(number)
            } else {
                rounded(rounding, like.lit(number))
            }
        };
        let numbers = self.shared.iter().map(kept).collect();
        Setting { numbers, cubes: self.graph.resources.iter().map(|name| cubes(name)).collect() }
    }

    /// Compute the outputs for one number of the kind, in `registers`: `field` gives what is read, by its place among
    /// [`Self::fields`].
    #[inline(always)]
    pub fn run<R: Real>(
        &self,
        shared: &Setting<'_, R>,
        like: R,
        registers: &mut Vec<R::Wide>,
        field: impl Fn(usize) -> R,
    ) {
        registers.resize(self.registers, like.widen());
        for &(step, rounding) in &self.steps {
            step.run(rounding, shared, registers, &field);
        }
    }

    /// What [`Self::run`] computed, in place of what stood in `outputs`.
    #[inline(always)]
    pub fn put<R: Real>(&self, shared: &Setting<'_, R>, registers: &[R::Wide], outputs: &mut Vec<R>) {
        outputs.clear();
        for &slot in &self.outputs {
            outputs.push(R::narrow(wide(shared, registers, slot)));
        }
    }

    /// What [`Self::run`] computed.
    #[inline(always)]
    pub fn outputs<'o, R: Real>(
        &'o self,
        shared: &'o Setting<'_, R>,
        registers: &'o [R::Wide],
    ) -> impl Iterator<Item = R> + 'o {
        self.outputs.iter().map(move |&slot| R::narrow(wide(shared, registers, slot)))
    }
}

#[inline(always)]
fn wide<R: Real>(shared: &Setting<'_, R>, registers: &[R::Wide], slot: Slot) -> R::Wide {
    match slot {
        Slot::Own(at) => registers[at],
        Slot::Shared(at) => shared.numbers[at],
    }
}

/// A value as it is kept.
#[inline(always)]
fn rounded<R: Real>(rounding: Rounding, value: R) -> R::Wide {
    match rounding {
        Rounding::Plain | Rounding::Address => value.widen(),
        Rounding::Half => value.half().widen(),
        Rounding::Fixed => value.fixed().widen(),
    }
}

impl Step {
    #[inline(always)]
    fn run<R: Real>(
        self,
        rounding: Rounding,
        shared: &Setting<'_, R>,
        registers: &mut [R::Wide],
        field: &impl Fn(usize) -> R,
    ) {
        // No closures: what is not inlined is compiled without the instructions that lanes need.
        let exact = rounding == Rounding::Address;
        let (value, out) = match self {
            Self::Field(at, out) => (rounded(rounding, field(at)), out),
            Self::Unary(op, a, out) if exact => (unary(op, wide(shared, registers, a)), out),
            Self::Unary(op, a, out) => {
                (rounded(rounding, unary(op, R::narrow(wide(shared, registers, a)))), out)
            }
            Self::Binary(op, [a, b], out) if exact => {
                (binary(op, wide(shared, registers, a), wide(shared, registers, b)), out)
            }
            Self::Binary(op, [a, b], out) => {
                let a = R::narrow(wide(shared, registers, a));
                let b = R::narrow(wide(shared, registers, b));
                (rounded(rounding, binary(op, a, b)), out)
            }
            Self::Select([condition, yes, no], out) => {
                let condition: R::Wide = wide(shared, registers, condition);
                let (yes, no) = (wide(shared, registers, yes), wide(shared, registers, no));
                let chosen = Real::select(condition.ge(condition.lit(0.5)), yes, no);
                // Of numbers that were rounded, unless the choice has a rounding of its own.
                let declared = matches!(rounding, Rounding::Half | Rounding::Fixed);
                (if declared { rounded(rounding, R::narrow(chosen)) } else { chosen }, out)
            }
            Self::Lookup(resource, [face, s, t], along, first) => {
                let get = |slot| wide(shared, registers, slot);
                let cube = shared.cubes[resource];
                let at = cube.footprint_at(get(face), get(s), get(t));
                let channels = match along {
                    None => cube.sample_at(&at),
                    Some(along) => cube.sample_with_slope(&at, cube.texels(along.map(get))).1,
                };
                for (out, channel) in registers[first..].iter_mut().zip(channels) {
                    *out = rounded(rounding, R::narrow(channel));
                }
                return;
            }
        };
        registers[out] = value;
    }
}

/// Steps while their registers are found.
struct Writer<'a> {
    graph: &'a Graph,
    varies: Vec<bool>,
    reached: Vec<bool>,
    /// The last node that reads each node.
    last: Vec<usize>,
    places: Vec<Slot>,
    free: Vec<usize>,
    registers: usize,
}

impl<'a> Writer<'a> {
    fn new(graph: &'a Graph, outputs: &[Id]) -> Self {
        let reached = graph.reached(outputs);
        let varies = graph
            .made_of(|graph, id| matches!(graph.node(id), Node::Field(_)) || graph.looked_up(id).is_some());
        let mut last = vec![0; graph.len()];
        for id in graph.ids().filter(|id| reached[id.index()]) {
            graph.operands(id).iter().for_each(|operand| last[operand.index()] = id.index());
        }
        outputs.iter().for_each(|id| last[id.index()] = usize::MAX);
        let places = vec![Slot::Shared(0); graph.len()];
        Self { graph, varies, reached, last, places, free: Vec::new(), registers: 0 }
    }

    fn finish(mut self, outputs: &[Id], rounding: impl Fn(Id) -> Rounding) -> Steps {
        let (mut steps, mut shared) = (Vec::new(), Vec::new());
        let graph = self.graph;
        for id in graph.ids().filter(|id| self.reached[id.index()]).collect::<Vec<_>>() {
            if !self.varies[id.index()] {
                self.places[id.index()] = Slot::Shared(shared.len());
                shared.push((id, rounding(id)));
            } else if let Some(step) = self.step(id) {
                steps.push((step, rounding(id)));
            }
        }
        let outputs = outputs.iter().map(|id| self.places[id.index()]).collect();
        Steps { steps, registers: self.registers, outputs, shared, graph: graph.clone() }
    }

    fn step(&mut self, id: Id) -> Option<Step> {
        let at = |id: Id| self.places[id.index()];
        let node = self.graph.node(id);
        // What a lookup wrote stays where it is.
        if let Node::Part(lookup, part) = node {
            if let Slot::Own(first) = at(lookup) {
                self.places[id.index()] = Slot::Own(first + usize::from(part));
            }
            return None;
        }
        if let Some(call) = self.graph.call_of(id) {
            let Native::Lookup(resource) = call.native else {
                unreachable!("steps are made of functions as they are written")
            };
            let three = [0, 1, 2].map(|k| at(call.arguments[k]));
            let along = (!call.along.is_empty()).then(|| [0, 1].map(|k| at(call.along[k])));
            let first = self.registers;
            self.registers += 4;
            self.places[id.index()] = Slot::Own(first);
            return Some(Step::Lookup(resource as usize, three, along, first));
        }
        let operands: Vec<Slot> = self.graph.operands(id).into_iter().map(at).collect();
        self.release(id);
        let out = self.free.pop().unwrap_or_else(|| {
            self.registers += 1;
            self.registers - 1
        });
        self.places[id.index()] = Slot::Own(out);
        Some(match (node, operands.as_slice()) {
            (Node::Unary(op, _), &[a]) => Step::Unary(op, a, out),
            (Node::Binary(op, ..), &[a, b]) => Step::Binary(op, [a, b], out),
            (Node::Select { .. }, &[condition, yes, no]) => Step::Select([condition, yes, no], out),
            (Node::Field(field), _) => Step::Field(field as usize, out),
            _ => unreachable!("it is the same for all samples, or part of a lookup"),
        })
    }

    /// Registers of operands that nothing after this node reads.
    fn release(&mut self, id: Id) {
        let mut operands = self.graph.operands(id);
        operands.sort_unstable();
        operands.dedup();
        for operand in operands {
            let part = matches!(self.graph.node(operand), Node::Part(..) | Node::Call(_));
            if let Slot::Own(register) = self.places[operand.index()]
                && self.last[operand.index()] == id.index()
                && !part
            {
                self.free.push(register);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::batch::Batch;
    use crate::model::cube::Cube;
    use crate::model::formats::{Emulated, Half, to_half};

    #[test]
    fn steps_compute_what_the_graph_says_in_every_lane() {
        let mut graph = Graph::default();
        let (x, k) = (graph.field("x", 0), graph.uniform("k", 0));
        let one = graph.constant(1.0);
        let shifted = graph.binary(Binary::Add, k, one);
        let mut power = graph.binary(Binary::Multiply, shifted, x);
        for _ in 0..5 {
            power = graph.binary(Binary::Multiply, power, power);
        }
        let small = graph.binary(Binary::Less, x, k);
        let chosen = graph.select(small, power, x);
        let steps = Steps::new(&graph, &[chosen, shifted], |_| Rounding::Plain);
        // Six products, a comparison, a choice and the field; the sum is the same for all.
        assert_eq!((steps.count(), steps.shared.len()), (9, 3));
        assert!(steps.registers <= 3, "{}", steps.registers);
        let shared = steps.setting(Batch([0.0; 2]), |_| 0.5, |_| unreachable!("nothing is looked up"));
        let mut registers = Vec::new();
        steps.run(&shared, Batch([0.0; 2]), &mut registers, |_| Batch([0.25, 2.0]));
        let got: Vec<_> = steps.outputs(&shared, &registers).collect();
        assert_eq!(got, [Batch([0.375_f64.powi(32), 2.0]), Batch([1.5; 2])]);
    }

    #[test]
    fn lookups_are_addressed_without_rounding_and_their_values_are_rounded() {
        let mut graph = Graph::default();
        let x = graph.field("x", 0);
        let (third, zero) = (graph.constant(1.0 / 3.0), graph.constant(0.0));
        let s = graph.binary(Binary::Multiply, third, x);
        let middle = graph.constant(0.5);
        let resource = graph.resource("faces");
        let parts = graph.call(Native::Lookup(resource), vec![zero, s, middle], Vec::new());
        let cube = Cube::from_fn(8, |_, column, _| [column as f64 / 7.0; 4]);
        let run = |rounding: Rounding| -> f64 {
            let steps =
                Steps::new(&graph, &parts[..1], |id| if id == s { rounding } else { Rounding::Plain });
            let (like, mut registers) = (Emulated::<Half>::new(0.0), Vec::new());
            let shared = steps.setting(like, |_| 0.0, |_| &cube);
            steps.run(&shared, like, &mut registers, |_| Emulated::new(0.23));
            let found = steps.outputs(&shared, &registers).next();
            found.unwrap().into()
        };
        let product = to_half(1.0 / 3.0) * to_half(0.23);
        let at = |s: f64| -> f64 { to_half(cube.sample_at(&cube.footprint_at(0.0, s, 0.5))[0]) };
        assert_eq!(run(Rounding::Address), at(product));
        assert_eq!(run(Rounding::Plain), at(to_half(product)));
        assert_ne!(at(product), at(to_half(product)));
    }
}
