//! Functions of the rules' library that run as one instruction: what each computes, in any kind of number.
//!
//! Their WGSL stands in `shader/rules/lib`; as arithmetic they would be some thirty instructions, most of which choose
//! between numbers that are at hand. The tests compare both.

use super::graph::Native;
use crate::model::cube::{Cube, CubePoint};
use crate::model::real::Real;
use crate::model::vector::{V3, dot, scale, select};

/// Squares of lengths whose roots and reciprocals an f32 holds with all its digits.
const PLAIN_SQUARES: [f64; 2] = [1e-30, 1e30];

/// The unit vector of a vector, and what its derivatives need.
#[derive(Clone, Copy)]
pub struct Unit<R: Real> {
    /// (1, 0, 0) where there is none.
    pub direction: V3<R>,
    /// Where the vector has a direction: its largest component is 1e-37 or more, and all are finite.
    pub has_direction: R::Mask,
    /// Whether every lane has one.
    pub all: bool,
    /// What the vector was divided by, so that its square is in range.
    size: R,
    /// 1 / that.
    reciprocal: R,
    /// 1 / the length of what was left.
    inverse: R,
}

impl<R: Real> Unit<R> {
    /// Of a vector of any length.
    #[inline(always)]
    pub fn new(v: V3<R>) -> Self {
        let one = v[0].lit(1.0);
        let (low, high) = (one.lit(PLAIN_SQUARES[0]), one.lit(PLAIN_SQUARES[1]));
        let square = dot(v, v);
        // A NaN fails the comparisons.
        let plain = R::and(square.ge(low), high.ge(square));
        if R::all(plain) {
            let (direction, inverse) = Self::divided(v, square);
            return Self { direction, has_direction: plain, all: true, size: one, reciprocal: one, inverse };
        }
        let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
        // `max` may have dropped a NaN, the sum has not.
        let sum = v[0] + v[1] + v[2];
        let ok = R::and(largest.ge(one.lit(1e-37)), R::and(largest.is_finite(), sum.is_finite()));
        let size = R::select(ok, largest, one);
        let zero = one.lit(0.0);
        let reciprocal = one / size;
        let u = select::<R>(ok, scale(reciprocal, v), [one, zero, zero]);
        let (direction, inverse) = Self::divided(u, dot(u, u));
        Self { direction, has_direction: ok, all: R::all(ok), size, reciprocal, inverse }
    }

    /// A vector by its length, whose square is in range, and 1 / the length.
    #[inline(always)]
    fn divided(v: V3<R>, square: R) -> (V3<R>, R) {
        let inverse = square.sqrt().recip();
        (scale(inverse, v), inverse)
    }

    /// How it moves as the vector moves along `d`: at most 1e6 in each component, beyond which squares of derivatives
    /// overflow an f32; 0 where there is no direction.
    #[inline(always)]
    pub fn along(&self, d: V3<R>) -> V3<R> {
        let n = self.direction;
        let most = self.size.lit(1e6) * self.size;
        let across = scale(self.inverse, d);
        let radial = dot(n, across);
        let mut turning = across;
        for k in 0..3 {
            let moved = (-radial).mul_add(n[k], across[k]);
            turning[k] = moved.max(-most).min(most) * self.reciprocal;
        }
        if self.all { turning } else { select::<R>(self.has_direction, turning, [most.lit(0.0); 3]) }
    }
}

