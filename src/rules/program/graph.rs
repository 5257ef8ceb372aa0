//! Arithmetic as a graph of numbers: each node one operation, each operation once.
//!
//! Nodes are made through [`Graph`]'s constructors, which find an equal node where there is one, compute what is
//! constant, and leave out what changes nothing (`x + 0`, `1 x`). So two rules, or a rule and its tangent, that
//! compute the same number share it without a word in either.
//!
//! `node`: what a graph consists of; `simplify`: its operations; `rebuilt`: parts of it as a graph of their own;
//! `factored`: sums of products with what they have in common taken out.

mod factored;
mod node;
mod rebuilt;
mod simplify;

use std::collections::HashMap;

pub use self::node::{Binary, Call, Id, Input, Native, Node, Unary, Widths};
pub use self::simplify::{apply_binary, apply_unary};

/// Numbers and what they are made of.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    /// What a sample holds.
    pub fields: Vec<Input>,
    /// What is the same for all samples of a pass.
    pub uniforms: Vec<Input>,
    /// Faces that are looked up, by their names in the rules.
    pub resources: Vec<String>,
    calls: Vec<Call>,
    known_calls: HashMap<Call, u32>,
}

/// The place of `item` in `list`, put there where it is new.
fn place<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    let at = list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    });
    at as u32
}

