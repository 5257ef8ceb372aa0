//! A stack of specular cubes over the Phong exponent, and the smooth curve through it.

use std::ops::RangeInclusive;

use crate::model::cube::Cube;

/// Specular cubes for exponents that grow geometrically; alpha is the luminance.
#[derive(Clone, Debug)]
pub struct LobeStack {
    /// Phong exponents, ascending, each the same ratio above the one before.
    pub exponents: Vec<f64>,
    /// One cube an exponent, all of one size.
    pub cubes: Vec<Cube<f32>>,
}

/// The greatest exponent of a stack (that of the parameter table).
const SHARPEST_LOG2: u32 = 11;

/// The exponents 2^(k / per_octave) of 1 to 2048 that interpolation needs anywhere in `range`: one
/// where `range` is a single exponent of the stack, else those around it and a neighbour on each
/// side.
#[must_use]
pub fn knots(range: &RangeInclusive<f64>, per_octave: u32) -> Vec<f64> {
    let per_octave = per_octave.max(1);
    let last = i64::from(SHARPEST_LOG2 * per_octave);
    let position = |e: f64| (e.clamp(1.0, 2048.0).log2() * f64::from(per_octave)).clamp(0.0, last as f64);
    let (low, high) = (position(*range.start()), position(*range.end()));
    // Within 1e-9 of a knot the others' weights are below the cubes' rounding.
    let (first, end) = if high - low < 1e-9 && (low - low.round()).abs() < 1e-9 {
        (low.round() as i64, low.round() as i64)
    } else {
        let interval = (low.floor() as i64).min(last - 1);
        (interval - 1, (high.ceil() as i64).max(interval + 1) + 1)
    };
    (first.max(0)..=end.min(last)).map(|k| (k as f64 / f64::from(per_octave)).exp2()).collect()
}

impl LobeStack {
    /// The cube at `exponent` and its derivative with respect to the exponent.
    ///
    /// Between the stack's cubes runs a Catmull-Rom spline in log2(exponent), with the end slopes of
    /// the parabola through three cubes: exact at each cube, the derivative continuous. A stack of
    /// two is joined by a line, one cube holds everywhere. Beyond its ends the stack is constant.
    ///
    /// # Panics
    /// When the stack is empty, which no bake makes.
    #[must_use]
    pub fn at(&self, exponent: f64) -> (Cube<f32>, Cube<f32>) {
        let count = self.exponents.len();
        assert!(count > 0 && count == self.cubes.len(), "a lobe stack has a cube for each exponent");
        if count == 1 {
            return (self.cubes[0].clone(), self.cubes[0].map(|_| [0.0; 4]));
        }
        let (start, end) = (self.exponents[0].log2(), self.exponents[count - 1].log2());
        let step = (end - start) / (count - 1) as f64;
        let position = (exponent.max(1e-6).log2() - start) / step;
        let inside = (0.0..=(count - 1) as f64).contains(&position);
        let position = position.clamp(0.0, (count - 1) as f64);
        let i = (position as usize).min(count - 2);
        let (value, slope) = self.spline(i, position - i as f64);
        // d position / d exponent.
        let rate = if inside { 1.0 / (step * exponent * std::f64::consts::LN_2) } else { 0.0 };
        (self.combine(i, 1.0, value), self.combine(i, 0.0, slope.map(|w| w * rate)))
    }

    /// Weights of the *differences* between neighbouring cubes i-1..i, i..i+1 and i+1..i+2, for the
    /// value above cube i and for its derivative, at x in [0, 1] of interval i.
    fn spline(&self, i: usize, x: f64) -> ([f64; 3], [f64; 3]) {
        let last = self.exponents.len() - 1;
        // The slope at a cube, from the differences before and behind it.
        let left = match (i > 0, i + 1 < last) {
            (true, _) => [0.5, 0.5, 0.0],
            (false, true) => [0.0, 1.5, -0.5],
            (false, false) => [0.0, 1.0, 0.0],
        };
        let right = match (i + 1 < last, i > 0) {
            (true, _) => [0.0, 0.5, 0.5],
            (false, true) => [-0.5, 1.5, 0.0],
            (false, false) => [0.0, 1.0, 0.0],
        };
        // Cubic Hermite basis and its derivative.
        let (x2, x3) = (x * x, x * x * x);
        let hermite = |h01: f64, h10: f64, h11: f64| {
            std::array::from_fn(|k| f64::from(u8::from(k == 1)) * h01 + h10 * left[k] + h11 * right[k])
        };
        (
            hermite(3.0 * x2 - 2.0 * x3, x3 - 2.0 * x2 + x, x3 - x2),
            hermite(6.0 * x - 6.0 * x2, 3.0 * x2 - 4.0 * x + 1.0, 3.0 * x2 - 2.0 * x),
        )
    }

