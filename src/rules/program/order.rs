//! The order of instructions in which few numbers wait at once.
//!
//! Numbers that wait stand in registers, and a processor that runs out of these writes and reads memory. In the order of
//! outputs all of a value is computed before the first of its slopes, and every number on the way waits for these.
//! So each slope is computed as soon as what it is made of is there. Then, again and again, what makes more numbers than
//! it uses up goes down to where it is first read, and what uses up as many as it makes goes up to where these are there:
//! the two moves of which list schedulers for registers are made (Goodman and Hsu, "Code scheduling and register
//! allocation in large basic blocks", 1988).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Times that everything is moved down, then up; more gain nothing.
const ROUNDS: usize = 5;

/// Steps by the numbers that they read and write; every number has one step that writes it.
#[derive(Debug, Default)]
pub(super) struct Dependencies {
    /// For each step the numbers that it reads, each once.
    pub(super) reads: Vec<Vec<usize>>,
    /// For each step the numbers that it writes and somebody reads.
    pub(super) writes: Vec<Vec<usize>>,
    /// The steps that must come before each, for another reason than a number.
    pub(super) after: Vec<Vec<usize>>,
    /// Numbers that are wanted in the end: values first, then slopes.
    pub(super) outputs: Vec<usize>,
}

/// Where a step would like to stand: the place, then what decides between equals.
type Key = (usize, usize);

/// The steps, and who depends on whom.
struct Order<'a> {
    steps: &'a Dependencies,
    before: Vec<Vec<usize>>,
    behind: Vec<Vec<usize>>,
    readers: Vec<Vec<usize>>,
    wanted: Vec<bool>,
}

impl Dependencies {
    /// How many numbers wait at the most, the steps being taken in `order`.
    pub(super) fn pressure(&self, order: &[usize]) -> usize {
        let mut left = vec![0_usize; self.writes.iter().flatten().max().map_or(0, |most| most + 1)];
        self.reads.iter().flatten().chain(&self.outputs).for_each(|&number| left[number] += 1);
        let (mut waiting, mut most) = (0, 0);
        for &step in order {
            for &number in &self.reads[step] {
                left[number] -= 1;
                waiting -= usize::from(left[number] == 0);
            }
            waiting += self.writes[step].len();
            most = most.max(waiting);
        }
        most
    }

    /// The steps in an order in which few numbers wait.
    pub(super) fn ordered(&self) -> Vec<usize> {
        let order = Order::new(self);
        let mut steps = order.as_soon_as_possible();
        for _ in 0..ROUNDS {
            steps = order.lowered(&steps);
            steps = order.raised(&steps);
        }
        steps
    }
}

impl<'a> Order<'a> {
    fn new(steps: &'a Dependencies) -> Self {
        let count = steps.reads.len();
        let numbers = steps.writes.iter().flatten().max().map_or(0, |most| most + 1);
        let mut writer = vec![0; numbers];
        for (step, writes) in steps.writes.iter().enumerate() {
            writes.iter().for_each(|&number| writer[number] = step);
        }
        let (mut readers, mut behind) = (vec![Vec::new(); numbers], vec![Vec::new(); count]);
        let mut before = Vec::with_capacity(count);
        for (step, reads) in steps.reads.iter().enumerate() {
            reads.iter().for_each(|&number| readers[number].push(step));
            let mut of: Vec<usize> = reads.iter().map(|&number| writer[number]).collect();
            of.extend(&steps.after[step]);
            of.sort_unstable();
            of.dedup();
            of.iter().for_each(|&earlier| behind[earlier].push(step));
            before.push(of);
        }
        let mut wanted = vec![false; count];
        steps.outputs.iter().for_each(|&number| wanted[writer[number]] = true);
        Self { steps, before, behind, readers, wanted }
    }

    /// The steps by their keys, each after those that it depends on.
    fn by(&self, keys: &[Key]) -> Vec<usize> {
        let mut open: Vec<usize> = self.before.iter().map(Vec::len).collect();
        let mut ready: BinaryHeap<Reverse<(Key, usize)>> =
            (0..open.len()).filter(|&step| open[step] == 0).map(|step| Reverse((keys[step], step))).collect();
        let mut order = Vec::with_capacity(open.len());
        while let Some(Reverse((_, step))) = ready.pop() {
            order.push(step);
            for &next in &self.behind[step] {
                open[next] -= 1;
                if open[next] == 0 {
                    ready.push(Reverse((keys[next], next)));
                }
            }
        }
        order
    }

    /// The first half of the outputs as they stand, and everything else as soon as what it needs is there. Of a tape of
    /// slopes these are the values and some slopes: with values alone a few more numbers wait.
    fn as_soon_as_possible(&self) -> Vec<usize> {
        let first = &self.steps.outputs[..self.steps.outputs.len() / 2];
        let mut early = vec![false; self.before.len()];
        for (step, writes) in self.steps.writes.iter().enumerate() {
            early[step] = writes.iter().any(|number| first.contains(number));
        }
        for step in (0..early.len()).rev() {
            if early[step] {
                self.before[step].iter().for_each(|&earlier| early[earlier] = true);
            }
        }
        let mut places = vec![0; early.len()];
        for step in 0..early.len() {
            let needed = self.before[step].iter().map(|&earlier| places[earlier]).max();
            places[step] = if early[step] { step } else { needed.unwrap_or(0) };
        }
        let keys: Vec<Key> =
            places.iter().zip(&early).map(|(&place, &early)| (place, usize::from(!early))).collect();
        self.by(&keys)
    }

