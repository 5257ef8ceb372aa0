//! What to keep and what to make anew, at the least cost.
//!
//! Things are made of other things; who wants one reads what was kept of it, or makes it anew and wants what it is made of.
//! That choice is a minimum cut of a network (after Picard, "Maximal closure of a graph and applications to combinatorial
//! problems", Management Science 22, 1976). A thing is two vertices, *wanted* and *made*; the edge between them can carry
//! what keeping costs, the one from *made* to the sink what making costs, and those from *made* to what it is made of any
//! amount. What can flow from all that is wanted to the sink is what the best choice costs. Where no more can flow, what is
//! wanted and still reached from the source, but not made, is kept.

use std::collections::{BTreeMap, BTreeSet};

use petgraph::Graph;
use petgraph::algo::dinics;
use petgraph::graph::NodeIndex;
use petgraph::visit::EdgeRef;

/// More than any choice costs: of what cannot be kept, or not be made. A thing is one of both at the most.
pub(crate) const NEVER: u64 = 1 << 32;

/// What a thing costs, in any unit, and what it is made of.
pub(crate) struct Costs<T> {
    /// To read what was kept of it.
    pub(crate) kept: u64,
    /// To make it, once what it is made of is there.
    pub(crate) made: u64,
    /// What it is made of.
    pub(crate) of: Vec<T>,
}

/// The network: its edges carry what they can.
type Network = Graph<(), u64>;

/// What is kept so that all `wanted` are there at the least cost.
pub(crate) fn cheapest<T: Copy + Ord>(wanted: &[T], costs: impl Fn(T) -> Costs<T>) -> BTreeSet<T> {
    let mut network = Network::new();
    let (source, sink) = (network.add_node(()), network.add_node(()));
    let mut vertices: BTreeMap<T, [NodeIndex; 2]> = BTreeMap::new();
    let mut vertices_of = |thing, network: &mut Network| {
        *vertices.entry(thing).or_insert_with(|| [network.add_node(()), network.add_node(())])
    };
    for &thing in wanted {
        let [wanted, _] = vertices_of(thing, &mut network);
        network.update_edge(source, wanted, NEVER);
    }
    let (mut open, mut seen) = (wanted.to_vec(), BTreeSet::new());
    while let Some(thing) = open.pop() {
        if !seen.insert(thing) {
            continue;
        }
        let Costs { kept, made, of } = costs(thing);
        let [wanted, anew] = vertices_of(thing, &mut network);
        network.add_edge(wanted, anew, kept);
        network.add_edge(anew, sink, made);
        for &part in &of {
            let [part, _] = vertices_of(part, &mut network);
            network.update_edge(anew, part, NEVER);
        }
        open.extend(of);
    }
    let (_, flows) = dinics(&network, source, sink);
    let reached = still_reached(&network, &flows, source);
    let is_kept = |[wanted, anew]: &[NodeIndex; 2]| reached[wanted.index()] && !reached[anew.index()];
    vertices.into_iter().filter(|(_, vertices)| is_kept(vertices)).map(|(thing, _)| thing).collect()
}

/// For each vertex, whether more could flow there: along edges that are not full, and against what flows.
fn still_reached(network: &Network, flows: &[u64], source: NodeIndex) -> Vec<bool> {
    let (mut open, mut reached) = (vec![source], vec![false; network.node_count()]);
    reached[source.index()] = true;
    while let Some(vertex) = open.pop() {
        let onwards = network.edges(vertex).filter(|edge| flows[edge.id().index()] < *edge.weight());
        let against = network.edges_directed(vertex, petgraph::Incoming);
        let against = against.filter(|edge| flows[edge.id().index()] > 0).map(|edge| edge.source());
        for next in onwards.map(|edge| edge.target()).chain(against) {
            if !std::mem::replace(&mut reached[next.index()], true) {
                open.push(next);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What it costs to have all `wanted` where `kept` are.
    fn spent(wanted: &[usize], kept: u32, costs: &[Costs<usize>]) -> u64 {
        let (mut open, mut seen) = (wanted.to_vec(), BTreeSet::new());
        let mut sum = 0;
        while let Some(thing) = open.pop() {
            if !seen.insert(thing) {
                continue;
            }
            if kept >> thing & 1 == 1 {
                sum += costs[thing].kept;
            } else {
                sum += costs[thing].made;
                open.extend(&costs[thing].of);
            }
        }
        sum
    }

    #[test]
    fn no_other_choice_costs_less() {
        let mut state = 7_u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for turn in 0..200 {
            let costs: Vec<Costs<usize>> = (0..12)
                .map(|thing| Costs {
                    kept: if random(6) == 0 { NEVER } else { 1 + random(9) as u64 },
                    // What all share costs nothing.
                    made: random(12) as u64,
                    of: (0..thing).filter(|_| random(4) == 0).collect(),
                })
                .collect();
            let wanted = [11, 10, random(10)];
            let kept = cheapest(&wanted, |thing| {
                let Costs { kept, made, ref of } = costs[thing];
                Costs { kept, made, of: of.clone() }
            });
            let bits = kept.iter().fold(0, |bits, thing| bits | 1 << thing);
            let least = (0..1 << costs.len()).map(|bits| spent(&wanted, bits, &costs)).min();
            assert_eq!(Some(spent(&wanted, bits, &costs)), least, "turn {turn}");
        }
    }
}
