//! What stays from pass to pass: the numbers of a sample that no free parameter moves.
//!
//! Where such a number meets one that moves, the graph is cut: the number is computed once, kept beside the sample,
//! and read by later passes like a field. What is cheaper to compute anew than to read is not kept.

use super::graph::{Binary, Graph, Id, Input, Node, Unary};

/// The name under which kept numbers are read.
pub const KEPT: &str = "kept";

/// Operations up to which a number of one field is computed anew in each pass.
const CHEAP: usize = 3;

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
    let mut kept = Vec::new();
    for at in 0..graph.len() {
        let id = Id(at as u32);
        if !edge[at] && !seldom[at] {
            continue;
        }
        if !edge[at] || is_cheap(graph, id) {
            let leaves = leaves(graph, id);
            if !looks_up {
                for leaf in leaves {
                    if !kept.contains(&leaf) {
                        kept.push(leaf);
                    }
                }
            }
        } else if !kept.contains(&id) && !is_one_operation_on(graph, id, &kept, &varies) {
            kept.push(id);
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

/// Whether a number is a field, or a few operations on one.
fn is_cheap(graph: &Graph, id: Id) -> bool {
    let reached = graph.reached(&[id]);
    let nodes = (0..=id.index()).filter(|&at| reached[at]).map(|at| graph.node(Id(at as u32)));
    let (mut fields, mut operations) = (0, 0);
    for node in nodes {
        match node {
            Node::Field(_) => fields += 1,
            Node::Constant(_) | Node::Uniform(_) => {}
            Node::Call(_) | Node::Part(..) => return false,
            Node::Unary(..) | Node::Binary(..) | Node::Select { .. } => operations += 1,
        }
    }
    fields <= 1 && operations <= CHEAP
}

/// The fields that a number is made of.
fn leaves(graph: &Graph, id: Id) -> Vec<Id> {
    let reached = graph.reached(&[id]);
    let ids = (0..=id.index()).filter(|&at| reached[at]).map(|at| Id(at as u32));
    ids.filter(|&id| matches!(graph.node(id), Node::Field(_))).collect()
}
