//! Nodes of a graph in an order in which they can be computed, as instructions; then the registers.
//!
//! An operand that was not yet written is written right before the operation, so that most numbers are used by the
//! instruction after theirs.

use std::collections::HashMap;

use super::blocks::in_order;
use super::draft::{Draft, Kind};
use super::families::{Family, families};
use super::graph::{Binary, Call, Graph, Id, Native, Node, Unary};
use super::rolled::bodies;
use super::tape::{Operand, Rolled, Slot, Tape};

/// Instructions over nodes, whose registers are not yet known.
struct Writer<'a> {
    graph: &'a Graph,
    /// Whether a node differs between samples.
    varies: Vec<bool>,
    /// Whether a node is needed for every sample, and not only where something stands in.
    hot: Vec<bool>,
    /// How often a node is an operand or an output.
    uses: Vec<u32>,
    /// Denominators of several quotients: one reciprocal serves them.
    divides: Vec<u32>,
    /// For each call, the calls for how its value moves.
    slopes: HashMap<(Native, Vec<Id>), Vec<Id>>,
    written: Vec<bool>,
    reciprocals: Vec<bool>,
    drafts: Vec<Draft>,
    uniforms: Vec<Operand>,
    rolled: Option<Rolled>,
}

impl Tape {
    /// The instructions that compute `outputs`.
    #[must_use]
    pub fn new(graph: &Graph, outputs: &[Id]) -> Self {
        let mut writer = Writer::new(graph, outputs);
        writer.write(outputs);
        writer.finish(outputs)
    }

    /// The same in an order in which few numbers wait at once, where many would: so that a compiler finds registers for
    /// most of them. A machine with an accumulator has none to find, and prefers the order of [`Self::new`].
    ///
    /// What is the same for several members of a family stands together, so that it can be printed once; `kept` says what the
    /// numbers are of that are read as [`KEPT`](super::cut::KEPT).
    #[must_use]
    pub fn with_few_registers(graph: &Graph, outputs: &[Id], kept: &[Family]) -> Self {
        let mut writer = Writer::new(graph, outputs);
        writer.write(outputs);
        let drafts = std::mem::take(&mut writer.drafts);
        let bodies = bodies(graph, &drafts, &families(graph, kept), &writer.varies);
        let wanted: Vec<Operand> = outputs.iter().map(|&id| Operand::Of(id)).collect();
        (writer.drafts, writer.rolled) = in_order(drafts, &wanted, bodies.as_ref());
        if let (Some(bodies), Some(rolled)) = (bodies, &mut writer.rolled) {
            rolled.own = bodies.uniforms.len();
            let members = 0..rolled.left.len();
            let of = |member: usize| bodies.uniforms.iter().map(move |of_all| of_all[member]);
            writer.uniforms = members.flat_map(of).collect();
        }
        writer.finish(outputs)
    }
}

impl<'a> Writer<'a> {
    fn new(graph: &'a Graph, outputs: &[Id]) -> Self {
        let varies = graph
            .made_of(|graph, id| matches!(graph.node(id), Node::Field(_)) || graph.looked_up(id).is_some());
        let reached = graph.reached(outputs);
        let (mut uses, mut divides) = (vec![0; graph.len()], vec![0; graph.len()]);
        outputs.iter().for_each(|id| uses[id.index()] += 1);
        let mut slopes: HashMap<(Native, Vec<Id>), Vec<Id>> = HashMap::new();
        for at in (0..graph.len()).filter(|&at| reached[at]) {
            let id = Id(at as u32);
            graph.operands(id).iter().for_each(|operand| uses[operand.index()] += 1);
            if let Node::Binary(Binary::Divide, _, b) = graph.node(id) {
                divides[b.index()] += 1;
            }
            if let Some(Call { native, arguments, along }) = graph.call_of(id)
                && !along.is_empty()
            {
                slopes.entry((*native, arguments.clone())).or_default().push(id);
            }
        }
        Self {
            graph,
            varies,
            hot: hot(graph, outputs),
            uses,
            divides,
            slopes,
            written: vec![false; graph.len()],
            reciprocals: vec![false; graph.len()],
            drafts: Vec::new(),
            uniforms: Vec::new(),
            rolled: None,
        }
    }

    fn write(&mut self, outputs: &[Id]) {
        // Where lookups fall comes first, and powers: what they wait for hides behind the texels.
        let hot: Vec<Id> = (0..self.graph.len()).filter(|&at| self.hot[at]).map(|at| Id(at as u32)).collect();
        for &id in &hot {
            if let Some(call) = self.graph.call_of(id)
                && matches!(call.native, Native::Lookup(_))
            {
                let reads: Vec<Id> = call.arguments.iter().chain(&call.along).copied().collect();
                reads.into_iter().for_each(|id| self.want(id));
            }
        }
        for &id in &hot {
            if matches!(self.graph.node(id), Node::Unary(Unary::Exp2, _)) {
                self.want(id);
            }
        }
        outputs.iter().for_each(|&id| self.want(id));
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
        match self.graph.node(id) {
            Node::Part(call, _) => return self.want_call(call),
            Node::Call(_) => return self.want_call(id),
            _ => {}
        }
        self.written[id.index()] = true;
        let (kind, reads) = self.selected(id);
        for operand in &reads {
            match *operand {
                Operand::Of(id) | Operand::FlagOf(id) => self.want(id),
                Operand::ReciprocalOf(id) => self.want_reciprocal(id),
            }
        }
        self.drafts.push(Draft { kind, reads, writes: vec![Operand::Of(id)] });
    }

