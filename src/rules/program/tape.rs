//! A graph as a list of instructions over registers.
//!
//! What is the same for all samples is computed once a pass, in f64. Of the rest, products that are added become one
//! operation and comparisons part of the choice that they make; registers are used again as soon as their number is not
//! needed any more.

use std::ops::Range;

use super::graph::{Binary, Graph, Id, Input, Native, Node, Unary, apply_binary, apply_unary};
use super::native;

/// Where an operand stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    /// A number for each sample.
    Register(usize),
    /// A number for all of them, by its place in [`Tape::uniform_values`].
    Uniform(usize),
}

/// What a choice asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Test {
    /// `a < b`
    Less(Slot, Slot),
    /// `a >= b`
    GreaterEqual(Slot, Slot),
    /// `a` is neither NaN nor infinite.
    IsFinite(Slot),
    /// `a` is 1 (and not 0).
    Holds(Slot),
}

/// A call of a [`Native`], of whose parts those are written that have a register.
#[derive(Clone, Debug, PartialEq)]
pub struct CallOf {
    /// The function.
    pub native: Native,
    /// What its value is of; a fallback is not among it.
    pub arguments: Vec<Slot>,
    /// The vectors that the arguments move along.
    pub along: Vec<Vec<Slot>>,
    /// The parts of the value.
    pub parts: Vec<Option<usize>>,
    /// The parts of how it moves, along each.
    pub slopes: Vec<Vec<Option<usize>>>,
}

/// What stands in for unit vectors that there are not.
#[derive(Clone, Debug, PartialEq)]
pub struct Mend {
    /// The register that tells where there is one.
    pub flag: usize,
    /// The registers of the unit vector.
    pub parts: Vec<Option<usize>>,
    /// What stands in.
    pub fallback: Vec<Slot>,
}

/// One instruction; its last member is the register that it writes.
#[derive(Clone, Debug, PartialEq)]
pub enum Instruction {
    /// A number of the sample, by its place among [`Tape::fields`].
    Load(usize, usize),
    /// An operation on one number.
    Unary(Unary, Slot, usize),
    /// An operation on two.
    Binary(Binary, Slot, Slot, usize),
    /// `a b + c`
    MultiplyAdd([Slot; 3], usize),
    /// `c - a b`
    SubtractProduct([Slot; 3], usize),
    /// `yes` or `no`.
    Select(Test, Slot, Slot, usize),
    /// A function.
    Call(Box<CallOf>),
    /// A unit vector: as [`Instruction::Call`]. Where every sample has one, the instructions after it are skipped, as
    /// many as the last number says: they make what stands in, and a [`Mend`] is the last of them. Else the register
    /// tells which have.
    Unit(Box<CallOf>, usize, usize),
    /// Put what stands in where it is needed.
    Mend(Box<Mend>),
}

/// A list of instructions.
#[derive(Clone, Debug)]
pub struct Tape {
    /// The instructions, in their order.
    pub instructions: Vec<Instruction>,
    /// How many registers there are.
    pub registers: usize,
    /// What is read of a sample.
    pub fields: Vec<Input>,
    /// Faces that are looked up.
    pub resources: Vec<String>,
    /// Where each output stands at the end.
    pub outputs: Vec<Slot>,
    pub(super) graph: Graph,
    pub(super) uniforms: Vec<Operand>,
    pub(super) rolled: Option<Rolled>,
}

/// An operand before it has a place: a node, or the reciprocal of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Operand {
    Of(Id),
    ReciprocalOf(Id),
    /// Where a unit vector has a direction, by the node of its call.
    FlagOf(Id),
}

impl Operand {
    /// The node that it is of.
    pub(super) const fn id(self) -> Id {
        match self {
            Self::Of(id) | Self::ReciprocalOf(id) | Self::FlagOf(id) => id,
        }
    }
}

/// Instructions that are the same for each member of a family, one member's after the other's, each with numbers of its own.
#[derive(Clone, Debug, Default)]
pub(super) struct Rolled {
    /// The first of them.
    pub(super) start: usize,
    /// How many a member has.
    pub(super) length: usize,
    /// For each member the registers of what is read after the last of them, of the same instructions of each.
    pub(super) left: Vec<Vec<usize>>,
    /// How many numbers that all samples share are a member's own: they stand first, one member's after the other's.
    pub(super) own: usize,
}

impl Rolled {
    /// The instructions of all members.
    pub(super) fn range(&self) -> Range<usize> {
        self.start..self.start + self.length * self.left.len()
    }
}

impl Tape {
    /// The numbers that are the same for all samples, in the order of their slots.
    #[must_use]
    pub fn uniform_values(&self, value: impl Fn(&Input) -> f64) -> Vec<f64> {
        self.uniform_values_by(|at| value(&self.graph.uniforms[at]))
    }

