//! What stays from pass to pass: the numbers of a sample that no free parameter moves.
//!
//! Where such a number meets one that moves, the graph is cut: the number is computed once, kept beside the sample,
//! and read by later passes like a field; or each pass computes it anew, of other numbers that are kept and of fields:
//! what takes the least time of all (`minimum_cut`).

use super::graph::{Binary, Graph, Id, Input, Native, Node, Unary};
use crate::minimum_cut::{Costs, NEVER, cheapest};

/// The name under which kept numbers are read.
pub const KEPT: &str = "kept";

/// What a pass spends on sixteen samples to read a field of theirs, in additions: passes over more than the caches hold wait
/// for memory, from which such a row of 64 bytes comes to a core in some eight nanoseconds.
const READ: u64 = 24;
/// And to read a number that is kept, which takes memory beside the fields.
const READ_KEPT: u64 = 25;
/// A quotient or a root.
const DIVIDE: u64 = 6;
/// A power or a logarithm.
const POWER: u64 = 16;
/// A unit vector, or a place on a cube.
const UNIT: u64 = 24;
/// More than to read what it finds, which is four numbers: nothing is looked up anew that stays.
const LOOKUP: u64 = 200;

/// A graph in two parts.
#[derive(Debug)]
pub struct Cut {
    /// Numbers to be kept, nodes of the graph that was cut.
    pub kept: Vec<Id>,
    /// What is left for each pass; it reads the kept numbers as components of [`KEPT`].
    pub graph: Graph,
    /// The outputs there.
    pub outputs: Vec<Id>,
}

/// Cut off what `outputs` need but does not differ between passes; `moves` says which inputs and lookups do.
pub fn cut(graph: &Graph, outputs: &[Id], moves: impl Fn(&Graph, Id) -> bool) -> Cut {
    let numbers = Numbers::new(graph, outputs, moves);
    let kept: Vec<Id> = cheapest(&numbers.met(outputs), |id| numbers.costs(id)).into_iter().collect();
    let place = |id: Id| kept.iter().position(|&k| k == id);
    let instead = |id: Id| place(id).map(|component| Input { name: KEPT.to_owned(), component });
    let (rest, outputs) = graph.rebuilt(outputs, instead);
    Cut { kept, graph: rest, outputs }
}

/// A graph's numbers by what becomes of them.
struct Numbers<'a> {
    graph: &'a Graph,
    /// Made of what differs between passes.
    live: Vec<bool>,
    /// Made of what differs between samples.
    varies: Vec<bool>,
    /// Made of a lookup.
    looked_up: Vec<bool>,
    /// Whether passes look something up. Without lookups of its own a pass need not read samples at all: what it would read
    /// of them is kept as well.
    looks_up: bool,
}

impl<'a> Numbers<'a> {
    fn new(graph: &'a Graph, outputs: &[Id], moves: impl Fn(&Graph, Id) -> bool) -> Self {
        let live = graph.made_of(moves);
        let varies = graph
            .made_of(|graph, id| matches!(graph.node(id), Node::Field(_)) || graph.looked_up(id).is_some());
        let looked_up = graph.made_of(|graph, id| graph.looked_up(id).is_some());
        let reached = graph.reached(outputs);
        let looks_up =
            graph.ids().any(|id| reached[id.index()] && live[id.index()] && graph.looked_up(id).is_some());
        Self { graph, live, varies, looked_up, looks_up }
    }

    fn stays(&self, id: Id) -> bool {
        self.varies[id.index()] && !self.live[id.index()]
    }

    /// What an operation takes of numbers that stay. A fallback is asked for so seldom that it is not worth keeping, unless
    /// it is a lookup, or nothing else is read of samples.
    fn operands(&self, id: Id) -> Vec<Id> {
        let first = self.graph.call_of(id).map_or(usize::MAX, |call| call.native.hot());
        let last = self.graph.call_of(id).map_or(0, |call| call.arguments.len());
        let of = self.graph.operands(id).into_iter().enumerate();
        let seldom =
            |k: usize, id: Id| (first..last).contains(&k) && self.looks_up && !self.looked_up[id.index()];
        of.filter(|&(k, id)| self.stays(id) && !seldom(k, id)).map(|(_, id)| id).collect()
    }