impl Graph {
    /// A node.
    #[must_use]
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.index()]
    }

    /// How many nodes there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Every node, operands before what they are operands of.
    pub fn ids(&self) -> impl Iterator<Item = Id> + use<> {
        (0..self.nodes.len()).map(|at| Id(at as u32))
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn add(&mut self, node: Node) -> Id {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = Id(self.nodes.len() as u32);
        self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    /// The node that is this one, where there is one.
    pub(super) fn known(&self, node: Node) -> Option<Id> {
        self.known.get(&node).copied()
    }

    /// The node of a call, where there is one.
    pub(super) fn known_call(&self, call: &Call) -> Option<Id> {
        self.known(Node::Call(*self.known_calls.get(call)?))
    }

    /// A constant.
    pub fn constant(&mut self, value: f64) -> Id {
        // -0 and 0 are one number here.
        self.add(Node::Constant((value + 0.0).to_bits()))
    }

    /// The value of a constant node.
    #[must_use]
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// A number of the sample.
    pub fn field(&mut self, name: &str, component: usize) -> Id {
        let at = place(&mut self.fields, Input { name: name.to_owned(), component });
        self.add(Node::Field(at))
    }

    /// How far a number goes from one sample to the next: of a field, the one with `prefix` before its name; what is the
    /// same for all samples stays. `None` for other numbers.
    pub fn step(&mut self, id: Id, prefix: &str) -> Option<Id> {
        match self.node(id) {
            Node::Constant(_) | Node::Uniform(_) => Some(self.constant(0.0)),
            Node::Field(at) => {
                let Input { name, component } = &self.fields[at as usize];
                let (name, component) = (format!("{prefix}{name}"), *component);
                Some(self.field(&name, component))
            }
            _ => None,
        }
    }

    /// A number that is the same for all samples.
    pub fn uniform(&mut self, name: &str, component: usize) -> Id {
        let at = place(&mut self.uniforms, Input { name: name.to_owned(), component });
        self.add(Node::Uniform(at))
    }

    /// The place of faces among those that are looked up.
    pub fn resource(&mut self, name: &str) -> u32 {
        place(&mut self.resources, name.to_owned())
    }

    /// A call that a node is.
    #[must_use]
    pub fn call_of(&self, id: Id) -> Option<&Call> {
        match self.node(id) {
            Node::Call(at) => self.calls.get(at as usize),
            _ => None,
        }
    }

    /// Whether a node is a lookup, and of which faces.
    #[must_use]
    pub fn looked_up(&self, id: Id) -> Option<&str> {
        match self.call_of(id)?.native {
            Native::Lookup(resource) => self.resources.get(resource as usize).map(String::as_str),
            _ => None,
        }
    }

    /// The numbers of a function's value, or (with `along`) of how it moves.
    pub fn call(&mut self, native: Native, arguments: Vec<Id>, along: Vec<Id>) -> Vec<Id> {
        let widths = native.widths();
        if !along.is_empty() && along.iter().all(|&id| self.value(id) == Some(0.0)) {
            return vec![self.constant(0.0); widths.slopes];
        }
        let count = if along.is_empty() { widths.parts } else { widths.slopes };
        let node = self.add_call(Call { native, arguments, along });
        (0..count).map(|part| self.add(Node::Part(node, part as u8))).collect()
    }

    fn add_call(&mut self, call: Call) -> Id {
        let next = self.calls.len() as u32;
        let at = *self.known_calls.entry(call.clone()).or_insert(next);
        if at == next {
            self.calls.push(call);
        }
        self.add(Node::Call(at))
    }

    /// What a node is made of.
    #[must_use]
    pub fn operands(&self, id: Id) -> Vec<Id> {
        match self.node(id) {
            Node::Constant(_) | Node::Field(_) | Node::Uniform(_) => Vec::new(),
            Node::Unary(_, a) | Node::Part(a, _) => vec![a],
            Node::Binary(_, a, b) => vec![a, b],
            Node::Select { condition, yes, no } => vec![condition, yes, no],
            Node::Call(at) => {
                let Call { arguments, along, .. } = &self.calls[at as usize];
                arguments.iter().chain(along).copied().collect()
            }
        }
    }

    /// The nodes that `outputs` are made of, themselves included; a flag for each node.
    #[must_use]
    pub fn reached(&self, outputs: &[Id]) -> Vec<bool> {
        let mut reached = vec![false; self.nodes.len()];
        outputs.iter().for_each(|id| reached[id.index()] = true);
        for at in (0..self.nodes.len()).rev() {
            if reached[at] {
                self.operands(Id(at as u32)).iter().for_each(|id| reached[id.index()] = true);
            }
        }
        reached
    }

    /// For each node, whether it is made of something that `is` says of.
    #[must_use]
    pub fn made_of(&self, is: impl Fn(&Self, Id) -> bool) -> Vec<bool> {
        let mut made = vec![false; self.nodes.len()];
        for at in 0..self.nodes.len() {
            let id = Id(at as u32);
            made[at] = is(self, id) || self.operands(id).iter().any(|operand| made[operand.index()]);
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_numbers_are_one_node_whatever_the_order_of_their_operands() {
        let mut graph = Graph::default();
        let (x, y) = (graph.field("x", 0), graph.field("y", 0));
        let (a, b) = (graph.binary(Binary::Add, x, y), graph.binary(Binary::Add, y, x));
        assert_eq!(a, b);
        let negative = graph.unary(Unary::Negate, x);
        assert_eq!(graph.binary(Binary::Subtract, y, negative), a);
    }

    #[test]
    fn what_changes_nothing_is_left_out() {
        let mut graph = Graph::default();
        let x = graph.field("x", 0);
        let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
        let before = graph.len();
        assert_eq!(graph.binary(Binary::Add, zero, x), x);
        assert_eq!(graph.binary(Binary::Multiply, x, one), x);
        assert_eq!(graph.binary(Binary::Multiply, x, zero), zero);
        assert_eq!(graph.select(one, x, zero), x);
        assert_eq!(graph.len(), before);
        let y = graph.field("y", 0);
        let holds = graph.binary(Binary::Less, x, y);
        let once = graph.select(holds, x, zero);
        assert_eq!(graph.select(holds, once, zero), once);
        let otherwise = graph.select(holds, y, once);
        assert_eq!(otherwise, graph.select(holds, y, zero));
    }

    #[test]
    fn a_graph_is_cut_where_another_input_stands_in() {
        let mut graph = Graph::default();
        let (x, y) = (graph.field("x", 0), graph.field("y", 1));
        let square = graph.binary(Binary::Multiply, x, x);
        let sum = graph.binary(Binary::Add, square, y);
        let (cut, outputs) =
            graph.rebuilt(&[sum], |id| (id == square).then(|| Input { name: "kept".into(), component: 0 }));
        assert_eq!(cut.fields.len(), 2);
        assert_eq!(cut.operands(outputs[0]).len(), 2);
        assert!(cut.fields.iter().all(|input| input.name != "x"));
    }
}