/// The parts of a call's value, then of how it moves along each of `along`; a flag that tells where [`Native::Unit`]
/// has a direction.
pub fn call<R: Real>(
    native: Native,
    cube: Option<&Cube<R::Texel>>,
    arguments: &[R],
    along: &[Vec<R>],
) -> (Vec<R>, Vec<Vec<R>>, bool) {
    let three = |x: &[R]| [x[0], x[1], x[2]];
    match native {
        Native::Unit => {
            let unit = Unit::new(three(arguments));
            let slopes = along.iter().map(|d| unit.along(three(d)).to_vec()).collect();
            (unit.direction.to_vec(), slopes, unit.all)
        }
        Native::Place => {
            let point = CubePoint::of_unit(three(arguments));
            let slopes = along.iter().map(|d| point.tangent(three(d)).to_vec()).collect();
            (point.place().to_vec(), slopes, true)
        }
        Native::Lookup(_) => {
            let [face, s, t] = three(arguments);
            let Some(cube) = cube else { return (vec![face; 4], vec![vec![face; 4]; along.len()], true) };
            let at = cube.footprint_at(face.widen(), s.widen(), t.widen());
            let [value, across, down] = cube.sample_with_gradient(&at).map(|part| part.map(R::narrow));
            let of = |d: &Vec<R>| {
                let [ds, dt] = cube.texels([d[0], d[1]]);
                (0..4).map(|c| ds.mul_add(across[c], dt * down[c])).collect()
            };
            (value.to_vec(), along.iter().map(of).collect(), true)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::evaluate::Shared;
    use crate::program::graph::Graph;
    use crate::program::lower::{Natives, Source, Value};
    use crate::program::tape::Tape;

    /// What the rules' text computes of numbers, operation by operation.
    fn as_written(function: &str, arguments: &[[f64; 3]]) -> Vec<f64> {
        let text = [
            include_str!("../shader/rules/lib/vector.wgsl"),
            include_str!("../shader/rules/lib/cube.wgsl"),
            include_str!("../shader/rules/tangent/normalize_or.wgsl"),
            include_str!("../shader/rules/tangent/cube_place_of_unit.wgsl"),
        ];
        let source = Source::new(&text.concat(), Natives::Written).unwrap();
        let mut graph = Graph::default();
        let mut values = Vec::new();
        for (k, argument) in arguments.iter().enumerate() {
            let numbers = (0..argument.len()).map(|c| graph.field(&k.to_string(), c)).collect();
            values.push(Value::Numbers(numbers));
        }
        let outputs = source.call(&mut graph, function, values).unwrap();
        let tape = Tape::new(&graph, &outputs);
        let shared = Shared { uniforms: tape.uniform_values(|_| 0.0), cubes: Vec::new() };
        tape.run(&shared, 0.0_f64, |input| arguments[input.name.parse::<usize>().unwrap()][input.component])
    }

    const ALONG: [f64; 3] = [0.3, -0.8, 0.5];

    fn near(got: &[f64], want: &[f64], of: &str) {
        // A few roundings of f64; slopes at most 1e6.
        let close = |(g, w): (&f64, &f64)| (g - w).abs() <= 1e-12 * (1.0 + w.abs());
        assert!(got.len() == want.len() && got.iter().zip(want).all(close), "{of}: {got:?} {want:?}");
    }

    #[test]
    fn unit_vectors_are_those_of_the_rules() {
        let fallback = [0.0, 0.6, -0.8];
        let hard = [[0.0; 3], [f64::NAN, 1.0, 0.0], [1.0, f64::INFINITY, 0.0], [1e-38, 0.0, 0.0]];
        let plain = [[0.3, -0.4, 0.9], [1e-20, 2e-20, 0.0], [3e25, 1e20, -1e25], [1e-36, 0.0, 1e-36]];
        for v in hard.into_iter().chain(plain) {
            let (value, slopes, found) = call(Native::Unit, None, &v, &[ALONG.to_vec()]);
            let value = if found { value } else { fallback.to_vec() };
            near(&value, &as_written("normalize_or", &[v, fallback]), &format!("{v:?}"));
            let want = as_written("normalize_or_tangent", &[v, fallback, ALONG, [0.0; 3]]);
            near(&slopes[0], &want, &format!("{v:?} along"));
        }
    }

    #[test]
    fn places_are_those_of_the_rules() {
        let directions = [
            [0.6, 0.0, 0.8],
            [-0.9, 0.1, 0.3],
            [0.1, 0.7, -0.2],
            [0.2, -0.8, 0.1],
            [0.1, 0.2, -0.9],
            [0.0; 3],
        ];
        for d in directions {
            let (value, slopes, _) = call(Native::Place, None, &d, &[ALONG.to_vec()]);
            near(&value, &as_written("cube_place_of_unit", &[d]), &format!("{d:?}"));
            let want = as_written("cube_place_of_unit_tangent", &[d, ALONG]);
            near(&slopes[0], &want[1..], &format!("{d:?} along"));
        }
    }
}