    fn want_reciprocal(&mut self, id: Id) {
        self.want(id);
        if self.varies[id.index()] && !self.reciprocals[id.index()] {
            self.reciprocals[id.index()] = true;
            self.drafts.push(Draft {
                kind: Kind::Unary(Unary::Reciprocal),
                reads: vec![Operand::Of(id)],
                writes: vec![Operand::ReciprocalOf(id)],
            });
        }
    }

    /// A call's value and its wanted slopes, in one instruction.
    fn want_call(&mut self, id: Id) {
        let Some(Call { native, arguments, along }) = self.graph.call_of(id).cloned() else { return };
        let hot = native.hot();
        let group = self.slopes.get(&(native, arguments.clone())).cloned().unwrap_or_default();
        let value = self.value_of(native, &arguments);
        // A vector that is made of the value, or of how it moves, comes later, by an instruction of its own.
        let free = |&slope: &Id| {
            let along = self.graph.call_of(slope).map(|call| call.along.clone()).unwrap_or_default();
            let reached = self.graph.reached(&along);
            !value.iter().chain(&group).any(|member| reached[member.index()])
        };
        let together: Vec<Id> = group.iter().copied().filter(free).collect();
        let (value, slopes) =
            if along.is_empty() || together.contains(&id) { (value, together) } else { (None, vec![id]) };
        arguments[..hot].iter().for_each(|&id| self.want(id));
        let mut reads: Vec<Operand> = arguments[..hot].iter().map(|&id| Operand::Of(id)).collect();
        for &slope in &slopes {
            let along = self.graph.call_of(slope).map(|call| call.along.clone()).unwrap_or_default();
            along.iter().for_each(|&id| self.want(id));
            reads.extend(along.into_iter().map(Operand::Of));
        }
        let widths = native.widths();
        let (mut parts, mut writes) = (Vec::new(), Vec::new());
        let calls = value.into_iter().map(|id| (id, 0));
        let moved = slopes.iter().enumerate().map(|(k, &id)| (id, widths.parts + k * widths.slopes));
        for (call, first) in calls.chain(moved) {
            self.written[call.index()] = true;
            for part in 0..widths.parts.max(widths.slopes) {
                if let Some(node) =
                    self.graph.known(Node::Part(call, part as u8)).filter(|n| self.uses[n.index()] > 0)
                {
                    self.written[node.index()] = true;
                    parts.push(first + part);
                    writes.push(Operand::Of(node));
                }
            }
        }
        let shown: Vec<(usize, Operand)> = parts
            .iter()
            .copied()
            .zip(writes.iter().copied())
            .filter(|(part, _)| *part < widths.parts)
            .collect();
        let fallback = &arguments[hot..];
        let mends = !fallback.is_empty() && !shown.is_empty();
        if mends {
            // What every sample needs is no part of what is left out.
            for &id in fallback {
                self.want_hot(id);
            }
            writes.push(Operand::FlagOf(id));
        }
        let at = self.drafts.len();
        let skip = mends.then_some(0);
        self.drafts.push(Draft {
            kind: Kind::Call { native, along: slopes.len(), parts, skip },
            reads,
            writes,
        });
        if mends {
            let before = self.written.clone();
            let reciprocals = self.reciprocals.clone();
            fallback.iter().for_each(|&id| self.want(id));
            let mut reads = vec![Operand::FlagOf(id)];
            reads.extend(shown.iter().map(|(_, operand)| *operand));
            reads.extend(fallback.iter().map(|&id| Operand::Of(id)));
            let parts = shown.iter().map(|(part, _)| *part).collect();
            self.drafts.push(Draft { kind: Kind::Mend(parts), reads, writes: Vec::new() });
            // What was written in between is there only where it was needed.
            (self.written, self.reciprocals) = (before, reciprocals);
            let after = self.drafts.len();
            if let Kind::Call { skip, .. } = &mut self.drafts[at].kind {
                *skip = Some(after - at - 1);
            }
        }
    }

    /// The call of a function's value, where the graph has one.
    fn value_of(&self, native: Native, arguments: &[Id]) -> Option<Id> {
        self.graph.known_call(&Call { native, arguments: arguments.to_vec(), along: Vec::new() })
    }

    /// Write what a node is made of that every sample needs.
    fn want_hot(&mut self, id: Id) {
        if self.hot[id.index()] {
            self.want(id);
            return;
        }
        if self.varies[id.index()] {
            self.graph.operands(id).into_iter().for_each(|id| self.want_hot(id));
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
            Node::Part(..) | Node::Call(_) => unreachable!("a call writes its parts"),
            Node::Constant(_) | Node::Uniform(_) => unreachable!("it is the same for all samples"),
        }
    }

