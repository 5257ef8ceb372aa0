//! The fragment stage (listing 3-4): from interpolated values and texels to what the lights see.
//!
//! A [`Fragment`] is shaded in three steps: its [`Shading`] normal and reflection, the light's terms
//! along them (see [`super::terms`]), and their weighted sum (see [`super::compose`]). Only the first
//! two depend on the non-linear parameters `normal_strength`, `specular_lobe` and
//! `environment_rotation`.

use super::effects::{Form, Silhouette};
use super::real::Real;
use super::rim::{silhouette, silhouette_slope};
use super::vector::{V3, dot, normalize_or, scale, scale_add, select, sub};

/// One fragment, as the model reads it.
#[derive(Clone, Copy, Debug)]
pub struct Fragment<R> {
    /// The part of the shading normal that the normal map's strength leaves alone.
    pub base: V3<R>,
    /// The part that it scales.
    pub bump: V3<R>,
    /// Stands in where `base + normal_strength bump` has no direction; also the key light's N.
    pub normal: V3<R>,
    /// V, from the eye to the surface.
    pub view: V3<R>,
    /// S.x, the open share of the hemisphere.
    pub occlusion: R,
    /// S.z; not read when the silhouette follows the bumped normal.
    pub silhouette: R,
    /// S.w.
    pub dapple: R,
    /// Albedo, linear.
    pub albedo: V3<R>,
    /// Specular map s.
    pub specular: R,
    /// Attenuator map a.
    pub attenuator: R,
}

/// The two parts of the shading normal from a normal map's texel in [0, 1] and the rows of the
/// tangent-to-world matrix: n is the direction of `base + normal_strength bump`.
///
/// `listing` takes the texel as it is (oddity 5), `corrected` decodes it; one that is not finite or is nothing then
/// gives the smooth normal (MODEL 7).
#[inline(always)]
pub fn decode_normal<R: Real>(form: Form, texel: V3<R>, t: V3<R>, b: V3<R>, n: V3<R>) -> (V3<R>, V3<R>) {
    let (zero, one, two) = (n[0].lit(0.0), n[0].lit(1.0), n[0].lit(2.0));
    let d = match form {
        Form::Listing => texel,
        Form::Corrected => texel.map(|x| two * x - one),
    };
    let size = d[0].abs() + d[1].abs() + d[2].abs();
    let ok = R::and(size.is_finite(), zero.lt(size));
    let d = select::<R>(ok, d, [zero, zero, one]);
    (scale(d[2], n), scale_add(d[0], t, scale(d[1], b)))
}

/// Base and bump as a sample holds them: where no base is left (below 1e-37 it is noise) the side that faces
/// the eye counts, and a bump that is not finite counts nothing (MODEL 7).
#[inline(always)]
pub fn guarded<R: Real>(base: V3<R>, bump: V3<R>, view: V3<R>) -> (V3<R>, V3<R>) {
    let zero = view[0].lit(0.0);
    let size = |v: V3<R>| v[0].abs() + v[1].abs() + v[2].abs();
    let (base_size, bump_size) = (size(base), size(bump));
    let there = R::and(base_size.is_finite(), base_size.ge(zero.lit(1e-37)));
    let base = select::<R>(there, base, [-view[0], -view[1], -view[2]]);
    (base, select::<R>(bump_size.is_finite(), bump, [zero; 3]))
}

/// The unit view vector of the corrected form; (0, 0, -1) for an eye on the surface.
#[inline(always)]
pub fn unit_view<R: Real>(view: V3<R>) -> V3<R> {
    let (zero, one) = (view[0].lit(0.0), view[0].lit(1.0));
    normalize_or(view, [zero, zero, -one]).0
}

/// The shading normal, the reflection, and how both move with the normal map's strength.
#[derive(Clone, Copy, Debug)]
pub struct Shading<R> {
    /// n, unit length in the corrected form.
    pub n: V3<R>,
    /// n . V
    pub n_dot_v: R,
    /// The reflection vector.
    pub reflection: V3<R>,
    /// S.z, as the silhouette asks.
    pub silhouette: R,
    /// d n / d normal_strength.
    pub n_tangent: V3<R>,
    /// d reflection / d normal_strength.
    pub reflection_tangent: V3<R>,
    /// d S.z / d normal_strength.
    pub silhouette_tangent: R,
}

/// The most by which a normal that all but vanishes turns with its map's strength: beyond, the squares of
/// derivatives would overflow an f32.
const STEEPEST: f64 = 1e6;

/// The shading normal at `strength` and what follows from it.
#[inline(always)]
pub fn shading<R: Real>(form: Form, at: Silhouette, f: &Fragment<R>, strength: R) -> Shading<R> {
    let two = strength.lit(2.0);
    let v = f.view;
    let m = scale_add(strength, f.bump, f.base);
    let (n, n_tangent) = match form {
        Form::Listing => (m, f.bump),
        Form::Corrected => {
            let (n, inverse_length) = unit_normal(m, f.normal, v);
            // d (m / |m|) = (dm - n (n . dm)) / |m|
            let turning = scale(inverse_length, scale_add(-dot(n, f.bump), n, f.bump));
            let (least, most) = (strength.lit(-STEEPEST), strength.lit(STEEPEST));
            (n, turning.map(|x| x.max(least).min(most)))
        }
    };
    let (q, dq) = (dot(n, v), dot(n_tangent, v));
    let (reflection, reflection_tangent) = match form {
        // Oddity 3: the two dot products look swapped.
        Form::Listing => (sub(scale(q, v), scale(two, n)), sub(scale(dq, v), scale(two, n_tangent))),
        Form::Corrected => (scale_add(-two * q, n, v), scale(-two, scale_add(dq, n, scale(q, n_tangent)))),
    };
    let (silhouette, silhouette_tangent) = match at {
        Silhouette::Bumped => (silhouette(q), silhouette_slope(q) * dq),
        Silhouette::Vertex | Silhouette::Fragment => (f.silhouette, strength.lit(0.0)),
    };
    Shading { n, n_dot_v: q, reflection, silhouette, n_tangent, reflection_tangent, silhouette_tangent }
}

/// m / |m| and 1 / |m|; without a direction, the smooth normal's; without that, -V (MODEL 7).
#[inline(always)]
fn unit_normal<R: Real>(m: V3<R>, smooth: V3<R>, view: V3<R>) -> (V3<R>, R) {
    let (least, most) = (view[0].lit(1e-20), view[0].lit(1e20));
    let square = dot(m, m);
    // All lanes ordinary, as nearly always: no scaling, no fallbacks.
    if R::all(R::and(square.ge(least), most.ge(square))) {
        let inverse_length = square.sqrt().recip();
        return (scale(inverse_length, m), inverse_length);
    }
    let (normal, _) = normalize_or(smooth, [-view[0], -view[1], -view[2]]);
    normalize_or(m, normal)
}
