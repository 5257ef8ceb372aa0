//! What stays from pass to pass: the numbers of a sample that no free parameter moves.
//!
//! Where such a number meets one that moves, the graph is cut: the number is computed once, kept beside the sample,
//! and read by later passes like a field. What is cheaper to compute anew than to read is not kept.

use super::graph::{Binary, Graph, Id, Input, Node, Unary};

/// The name under which kept numbers are read.
pub const KEPT: &str = "kept";

/// Operations up to which a number of one field is computed anew in each pass.
const CHEAP: usize = 3;
/// And of fields that a pass reads anyway.
const CHEAP_OF_READ: usize = 6;

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
    let live = graph.made_of(&moves);
    let varies =
        graph.made_of(|graph, id| matches!(graph.node(id), Node::Field(_)) || graph.looked_up(id).is_some());
    let looked_up = graph.made_of(|graph, id| graph.looked_up(id).is_some());
    let reached = graph.reached(outputs);
    let stays = |id: Id| varies[id.index()] && !live[id.index()];
    let (mut edge, mut seldom) = (vec![false; graph.len()], vec![false; graph.len()]);
    for at in (0..graph.len()).map(|at| Id(at as u32)).filter(|id| reached[id.index()]) {
        if live[at.index()] {
            // A fallback is asked for so seldom that it is not worth keeping, unless it is a lookup.
            let first = graph.call_of(at).map_or(usize::MAX, |call| call.native.hot());
            let last = graph.call_of(at).map_or(0, |call| call.arguments.len());
            for (k, id) in graph.operands(at).into_iter().enumerate().filter(|&(_, id)| stays(id)) {
                let fallback = (first..last).contains(&k) && !looked_up[id.index()];
                (if fallback { &mut seldom } else { &mut edge })[id.index()] = true;
            }
        }
    }
    outputs.iter().filter(|&&id| stays(id)).for_each(|id| edge[id.index()] = true);
    // Without lookups of its own a pass need not read samples at all.
    let looks_up =
        (0..graph.len()).any(|at| reached[at] && live[at] && graph.looked_up(Id(at as u32)).is_some());
    // What such a pass reads and computes for its own sake is there for other numbers, too.
    let mut there = vec![false; graph.len()];
    let computed = |id: Id, there: &mut [bool]| {
        let reached = graph.reached(&[id]);
        reached.iter().zip(there).for_each(|(reached, there)| *there |= reached);
    };
    if looks_up {
        let cheap: Vec<Id> =
            graph.ids().filter(|id| edge[id.index()] && is_cheap(graph, *id, &varies, &there)).collect();
        cheap.into_iter().for_each(|id| computed(id, &mut there));
    }
    let mut kept = Vec::new();
    for at in 0..graph.len() {
        let id = Id(at as u32);
        if !edge[at] && !seldom[at] {
            continue;
        }
        if !edge[at] || is_cheap(graph, id, &varies, &there) {
            if looks_up {
                if edge[at] {
                    computed(id, &mut there);
                }
                continue;
            }
            for leaf in leaves(graph, id) {
                if !kept.contains(&leaf) {
                    kept.push(leaf);
                }
            }
        } else if !kept.contains(&id) && !is_one_operation_on(graph, id, &kept, &varies) {
            kept.push(id);
            there[at] |= looks_up;
        }
    }
    let place = |id: Id| kept.iter().position(|&k| k == id);
    let instead = |id: Id| place(id).map(|component| Input { name: KEPT.to_owned(), component });
    let (rest, outputs) = graph.rebuilt(outputs, instead);
    Cut { kept, graph: rest, outputs }
}

/// Whether a number is one operation on numbers that are kept, and on such as do not vary: as cheap to make as to read.
fn is_one_operation_on(graph: &Graph, id: Id, kept: &[Id], varies: &[bool]) -> bool {
    let plain = match graph.node(id) {
        Node::Unary(op, _) => !matches!(op, Unary::Log2 | Unary::Exp2 | Unary::Sqrt | Unary::Reciprocal),
        Node::Binary(op, ..) => op != Binary::Divide,
        _ => false,
    };
    plain && graph.operands(id).into_iter().all(|operand| !varies[operand.index()] || kept.contains(&operand))
}

/// Whether a number is a field, or a few operations on one, and on what is `there` anyway.
fn is_cheap(graph: &Graph, id: Id, varies: &[bool], there: &[bool]) -> bool {
    let (mut fields, mut operations) = (0, 0);
    let (mut open, mut seen) = (vec![id], vec![false; id.index() + 1]);
    while let Some(id) = open.pop() {
        // What all samples share is computed once.
        if !varies[id.index()] || there[id.index()] || std::mem::replace(&mut seen[id.index()], true) {
            continue;
        }
        match graph.node(id) {
            Node::Field(_) => fields += 1,
            Node::Constant(_) | Node::Uniform(_) => {}
            Node::Call(_) | Node::Part(..) => return false,
            Node::Unary(..) | Node::Binary(..) | Node::Select { .. } => operations += 1,
        }
        open.extend(graph.operands(id));
    }
    fields == 0 && operations <= CHEAP_OF_READ || fields <= 1 && operations <= CHEAP
}

/// The fields that a number is made of.
fn leaves(graph: &Graph, id: Id) -> Vec<Id> {
    let reached = graph.reached(&[id]);
    let ids = (0..=id.index()).filter(|&at| reached[at]).map(|at| Id(at as u32));
    ids.filter(|&id| matches!(graph.node(id), Node::Field(_))).collect()
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
        // Two more fields to read, for each of three numbers; the square takes five operations on them.
        assert_eq!(kept_of(2, false), 3);
        // What a fallback alone would read is not there.
        assert_eq!(kept_of(2, true), 3);
    }
}
