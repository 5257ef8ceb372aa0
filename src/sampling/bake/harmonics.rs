//! Real spherical harmonics: orthonormal, without Condon-Shortley phase, polar axis +Y, azimuth from +Z towards +X
//! (MODEL 10).
//!
//! Of order n are the bands l = 0 .. n-1, n² functions; that of band l and azimuthal order m has the index l² + l + m.
//! m > 0 goes with the cosine of m times the azimuth, m < 0 with the sine. Band 1 is sqrt(3 / 4 pi) (x, y, z).

use std::f64::consts::PI;
use std::ops::{Add, Mul, Sub};

use glam::Vec3;

/// Y_00, the constant function.
pub const CONSTANT: f64 = 0.282_094_791_773_878_14;

/// How many bands there are, 2 to 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Order(usize);

impl Order {
    /// The lowest order.
    pub const LEAST: Self = Self(2);
    /// Of four bands, by which light is known that is even but for its shadows.
    pub const FOUR: Self = Self(4);
    /// The highest order.
    pub const MOST: Self = Self(6);

    /// The order of `bands` bands, where there is one.
    #[must_use]
    pub fn new(bands: usize) -> Option<Self> {
        (Self::LEAST.0..=Self::MOST.0).contains(&bands).then_some(Self(bands))
    }

    /// Bands.
    #[must_use]
    pub fn bands(self) -> usize {
        self.0
    }

    /// Functions.
    #[must_use]
    pub fn functions(self) -> usize {
        self.0 * self.0
    }

    /// Band and azimuthal order of each function.
    pub fn of_each(self) -> impl Iterator<Item = (usize, i32)> {
        (0..self.0).flat_map(|l| (-(l as i32)..=l as i32).map(move |m| (l, m)))
    }
}

/// The functions of the first `bands` bands at the unit direction `d` without their [`scale`]s, each handed to `put`
/// with its index. `lit` makes a constant, so that vectors of directions go as well.
#[inline(always)]
pub(super) fn unscaled<T>(
    bands: usize,
    [x, y, z]: [T; 3],
    lit: impl Fn(f64) -> T,
    mut put: impl FnMut(usize, T),
) where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    // sin^m times cosine and sine of m times the azimuth, and the associated Legendre functions over sin^m.
    let (mut cosine, mut sine, mut first) = (lit(1.0), lit(0.0), 1.0);
    for m in 0..bands {
        let (mut before, mut own) = (lit(0.0), lit(first));
        for l in m..bands {
            if l > m {
                let step = 1.0 / (l - m) as f64;
                let (a, b) = ((2 * l - 1) as f64 * step, (l + m - 1) as f64 * step);
                (before, own) = (own, lit(a) * y * own - lit(b) * before);
            }
            put(l * l + l + m, own * cosine);
            if m > 0 {
                put(l * l + l - m, own * sine);
            }
        }
        (cosine, sine) = (z * cosine - x * sine, x * cosine + z * sine);
        first *= (2 * m + 1) as f64;
    }
}

/// What makes the function of band `l` and azimuthal order `m` orthonormal.
#[must_use]
pub(super) fn scale(l: usize, m: i32) -> f64 {
    let m = m.unsigned_abs() as usize;
    // (l - m)! / (l + m)!
    let factorials: f64 = (l - m + 1..=l + m).map(|k| 1.0 / k as f64).product();
    let both = if m > 0 { 2.0 } else { 1.0 };
    (both * (2 * l + 1) as f64 / (4.0 * PI) * factorials).sqrt()
}

/// Every function's value along the unit direction `d`.
#[must_use]
pub fn basis(order: Order, d: [f64; 3]) -> Vec<f64> {
    let mut values = vec![0.0; order.functions()];
    unscaled(order.bands(), d, |x| x, |i, value| values[i] = value);
    values.iter_mut().zip(order.of_each()).for_each(|(value, (l, m))| *value *= scale(l, m));
    values
}

/// The factors A_l / pi of the cosine lobe max(0, cos) / pi by band.
#[must_use]
pub fn cosine_lobe(l: usize) -> f64 {
    [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0, 0.0].get(l).copied().unwrap_or(0.0)
}

/// The transfer vector of an unoccluded surface, A_l / pi Y_lm(N). Without a direction (a normal of length 0, or one
/// that is not finite) it is that of all directions alike: the first number alone.
#[must_use]
pub fn open_transfer(order: Order, normal: [f64; 3]) -> Vec<f64> {
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length > 0.0 && length.is_finite()) {
        let mut open = vec![0.0; order.functions()];
        open[0] = CONSTANT;
        return open;
    }
    let mut open = basis(order, normal.map(|x| x / length));
    open.iter_mut().zip(order.of_each()).for_each(|(value, (l, _))| *value *= cosine_lobe(l));
    open
}

/// [`open_transfer`] of a vertex' normal, rounded as baked transfer is: to the bit what an unoccluded vertex has.
#[must_use]
pub fn open_transfer_at(order: Order, normal: Vec3) -> Vec<f32> {
    open_transfer(order, normal.to_array().map(f64::from)).into_iter().map(|x| x as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_two_to_six_and_their_functions_are_in_the_order_of_their_indices() {
        let orders: Vec<usize> = (0..10).filter_map(Order::new).map(Order::bands).collect();
        assert_eq!(orders, [2, 3, 4, 5, 6]);
        for (i, (l, m)) in Order::MOST.of_each().enumerate() {
            assert_eq!(i as i32, (l * l + l) as i32 + m);
        }
        assert!((basis(Order::MOST, [0.0, 1.0, 0.0])[0] - CONSTANT).abs() < 1e-16);
    }

    #[test]
    fn functions_are_orthonormal() {
        // Equal steps in azimuth and the midpoint rule in the height, whose error for polynomials of degree 10 is of
        // the order of 10^2 / 24 / 2000^2.
        let (rows, columns) = (2000, 16);
        let mut products = vec![0.0; 36 * 36];
        for i in 0..rows * columns {
            let y = (f64::from(i / columns) + 0.5) / f64::from(rows) * 2.0 - 1.0;
            let (sine, cosine) = (f64::from(i % columns) / f64::from(columns) * 2.0 * PI).sin_cos();
            let radius = (1.0 - y * y).sqrt();
            let values = basis(Order::MOST, [radius * sine, y, radius * cosine]);
            let weight = 4.0 * PI / f64::from(rows * columns);
            for (k, product) in products.iter_mut().enumerate() {
                *product += weight * values[k / 36] * values[k % 36];
            }
        }
        for (k, product) in products.iter().enumerate() {
            let want = f64::from(u8::from(k / 36 == k % 36));
            assert!((product - want).abs() < 2e-5, "{k}: {product}");
        }
    }

    #[test]
    fn a_surface_without_a_direction_sees_all_alike() {
        for normal in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            let open = open_transfer_at(Order::MOST, normal);
            assert!(open[0] == CONSTANT as f32 && open[1..].iter().all(|&x| x == 0.0), "{normal}");
        }
        // A normal's length does not matter.
        let (short, long) = (Vec3::new(0.3, 0.4, -0.5), Vec3::new(3e3, 4e3, -5e3));
        let pairs = open_transfer_at(Order::MOST, short).into_iter().zip(open_transfer_at(Order::MOST, long));
        // Roundings of f32.
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-6));
    }
}
