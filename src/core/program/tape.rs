//! A graph as a list of instructions over registers.
//!
//! What is the same for all samples is computed once a pass, in f64. Of the rest, products that are added become one
//! operation and comparisons part of the choice that they make; registers are used again as soon as their number is not
//! needed any more.

use std::collections::HashMap;

use super::graph::{Binary, Graph, Id, Input, LOOKUP_PARTS, Node, Unary, apply_binary, apply_unary};

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
    /// A lookup at (face, s, t), of whose parts those are written that have a register.
    Lookup(usize, [Slot; 3], [Option<usize>; LOOKUP_PARTS]),
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
    graph: Graph,
    uniforms: Vec<Operand>,
}

impl Tape {
    /// The instructions that compute `outputs`.
    #[must_use]
    pub fn new(graph: &Graph, outputs: &[Id]) -> Self {
        let mut writer = Writer::new(graph, outputs);
        outputs.iter().for_each(|&id| writer.want(id));
        writer.finish(outputs)
    }

    /// The numbers that are the same for all samples, in the order of their slots.
    #[must_use]
    pub fn uniform_values(&self, value: impl Fn(&Input) -> f64) -> Vec<f64> {
        let mut known: Vec<Option<f64>> = vec![None; self.graph.len()];
        let mut of = |operand| match operand {
            Operand::Of(id) => self.uniform(id, &value, &mut known),
            Operand::ReciprocalOf(id) => 1.0 / self.uniform(id, &value, &mut known),
        };
        self.uniforms.iter().map(|&operand| of(operand)).collect()
    }

    fn uniform(&self, id: Id, value: &impl Fn(&Input) -> f64, known: &mut Vec<Option<f64>>) -> f64 {
        if let Some(x) = known[id.index()] {
            return x;
        }
        let mut of = |id| self.uniform(id, value, known);
        let x = match self.graph.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Uniform(at) => value(&self.graph.uniforms[at as usize]),
            Node::Unary(op, a) => apply_unary(op, of(a)),
            Node::Binary(op, a, b) => apply_binary(op, of(a), of(b)),
            Node::Select { condition, yes, no } => {
                if of(condition) == 0.0 {
                    of(no)
                } else {
                    of(yes)
                }
            }
            Node::Field(_) | Node::Lookup { .. } | Node::Part(..) => {
                unreachable!("it differs between samples")
            }
        };
        known[id.index()] = Some(x);
        x
    }
}

/// Instructions over nodes, whose registers are not yet known.
struct Writer<'a> {
    graph: &'a Graph,
    /// Whether a node differs between samples.
    varies: Vec<bool>,
    /// How often a node is an operand or an output.
    uses: Vec<u32>,
    /// Denominators of several quotients: one reciprocal serves them.
    divides: Vec<u32>,
    written: Vec<bool>,
    instructions: Vec<Draft>,
    uniforms: Vec<Operand>,
}

/// An operand: a node, or the reciprocal of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Operand {
    Of(Id),
    ReciprocalOf(Id),
}

/// An instruction with operands in the place of slots.
struct Draft {
    kind: Kind,
    reads: Vec<Operand>,
    writes: Vec<(Operand, usize)>,
}

#[derive(Clone, Copy)]
enum Kind {
    Load(usize),
    Unary(Unary),
    Binary(Binary),
    MultiplyAdd,
    SubtractProduct,
    SelectLess,
    SelectGreaterEqual,
    SelectFinite,
    SelectHolds,
    Lookup(usize),
}

impl<'a> Writer<'a> {
    fn new(graph: &'a Graph, outputs: &[Id]) -> Self {
        let varies =
            graph.made_of(|graph, id| matches!(graph.node(id), Node::Field(_) | Node::Lookup { .. }));
        let reached = graph.reached(outputs);
        let (mut uses, mut divides) = (vec![0; graph.len()], vec![0; graph.len()]);
        outputs.iter().for_each(|id| uses[id.index()] += 1);
        for at in (0..graph.len()).filter(|&at| reached[at]) {
            let id = Id(at as u32);
            graph.operands(id).iter().for_each(|operand| uses[operand.index()] += 1);
            if let Node::Binary(Binary::Divide, _, b) = graph.node(id) {
                divides[b.index()] += 1;
            }
        }
        Self {
            graph,
            varies,
            uses,
            divides,
            written: vec![false; graph.len()],
            instructions: Vec::new(),
            uniforms: Vec::new(),
        }
    }

