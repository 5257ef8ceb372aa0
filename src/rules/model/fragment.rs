//! A fragment as samples hold it: interpolated values and texels, made ready for the rules.

use super::effects::Form;
use super::real::Real;
use super::vector::{V3, normalize_or, scale, scale_add, select};

/// A decoded z that is positive is at least this, so that the normal never vanishes.
const LEAST_Z: f64 = 1e-6;

/// One fragment, as the rules read it.
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

impl<R: Real> Fragment<R> {
    /// A component of what the rules call `name`; `None` for what a fragment does not hold.
    #[inline]
    pub fn number(&self, name: &str, component: usize) -> Option<R> {
        let vector = |of: &V3<R>| of.get(component).copied();
        match name {
            "base" => vector(&self.base),
            "bump" => vector(&self.bump),
            "normal" => vector(&self.normal),
            "view" => vector(&self.view),
            "albedo" => vector(&self.albedo),
            "open" => Some(self.occlusion),
            "silhouette" => Some(self.silhouette),
            "dapple" => Some(self.dapple),
            "specular" => Some(self.specular),
            "attenuator" => Some(self.attenuator),
            _ => None,
        }
    }
}

/// The two parts of the shading normal from a normal map's texel in [0, 1] and the rows of the
/// tangent-to-world matrix: n is the direction of `base + normal_strength bump`.
///
/// `listing` takes the texel as it is (as printed), `corrected` decodes it; one that is not finite or is nothing then
/// gives the smooth normal, and a positive z never vanishes (MODEL 7).
#[inline(always)]
pub fn decode_normal<R: Real>(form: Form, texel: V3<R>, t: V3<R>, b: V3<R>, n: V3<R>) -> (V3<R>, V3<R>) {
    let (zero, one, two) = (n[0].lit(0.0), n[0].lit(1.0), n[0].lit(2.0));
    let d = match form {
        Form::Listing => texel,
        Form::Corrected => texel.map(|x| two * x - one),
    };
    let size = d[0].abs() + d[1].abs() + d[2].abs();
    let ok = R::and(size.is_finite(), zero.lt(size));
    let [x, y, z] = select::<R>(ok, d, [zero, zero, one]);
    let least = one.lit(LEAST_Z);
    let z = R::select(R::and(z.ge(zero), z.lt(least)), least, z);
    (scale(z, n), scale_add(x, t, scale(y, b)))
}

/// The variance of the slopes below a sample, along each axis, from a texel that is the mean of encoded unit normals: their
/// mean is as long as 1 / (1 + that) (Toksvig 2005). 0 where the texel is not finite or nothing.
#[must_use]
#[inline]
pub fn normal_spread(texel: [f32; 3]) -> f32 {
    let [x, y, z] = texel.map(|t| 2.0 * t - 1.0);
    let squared = x * x + y * y + z * z;
    if !squared.is_finite() || squared == 0.0 {
        return 0.0;
    }
    let size = squared.sqrt().clamp(0.1, 1.0);
    (1.0 - size) / size
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
