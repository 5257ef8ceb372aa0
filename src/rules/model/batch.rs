//! Several numbers as one: what is done is found out once for all of them.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::real::Real;

/// `N` numbers, each operation on all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batch<R, const N: usize>(pub [R; N]);

// Loops, not closures over arrays: a closure is compiled without the instructions of who calls it.
macro_rules! operator {
    ($trait:ident $method:ident) => {
        impl<R: Real, const N: usize> $trait for Batch<R, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] = self.0[i].$method(other.0[i]);
                }
                self
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
    fn neg(mut self) -> Self {
        for i in 0..N {
            self.0[i] = -self.0[i];
        }
        self
    }
}

/// Methods of one and of two numbers.
macro_rules! by_lanes {
    ([$($one:ident)*] [$($two:ident)*]) => {
        $(#[inline(always)]
        fn $one(mut self) -> Self {
            for i in 0..N {
                self.0[i] = self.0[i].$one();
            }
            self
        })*
        $(#[inline(always)]
        fn $two(mut self, other: Self) -> Self {
            for i in 0..N {
                self.0[i] = self.0[i].$two(other.0[i]);
            }
            self
        })*
    };
}

/// What comparisons yield: of each number.
macro_rules! masks {
    ($($method:ident)*) => {
        $(#[inline(always)]
        fn $method(self, other: Self) -> Self::Mask {
            let mut mask = [self.0[0].$method(other.0[0]); N];
            for i in 1..N {
                mask[i] = self.0[i].$method(other.0[i]);
            }
            mask
        })*
    };
}

impl<R: Real, const N: usize> Real for Batch<R, N> {
    type Mask = [R::Mask; N];
    type Texel = R::Texel;
    type Wide = Batch<R::Wide, N>;

    by_lanes!([half fixed recip sqrt abs floor log2 exp2] [min max]);
    masks!(lt ge);

    #[inline(always)]
    fn widen(self) -> Self::Wide {
        let mut wide = Batch([self.0[0].widen(); N]);
        for i in 1..N {
            wide.0[i] = self.0[i].widen();
        }
        wide
    }
    #[inline(always)]
    fn narrow(wide: Self::Wide) -> Self {
        let mut narrow = Self([R::narrow(wide.0[0]); N]);
        for i in 1..N {
            narrow.0[i] = R::narrow(wide.0[i]);
        }
        narrow
    }
    #[inline(always)]
    fn lit(self, value: f64) -> Self {
        Self([self.0[0].lit(value); N])
    }
    #[inline(always)]
    fn mul_add(mut self, a: Self, b: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].mul_add(a.0[i], b.0[i]);
        }
        self
    }
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        let mut mask = [self.0[0].is_finite(); N];
        for i in 1..N {
            mask[i] = self.0[i].is_finite();
        }
        mask
    }
    #[inline(always)]
    fn and(mut a: Self::Mask, b: Self::Mask) -> Self::Mask {
        for i in 0..N {
            a[i] = R::and(a[i], b[i]);
        }
        a
    }
    #[inline(always)]
    fn select(mask: Self::Mask, mut yes: Self, no: Self) -> Self {
        for i in 0..N {
            yes.0[i] = R::select(mask[i], yes.0[i], no.0[i]);
        }
        yes
    }
    #[inline(always)]
    fn all(mask: Self::Mask) -> bool {
        let mut all = true;
        for i in 0..N {
            all &= R::all(mask[i]);
        }
        all
    }
    #[inline(always)]
    fn bilinear(texels: &[[R::Texel; 4]], row: usize, index: Self, fx: Self, fy: Self) -> [Self; 4] {
        let mut out = [fx; 4];
        for i in 0..N {
            let found = R::bilinear(texels, row, index.0[i], fx.0[i], fy.0[i]);
            for c in 0..4 {
                out[c].0[i] = found[c];
            }
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
            let (f, d) = ([f[0].0[i], f[1].0[i]], [d[0].0[i], d[1].0[i]]);
            let (value, slope) = R::bilinear_with_slope(texels, row, index.0[i], f, d);
            for c in 0..4 {
                (out.0[c].0[i], out.1[c].0[i]) = (value[c], slope[c]);
            }
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
            let parts = R::bilinear_with_gradient(texels, row, index.0[i], [f[0].0[i], f[1].0[i]]);
            for (out, part) in out.iter_mut().zip(parts) {
                for c in 0..4 {
                    out[c].0[i] = part[c];
                }
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