    /// A product that nothing else needs.
    fn lone_product(&self, id: Id) -> Option<(Id, Id)> {
        match self.graph.node(id) {
            Node::Binary(Binary::Multiply, a, b) if self.uses[id.index()] == 1 && self.varies[id.index()] => {
                Some((a, b))
            }
            _ => None,
        }
    }

    /// Write what a node needs, then the node.
    fn want(&mut self, id: Id) {
        if self.written[id.index()] || !self.varies[id.index()] {
            return;
        }
        self.written[id.index()] = true;
        if let Node::Part(lookup, part) = self.graph.node(id) {
            self.want(lookup);
            self.part(lookup, part, id);
            return;
        }
        let (kind, reads) = self.selected(id);
        for operand in &reads {
            match *operand {
                Operand::Of(id) => self.want(id),
                Operand::ReciprocalOf(id) => self.want_reciprocal(id),
            }
        }
        // A lookup writes those of its parts that are wanted later.
        let is_lookup = matches!(kind, Kind::Lookup(_));
        let writes = if is_lookup { Vec::new() } else { vec![(Operand::Of(id), 0)] };
        self.instructions.push(Draft { kind, reads, writes });
    }

    fn want_reciprocal(&mut self, id: Id) {
        self.want(id);
        let known =
            self.instructions.iter().any(|d| d.writes.iter().any(|w| w.0 == Operand::ReciprocalOf(id)));
        if self.varies[id.index()] && !known {
            self.instructions.push(Draft {
                kind: Kind::Unary(Unary::Reciprocal),
                reads: vec![Operand::Of(id)],
                writes: vec![(Operand::ReciprocalOf(id), 0)],
            });
        }
    }

    /// A part of a lookup that was written already.
    fn part(&mut self, lookup: Id, part: u8, id: Id) {
        let reads_lookup =
            |draft: &&mut Draft| matches!(draft.kind, Kind::Lookup(at) if at == lookup.index());
        if let Some(draft) = self.instructions.iter_mut().find(reads_lookup) {
            draft.writes.push((Operand::Of(id), part as usize));
        }
    }

    /// The instruction for a node.
    fn selected(&self, id: Id) -> (Kind, Vec<Operand>) {
        let of = |ids: &[Id]| ids.iter().map(|&id| Operand::Of(id)).collect::<Vec<_>>();
        match self.graph.node(id) {
            Node::Field(at) => (Kind::Load(at as usize), Vec::new()),
            Node::Unary(op, a) => (Kind::Unary(op), of(&[a])),
            Node::Binary(op, a, b) => match (op, self.lone_product(a), self.lone_product(b)) {
                (Binary::Add, _, Some((x, y))) => (Kind::MultiplyAdd, of(&[x, y, a])),
                (Binary::Add, Some((x, y)), None) => (Kind::MultiplyAdd, of(&[x, y, b])),
                (Binary::Subtract, _, Some((x, y))) => (Kind::SubtractProduct, of(&[x, y, a])),
                (Binary::Divide, ..) if self.divides[b.index()] > 1 || !self.varies[b.index()] => {
                    (Kind::Binary(Binary::Multiply), vec![Operand::Of(a), Operand::ReciprocalOf(b)])
                }
                _ => (Kind::Binary(op), of(&[a, b])),
            },
            Node::Select { condition, yes, no } => match self.graph.node(condition) {
                Node::Binary(Binary::Less, a, b) => (Kind::SelectLess, of(&[a, b, yes, no])),
                Node::Binary(Binary::GreaterEqual, a, b) => (Kind::SelectGreaterEqual, of(&[a, b, yes, no])),
                Node::Unary(Unary::IsFinite, a) => (Kind::SelectFinite, of(&[a, yes, no])),
                _ => (Kind::SelectHolds, of(&[condition, yes, no])),
            },
            Node::Lookup { face, s, t, .. } => (Kind::Lookup(id.index()), of(&[face, s, t])),
            Node::Part(..) => unreachable!("a lookup writes its parts"),
            Node::Constant(_) | Node::Uniform(_) => unreachable!("it is the same for all samples"),
        }
    }