    /// Where each step stands, with room between two, and the last that reads each number.
    fn places(&self, order: &[usize]) -> (Vec<Key>, Vec<usize>) {
        let mut keys = vec![(0, 0); order.len()];
        let mut last = vec![usize::MAX; self.readers.len()];
        for (place, &step) in order.iter().enumerate() {
            keys[step] = (2 * place + 2, place);
            self.steps.reads[step].iter().for_each(|&number| last[number] = step);
        }
        (keys, last)
    }

    /// The numbers that nobody reads after a step. (An output stays all the same; it is counted as gone.)
    fn used_up(&self, step: usize, last: &[usize]) -> impl Iterator<Item = usize> {
        self.steps.reads[step].iter().copied().filter(move |&number| last[number] == step)
    }

    /// What makes more numbers than it uses up goes down to right before where it is first read.
    fn lowered(&self, order: &[usize]) -> Vec<usize> {
        let (mut keys, last) = self.places(order);
        for &step in order.iter().rev().filter(|&&step| !self.wanted[step]) {
            let readers = self.steps.writes[step].iter().flat_map(|&number| &self.readers[number]);
            let Some(first) = readers.map(|&reader| keys[reader].0).min() else { continue };
            let makes_more = self.steps.writes[step].len() > self.used_up(step, &last).count();
            if makes_more && first > keys[step].0 {
                keys[step].0 = first - 1;
            }
        }
        self.by(&keys)
    }

    /// What uses up as many numbers as it makes goes up to right behind the last that it waits for: the steps that it
    /// depends on, and other readers of what it uses up.
    fn raised(&self, order: &[usize]) -> Vec<usize> {
        let (mut keys, last) = self.places(order);
        for &step in order.iter().filter(|&&step| !self.before[step].is_empty()) {
            let used_up: Vec<usize> = self.used_up(step, &last).collect();
            if used_up.len() < self.steps.writes[step].len() {
                continue;
            }
            let others =
                used_up.iter().flat_map(|&number| &self.readers[number]).filter(|&&other| other != step);
            let behind = self.before[step].iter().chain(others).map(|&other| keys[other].0).max();
            if let Some(behind) = behind.filter(|&behind| behind + 1 < keys[step].0) {
                keys[step].0 = behind + 1;
            }
        }
        self.by(&keys)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` chains: a number is loaded, goes through `length` steps, and each of these has a slope that is an output,
    /// the values standing before the slopes.
    fn chains(count: usize, length: usize) -> Dependencies {
        let mut steps = Dependencies::default();
        let mut numbers = 0;
        let mut step = |steps: &mut Dependencies, reads: Vec<usize>| {
            steps.reads.push(reads);
            steps.writes.push(vec![numbers]);
            steps.after.push(Vec::new());
            numbers += 1;
            numbers - 1
        };
        let mut links = Vec::new();
        for _ in 0..count {
            let mut chain = vec![step(&mut steps, Vec::new())];
            for _ in 0..length {
                let last = chain[chain.len() - 1];
                chain.push(step(&mut steps, vec![last]));
            }
            steps.outputs.push(chain[length]);
            links.push(chain);
        }
        for chain in links {
            let mut slope = step(&mut steps, vec![chain[0]]);
            for &link in &chain[1..] {
                slope = step(&mut steps, vec![link, slope]);
            }
            steps.outputs.push(slope);
        }
        steps
    }

    #[test]
    fn each_step_comes_once_and_after_what_it_reads() {
        let mut steps = chains(4, 10);
        // The first comes after the last load, for a reason of its own.
        let load = 3 * 11;
        steps.after[1].push(load);
        let order = steps.ordered();
        let mut place = vec![usize::MAX; order.len()];
        order.iter().enumerate().for_each(|(at, &step)| place[step] = at);
        assert!(place.iter().all(|&at| at < usize::MAX));
        for (step, reads) in steps.reads.iter().enumerate() {
            assert!(reads.iter().all(|&number| place[number] < place[step]), "{step}");
        }
        assert!(place[load] < place[1]);
    }

    #[test]
    fn slopes_are_computed_beside_their_values() {
        let steps = chains(8, 30);
        let as_given: Vec<usize> = (0..steps.reads.len()).collect();
        // Every link of every chain waits for its slope.
        assert!(steps.pressure(&as_given) >= 8 * 30);
        // The outputs, and of one chain a link, its slope and the two before.
        assert!(steps.pressure(&steps.ordered()) <= 16 + 4, "{}", steps.pressure(&steps.ordered()));
    }
}