    /// The faces that its own instructions look up; [`Self::resources`] are those of all tapes of a graph.
    #[must_use]
    pub fn looked_up(&self) -> Vec<String> {
        let of = |instruction: &Instruction| match instruction {
            Instruction::Call(call) | Instruction::Unit(call, ..) => match call.native {
                Native::Lookup(resource) => self.resources.get(resource as usize).cloned(),
                _ => None,
            },
            _ => None,
        };
        let mut names: Vec<String> = self.instructions.iter().filter_map(of).collect();
        names.sort();
        names.dedup();
        names
    }

    /// What [`Self::uniform_values`] are made of.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.graph.uniforms
    }

    /// [`Self::uniform_values`], by the place of each input among [`Self::inputs`].
    #[must_use]
    pub fn uniform_values_by(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut known: Vec<Option<f64>> = vec![None; self.graph.len()];
        let mut of = |operand| match operand {
            Operand::Of(id) => self.uniform(id, &value, &mut known),
            Operand::ReciprocalOf(id) => 1.0 / self.uniform(id, &value, &mut known),
            Operand::FlagOf(_) => unreachable!("a flag is a register"),
        };
        self.uniforms.iter().map(|&operand| of(operand)).collect()
    }

    fn uniform(&self, id: Id, value: &impl Fn(usize) -> f64, known: &mut Vec<Option<f64>>) -> f64 {
        if let Some(x) = known[id.index()] {
            return x;
        }
        let mut of = |id| self.uniform(id, value, known);
        let x = match self.graph.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Uniform(at) => value(at as usize),
            Node::Unary(op, a) => apply_unary(op, of(a)),
            Node::Binary(op, a, b) => apply_binary(op, of(a), of(b)),
            Node::Select { condition, yes, no } => {
                if of(condition) == 0.0 {
                    of(no)
                } else {
                    of(yes)
                }
            }
            Node::Part(call, part) => {
                let part = part as usize;
                let Some(call) = self.graph.call_of(call) else { unreachable!("parts are of calls") };
                let numbers: Vec<f64> = call.arguments.iter().map(|&id| of(id)).collect();
                let along: Vec<f64> = call.along.iter().map(|&id| of(id)).collect();
                let along: Vec<Vec<f64>> = (!along.is_empty()).then_some(along).into_iter().collect();
                let (value, slopes, found) = native::call(call.native, None, &numbers, &along);
                match (slopes.first(), found) {
                    (Some(slope), _) => slope[part],
                    (None, true) => value[part],
                    (None, false) => numbers[call.native.hot() + part],
                }
            }
            Node::Field(_) | Node::Call(_) => unreachable!("it differs between samples"),
        };
        known[id.index()] = Some(x);
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::evaluate::Shared;

    fn run(graph: &Graph, outputs: &[Id], uniform: f64, field: f64) -> Vec<f64> {
        let tape = Tape::new(graph, outputs);
        let shared = Shared { uniforms: tape.uniform_values(|_| uniform), cubes: Vec::new() };
        tape.run(&shared, 0.0_f64, |_| field)
    }

    #[test]
    fn what_all_samples_share_is_no_instruction() {
        let mut graph = Graph::default();
        let (x, k) = (graph.field("x", 0), graph.uniform("k", 0));
        let two = graph.constant(2.0);
        let doubled = graph.binary(Binary::Multiply, two, k);
        let product = graph.binary(Binary::Multiply, doubled, x);
        let sum = graph.binary(Binary::Add, product, k);
        let tape = Tape::new(&graph, &[sum]);
        // The field's, and one that multiplies and adds.
        assert_eq!(tape.instructions.len(), 2, "{:?}", tape.instructions);
        assert_eq!(run(&graph, &[sum], 3.0, 5.0), [33.0]);
    }

    #[test]
    fn registers_are_used_again_and_outputs_stay() {
        let mut graph = Graph::default();
        let x = graph.field("x", 0);
        let mut powers = vec![x];
        for _ in 0..6 {
            let last = powers[powers.len() - 1];
            powers.push(graph.binary(Binary::Multiply, last, last));
        }
        let tape = Tape::new(&graph, &[powers[1], powers[6]]);
        assert!(tape.registers <= 3, "{}", tape.registers);
        assert_eq!(run(&graph, &[powers[1], powers[6]], 0.0, 1.5), [2.25, 1.5_f64.powi(64)]);
    }

    #[test]
    fn quotients_by_one_number_share_its_reciprocal() {
        let mut graph = Graph::default();
        let (x, k) = (graph.field("x", 0), graph.uniform("k", 0));
        let one = graph.constant(1.0);
        let shifted = graph.binary(Binary::Add, x, one);
        let quotients = [k, x].map(|a| graph.binary(Binary::Divide, a, shifted));
        let by_uniform = graph.binary(Binary::Divide, x, k);
        let outputs = [quotients[0], quotients[1], by_uniform];
        let tape = Tape::new(&graph, &outputs);
        let divides = |i: &&Instruction| matches!(i, Instruction::Binary(Binary::Divide, ..));
        assert_eq!(tape.instructions.iter().filter(divides).count(), 0);
        assert_eq!(run(&graph, &outputs, 2.0, 3.0), [0.5, 0.75, 1.5]);
    }
}
