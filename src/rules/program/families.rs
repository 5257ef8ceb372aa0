//! Numbers that differ by the member of a family alone: of the first light, of the second one, and so on.
//!
//! Inputs whose names differ by a number in them (`light_sky_1_color`, `light_sky_2_color`) are of one kind and of several
//! members. What is made of one member's inputs, and of what is no member's, is of that member; what is made alike is of one
//! kind.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

use super::cut::KEPT;
use super::graph::{Binary, Graph, Id, Input, Node};

/// The member of a family: what its inputs are named before its number, hashed, and that number.
pub type Member = (u64, u32);

/// What a number is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Of no member.
    Shared,
    /// Of one, and its kind.
    Member(Member, u64),
    /// Of several.
    Several,
}

/// For each node of a graph what it is of; `kept` says it of the numbers that are read as [`KEPT`].
#[must_use]
pub fn families(graph: &Graph, kept: &[Family]) -> Vec<Family> {
    let mut found: Vec<Family> = Vec::with_capacity(graph.len());
    for id in graph.ids() {
        let of_input = |input: &Input| match input.name.as_str() {
            KEPT => kept.get(input.component).copied().unwrap_or(Family::Shared),
            name => numbered(name).map_or(Family::Shared, |(before, number, behind)| {
                Family::Member((hashed(&before), number), hashed(&(before, behind, input.component)))
            }),
        };
        let family = match graph.node(id) {
            Node::Field(at) => of_input(&graph.fields[at as usize]),
            Node::Uniform(at) => of_input(&graph.uniforms[at as usize]),
            node => {
                let operands: Vec<OperandOf> =
                    graph.operands(id).iter().map(|of| (of.index(), found[of.index()])).collect();
                let (operation, commuting) = operation(graph, id, node);
                made_of(&operation, &operands, commuting)
            }
        };
        found.push(family);
    }
    found
}

/// What an operand is known by, and what it is of.
pub(super) type OperandOf = (usize, Family);

/// What is made by an operation of such operands, of which the first `commuting` may stand in any order.
pub(super) fn made_of(operation: &str, operands: &[OperandOf], commuting: usize) -> Family {
    let mut member = None;
    for &(_, family) in operands {
        match (family, member) {
            (Family::Several, _) => return Family::Several,
            (Family::Member(of, _), Some(known)) if of != known => return Family::Several,
            (Family::Member(of, _), _) => member = Some(of),
            (Family::Shared, _) => {}
        }
    }
    let Some(member) = member else { return Family::Shared };
    // What is no member's is the same number for all.
    let kind = |&(known_by, family): &OperandOf| match family {
        Family::Member(_, kind) => (1, kind),
        _ => (0, known_by as u64),
    };
    let mut kinds: Vec<_> = operands.iter().map(kind).collect();
    kinds[..commuting].sort_unstable();
    Family::Member(member, hashed(&(operation, kinds)))
}

/// An operation but for its operands, and how many of these may stand in any order.
fn operation(graph: &Graph, id: Id, node: Node) -> (String, usize) {
    match node {
        Node::Unary(op, _) => (format!("{op:?}"), 0),
        Node::Binary(op, ..) => (format!("{op:?}"), commuting(op)),
        Node::Part(_, part) => (format!("part {part}"), 0),
        Node::Select { .. } => ("select".to_owned(), 0),
        Node::Call(_) => match graph.call_of(id) {
            Some(call) => (format!("{:?} along {}", call.native, call.along.len()), 0),
            None => (String::new(), 0),
        },
        Node::Constant(_) | Node::Field(_) | Node::Uniform(_) => (String::new(), 0),
    }
}

/// How many operands may stand in any order.
pub(super) const fn commuting(op: Binary) -> usize {
    match op {
        Binary::Add | Binary::Multiply | Binary::Min | Binary::Max => 2,
        Binary::Subtract | Binary::Divide | Binary::Less | Binary::GreaterEqual => 0,
    }
}

