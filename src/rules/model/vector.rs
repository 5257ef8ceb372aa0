//! A few operations of 3-vectors, over any [`Real`].

use super::real::Real;

/// A 3-vector, or three colour channels.
pub type V3<R> = [R; 3];

/// a . b
#[inline(always)]
pub fn dot<R: Real>(a: V3<R>, b: V3<R>) -> R {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// a x b
#[inline(always)]
pub fn cross<R: Real>(a: V3<R>, b: V3<R>) -> V3<R> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + b
#[inline(always)]
pub fn add<R: Real>(a: V3<R>, b: V3<R>) -> V3<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b
#[inline(always)]
pub fn sub<R: Real>(a: V3<R>, b: V3<R>) -> V3<R> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a
#[inline(always)]
pub fn scale<R: Real>(s: R, a: V3<R>) -> V3<R> {
    [s * a[0], s * a[1], s * a[2]]
}

/// s a + b
#[inline(always)]
pub fn scale_add<R: Real>(s: R, a: V3<R>, b: V3<R>) -> V3<R> {
    [s.mul_add(a[0], b[0]), s.mul_add(a[1], b[1]), s.mul_add(a[2], b[2])]
}

/// `yes` where `mask` holds, else `no`.
#[inline(always)]
pub fn select<R: Real>(mask: R::Mask, yes: V3<R>, no: V3<R>) -> V3<R> {
    [R::select(mask, yes[0], no[0]), R::select(mask, yes[1], no[1]), R::select(mask, yes[2], no[2])]
}

/// v / |v| without under- or overflow, and 1 / |v|; `fallback` and 0 where v is zero or not finite
/// (so that every derivative through the direction is 0 there).
#[inline(always)]
pub fn normalize_or<R: Real>(v: V3<R>, fallback: V3<R>) -> (V3<R>, R) {
    let one = v[0].lit(1.0);
    let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
    // A NaN component fails every comparison; `max` may have dropped it, so the sum is asked too.
    let sum = v[0] + v[1] + v[2];
    // Below 1e-37 the reciprocal of an f32 would overflow; such a vector is noise.
    let ok = R::and(largest.ge(one.lit(1e-37)), R::and(largest.is_finite(), sum.is_finite()));
    let inverse = one / R::select(ok, largest, one);
    let u = scale(inverse, v);
    let length = R::select(ok, dot(u, u), one).sqrt();
    let inverse_length = one / length;
    let n = select::<R>(ok, scale(inverse_length, u), fallback);
    (n, R::select(ok, inverse_length * inverse, one.lit(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normalising_survives_tiny_huge_zero_and_nan_vectors() {
        let fallback = [0.0, 0.0, 1.0];
        for scale in [1e-36_f32, 1e-20, 1.0, 1e30] {
            let (n, _) = normalize_or([3.0 * scale, 0.0, 4.0 * scale], fallback);
            // Two roundings of f32 in each component.
            assert!((n[0] - 0.6).abs() < 2e-7 && (n[2] - 0.8).abs() < 2e-7, "{scale}: {n:?}");
        }
        for bad in [[0.0; 3], [f32::NAN, 0.5, 1.0], [1.0, f32::NAN, 0.0], [0.0, f32::INFINITY, 0.0]] {
            assert_eq!(normalize_or(bad, fallback), (fallback, 0.0));
        }
    }
}
