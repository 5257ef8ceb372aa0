//! Several numbers as one: what is done is found out once for all of them.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::real::Real;

/// `N` numbers, each operation on all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batch<R, const N: usize>(pub [R; N]);

impl<R: Copy, const N: usize> Batch<R, N> {
    #[inline(always)]
    fn each(mut self, of: impl Fn(R) -> R) -> Self {
        self.0.iter_mut().for_each(|x| *x = of(*x));
        self
    }

    #[inline(always)]
    fn both(mut self, other: Self, of: impl Fn(R, R) -> R) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(x, y)| *x = of(*x, y));
        self
    }
}

macro_rules! operator {
    ($trait:ident $method:ident) => {
        impl<R: Real, const N: usize> $trait for Batch<R, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.both(other, R::$method)
            }
        }
    };
}
operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);
operator!(Div div);

impl<R: Real, const N: usize> Neg for Batch<R, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(R::neg)
    }
}

/// Methods of one and of two numbers.
macro_rules! by_lanes {
    ([$($one:ident)*] [$($two:ident)*]) => {
        $(#[inline(always)]
        fn $one(self) -> Self {
            self.each(R::$one)
        })*
        $(#[inline(always)]
        fn $two(self, other: Self) -> Self {
            self.both(other, R::$two)
        })*
    };
}

impl<R: Real, const N: usize> Real for Batch<R, N> {
    type Mask = [R::Mask; N];
    type Texel = R::Texel;
    type Wide = Batch<R::Wide, N>;

    by_lanes!([half fixed recip sqrt abs floor log2 exp2] [min max]);

    #[inline(always)]
    fn widen(self) -> Self::Wide {
        Batch(self.0.map(R::widen))
    }
    #[inline(always)]
    fn narrow(wide: Self::Wide) -> Self {
        Self(wide.0.map(R::narrow))
    }
    #[inline(always)]
    fn lit(self, value: f64) -> Self {
        self.each(|x| x.lit(value))
    }
    #[inline(always)]
    fn mul_add(mut self, a: Self, b: Self) -> Self {
        self.0.iter_mut().zip(a.0).zip(b.0).for_each(|((x, a), b)| *x = x.mul_add(a, b));
        self
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        std::array::from_fn(|i| self.0[i].lt(other.0[i]))
    }
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        std::array::from_fn(|i| self.0[i].ge(other.0[i]))
    }
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.0.map(R::is_finite)
    }
    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        std::array::from_fn(|i| R::and(a[i], b[i]))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| R::select(mask[i], yes.0[i], no.0[i])))
    }
    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        mask.into_iter().all(R::all)
    }
    #[inline(always)]
    fn bilinear(texels: &[[R::Texel; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4] {
        let mut out = [fx; 4];
        for i in 0..N {
            let found = R::bilinear(texels, row, index.0[i], fx.0[i], fy.0[i]);
            (0..4).for_each(|c| out[c].0[i] = found[c]);
        }
        out
    }
    #[inline(always)]
    fn bilinear_with_slope(
        texels: &[[R::Texel; 4]],
        row: usize,
        index: Self,
        f: [Self; 2],
        d: [Self; 2],
    ) -> ([Self; 4], [Self; 4]) {
        let mut out = ([index; 4], [index; 4]);
        for i in 0..N {
            let (f, d) = (f.map(|f| f.0[i]), d.map(|d| d.0[i]));
            let (value, slope) = R::bilinear_with_slope(texels, row, index.0[i], f, d);
            (0..4).for_each(|c| (out.0[c].0[i], out.1[c].0[i]) = (value[c], slope[c]));
        }
        out
    }
    #[inline(always)]
    fn bilinear_with_gradient(
        texels: &[[R::Texel; 4]],
        row: usize,
        index: Self,
        f: [Self; 2],
    ) -> [[Self; 4]; 3] {
        let mut out = [[index; 4]; 3];
        for i in 0..N {
            let parts = R::bilinear_with_gradient(texels, row, index.0[i], f.map(|f| f.0[i]));
            for (out, part) in out.iter_mut().zip(parts) {
                (0..4).for_each(|c| out[c].0[i] = part[c]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::cube::Cube;
    use crate::model::formats::{Emulated, Half};

    #[test]
    fn every_lane_is_computed_as_if_it_were_alone() {
        let (a, b) = ([0.3_f64, -2.5, 7.0], [1.5_f64, 0.25, -3.0]);
        let (many, other) = (Batch(a), Batch(b));
        let of = |x: f64, y: f64| {
            let mask = x.lt(y);
            f64::select(mask, x.mul_add(y, x.abs().sqrt()), x.max(y).floor() / y)
        };
        let mask = many.lt(other);
        let batch =
            Batch::select(mask, many.mul_add(other, many.abs().sqrt()), many.max(other).floor() / other);
        for i in 0..3 {
            assert_eq!(batch.0[i], of(a[i], b[i]));
        }
    }

    #[test]
    fn lookups_and_formats_are_those_of_the_lanes() {
        let cube = Cube::from_fn(4, |face, column, row| {
            [face as f64, column as f64, row as f64, (face * column + row) as f64]
        });
        let lanes = [[0.0, 0.2, 0.9], [3.0, 0.61, 0.33]];
        let number = |x: f64| Emulated::<Half>::new(x);
        let [face, s, t] = [0, 1, 2].map(|c| Batch(lanes.map(|at| number(at[c]).widen())));
        let found = cube.sample_with_gradient(&cube.footprint_at(face, s, t));
        for (i, at) in lanes.iter().enumerate() {
            let [face, s, t] = at.map(|x| number(x).widen());
            let alone = cube.sample_with_gradient(&cube.footprint_at(face, s, t));
            for (part, alone) in found.iter().zip(alone) {
                for c in 0..4 {
                    let (got, want): (f64, f64) =
                        (Emulated::narrow(part[c].0[i]).into(), Emulated::<Half>::narrow(alone[c]).into());
                    assert_eq!(got, want);
                }
            }
        }
    }
}
