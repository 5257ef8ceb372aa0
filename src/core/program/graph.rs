//! Arithmetic as a graph of numbers: each node one operation, each operation once.
//!
//! Nodes are made through [`Graph`]'s constructors, which find an equal node where there is one, compute what is
//! constant, and leave out what changes nothing (`x + 0`, `1 x`). So two rules, or a rule and its tangent, that
//! compute the same number share it without a word in either.

use std::collections::HashMap;

/// A node's place in its graph. Operands have smaller ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub(super) u32);

impl Id {
    pub(super) const fn index(self) -> usize {
        self.0 as usize
    }
}

/// An operation on one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "named as in mathematics")]
pub enum Unary {
    Negate,
    Abs,
    Sqrt,
    Reciprocal,
    Floor,
    Exp2,
    Log2,
    /// 1 where the number is neither NaN nor infinite, else 0.
    IsFinite,
}

/// An operation on two numbers. Truth is 1, falsehood 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "named as in mathematics")]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Min,
    Max,
    /// `a < b`
    Less,
    /// `a >= b`
    GreaterEqual,
}

/// A function of several numbers that runs as one instruction ([`super::native`]). It has parts, and for each vector
/// that its arguments move along more of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Native {
    /// `normalize_or` of a vector; after it the fallback, which is seldom asked for.
    Unit,
    /// `cube_place_of_unit` of a direction: face, s, t.
    Place,
    /// A bilinear lookup in padded cube faces, at (face, s, t): the four channels. Which faces: the place among
    /// [`Graph::resources`].
    Lookup(u32),
}

impl Native {
    /// How many numbers it takes, how many of them can move, and how many it yields: of the value, and along each
    /// vector that the arguments move.
    #[must_use]
    pub const fn widths(self) -> Widths {
        match self {
            Self::Unit => Widths { arguments: 6, moving: 3, parts: 3, slopes: 3 },
            Self::Place => Widths { arguments: 3, moving: 3, parts: 3, slopes: 2 },
            Self::Lookup(_) => Widths { arguments: 3, moving: 2, parts: 4, slopes: 4 },
        }
    }

    /// Which of its arguments are asked for only where the others leave nothing: those from here on.
    #[must_use]
    pub const fn hot(self) -> usize {
        3
    }
}

/// How many numbers a [`Native`] takes and yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "told by Native::widths")]
pub struct Widths {
    pub arguments: usize,
    pub moving: usize,
    pub parts: usize,
    pub slopes: usize,
}

/// A call of a [`Native`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Call {
    /// The function.
    pub native: Native,
    /// Its arguments.
    pub arguments: Vec<Id>,
    /// What its arguments move along, where the call is for how the value moves; else nothing.
    pub along: Vec<Id>,
}

/// One number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// The bits of an f64.
    Constant(u64),
    /// A number of the sample, by its place among [`Graph::fields`].
    Field(u32),
    /// A number that is the same for all samples of a pass, by its place among [`Graph::uniforms`].
    Uniform(u32),
    /// An operation on one number.
    Unary(Unary, Id),
    /// An operation on two.
    Binary(Binary, Id, Id),
    /// `yes` where the condition is not 0, else `no`.
    Select {
        /// 0 or 1.
        condition: Id,
        /// Where it is 1.
        yes: Id,
        /// Where it is 0.
        no: Id,
    },
    /// A call, by its place among the graph's calls. Its numbers are read by [`Node::Part`]s.
    Call(u32),
    /// One of a call's numbers.
    Part(Id, u8),
}