/// The number that stands in a name between underscores, with what stands before and behind it.
pub(super) fn numbered(name: &str) -> Option<(&str, u32, &str)> {
    name.match_indices('_').find_map(|(at, _)| {
        let rest = &name[at + 1..];
        let (word, behind) = rest.split_once('_').unwrap_or((rest, ""));
        Some((&name[..at], word.parse().ok()?, behind))
    })
}

pub(super) fn hashed(of: &impl Hash) -> u64 {
    // Its keys are fixed: the same in every run.
    let mut hasher = DefaultHasher::new();
    of.hash(&mut hasher);
    hasher.finish()
}

/// Of each kind of the family with the most of them its members' numbers, by member, as far as every member has one.
pub(super) fn complete<T: Copy>(items: impl Iterator<Item = (Family, T)>) -> Vec<Vec<T>> {
    let mut families: BTreeMap<u64, BTreeMap<u64, Vec<(u32, T)>>> = BTreeMap::new();
    for (family, item) in items {
        if let Family::Member((of, number), kind) = family {
            families.entry(of).or_default().entry(kind).or_default().push((number, item));
        }
    }
    let Some(kinds) = families.into_values().max_by_key(BTreeMap::len) else { return Vec::new() };
    let members: BTreeSet<u32> = kinds.values().flatten().map(|(number, _)| *number).collect();
    let of_all = |mut of: Vec<(u32, T)>| {
        of.sort_by_key(|(number, _)| *number);
        let every = of.iter().map(|(number, _)| number).eq(&members);
        every.then(|| of.into_iter().map(|(_, item)| item).collect())
    };
    kinds.into_values().filter_map(of_all).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_in_a_name_is_the_member() {
        assert_eq!(numbered("light_sky_2_color"), Some(("light_sky", 2, "color")));
        assert_eq!(numbered("diffusion_weight_5"), Some(("diffusion_weight", 5, "")));
        assert_eq!(numbered("base_weight"), None);
        assert_eq!(numbered("f0"), None);
    }

    /// A field and a number of a light, with what all of them share.
    fn lit(graph: &mut Graph, light: usize, weight: Id) -> Id {
        let open = graph.field(&format!("light_sky_{light}_open"), 0);
        let color = graph.uniform(&format!("light_sky_{light}_color"), 0);
        let weighed = graph.binary(Binary::Multiply, open, weight);
        graph.binary(Binary::Multiply, color, weighed)
    }

    #[test]
    fn what_is_made_alike_of_each_member_is_of_one_kind() {
        let mut graph = Graph::default();
        let albedo = graph.field("albedo", 0);
        let first = lit(&mut graph, 1, albedo);
        // Made later, it stands behind the second light's field.
        let other = graph.field("light_sky_2_open", 0);
        let weight = graph.field("weight", 0);
        let second = lit(&mut graph, 2, albedo);
        let unlike = lit(&mut graph, 2, weight);
        let both = graph.binary(Binary::Add, first, second);
        let of = families(&graph, &[]);
        let kind = |id: Id| match of[id.index()] {
            Family::Member(member, kind) => (member, kind),
            family => panic!("{family:?}"),
        };
        assert_eq!((kind(first).0.1, kind(second).0.1, kind(other).0.1), (1, 2, 2));
        assert_eq!(kind(first).1, kind(second).1);
        assert_ne!(kind(first).1, kind(unlike).1);
        assert_eq!((of[albedo.index()], of[both.index()]), (Family::Shared, Family::Several));
    }

    #[test]
    fn kinds_that_a_member_lacks_or_has_twice_are_left_out() {
        let of = |member, kind| Family::Member((0, member), kind);
        // Another family's members are not asked for.
        let other = Family::Member((1, 3), 10);
        let items = [
            of(1, 7),
            of(2, 7),
            of(1, 8),
            of(2, 9),
            of(2, 9),
            of(1, 9),
            Family::Shared,
            Family::Several,
            other,
        ];
        let complete = complete(items.into_iter().enumerate().map(|(at, family)| (family, at)));
        assert_eq!(complete, [[0, 1]]);
    }
}
