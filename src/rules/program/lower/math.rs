//! WGSL's operators and functions of numbers.

use naga::{BinaryOperator as B, MathFunction as M};

use super::LowerError;
use super::frame::Frame;
use crate::program::graph::{Binary, Graph, Id, Unary};

impl Frame<'_> {
    pub(super) fn binary(&mut self, op: B, a: Id, b: Id) -> Result<Id, LowerError> {
        let graph = &mut *self.graph;
        Ok(match op {
            B::Add => graph.binary(Binary::Add, a, b),
            B::Subtract => graph.binary(Binary::Subtract, a, b),
            B::Multiply => graph.binary(Binary::Multiply, a, b),
            B::Divide => graph.binary(Binary::Divide, a, b),
            B::Less => graph.binary(Binary::Less, a, b),
            B::Greater => graph.binary(Binary::Less, b, a),
            B::GreaterEqual => graph.binary(Binary::GreaterEqual, a, b),
            B::LessEqual => graph.binary(Binary::GreaterEqual, b, a),
            B::Equal => {
                let (above, below) =
                    (graph.binary(Binary::GreaterEqual, a, b), graph.binary(Binary::GreaterEqual, b, a));
                graph.and(above, below)
            }
            B::NotEqual => {
                let equal = self.binary(B::Equal, a, b)?;
                self.graph.not(equal)
            }
            B::And | B::LogicalAnd => graph.and(a, b),
            B::InclusiveOr | B::LogicalOr => graph.or(a, b),
            other => return Err(self.unsupported(format!("operator {other:?}"))),
        })
    }

    fn dot(&mut self, a: &[Id], b: &[Id]) -> Id {
        let mut sum = self.graph.constant(0.0);
        for (&x, &y) in a.iter().zip(b) {
            let product = self.graph.binary(Binary::Multiply, x, y);
            sum = self.graph.binary(Binary::Add, sum, product);
        }
        sum
    }

    pub(super) fn math(&mut self, fun: M, arguments: &[Vec<Id>]) -> Result<Vec<Id>, LowerError> {
        match fun {
            M::Dot => return Ok(vec![self.dot(&arguments[0], &arguments[1])]),
            M::Length => {
                let square = self.dot(&arguments[0], &arguments[0]);
                return Ok(vec![self.graph.unary(Unary::Sqrt, square)]);
            }
            M::Cross => {
                let (a, b) = (&arguments[0], &arguments[1]);
                let graph = &mut *self.graph;
                let minor = |i: usize, j: usize| {
                    let (p, q) = (
                        graph.binary(Binary::Multiply, a[i], b[j]),
                        graph.binary(Binary::Multiply, a[j], b[i]),
                    );
                    graph.binary(Binary::Subtract, p, q)
                };
                return Ok([(1, 2), (2, 0), (0, 1)]
                    .map({
                        let mut minor = minor;
                        move |(i, j)| minor(i, j)
                    })
                    .to_vec());
            }
            _ => {}
        }
        self.by_components(arguments, |frame, x| frame.math_of_numbers(fun, x))
    }

    /// sin(x) by its series over half a turn, which ends below the last bit of an f64 there.
    fn sine(&mut self, x: Id) -> Id {
        use std::f64::consts::{FRAC_1_PI, PI};
        // What PI lacks of pi: half turns are taken off in two parts.
        const REST: f64 = 1.224_646_799_147_353_2e-16;
        let graph = &mut *self.graph;
        let constant = |graph: &mut Graph, x: f64| graph.constant(x);
        let (per_turn, half) = (constant(graph, FRAC_1_PI), constant(graph, 0.5));
        let turns = graph.binary(Binary::Multiply, x, per_turn);
        let turns = graph.binary(Binary::Add, turns, half);
        let turns = graph.unary(Unary::Floor, turns);
        let mut left = x;
        for part in [PI, REST] {
            let part = constant(graph, part);
            let taken = graph.binary(Binary::Multiply, turns, part);
            left = graph.binary(Binary::Subtract, left, taken);
        }
        let square = graph.binary(Binary::Multiply, left, left);
        let mut series = constant(graph, 1.0);
        for k in (1..=11).rev() {
            let divisor = constant(graph, -1.0 / f64::from(2 * k * (2 * k + 1)));
            let next = graph.binary(Binary::Multiply, square, divisor);
            let next = graph.binary(Binary::Multiply, next, series);
            let one = constant(graph, 1.0);
            series = graph.binary(Binary::Add, one, next);
        }
        let sine = graph.binary(Binary::Multiply, left, series);
        let (odd, opposite) = (self.odd(turns), self.graph.unary(Unary::Negate, sine));
        self.graph.select(odd, opposite, sine)
    }

    /// Whether a whole number is odd.
    fn odd(&mut self, whole: Id) -> Id {
        let graph = &mut *self.graph;
        let half = graph.constant(0.5);
        let halved = graph.binary(Binary::Multiply, half, whole);
        let down = graph.unary(Unary::Floor, halved);
        graph.binary(Binary::Less, down, halved)
    }

    /// The nearest whole number, the even one of two.
    fn nearest(&mut self, x: Id) -> Id {
        let graph = &mut *self.graph;
        let (half, one) = (graph.constant(0.5), graph.constant(1.0));
        let above = graph.binary(Binary::Add, x, half);
        let up = graph.unary(Unary::Floor, above);
        let (tied, down) =
            (graph.binary(Binary::GreaterEqual, up, above), graph.binary(Binary::Subtract, up, one));
        let odd = self.odd(up);
        let lower = self.graph.and(tied, odd);
        self.graph.select(lower, down, up)
    }

    fn math_of_numbers(&mut self, fun: M, x: &[Id]) -> Result<Id, LowerError> {
        let graph = &mut *self.graph;
        Ok(match fun {
            M::Abs => graph.unary(Unary::Abs, x[0]),
            M::Floor => graph.unary(Unary::Floor, x[0]),
            M::Sqrt => graph.unary(Unary::Sqrt, x[0]),
            M::Exp2 => graph.unary(Unary::Exp2, x[0]),
            M::Log2 => graph.unary(Unary::Log2, x[0]),
            M::InverseSqrt => {
                let root = graph.unary(Unary::Sqrt, x[0]);
                graph.unary(Unary::Reciprocal, root)
            }
            M::Exp => {
                let factor = graph.constant(std::f64::consts::LOG2_E);
                let scaled = graph.binary(Binary::Multiply, factor, x[0]);
                graph.unary(Unary::Exp2, scaled)
            }
            M::Log => {
                let (factor, log) = (graph.constant(std::f64::consts::LN_2), graph.unary(Unary::Log2, x[0]));
                graph.binary(Binary::Multiply, factor, log)
            }
            M::Pow => {
                let log = graph.unary(Unary::Log2, x[0]);
                let scaled = graph.binary(Binary::Multiply, x[1], log);
                graph.unary(Unary::Exp2, scaled)
            }
            M::Sin => self.sine(x[0]),
            M::Cos => {
                let quarter = graph.constant(std::f64::consts::FRAC_PI_2);
                let ahead = graph.binary(Binary::Add, x[0], quarter);
                self.sine(ahead)
            }
            M::Ceil => {
                let below = graph.unary(Unary::Negate, x[0]);
                let below = graph.unary(Unary::Floor, below);
                graph.unary(Unary::Negate, below)
            }
            M::Trunc => {
                let size = graph.unary(Unary::Abs, x[0]);
                let (size, zero) = (graph.unary(Unary::Floor, size), graph.constant(0.0));
                let (negative, opposite) =
                    (graph.binary(Binary::Less, x[0], zero), graph.unary(Unary::Negate, size));
                graph.select(negative, opposite, size)
            }
            M::Round => self.nearest(x[0]),
            M::Fract => {
                let whole = graph.unary(Unary::Floor, x[0]);
                graph.binary(Binary::Subtract, x[0], whole)
            }
            M::Min => graph.binary(Binary::Min, x[0], x[1]),
            M::Max => graph.binary(Binary::Max, x[0], x[1]),
            M::Clamp => {
                let raised = graph.binary(Binary::Max, x[0], x[1]);
                graph.binary(Binary::Min, raised, x[2])
            }
            M::Saturate => {
                let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
                let raised = graph.binary(Binary::Max, x[0], zero);
                graph.binary(Binary::Min, raised, one)
            }
            M::Fma => {
                let product = graph.binary(Binary::Multiply, x[0], x[1]);
                graph.binary(Binary::Add, product, x[2])
            }
            M::Mix => {
                let step = graph.binary(Binary::Subtract, x[1], x[0]);
                let part = graph.binary(Binary::Multiply, step, x[2]);
                graph.binary(Binary::Add, x[0], part)
            }
            M::Step => graph.binary(Binary::GreaterEqual, x[1], x[0]),
            M::Sign => {
                let zero = graph.constant(0.0);
                let (positive, negative) =
                    (graph.binary(Binary::Less, zero, x[0]), graph.binary(Binary::Less, x[0], zero));
                graph.binary(Binary::Subtract, positive, negative)
            }
            other => return Err(self.unsupported(format!("{other:?}"))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::lower::{Natives, Source, Value};
    use crate::program::steps::{Rounding, Steps};

    /// A function of one number, at some numbers.
    fn values(body: &str, at: &[f64]) -> Vec<f64> {
        let source =
            Source::new(&format!("fn f(x: f32) -> f32 {{ return {body}; }}"), Natives::Written).unwrap();
        let mut graph = Graph::default();
        let x = graph.field("x", 0);
        let outputs = source.call(&mut graph, "f", vec![Value::Numbers(vec![x])]).unwrap();
        let steps = Steps::new(&graph, &outputs, |_| Rounding::Plain);
        let shared = steps.setting(0.0, |_| 0.0, |_| unreachable!("nothing is looked up"));
        let mut registers = Vec::new();
        let mut value = |x: f64| {
            steps.run(&shared, 0.0, &mut registers, |_| x);
            steps.outputs(&shared, &registers).next().unwrap()
        };
        at.iter().map(|&x| value(x)).collect()
    }

    #[test]
    fn sines_are_those_of_f64() {
        let at: Vec<f64> = (-200..200).map(|i| 0.173 * f64::from(i)).collect();
        for (body, want) in [("sin(x)", f64::sin as fn(f64) -> f64), ("cos(x)", f64::cos)] {
            for (x, got) in at.iter().zip(values(body, &at)) {
                // Some roundings of numbers up to 35, whose last bit is 7e-15.
                assert!((got - want(*x)).abs() < 1e-14, "{body} at {x}: {got} {}", want(*x));
            }
        }
    }

    #[test]
    fn whole_numbers_are_found_as_wgsl_defines_them() {
        let at = [-2.5, -1.5, -1.2, -0.5, 0.0, 0.5, 0.7, 1.5, 2.5, 3.0, 3.49];
        assert_eq!(values("round(x)", &at), at.map(f64::round_ties_even));
        assert_eq!(values("trunc(x)", &at), at.map(f64::trunc));
        assert_eq!(values("ceil(x)", &at), at.map(f64::ceil));
    }

    #[test]
    fn constants_of_mathematics_are_meant_and_not_their_nearest_f32() {
        let exact = [std::f64::consts::LN_2, std::f64::consts::PI, std::f64::consts::PI / 180.0, 0.1];
        for (body, want) in
            ["0.6931472 * x", "3.1415927 * x", "0.017453292 * x", "0.1 * x"].into_iter().zip(exact)
        {
            assert_eq!(values(body, &[1.0]), [want], "{body}");
        }
    }
}