/// One number of something that has a name: a field `base` has the components 0 to 2.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Input {
    /// The name in the rules.
    pub name: String,
    /// Which of its numbers.
    pub component: usize,
}

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

    /// An operation on one number.
    pub fn unary(&mut self, op: Unary, a: Id) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(apply_unary(op, x));
        }
        match (op, self.node(a)) {
            (Unary::Negate, Node::Unary(Unary::Negate, inner)) => inner,
            (Unary::Negate, Node::Binary(Binary::Subtract, x, y)) => self.binary(Binary::Subtract, y, x),
            (Unary::Abs, Node::Unary(Unary::Negate | Unary::Abs, inner)) => self.unary(Unary::Abs, inner),
            _ => self.add(Node::Unary(op, a)),
        }
    }

    /// An operation on two numbers.
    pub fn binary(&mut self, op: Binary, a: Id, b: Id) -> Id {
        use Binary as B;
        let (x, y) = (self.value(a), self.value(b));
        if let (Some(x), Some(y)) = (x, y) {
            return self.constant(apply_binary(op, x, y));
        }
        let negated = |graph: &Self, id| match graph.node(id) {
            Node::Unary(Unary::Negate, inner) => Some(inner),
            _ => None,
        };
        match (op, x, y) {
            (B::Add, Some(0.0), _) => b,
            (B::Add | B::Subtract, _, Some(0.0)) => a,
            (B::Subtract, Some(0.0), _) => self.unary(Unary::Negate, b),
            // Tangents of what stays are written as 0: their products with a finite number are.
            (B::Multiply, Some(0.0), _) | (B::Multiply, _, Some(0.0)) | (B::Divide, Some(0.0), _) => {
                self.constant(0.0)
            }
            (B::Multiply, Some(1.0), _) => b,
            (B::Multiply | B::Divide, _, Some(1.0)) => a,
            (B::Multiply, Some(-1.0), _) => self.unary(Unary::Negate, b),
            (B::Multiply | B::Divide, _, Some(-1.0)) => self.unary(Unary::Negate, a),
            (B::Divide, Some(1.0), _) => self.unary(Unary::Reciprocal, b),
            _ => match (op, negated(self, a), negated(self, b)) {
                (B::Add, _, Some(b)) => self.binary(B::Subtract, a, b),
                (B::Add, Some(a), None) => self.binary(B::Subtract, b, a),
                (B::Subtract, _, Some(b)) => self.binary(B::Add, a, b),
                (B::Multiply | B::Divide, Some(a), Some(b)) => self.binary(op, a, b),
                (B::Multiply | B::Divide, Some(a), None) => {
                    let positive = self.binary(op, a, b);
                    self.unary(Unary::Negate, positive)
                }
                (B::Multiply | B::Divide, None, Some(b)) => {
                    let positive = self.binary(op, a, b);
                    self.unary(Unary::Negate, positive)
                }
                // One order for what has none, so that both find the same node.
                (B::Add | B::Multiply | B::Min | B::Max, ..) if a > b => self.add(Node::Binary(op, b, a)),
                _ => self.add(Node::Binary(op, a, b)),
            },
        }
    }

    /// `yes` where `condition` is 1, else `no`.
    pub fn select(&mut self, condition: Id, yes: Id, no: Id) -> Id {
        if let Some(value) = self.value(condition) {
            return if value == 0.0 { no } else { yes };
        }
        if yes == no {
            return yes;
        }
        match self.negation(condition) {
            Some(opposite) => self.select(opposite, no, yes),
            None => self.add(Node::Select { condition, yes, no }),
        }
    }

    /// What a condition is the negation of.
    fn negation(&self, condition: Id) -> Option<Id> {
        match self.node(condition) {
            Node::Binary(Binary::Subtract, one, inner) if self.value(one) == Some(1.0) => Some(inner),
            _ => None,
        }
    }

    /// Not: 1 - condition.
    pub fn not(&mut self, condition: Id) -> Id {
        if let Some(inner) = self.negation(condition) {
            return inner;
        }
        let one = self.constant(1.0);
        self.binary(Binary::Subtract, one, condition)
    }

    /// Both conditions.
    pub fn and(&mut self, a: Id, b: Id) -> Id {
        if a == b { a } else { self.binary(Binary::Multiply, a, b) }
    }

    /// Either condition.
    pub fn or(&mut self, a: Id, b: Id) -> Id {
        if a == b { a } else { self.binary(Binary::Max, a, b) }
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

    /// A graph of what `outputs` are made of, with other inputs in the place of some nodes; and the outputs there.
    #[must_use]
    pub fn rebuilt(&self, outputs: &[Id], instead: impl Fn(Id) -> Option<Input>) -> (Self, Vec<Id>) {
        let mut graph = Self::default();
        let mut moved: Vec<Option<Id>> = vec![None; self.nodes.len()];
        let new =
            |id: Id, graph: &mut Self, moved: &mut Vec<Option<Id>>| self.copy(id, graph, moved, &instead);
        let outputs = outputs.iter().map(|&id| new(id, &mut graph, &mut moved)).collect();
        (graph, outputs)
    }

    fn copy(
        &self,
        id: Id,
        graph: &mut Self,
        moved: &mut Vec<Option<Id>>,
        instead: &impl Fn(Id) -> Option<Input>,
    ) -> Id {
        if let Some(done) = moved[id.index()] {
            return done;
        }
        let made = if let Some(input) = instead(id) {
            graph.field(&input.name, input.component)
        } else {
            let mut to = |id| self.copy(id, graph, moved, instead);
            match self.node(id) {
                Node::Constant(bits) => graph.constant(f64::from_bits(bits)),
                Node::Field(at) => {
                    let Input { name, component } = &self.fields[at as usize];
                    graph.field(name, *component)
                }
                Node::Uniform(at) => {
                    let Input { name, component } = &self.uniforms[at as usize];
                    graph.uniform(name, *component)
                }
                Node::Unary(op, a) => {
                    let a = to(a);
                    graph.unary(op, a)
                }
                Node::Binary(op, a, b) => {
                    let (a, b) = (to(a), to(b));
                    graph.binary(op, a, b)
                }
                Node::Select { condition, yes, no } => {
                    let (condition, yes, no) = (to(condition), to(yes), to(no));
                    graph.select(condition, yes, no)
                }
                Node::Call(at) => {
                    let Call { native, arguments, along } = &self.calls[at as usize];
                    let (mut copied, mut moved_along) = (Vec::new(), Vec::new());
                    for &id in arguments {
                        copied.push(self.copy(id, graph, moved, instead));
                    }
                    for &id in along {
                        moved_along.push(self.copy(id, graph, moved, instead));
                    }
                    let native = match *native {
                        Native::Lookup(resource) => {
                            Native::Lookup(graph.resource(&self.resources[resource as usize]))
                        }
                        other => other,
                    };
                    graph.add_call(Call { native, arguments: copied, along: moved_along })
                }
                Node::Part(lookup, part) => {
                    let lookup = to(lookup);
                    graph.add(Node::Part(lookup, part))
                }
            }
        };
        moved[id.index()] = Some(made);
        made
    }
}

/// An operation's value.
#[must_use]
pub fn apply_unary(op: Unary, x: f64) -> f64 {
    match op {
        Unary::Negate => -x,
        Unary::Abs => x.abs(),
        Unary::Sqrt => x.sqrt(),
        Unary::Reciprocal => 1.0 / x,
        Unary::Floor => x.floor(),
        Unary::Exp2 => x.exp2(),
        Unary::Log2 => x.log2(),
        Unary::IsFinite => f64::from(u8::from(x.is_finite())),
    }
}

/// An operation's value.
#[must_use]
pub fn apply_binary(op: Binary, x: f64, y: f64) -> f64 {
    let truth = |holds: bool| f64::from(u8::from(holds));
    match op {
        Binary::Add => x + y,
        Binary::Subtract => x - y,
        Binary::Multiply => x * y,
        Binary::Divide => x / y,
        Binary::Min => x.min(y),
        Binary::Max => x.max(y),
        Binary::Less => truth(x < y),
        Binary::GreaterEqual => truth(x >= y),
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
