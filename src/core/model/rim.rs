//! The silhouette S.z = 1 - |N.V| and the rim S.z^p (listing 3-3), with their derivatives.

use super::real::Real;

/// S.z = 1 - min(|N.V|, 1) from the dot product of unit vectors (MODEL 3, corrected form).
#[inline(always)]
pub fn silhouette<R: Real>(n_dot_v: R) -> R {
    let one = n_dot_v.lit(1.0);
    one - n_dot_v.abs().min(one)
}

/// d silhouette / d (N.V): the sign of -(N.V), and 0 where N.V is 0 or the clamp holds (MODEL 7).
#[inline(always)]
pub fn silhouette_slope<R: Real>(n_dot_v: R) -> R {
    let (zero, one) = (n_dot_v.lit(0.0), n_dot_v.lit(1.0));
    let sign = R::select(zero.lt(n_dot_v), -one, R::select(n_dot_v.lt(zero), one, zero));
    R::select(n_dot_v.abs().lt(one), sign, zero)
}

/// The rim and its two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Rim<R> {
    /// z^p, with 0^p = 0 and 0^0 = 1.
    pub value: R,
    /// d rim / d p = z^p ln z, and 0 at z = 0.
    pub by_exponent: R,
    /// d rim / d z = p z^(p-1), taken at z = 1e-6 below that, so that it stays finite for p < 1.
    pub by_silhouette: R,
}

/// z^p for z in [0, 1].
#[inline(always)]
pub fn rim<R: Real>(z: R, exponent: R) -> Rim<R> {
    let (zero, one) = (z.lit(0.0), z.lit(1.0));
    // The smallest positive normal f32; below it the power is 0 for any exponent of the table's bounds.
    let positive = z.ge(z.lit(1.2e-38));
    let log2 = R::select(positive, z, one).log2();
    let power = (exponent * log2).exp2();
    let at_zero = R::select(zero.lt(exponent), zero, one);
    let value = R::select(positive, power, at_zero);
    let by_exponent = R::select(positive, power * log2 * z.lit(std::f64::consts::LN_2), zero);
    let floor = z.lit(1e-6);
    let above = z.ge(floor);
    // floor^(p-1), with log2(1e-6) = -19.93.
    let least = ((exponent - one) * z.lit(-19.931_568_569_324_174)).exp2();
    let slope = R::select(above, power * R::select(above, z, one).recip(), least);
    Rim { value, by_exponent, by_silhouette: exponent * slope }
}