    /// The numbers that stay and meet what does not, outputs among them.
    fn met(&self, outputs: &[Id]) -> Vec<Id> {
        let reached = self.graph.reached(outputs);
        let live = self.graph.ids().filter(|id| reached[id.index()] && self.live[id.index()]);
        let mut met: Vec<Id> = live.flat_map(|id| self.operands(id)).collect();
        met.extend(outputs.iter().filter(|&&id| self.stays(id)));
        met.sort_unstable();
        met.dedup();
        met
    }

    fn costs(&self, id: Id) -> Costs<Id> {
        // Of a call each part is kept by itself.
        let kept = if matches!(self.graph.node(id), Node::Call(_)) { NEVER } else { READ_KEPT };
        Costs { kept, made: self.made(id), of: self.operands(id) }
    }

    /// What it costs to have a number in a pass whose operands are there: about as long as processors take.
    fn made(&self, id: Id) -> u64 {
        match self.graph.node(id) {
            Node::Field(_) if self.looks_up => READ,
            Node::Field(_) => NEVER,
            Node::Constant(_) | Node::Uniform(_) | Node::Part(..) => 0,
            Node::Unary(Unary::Sqrt | Unary::Reciprocal, _) | Node::Binary(Binary::Divide, ..) => DIVIDE,
            Node::Unary(Unary::Exp2 | Unary::Log2, _) => POWER,
            Node::Unary(..) | Node::Binary(..) | Node::Select { .. } => 1,
            Node::Call(_) => match self.graph.call_of(id).map(|call| call.native) {
                Some(Native::Lookup(_)) => LOOKUP,
                Some(Native::Unit | Native::Place) | None => UNIT,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::graph::Native;

    /// How many numbers are kept of a fixed vector less the view and less `other` fields, whose components and
    /// square are needed beside a lookup along what the uniform `free` makes of the view: along a unit vector whose
    /// fallback is made of these fields, if `falls_back`.
    fn kept_of(other: usize, falls_back: bool) -> usize {
        let mut graph = Graph::default();
        let (free, angle) = (graph.uniform("free", 0), graph.uniform("angle", 0));
        // What all samples share, in many operations.
        let fixed = (0..9).fold(angle, |all, _| graph.binary(Binary::Multiply, all, angle));
        let view = [0, 1, 2].map(|c| graph.field("view", c));
        let mut along = view.map(|v| graph.binary(Binary::Add, v, free)).to_vec();
        if falls_back {
            let others: Vec<Id> = (0..other).map(|k| graph.field("other", k)).collect();
            let fallback = others.iter().fold(fixed, |sum, other| graph.binary(Binary::Add, sum, *other));
            along = graph.call(Native::Unit, [along, vec![fallback; 3]].concat(), Vec::new());
        }
        let faces = graph.resource("faces");
        let [mut sum, ..] = graph.call(Native::Lookup(faces), along, Vec::new())[..] else {
            return 0;
        };
        let mut square = graph.constant(0.0);
        for v in view {
            let mut half = graph.binary(Binary::Subtract, fixed, v);
            for k in 0..other {
                let more = graph.field("other", k);
                half = graph.binary(Binary::Subtract, half, more);
            }
            let squared = graph.binary(Binary::Multiply, half, half);
            square = graph.binary(Binary::Add, square, squared);
            let moved = graph.binary(Binary::Multiply, half, free);
            sum = graph.binary(Binary::Add, sum, moved);
        }
        let output = graph.binary(Binary::Multiply, sum, square);
        let moves = |graph: &Graph, id: Id| match graph.node(id) {
            Node::Uniform(at) => graph.uniforms[at as usize].name == "free",
            _ => false,
        };
        cut(&graph, &[output], moves).kept.len()
    }

    #[test]
    fn what_a_few_operations_make_of_numbers_that_are_read_anyway_is_not_kept() {
        assert_eq!(kept_of(0, false), 0);
        assert_eq!(kept_of(1, false), 0);
        // Four more fields to read, for three numbers; the square takes five operations on them.
        assert_eq!(kept_of(4, false), 3);
        // What a fallback alone would read is not there.
        assert_eq!(kept_of(4, true), 3);
    }
}
