//! Operations as nodes: what is constant is computed, and what changes nothing is left out.

use super::{Binary, Graph, Id, Node, Unary};

impl Graph {
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
        // Where a condition holds already, it holds.
        let (yes, no) = (self.under(condition, true, yes), self.under(condition, false, no));
        if yes == no {
            return yes;
        }
        match self.negation(condition) {
            Some(opposite) => self.select(opposite, no, yes),
            None => self.add(Node::Select { condition, yes, no }),
        }
    }

    /// What a number is where a condition is known to hold, or not to.
    fn under(&self, known: Id, holds: bool, mut number: Id) -> Id {
        while let Node::Select { condition, yes, no } = self.node(number)
            && condition == known
        {
            number = if holds { yes } else { no };
        }
        number
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
