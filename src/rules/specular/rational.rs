//! Quotients of two polynomials in up to three variables, fitted to points and printed as functions of the rules.
//!
//! The coefficients are those of least squares with the denominator of the step before as weight (Sanathanan and
//! Koerner, *Transfer function synthesis as a ratio of two complex polynomials*, IEEE Transactions on Automatic
//! Control 8, 1963), weighted towards the largest error (Lawson's iteration). Variables lie in [-1, 1]. In print some run
//! from an end, so that f32 holds the sums where numerator and denominator are both small.

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};

/// Steps of a fit; the largest error no longer falls.
const STEPS: usize = 26;

/// The variables' names in print.
const VARIABLES: [&str; 3] = ["x", "y", "z"];

/// Where a variable is 0 in print.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// At -1, and 1 at 1.
    Low,
    /// Where it is.
    Middle,
    /// At 1, and 1 at -1.
    High,
}

impl Origin {
    /// x of what is printed: the sum of the first, and of the second times it.
    fn line(self) -> [f64; 2] {
        match self {
            Self::Low => [-1.0, 2.0],
            Self::Middle => [0.0, 1.0],
            Self::High => [1.0, -2.0],
        }
    }

    /// What is printed, of x.
    #[cfg(test)]
    pub(super) fn of(self, x: f64) -> f64 {
        let [start, scale] = self.line();
        (x - start) / scale
    }

    /// x to a power, by the powers of what is printed.
    fn power(self, power: usize) -> Vec<f64> {
        let [start, scale] = self.line();
        let mut own = vec![1.0];
        for _ in 0..power {
            let mut after: Vec<f64> = own.iter().map(|c| start * c).chain([0.0]).collect();
            own.iter().enumerate().for_each(|(k, c)| after[k + 1] += scale * c);
            own = after;
        }
        own
    }
}

/// Powers of x, y and z.
pub(super) type Term = [usize; 3];

/// What is to be met at one place.
#[derive(Clone, Copy)]
pub(super) struct Point {
    /// x, y and z.
    pub(super) at: [f64; 3],
    /// The quotient's value there.
    pub(super) target: f64,
    /// How much an error of it counts.
    pub(super) counts: f64,
}

/// Which terms numerator and denominator have; the first of each is the constant.
#[derive(Clone)]
pub(super) struct Shape {
    pub(super) numerator: Vec<Term>,
    pub(super) denominator: Vec<Term>,
}

/// All terms whose powers sum to no more than `degree`, z to no more than `depth`.
pub(super) fn terms(degree: usize, depth: usize) -> Vec<Term> {
    let powers = |i: usize| (0..=degree - i).map(move |j| (i, j));
    let with_z = |(i, j): (usize, usize)| (0..=depth.min(degree - i - j)).map(move |k| [i, j, k]);
    (0..=degree).flat_map(powers).flat_map(with_z).collect()
}

impl Shape {
    /// Coefficients of the numerator's and the denominator's terms.
    pub(super) fn solve(&self, points: &[Point]) -> [Vec<f64>; 2] {
        let (above, below) = (self.numerator.len(), self.denominator.len() - 1);
        let basis = |terms: &[Term]| -> Vec<Vec<f64>> {
            points.iter().map(|point| terms.iter().map(|&term| product(term, point.at)).collect()).collect()
        };
        let (numerators, divisors) = (basis(&self.numerator), basis(&self.denominator[1..]));
        let mut denominators = vec![1.0_f64; points.len()];
        let mut emphasis = vec![1.0_f64; points.len()];
        let mut best = (f64::INFINITY, Vec::new());
        for step in 0..STEPS {
            let row_scale = |k: usize| emphasis[k].sqrt() * points[k].counts / denominators[k];
            let matrix = DMatrix::from_fn(points.len(), above + below, |k, term| {
                let of_divisor = || -points[k].target * divisors[k][term - above];
                row_scale(k) * if term < above { numerators[k][term] } else { of_divisor() }
            });
            let right = DVector::from_fn(points.len(), |k, _| row_scale(k) * points[k].target);
            let qr = matrix.qr();
            let Some(found) = qr.r().solve_upper_triangular(&(qr.q().transpose() * right)) else { break };
            let found: Vec<f64> = found.iter().copied().collect();
            let mut errors = Vec::new();
            let mut least = f64::INFINITY;
            for (k, point) in points.iter().enumerate() {
                let denominator = 1.0 + sum(&divisors[k], &found[above..]);
                least = least.min(denominator);
                denominators[k] = denominator.abs().max(1e-3);
                let off = sum(&numerators[k], &found) / denominator - point.target;
                errors.push(off.abs() * point.counts);
            }
            let largest = errors.iter().fold(0.0, |a: f64, &b| a.max(b));
            if largest < best.0 && least > 0.0 {
                best = (largest, found);
            }
            // The denominator settles first.
            if step > 4 {
                emphasis.iter_mut().zip(&errors).for_each(|(e, error)| *e *= error / largest + 1e-2);
                let mean = emphasis.iter().sum::<f64>() / emphasis.len() as f64;
                emphasis.iter_mut().for_each(|e| *e /= mean);
            }
        }
        assert!(best.0.is_finite(), "no step left a denominator without zeros");
        let (numerator, denominator) = best.1.split_at(above);
        let denominator = [&[1.0], denominator].concat();
        let powers = |terms: &[Term], series: &[f64]| rewritten(terms, series, |_, i| chebyshev_powers(i));
        [powers(&self.numerator, numerator), powers(&self.denominator, &denominator)]
    }

