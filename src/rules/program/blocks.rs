//! Instructions in an order in which few registers are in use, those that belong together as one block.

use std::collections::HashMap;

use super::draft::{Draft, Kind};
use super::order::Dependencies;
use super::rolled::Bodies;
use super::tape::{Operand, Rolled};

/// Numbers that may wait in the order of outputs: twice as many as processors have registers of 512 bits.
const FEW: usize = 64;

/// Instructions that stay together.
struct Block {
    drafts: Vec<Draft>,
    /// Of how many of them, the first, others may read what they write.
    shown: usize,
}

/// Instructions in an order in which few registers are in use, where many would be; what is to be a loop stands together, and
/// what is left of it is not yet said.
pub(super) fn in_order(
    drafts: Vec<Draft>,
    wanted: &[Operand],
    bodies: Option<&Bodies>,
) -> (Vec<Draft>, Option<Rolled>) {
    let Some(bodies) = bodies else {
        let blocks = blocks(drafts.into_iter());
        return (ordered(blocks, wanted).into_iter().flat_map(|block| block.drafts).collect(), None);
    };
    let (length, members) = (bodies.steps.len(), bodies.steps[0].len());
    let mut drafts: Vec<Option<Draft>> = drafts.into_iter().map(Some).collect();
    let of_loop = loop_of(&mut drafts, wanted, bodies);
    let is_loop = |block: &Block| block.shown == length * members;
    let written: Vec<Operand> = of_loop.drafts.iter().flat_map(|draft| draft.writes.clone()).collect();
    let (before, behind) = apart(blocks(drafts.into_iter().flatten()), written);
    let blocks: Vec<Block> = before.into_iter().chain([of_loop]).chain(behind).collect();
    let mut start = 0;
    let mut all = Vec::new();
    for block in ordered(blocks, wanted) {
        if is_loop(&block) {
            start = all.len();
        }
        all.extend(block.drafts);
    }
    (all, Some(Rolled { start, length, left: vec![Vec::new(); members], own: 0 }))
}

/// Blocks of instructions: a unit vector and what stands in for it stay together.
fn blocks(mut drafts: impl Iterator<Item = Draft>) -> Vec<Block> {
    let mut blocks = Vec::new();
    while let Some(draft) = drafts.next() {
        let more = if let Kind::Call { skip, .. } = draft.kind { skip.unwrap_or(0) } else { 0 };
        let drafts = std::iter::once(draft).chain(drafts.by_ref().take(more)).collect();
        blocks.push(Block { drafts, shown: 1 });
    }
    blocks
}

/// The instructions of all members, each member's in the order that is best for the first.
fn loop_of(drafts: &mut [Option<Draft>], wanted: &[Operand], bodies: &Bodies) -> Block {
    let mut of_member: Vec<Vec<Option<Draft>>> = (0..bodies.steps[0].len())
        .map(|member| bodies.steps.iter().map(|step| drafts[step[member]].take()).collect())
        .collect();
    let first: Vec<&Draft> = of_member[0].iter().flatten().collect();
    let read_outside = drafts.iter().flatten().flat_map(|draft| &draft.reads).chain(wanted);
    let read_outside: Vec<Operand> = read_outside.copied().collect();
    let left: Vec<Operand> = first
        .iter()
        .flat_map(|draft| &draft.writes)
        .filter(|written| read_outside.contains(written))
        .copied()
        .collect();
    let steps =
        steps(&first.iter().map(|draft| (std::slice::from_ref(*draft), 1)).collect::<Vec<_>>(), &left);
    let order = best(&steps);
    let drafts: Vec<Draft> = of_member
        .iter_mut()
        .flat_map(|own| order.iter().map(|&at| own[at].take()).collect::<Vec<_>>())
        .flatten()
        .collect();
    Block { shown: drafts.len(), drafts }
}

/// The blocks that do not depend on what is written, and those that do: they read of it, or write what one of these writes, too:
/// what is written where something stands in is written for all once more.
fn apart(blocks: Vec<Block>, written: Vec<Operand>) -> (Vec<Block>, Vec<Block>) {
    let mut written: std::collections::HashSet<Operand> = written.into_iter().collect();
    blocks.into_iter().partition(|block| {
        let mut operands = block.drafts.iter().flat_map(|draft| draft.reads.iter().chain(&draft.writes));
        let depends = operands.any(|operand| written.contains(operand));
        if depends {
            written.extend(block.drafts.iter().flat_map(|draft| &draft.writes));
        }
        !depends
    })
}

fn ordered(blocks: Vec<Block>, wanted: &[Operand]) -> Vec<Block> {
    let parts: Vec<(&[Draft], usize)> = blocks.iter().map(|block| (&block.drafts[..], block.shown)).collect();
    let order = best(&steps(&parts, wanted));
    let mut blocks: Vec<Option<Block>> = blocks.into_iter().map(Some).collect();
    order.into_iter().filter_map(|block| blocks[block].take()).collect()
}

/// The order in which steps stand, or a better one.
fn best(steps: &Dependencies) -> Vec<usize> {
    let as_they_stand: Vec<usize> = (0..steps.reads.len()).collect();
    if steps.pressure(&as_they_stand) > FEW { steps.ordered() } else { as_they_stand }
}

/// What blocks of instructions read and write for others; of each how many instructions write for others.
fn steps(blocks: &[(&[Draft], usize)], wanted: &[Operand]) -> Dependencies {
    let shown = |&(block, shown): &(&'_ [Draft], usize)| -> Vec<Operand> {
        block[..shown].iter().flat_map(|draft| draft.writes.clone()).collect()
    };
    let written =
        blocks.iter().enumerate().flat_map(|(at, block)| shown(block).into_iter().map(move |o| (o, at)));
    let writer: HashMap<Operand, usize> = written.collect();
    let mut numbers: HashMap<Operand, usize> = HashMap::new();
    let mut steps = Dependencies { after: vec![Vec::new(); blocks.len()], ..Dependencies::default() };
    for (at, block) in blocks.iter().enumerate() {
        let own: Vec<Operand> = block.0.iter().flat_map(|draft| &draft.writes).copied().collect();
        let mut reads: Vec<usize> = Vec::new();
        for operand in block.0.iter().flat_map(|draft| &draft.reads).filter(|operand| !own.contains(operand))
        {
            // What is the same for all samples has no register.
            if writer.contains_key(operand) {
                let next = numbers.len();
                reads.push(*numbers.entry(*operand).or_insert(next));
            }
        }
        reads.sort_unstable();
        reads.dedup();
        steps.reads.push(reads);
        // What is written where it stands in, too, is written for all afterwards.
        for operand in &own[shown(block).len()..] {
            if let Some(&later) = writer.get(operand).filter(|&&later| later != at) {
                steps.after[later].push(at);
            }
        }
    }
    for operand in wanted.iter().filter(|operand| writer.contains_key(operand)) {
        let next = numbers.len();
        steps.outputs.push(*numbers.entry(*operand).or_insert(next));
    }
    let known = |operand: &Operand| numbers.get(operand).copied();
    steps.writes = blocks.iter().map(|block| shown(block).iter().filter_map(known).collect()).collect();
    steps
}
