//! What is computed alike for each member of a family, to be written once, as a loop.
//!
//! Four lights of the sky are the same instructions four times over, each with numbers of its own. Written out they are more
//! than the nearest cache of instructions holds, and take the compiler longer.

use std::collections::HashSet;

use super::cut::KEPT;
use super::draft::{Draft, Kind};
use super::families::{Family, OperandOf, commuting, complete, hashed, made_of};
use super::graph::{Graph, Native};
use super::tape::Operand;

/// Instructions a member below which a loop is not worth it.
const LEAST: usize = 16;

/// Instructions that are alike for each member.
pub(super) struct Bodies {
    /// For each instruction of the loop, those of all members: places among the drafts, in their order.
    pub(super) steps: Vec<Vec<usize>>,
    /// For each number that all samples share and that is a member's own, those of all members.
    pub(super) uniforms: Vec<Vec<Operand>>,
}

/// The instructions of `graph`'s nodes that are alike; `families` says of nodes what they are of, `varies` whether they differ
/// between samples.
pub(super) fn bodies(
    graph: &Graph,
    drafts: &[Draft],
    families: &[Family],
    varies: &[bool],
) -> Option<Bodies> {
    let known_as = |operand: &Operand| {
        let (variant, id) = match *operand {
            Operand::Of(id) => (0, id),
            Operand::ReciprocalOf(id) => (1, id),
            Operand::FlagOf(id) => (2, id),
        };
        let family = match families[id.index()] {
            Family::Member(member, kind) => Family::Member(member, hashed(&(variant, kind))),
            other => other,
        };
        (3 * id.index() + variant, family)
    };
    let alone = alone(drafts);
    let of_draft = |draft: &Draft| {
        let operands: Vec<OperandOf> = draft.reads.iter().chain(&draft.writes).map(known_as).collect();
        let (text, commuting) = operation(graph, &draft.kind);
        made_of(&text, &operands, commuting)
    };
    let items = (0..drafts.len()).filter(|&at| alone[at]).map(|at| (of_draft(&drafts[at]), at));
    let mut candidates = complete(items);
    candidates.sort_unstable();
    let elsewhere = elsewhere(drafts, |draft| of_draft(draft) == Family::Shared);
    // What reads a member's number that is not of the loop cannot be of it.
    let mut of_loop: HashSet<Operand> = HashSet::new();
    let mut steps = Vec::new();
    for step in candidates {
        let known = |operand: &Operand| {
            let shared = known_as(operand).1 == Family::Shared && !elsewhere.contains(operand);
            shared || !varies[operand.id().index()] || of_loop.contains(operand)
        };
        let known = |&at: &usize| {
            let Draft { reads, writes, .. } = &drafts[at];
            reads.iter().all(known) && writes.iter().all(|written| !elsewhere.contains(written))
        };
        if step.iter().all(known) {
            of_loop.extend(step.iter().flat_map(|&at| &drafts[at].writes));
            steps.push(step);
        }
    }
    if steps.len() < LEAST || steps[0].len() < 2 {
        return None;
    }
    let mut own: Vec<Operand> = Vec::new();
    for operand in steps.iter().flatten().flat_map(|&at| &drafts[at].reads) {
        let of_member = matches!(known_as(operand).1, Family::Member(..));
        if of_member && !varies[operand.id().index()] && !own.contains(operand) {
            own.push(*operand);
        }
    }
    let mut uniforms = complete(own.iter().map(|operand| (known_as(operand).1, *operand)));
    // In the order in which the first member reads them.
    uniforms.sort_by_key(|of_all| own.iter().position(|operand| *operand == of_all[0]));
    let all_found = uniforms.iter().flatten().count() == own.len();
    all_found.then_some(Bodies { steps, uniforms })
}

/// Whether each instruction stands for itself: is not a unit vector with what stands in for it, nor a lookup, whose texels are
/// asked for where they are known.
fn alone(drafts: &[Draft]) -> Vec<bool> {
    let mut alone = vec![true; drafts.len()];
    for (at, draft) in drafts.iter().enumerate() {
        match draft.kind {
            Kind::Call { native: Native::Lookup(_), .. } => alone[at] = false,
            Kind::Call { skip: Some(skip), .. } => alone[at..=at + skip].fill(false),
            _ => {}
        }
    }
    alone
}

/// What is written where something stands in, and perhaps once more behind it; and what calls write that are of a member by their
/// slopes alone, whose value is of none.
fn elsewhere(drafts: &[Draft], shared: impl Fn(&Draft) -> bool) -> HashSet<Operand> {
    let mut found = HashSet::new();
    for (at, draft) in drafts.iter().enumerate() {
        let Kind::Call { skip, .. } = draft.kind else { continue };
        if !shared(draft) {
            found.extend(&draft.writes);
        }
        let cold = &drafts[at + 1..=at + skip.unwrap_or(0)];
        found.extend(cold.iter().flat_map(|draft| &draft.writes));
    }
    found
}