    /// The quotient's value.
    pub(super) fn of(&self, [numerator, denominator]: &[Vec<f64>; 2], at: [f64; 3]) -> f64 {
        let value = |terms: &[Term], series: &[f64]| -> f64 {
            let of = |(&[i, j, k], c): (&Term, &f64)| {
                c * at[0].powi(i as i32) * at[1].powi(j as i32) * at[2].powi(k as i32)
            };
            terms.iter().zip(series).map(of).sum()
        };
        value(&self.numerator, numerator) / value(&self.denominator, denominator)
    }

    /// WGSL of the function, of as many variables as it has, each from its origin.
    pub(super) fn print(&self, name: &str, found: &[Vec<f64>; 2], from: [Origin; 3]) -> String {
        let moved = |terms: &[Term], series: &[f64]| rewritten(terms, series, |axis, i| from[axis].power(i));
        let [numerator, denominator] =
            [moved(&self.numerator, &found[0]), moved(&self.denominator, &found[1])];
        let all = || self.numerator.iter().chain(&self.denominator);
        let variables = if all().any(|term| term[2] > 0) { 3 } else { 2 };
        let arguments: Vec<String> = VARIABLES[..variables].iter().map(|v| format!("{v}: f32")).collect();
        let mut text = format!("fn {name}({}) -> f32 {{\n", arguments.join(", "));
        let scale = denominator[0];
        let mut quotient = Vec::new();
        for (letter, terms, series) in
            [("n", &self.numerator, &numerator), ("d", &self.denominator, &denominator)]
        {
            let own: Vec<(Term, f64)> = terms.iter().copied().zip(series.iter().map(|c| c / scale)).collect();
            let parts = by_power(&own, 0);
            let names: Vec<String> = (0..parts.len()).map(|i| format!("{letter}{i}")).collect();
            for (name, part) in names.iter().zip(&parts) {
                let _ = writeln!(text, "    let {name}: f32 = {};", polynomial(part, 1));
            }
            quotient.push(horner(&names, VARIABLES[0]));
        }
        let _ = write!(text, "    return ({}) / ({});\n}}\n", quotient[0], quotient[1]);
        text
    }
}

fn sum(basis: &[f64], coefficients: &[f64]) -> f64 {
    basis.iter().zip(coefficients).map(|(b, c)| b * c).sum()
}

/// The product of Chebyshev polynomials.
fn product(term: Term, at: [f64; 3]) -> f64 {
    (0..3).map(|axis| chebyshev(term[axis], at[axis])).product()
}

/// A series of products, of a factor for each axis and power, by the powers of the factors' variables, in the terms' order.
fn rewritten(terms: &[Term], series: &[f64], factor: impl Fn(usize, usize) -> Vec<f64>) -> Vec<f64> {
    let mut powers = vec![0.0; terms.len()];
    for (&term, c) in terms.iter().zip(series) {
        let own: [Vec<f64>; 3] = std::array::from_fn(|axis| factor(axis, term[axis]));
        for (power, to) in powers.iter_mut().zip(terms) {
            let shares = (0..3).map(|axis| own[axis].get(to[axis]).unwrap_or(&0.0));
            *power += c * shares.product::<f64>();
        }
    }
    powers
}

/// Terms apart by their power of one variable, from 0 on.
fn by_power(terms: &[(Term, f64)], axis: usize) -> Vec<Vec<(Term, f64)>> {
    let most = terms.iter().map(|(term, _)| term[axis]).max().unwrap_or(0);
    (0..=most).map(|power| terms.iter().filter(|(term, _)| term[axis] == power).copied().collect()).collect()
}

/// A polynomial of the variables from `axis` on.
fn polynomial(terms: &[(Term, f64)], axis: usize) -> String {
    if axis == VARIABLES.len() {
        return format!("{:?}", terms.iter().map(|(_, c)| c).sum::<f64>() as f32);
    }
    let parts: Vec<String> = by_power(terms, axis).iter().map(|part| polynomial(part, axis + 1)).collect();
    horner(&parts, VARIABLES[axis])
}

/// c0 + y * (c1 + y * (...)).
fn horner(parts: &[String], variable: &str) -> String {
    let mut text = String::new();
    for part in parts.iter().rev() {
        text = match (text.is_empty(), text.contains(' ')) {
            (true, _) => part.clone(),
            (_, true) => format!("{part} + {variable} * ({text})"),
            (_, false) => format!("{part} + {variable} * {text}"),
        };
    }
    text
}

fn chebyshev(degree: usize, x: f64) -> f64 {
    chebyshev_powers(degree).iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The coefficients of a Chebyshev polynomial, by powers.
fn chebyshev_powers(degree: usize) -> Vec<f64> {
    let (mut own, mut next) = (vec![1.0], vec![0.0, 1.0]);
    for _ in 0..degree {
        let mut after = vec![0.0; next.len() + 1];
        next.iter().enumerate().for_each(|(k, c)| after[k + 1] += 2.0 * c);
        own.iter().enumerate().for_each(|(k, c)| after[k] -= c);
        (own, next) = (next, after);
    }
    own
}
