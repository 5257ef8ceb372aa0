//! What to keep and what to make anew, at the least cost.
//!
//! Things are made of other things; who wants one reads what was kept of it, or makes it anew and wants what it is made of.
//! That choice is a minimum cut of a network (after Picard, "Maximal closure of a graph and applications to combinatorial
//! problems", Management Science 22, 1976). A thing is two vertices, *wanted* and *made*; the edge between them can carry
//! what keeping costs, the one from *made* to the sink what making costs, and those from *made* to what it is made of any
//! amount. What can flow from all that is wanted to the sink is what the best choice costs, and the edges that a minimum cut
//! goes through are that choice.

use std::collections::BTreeSet;
use std::hash::Hash;

use pathfinding::directed::edmonds_karp::edmonds_karp_sparse;

/// More than any choice costs: of what cannot be kept.
pub(crate) const NEVER: i32 = 1 << 24;

/// What a thing costs, in any unit, and what it is made of.
pub(crate) struct Costs<T> {
    /// To read what was kept of it.
    pub(crate) kept: i32,
    /// To make it, once what it is made of is there.
    pub(crate) made: i32,
    /// What it is made of.
    pub(crate) of: Vec<T>,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Vertex<T> {
    Source,
    Wanted(T),
    Made(T),
    Sink,
}

/// What is kept so that all `wanted` are there at the least cost.
pub(crate) fn cheapest<T: Copy + Eq + Hash + Ord>(
    wanted: &[T],
    costs: impl Fn(T) -> Costs<T>,
) -> BTreeSet<T> {
    use Vertex::{Made, Sink, Source, Wanted};
    let mut edges: Vec<((Vertex<T>, Vertex<T>), i32)> =
        wanted.iter().map(|&thing| ((Source, Wanted(thing)), NEVER)).collect();
    let (mut open, mut seen) = (wanted.to_vec(), BTreeSet::new());
    let mut vertices = vec![Source, Sink];
    while let Some(thing) = open.pop() {
        if !seen.insert(thing) {
            continue;
        }
        let Costs { kept, made, of } = costs(thing);
        vertices.extend([Wanted(thing), Made(thing)]);
        edges.push(((Wanted(thing), Made(thing)), kept));
        edges.push(((Made(thing), Sink), made));
        edges.extend(of.iter().map(|&part| ((Made(thing), Wanted(part)), NEVER)));
        open.extend(of);
    }
    let (.., cut) = edmonds_karp_sparse(&vertices, &Source, &Sink, edges);
    let kept = |((from, to), _)| match (from, to) {
        (Wanted(thing), Made(_)) => Some(thing),
        _ => None,
    };
    cut.into_iter().filter_map(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What it costs to have all `wanted` where `kept` are.
    fn spent(wanted: &[usize], kept: u32, costs: &[Costs<usize>]) -> i32 {
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
                    kept: if random(6) == 0 { NEVER } else { 1 + random(9) as i32 },
                    // What all share costs nothing.
                    made: random(12) as i32,
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