/// What an instruction does, whatever it reads; and how many of its operands may stand in any order.
fn operation(graph: &Graph, kind: &Kind) -> (String, usize) {
    match kind {
        // They are read of different records.
        Kind::Load(field) if graph.fields[*field].name == KEPT => ("load what is kept".to_owned(), 0),
        Kind::Load(_) => ("load".to_owned(), 0),
        Kind::Unary(op) => (format!("{op:?}"), 0),
        Kind::Binary(op) => (format!("{op:?}"), commuting(*op)),
        Kind::MultiplyAdd => ("multiply and add".to_owned(), 2),
        Kind::SubtractProduct => ("subtract a product".to_owned(), 2),
        Kind::SelectLess => ("select less".to_owned(), 0),
        Kind::SelectGreaterEqual => ("select greater or equal".to_owned(), 0),
        Kind::SelectFinite => ("select finite".to_owned(), 0),
        Kind::SelectHolds => ("select".to_owned(), 0),
        Kind::Call { native, along, parts, .. } => (format!("{native:?} {along} {parts:?}"), 0),
        Kind::Mend(parts) => (format!("mend {parts:?}"), 0),
    }
}

#[cfg(test)]
mod tests {
    use crate::program::evaluate::Shared;
    use crate::program::graph::{Binary, Graph, Id, Input, Native, Unary};
    use crate::program::print::statements;
    use crate::program::tape::Tape;

    /// The sum of `lights` lights, each a chain of `length` steps of its own number and field and of one that all share.
    fn lit(lights: usize, length: usize) -> (Graph, Vec<Id>) {
        let mut graph = Graph::default();
        let shared = graph.field("albedo", 0);
        let mut sum = graph.field("sky", 0);
        for light in 1..=lights {
            let open = graph.field(&format!("light_sky_{light}_open"), 0);
            let color = graph.uniform(&format!("light_sky_{light}_color"), 0);
            let mut value = open;
            for _ in 0..length {
                let raised = graph.binary(Binary::Add, value, shared);
                let root = graph.unary(Unary::Sqrt, raised);
                value = graph.binary(Binary::Multiply, root, color);
            }
            sum = graph.binary(Binary::Add, sum, value);
        }
        (graph, vec![sum])
    }

    fn run(tape: &Tape) -> Vec<u64> {
        let number = |input: &Input| match input.name.as_str() {
            "nothing" => 0.0,
            name => 0.3 + name.bytes().map(f64::from).sum::<f64>() / 1e4,
        };
        let shared = Shared { uniforms: tape.uniform_values(number), cubes: Vec::new() };
        tape.run(&shared, 0.0_f64, number).into_iter().map(f64::to_bits).collect()
    }

    #[test]
    fn lights_are_one_loop_that_computes_the_same() {
        let (graph, outputs) = lit(3, 8);
        let [rolled, plain] = [Tape::with_few_registers(&graph, &outputs, &[]), Tape::new(&graph, &outputs)];
        assert_eq!(run(&rolled), run(&plain));
        let text = statements(&rolled, "", |k, output| format!("put({k}, {output});")).0;
        assert!(text.contains("for m in 0..3 {") && text.contains("samples(["), "{text}");
        // The last product is added behind the loop.
        assert_eq!((text.matches("sqrt").count(), text.matches("own(m, 0)").count()), (8, 7), "{text}");
        assert!(
            text.contains("] = made[2];")
                && !statements(&plain, "", |_, _| String::new()).0.contains("for m")
        );
    }

    #[test]
    fn what_stands_in_behind_a_loop_may_divide_by_what_others_divide_by() {
        let (mut graph, outputs) = lit(3, 8);
        let nothing = graph.field("nothing", 0);
        let [a, b, c] = ["a", "b", "c"].map(|name| graph.field(name, 0));
        // Of no direction, as it is of the loop's sum times nothing: a quotient stands in.
        let none = graph.binary(Binary::Multiply, outputs[0], nothing);
        let stands_in = graph.binary(Binary::Divide, a, b);
        let unit = graph.call(Native::Unit, vec![none, none, none, stands_in, a, c], Vec::new());
        // Every sample asks for one over b, too.
        let other = graph.binary(Binary::Divide, c, b);
        let outputs: Vec<Id> = unit.into_iter().chain([other]).collect();
        let rolled = Tape::with_few_registers(&graph, &outputs, &[]);
        assert!(rolled.rolled.is_some());
        let found = run(&rolled);
        assert_eq!(found, run(&Tape::new(&graph, &outputs)));
        assert!(found.iter().all(|bits| f64::from_bits(*bits) > 0.0), "{found:?}");
    }

    #[test]
    fn what_is_short_or_of_one_member_is_no_loop() {
        for (lights, length) in [(3, 2), (1, 8)] {
            let (graph, outputs) = lit(lights, length);
            let tape = Tape::with_few_registers(&graph, &outputs, &[]);
            assert!(tape.rolled.is_none(), "{lights} {length}");
        }
    }

    #[test]
    fn a_member_that_differs_is_computed_by_itself() {
        let (mut graph, outputs) = lit(2, 8);
        let open = graph.field("light_sky_2_open", 0);
        let more = graph.unary(Unary::Exp2, open);
        let sum = graph.binary(Binary::Add, outputs[0], more);
        let tape = Tape::with_few_registers(&graph, &[sum], &[]);
        assert_eq!(run(&tape), run(&Tape::new(&graph, &[sum])));
        let text = statements(&tape, "", |k, output| format!("put({k}, {output});")).0;
        let (within, behind) = text.split_once("made[m] =").unwrap();
        assert!(!within.contains("exp2") && behind.contains("exp2"), "{text}");
    }
}