    /// Cube i times `own`, plus the weighted differences of neighbouring cubes.
    fn combine(&self, i: usize, own: f64, weights: [f64; 3]) -> Cube<f32> {
        let last = self.cubes.len() - 1;
        let four = [i.saturating_sub(1), i, i + 1, (i + 2).min(last)].map(|k| &self.cubes[k]);
        Cube::from_fn(four[1].size(), |face, column, row| {
            let [a, b, c, d] = four.map(|cube| cube.texel(face, column, row).map(f64::from));
            std::array::from_fn(|k| {
                let differences = [b[k] - a[k], c[k] - b[k], d[k] - c[k]];
                let sum: f64 = (0..3).map(|n| weights[n] * differences[n]).sum();
                (own * b[k] + sum) as f32
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stack whose texels follow `f(log2 exponent)`.
    fn stack(range: RangeInclusive<f64>, per_octave: u32, f: impl Fn(f64) -> f64) -> LobeStack {
        let exponents = knots(&range, per_octave);
        let cubes = exponents.iter().map(|e| Cube::from_fn(2, |_, _, _| [f(e.log2()) as f32; 4])).collect();
        LobeStack { exponents, cubes }
    }

    fn read(stack: &LobeStack, exponent: f64) -> (f64, f64) {
        let (value, slope) = stack.at(exponent);
        (f64::from(value.texel(3, 1, 0)[2]), f64::from(slope.texel(3, 1, 0)[2]))
    }

    #[test]
    fn knots_cover_a_range_with_a_neighbour_on_each_side() {
        assert_eq!(knots(&(1.0..=2048.0), 1).len(), 12);
        assert_eq!(knots(&(32.0..=32.0), 1), [32.0]);
        assert_eq!(knots(&(33.0..=33.0), 1), [16.0, 32.0, 64.0, 128.0]);
        assert_eq!(knots(&(20.0..=40.0), 1), [8.0, 16.0, 32.0, 64.0, 128.0]);
        assert_eq!(knots(&(1.5..=1.5), 1), [1.0, 2.0, 4.0]);
        assert_eq!(knots(&(2048.0..=2048.0), 3), [2048.0]);
        assert_eq!(knots(&(1.0..=2048.0), 2).len(), 23);
    }

    #[test]
    fn a_part_of_the_stack_gives_what_the_whole_gives() {
        let whole = stack(1.0..=2048.0, 2, |x| (0.7 * x).sin());
        for e in [1.0, 1.2, 2.9, 32.0, 33.0, 700.0, 1500.0, 2000.0] {
            assert_eq!(read(&whole, e).0, read(&stack(e..=e, 2, |x| (0.7 * x).sin()), e).0, "{e}");
        }
    }

    #[test]
    fn a_parabola_in_the_logarithm_is_met_exactly_with_its_derivative() {
        let stack = stack(1.0..=2048.0, 1, |x| 3.0 - x + 0.25 * x * x);
        for e in [1.0, 1.3, 7.0, 100.0, 1024.0, 2000.0, 2048.0] {
            let x = f64::log2(e);
            let (value, slope) = read(&stack, e);
            let want = (0.5 * x - 1.0) / (e * std::f64::consts::LN_2);
            // Stored in f32.
            assert!((value - (3.0 - x + 0.25 * x * x)).abs() < 4e-6, "{e}: {value}");
            assert!((slope - want).abs() < 1e-6, "{e}: {slope} {want}");
        }
    }

    #[test]
    fn the_curve_and_its_derivative_are_continuous_and_a_constant_stays_itself() {
        let stack = stack(1.0..=2048.0, 1, |x| (1.3 * x).sin());
        for k in 1..11 {
            let knot = f64::from(k).exp2();
            let (below, above) = (read(&stack, knot * (1.0 - 1e-9)), read(&stack, knot * (1.0 + 1e-9)));
            // A billionth of the exponent aside, in f32.
            assert!((below.0 - above.0).abs() < 1e-6 && (below.1 - above.1).abs() < 1e-6, "{k}");
            assert_eq!(read(&stack, knot).0, f64::from((1.3 * f64::from(k)).sin() as f32));
        }
        let one = self::stack(1.0..=2048.0, 1, |_| 0.37);
        for e in [1.0, 1.7, 31.0, 900.0, 4000.0] {
            assert_eq!(read(&one, e), (f64::from(0.37_f32), 0.0));
        }
    }

    #[test]
    fn stacks_of_one_two_and_three_cubes_fall_back_gracefully() {
        let make = |n: usize| LobeStack {
            exponents: (0..n).map(|k| f64::from(1 << k)).collect(),
            cubes: (0..n).map(|k| Cube::from_fn(1, |_, _, _| [k as f32; 4])).collect(),
        };
        let read = |stack: &LobeStack, e: f64| stack.at(e).0.texel(0, 0, 0)[0];
        assert_eq!(read(&make(1), 50.0), 0.0);
        // Halfway in the logarithm; three equidistant cubes on a line.
        assert!((read(&make(2), 2_f64.sqrt()) - 0.5).abs() < 1e-6);
        assert!((read(&make(3), 8_f64.sqrt()) - 1.5).abs() < 1e-6);
        assert_eq!((read(&make(3), 0.1), read(&make(3), 1e9)), (0.0, 2.0));
    }
}