    fn finish(mut self, outputs: &[Id]) -> Tape {
        let mut last: HashMap<Operand, usize> = HashMap::new();
        for (at, draft) in self.instructions.iter().enumerate() {
            last.extend(draft.reads.iter().map(|&operand| (operand, at)));
        }
        // Outputs stay.
        last.extend(outputs.iter().map(|&id| (Operand::Of(id), usize::MAX)));
        let drafts = std::mem::take(&mut self.instructions);
        let (mut places, mut free): (HashMap<Operand, usize>, Vec<usize>) = (HashMap::new(), Vec::new());
        let mut registers = 0;
        let mut instructions = Vec::new();
        for (at, draft) in drafts.iter().enumerate() {
            let reads: Vec<Slot> = draft.reads.iter().map(|&o| self.slot(o, &places)).collect();
            let mut released: Vec<Operand> = draft.reads.clone();
            released.retain(|operand| last.get(operand) == Some(&at));
            for operand in released {
                free.extend(places.remove(&operand));
            }
            let mut writes: Vec<(usize, usize)> = Vec::new();
            for &(operand, part) in &draft.writes {
                let register = free.pop().unwrap_or_else(|| {
                    registers += 1;
                    registers - 1
                });
                places.insert(operand, register);
                writes.push((part, register));
            }
            instructions.push(self.instruction(draft.kind, &reads, &writes));
        }
        let outputs = outputs.iter().map(|&id| self.slot(Operand::Of(id), &places)).collect();
        let Self { graph, uniforms, .. } = self;
        Tape {
            instructions,
            registers,
            fields: graph.fields.clone(),
            resources: graph.resources.clone(),
            outputs,
            graph: graph.clone(),
            uniforms,
        }
    }

    fn instruction(&self, kind: Kind, reads: &[Slot], writes: &[(usize, usize)]) -> Instruction {
        let out = writes.first().map_or(0, |(_, register)| *register);
        match (kind, reads) {
            (Kind::Load(field), _) => Instruction::Load(field, out),
            (Kind::Unary(op), &[a]) => Instruction::Unary(op, a, out),
            (Kind::Binary(op), &[a, b]) => Instruction::Binary(op, a, b, out),
            (Kind::MultiplyAdd, &[a, b, c]) => Instruction::MultiplyAdd([a, b, c], out),
            (Kind::SubtractProduct, &[a, b, c]) => Instruction::SubtractProduct([a, b, c], out),
            (Kind::SelectLess, &[a, b, yes, no]) => Instruction::Select(Test::Less(a, b), yes, no, out),
            (Kind::SelectGreaterEqual, &[a, b, yes, no]) => {
                Instruction::Select(Test::GreaterEqual(a, b), yes, no, out)
            }
            (Kind::SelectFinite, &[a, yes, no]) => Instruction::Select(Test::IsFinite(a), yes, no, out),
            (Kind::SelectHolds, &[a, yes, no]) => Instruction::Select(Test::Holds(a), yes, no, out),
            (Kind::Lookup(node), &[face, s, t]) => {
                let Node::Lookup { resource, .. } = self.graph.node(Id(node as u32)) else {
                    unreachable!("a lookup is made of a lookup's node")
                };
                let mut parts = [None; LOOKUP_PARTS];
                writes.iter().for_each(|&(part, register)| parts[part] = Some(register));
                Instruction::Lookup(resource as usize, [face, s, t], parts)
            }
            _ => unreachable!("every kind reads as many operands as it is given"),
        }
    }

    /// Where an operand stands.
    fn slot(&mut self, operand: Operand, places: &HashMap<Operand, usize>) -> Slot {
        if let Some(&register) = places.get(&operand) {
            return Slot::Register(register);
        }
        let known = self.uniforms.iter().position(|&uniform| uniform == operand);
        Slot::Uniform(known.unwrap_or_else(|| {
            self.uniforms.push(operand);
            self.uniforms.len() - 1
        }))
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
