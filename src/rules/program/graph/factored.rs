//! Sums of products with what they have in common taken out: `a x + b x` as `(a + b) x`.
//!
//! Each light adds its own product of albedo, weight and what arrives of it, and each parameter moves them all. Written so,
//! the sum over lights is a number of its own, which value and slopes share.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::{Binary, Graph, Id, Node, Unary};
use crate::program::families::numbered;

/// A product, added or taken away.
#[derive(Clone, Debug)]
struct Addend {
    negative: bool,
    /// Numbers of the sample, in the order of their places; one may be there twice.
    factors: Vec<Id>,
    /// The product of those that all samples share.
    shared: Id,
}

/// A graph that is being made of another one.
struct Factoring<'a, M> {
    old: &'a Graph,
    new: Graph,
    /// Where the old graph's nodes stand in the new one.
    moved: Vec<Option<Id>>,
    /// Which of them are sums that one other sum asks for alone: their products are that one's.
    within: Vec<bool>,
    /// Which of the new graph's nodes differ between samples, and which of them between passes.
    made_of: Vec<MadeOf>,
    moves: M,
}

#[derive(Clone, Copy, Debug, Default)]
struct MadeOf {
    varies: bool,
    moves: bool,
    /// Of a member of a family.
    of_member: bool,
}

impl Graph {
    /// The same numbers with common factors taken out of sums, rounded otherwise; and the outputs there. `moves` says which
    /// inputs and lookups differ between passes: the others' products are numbers of their own, which can be kept.
    #[must_use]
    pub fn factored(&self, outputs: &[Id], moves: impl Fn(&Self, Id) -> bool) -> (Self, Vec<Id>) {
        let reached = self.reached(outputs);
        let within = self.sums_within(outputs, &reached);
        let moved = vec![None; self.len()];
        let mut factoring =
            Factoring { old: self, new: Self::default(), moved, within, made_of: Vec::new(), moves };
        // Operands stand before what they are operands of: nothing is deep.
        for id in self.ids().filter(|id| reached[id.index()]) {
            factoring.carry(id);
        }
        let outputs = outputs.iter().filter_map(|id| factoring.moved[id.index()]).collect();
        (factoring.new, outputs)
    }

    /// Which sums are operands of one other sum and of nothing else.
    fn sums_within(&self, outputs: &[Id], reached: &[bool]) -> Vec<bool> {
        let (mut uses, mut of_sums) = (vec![0; self.len()], vec![0; self.len()]);
        for id in self.ids().filter(|id| reached[id.index()]) {
            for operand in self.operands(id) {
                uses[operand.index()] += 1;
                of_sums[operand.index()] += usize::from(self.is_sum(id));
            }
        }
        outputs.iter().for_each(|id| uses[id.index()] += 1);
        let within = |id: Id| self.is_sum(id) && uses[id.index()] == 1 && of_sums[id.index()] == 1;
        self.ids().map(within).collect()
    }

    fn is_sum(&self, id: Id) -> bool {
        matches!(self.node(id), Node::Binary(Binary::Add | Binary::Subtract, ..))
    }
}