    fn finish(mut self, outputs: &[Id]) -> Tape {
        let mut last: HashMap<Operand, usize> = HashMap::new();
        for (at, draft) in self.drafts.iter().enumerate() {
            last.extend(draft.reads.iter().map(|&operand| (operand, at)));
        }
        // Outputs stay.
        last.extend(outputs.iter().map(|&id| (Operand::Of(id), usize::MAX)));
        let drafts = std::mem::take(&mut self.drafts);
        let mut registers = Registers::default();
        let mut instructions = Vec::new();
        let mut rolled = self.rolled.take();
        let left = rolled.as_ref().map(|rolled| left_by(&drafts, rolled, &last)).unwrap_or_default();
        for operand in left.iter().flatten() {
            // It stays to the end of the loop, whichever member's it is.
            let end = rolled.as_ref().map_or(0, |rolled| rolled.range().end);
            last.entry(*operand).and_modify(|last| *last = end.max(*last)).or_insert(end);
        }
        for (at, draft) in drafts.iter().enumerate() {
            let reads: Vec<Slot> = draft.reads.iter().map(|&o| self.slot(o, &registers)).collect();
            // A call reads its arguments again and again while it writes.
            let calls = matches!(draft.kind, Kind::Call { .. });
            if !calls {
                registers.release(&draft.reads, at, &last);
            }
            let writes: Vec<usize> = draft.writes.iter().map(|&operand| registers.take(operand)).collect();
            if calls {
                registers.release(&draft.reads, at, &last);
            }
            instructions.push(draft.kind.instruction(&reads, &writes));
            // What nobody reads, a flag for instance, is free again.
            registers.release(
                &draft.writes,
                at,
                &draft.writes.iter().map(|&o| (o, *last.get(&o).unwrap_or(&at))).collect(),
            );
            if let Some(rolled) = rolled.as_mut().filter(|rolled| rolled.range().end == at + 1) {
                rolled.left = left
                    .iter()
                    .map(|of| of.iter().map(|operand| registers.places[operand]).collect())
                    .collect();
            }
        }
        let outputs = outputs.iter().map(|&id| self.slot(Operand::Of(id), &registers)).collect();
        Tape {
            instructions,
            registers: registers.count,
            fields: self.graph.fields.clone(),
            resources: self.graph.resources.clone(),
            outputs,
            graph: self.graph.clone(),
            uniforms: self.uniforms,
            rolled,
        }
    }

    /// Where an operand stands.
    fn slot(&mut self, operand: Operand, registers: &Registers) -> Slot {
        if let Some(&register) = registers.places.get(&operand) {
            return Slot::Register(register);
        }
        let known = self.uniforms.iter().position(|&uniform| uniform == operand);
        Slot::Uniform(known.unwrap_or_else(|| {
            self.uniforms.push(operand);
            self.uniforms.len() - 1
        }))
    }
}

/// For each member of a loop what is read behind it, or of another member is.
fn left_by(drafts: &[Draft], rolled: &Rolled, last: &HashMap<Operand, usize>) -> Vec<Vec<Operand>> {
    let of_member = |member: usize| {
        let own = &drafts[rolled.start + member * rolled.length..][..rolled.length];
        own.iter().flat_map(|draft| &draft.writes).copied().collect::<Vec<Operand>>()
    };
    let all: Vec<Vec<Operand>> = (0..rolled.left.len()).map(of_member).collect();
    let end = rolled.range().end;
    let read = |&k: &usize| all.iter().any(|of| last.get(&of[k]).is_some_and(|&last| last >= end));
    let left: Vec<usize> = (0..all[0].len()).filter(read).collect();
    all.iter().map(|of| left.iter().map(|&k| of[k]).collect()).collect()
}

/// The nodes that every sample needs: fallbacks are not, nor what only they are made of.
fn hot(graph: &Graph, outputs: &[Id]) -> Vec<bool> {
    let mut hot = vec![false; graph.len()];
    outputs.iter().for_each(|id| hot[id.index()] = true);
    for at in (0..graph.len()).rev() {
        if hot[at] {
            let id = Id(at as u32);
            for (k, operand) in graph.operands(id).into_iter().enumerate() {
                let seldom = graph
                    .call_of(id)
                    .is_some_and(|call| (call.native.hot()..call.arguments.len()).contains(&k));
                if !seldom {
                    hot[operand.index()] = true;
                }
            }
        }
    }
    hot
}

/// Which registers are in use.
#[derive(Default)]
struct Registers {
    places: HashMap<Operand, usize>,
    free: Vec<usize>,
    count: usize,
}

impl Registers {
    fn take(&mut self, operand: Operand) -> usize {
        let register = self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        });
        self.places.insert(operand, register);
        register
    }

    /// Free what is read for the last time.
    fn release(&mut self, operands: &[Operand], at: usize, last: &HashMap<Operand, usize>) {
        for operand in operands {
            if last.get(operand) == Some(&at) {
                self.free.extend(self.places.remove(operand));
            }
        }
    }
}