impl<M: Fn(&Graph, Id) -> bool> Factoring<'_, M> {
    /// Make a node's like.
    fn carry(&mut self, id: Id) {
        if self.within[id.index()] {
            return;
        }
        let made = if self.old.is_sum(id) {
            let addends = self.addends(id);
            self.sum(addends)
        } else {
            self.old.copy(id, &mut self.new, &mut self.moved, &|_| None)
        };
        self.moved[id.index()] = Some(made);
    }

    /// The products that a sum adds up, in their order; those of a family's members, which come last, in one that is the same
    /// for each of them. A sum within it that is used elsewhere too is one number.
    fn addends(&mut self, sum: Id) -> Vec<Addend> {
        let (mut addends, mut open) = (Vec::new(), vec![(sum, false)]);
        while let Some((id, negative)) = open.pop() {
            match self.old.node(id) {
                Node::Binary(op @ (Binary::Add | Binary::Subtract), a, b)
                    if id == sum || self.within[id.index()] =>
                {
                    open.extend([(b, negative ^ (op == Binary::Subtract)), (a, negative)]);
                }
                _ => addends.push(self.addend(id, negative)),
            }
        }
        // Those of no member have one key, and keep their order.
        addends.sort_by_cached_key(|Addend { factors, shared, .. }| {
            let of_member = factors.iter().chain([shared]).any(|&id| self.made_of(id).of_member);
            of_member.then(|| (factors.clone(), *shared))
        });
        addends
    }

    /// A product's factors. A square is one: what is raised to a power is multiplied no more often than it was.
    fn addend(&mut self, product: Id, negative: bool) -> Addend {
        let one = self.new.constant(1.0);
        let (mut addend, mut open) = (Addend { negative, factors: Vec::new(), shared: one }, vec![product]);
        let mut shared = Vec::new();
        while let Some(id) = open.pop() {
            match self.old.node(id) {
                Node::Unary(Unary::Negate, a) => {
                    addend.negative ^= true;
                    open.push(a);
                }
                Node::Binary(Binary::Multiply, a, b) if a != b => open.extend([b, a]),
                _ => {
                    let factor = self.old.copy(id, &mut self.new, &mut self.moved, &|_| None);
                    if self.made_of(factor).varies {
                        addend.factors.push(factor);
                    } else {
                        shared.push(factor);
                    }
                }
            }
        }
        // What is of no member stands first, in the products of each.
        addend.factors.sort_by_key(|&id| (self.made_of(id).of_member, id));
        if shared.iter().any(|&id| self.made_of(id).of_member) {
            shared.sort_by_key(|&id| (self.made_of(id).of_member, id));
        }
        addend.shared = shared.into_iter().fold(one, |a, b| self.new.binary(Binary::Multiply, a, b));
        addend
    }

    /// What a node of the new graph is made of.
    fn made_of(&mut self, id: Id) -> MadeOf {
        for at in self.made_of.len()..self.new.len() {
            let (graph, of) = (&self.new, Id(at as u32));
            let mut made = MadeOf { moves: (self.moves)(graph, of), ..MadeOf::default() };
            made.varies = matches!(graph.node(of), Node::Field(_)) || graph.looked_up(of).is_some();
            made.of_member = match graph.node(of) {
                Node::Field(at) => numbered(&graph.fields[at as usize].name).is_some(),
                Node::Uniform(at) => numbered(&graph.uniforms[at as usize].name).is_some(),
                _ => false,
            };
            for operand in graph.operands(of) {
                let operand = self.made_of[operand.index()];
                made.varies |= operand.varies;
                made.moves |= operand.moves;
                made.of_member |= operand.of_member;
            }
            self.made_of.push(made);
        }
        self.made_of[id.index()]
    }

    /// Add products up, the factor first that most of them have.
    fn sum(&mut self, addends: Vec<Addend>) -> Id {
        let Some(factor) = most_common(&addends) else {
            return self.added(addends);
        };
        let (mut with, without): (Vec<Addend>, Vec<Addend>) =
            addends.into_iter().partition(|addend| addend.factors.contains(&factor));
        let mut common: Vec<Id> = Vec::new();
        for candidate in with[0].factors.clone() {
            if with.iter().all(|addend| addend.factors.contains(&candidate)) {
                for addend in &mut with {
                    let at = addend.factors.iter().position(|own| *own == candidate);
                    at.map(|at| addend.factors.remove(at));
                }
                common.push(candidate);
            }
        }
        let inner = self.sum(with);
        common.push(inner);
        let product = self.product(&common);
        if without.is_empty() {
            return product;
        }
        let rest = self.sum(without);
        self.new.binary(Binary::Add, rest, product)
    }

    /// Add products up that have nothing in common.
    fn added(&mut self, addends: Vec<Addend>) -> Id {
        let mut sum = self.new.constant(0.0);
        for Addend { negative, factors, shared } in addends {
            let product = self.product(&factors);
            let product = self.new.binary(Binary::Multiply, shared, product);
            let op = if negative { Binary::Subtract } else { Binary::Add };
            sum = self.new.binary(op, sum, product);
        }
        sum
    }

    /// A product; that of what stays between passes is a number of its own.
    fn product(&mut self, factors: &[Id]) -> Id {
        let one = self.new.constant(1.0);
        let mut products = [one; 2];
        for &factor in factors {
            let product = &mut products[usize::from(self.made_of(factor).moves)];
            *product = self.new.binary(Binary::Multiply, *product, factor);
        }
        self.new.binary(Binary::Multiply, products[0], products[1])
    }
}

/// The factor that the most products have, if two have one; of several the first.
fn most_common(addends: &[Addend]) -> Option<Id> {
    let mut counts: BTreeMap<Id, usize> = BTreeMap::new();
    for addend in addends {
        for of_one in addend.factors.chunk_by(|a, b| a == b) {
            *counts.entry(of_one[0]).or_default() += 1;
        }
    }
    let shared = counts.into_iter().filter(|&(_, count)| count > 1);
    shared.max_by_key(|&(id, count)| (count, Reverse(id))).map(|(id, _)| id)
}

#[cfg(test)]
mod tests {
    use super::super::{apply_binary, apply_unary};
    use super::*;

    #[test]
    fn what_products_have_in_common_is_taken_out_and_shared() {
        let mut graph = Graph::default();
        let [x, y, a, b] = ["x", "y", "a", "b"].map(|name| graph.field(name, 0));
        let u = graph.uniform("u", 0);
        let mut times = |p, q| graph.binary(Binary::Multiply, p, q);
        let (xa, xb, ya, yb) = (times(x, a), times(x, b), times(y, a), times(y, b));
        let (xua, yua) = (times(u, xa), times(u, ya));
        // x (u a - b), y (u a - b)
        let outputs = [graph.binary(Binary::Subtract, xua, xb), graph.binary(Binary::Subtract, yua, yb)];
        let (found, outputs) = graph.factored(&outputs, |_, _| false);
        let factors = outputs.map_operands(&found);
        assert!(factors[0].iter().any(|id| factors[1].contains(id)), "{found:?}");
    }

    /// A node's value where each field is its component and the uniform is 0.75.
    fn value(graph: &Graph, id: Id) -> f64 {
        match graph.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Field(at) => graph.fields[at as usize].component as f64,
            Node::Uniform(_) => 0.75,
            Node::Unary(op, a) => apply_unary(op, value(graph, a)),
            Node::Binary(op, a, b) => apply_binary(op, value(graph, a), value(graph, b)),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn sums_keep_their_values() {
        let mut graph = Graph::default();
        let [a, b, c, d, x] = [2, 3, 5, 7, 11].map(|component| graph.field("x", component));
        let u = graph.uniform("u", 0);
        let mut of = |op, p, q| graph.binary(op, p, q);
        use Binary::{Add, Multiply, Subtract};
        // a - (b - (c - d))
        let inner = of(Subtract, c, d);
        let middle = of(Subtract, b, inner);
        let signs = of(Subtract, a, middle);
        // A sum twice, which is an output, too.
        let [xa, xb] = [a, b].map(|p| of(Multiply, x, p));
        let sum = of(Add, xa, xb);
        let twice = of(Add, sum, sum);
        // x x a - x b + u x
        let square = of(Multiply, x, x);
        let [cubic, shared] = [of(Multiply, square, a), of(Multiply, u, x)];
        let less = of(Subtract, cubic, xb);
        let powers = of(Add, less, shared);
        // Nothing in common, and nothing left.
        let nothing = of(Subtract, xa, xa);
        let negative = graph.unary(Unary::Negate, xa);
        let added = graph.binary(Add, negative, u);
        let outputs = [signs, sum, twice, powers, nothing, added];
        let want = [-3.0, 55.0, 110.0, 217.25, 0.0, -21.25];
        assert_eq!(outputs.map(|id| value(&graph, id)), want);
        for moving in [false, true] {
            let (found, outputs) =
                graph.factored(&outputs, |graph, id| moving && graph.node(id) == Node::Field(0));
            let values: Vec<f64> = outputs.iter().map(|&id| value(&found, id)).collect();
            // Whole numbers and quarters: nothing is rounded.
            assert_eq!(values, want, "{found:?}");
        }
    }

    trait Operands {
        fn map_operands(&self, graph: &Graph) -> Vec<Vec<Id>>;
    }

    impl Operands for Vec<Id> {
        fn map_operands(&self, graph: &Graph) -> Vec<Vec<Id>> {
            self.iter().map(|&id| graph.operands(id)).collect()
        }
    }
}
