//! The fragment stage (listing 3-4): from interpolated values and texels to what the lights see.
//!
//! A [`Fragment`] is shaded in three steps: its [`Shading`] normal and reflection, the light's
//! [`Terms`] along them, and their weighted sum (see [`super::compose`]). Only the first two depend
//! on the non-linear parameters `normal_strength`, `specular_lobe` and `environment_rotation`.

use super::cube::{Cube, CubePoint};
use super::effects::{Form, Silhouette};
use super::lights::Lights;
use super::real::Real;
use super::rim::{silhouette, silhouette_slope};
use super::vector::{V3, dot, mul, normalize_or, scale, scale_add, select, sub};

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
/// `listing` takes the texel as it is (oddity 5). `corrected` decodes it; a texel that is not finite
/// or decodes to nothing gives the smooth normal (MODEL 7).
#[inline(always)]
pub fn decode_normal<R: Real>(form: Form, texel: V3<R>, t: V3<R>, b: V3<R>, n: V3<R>) -> (V3<R>, V3<R>) {
    if form == Form::Listing {
        return (scale(texel[2], n), scale_add(texel[0], t, scale(texel[1], b)));
    }
    let (zero, one, two) = (n[0].lit(0.0), n[0].lit(1.0), n[0].lit(2.0));
    let d = texel.map(|x| two * x - one);
    let size = d[0].abs() + d[1].abs() + d[2].abs();
    let ok = R::and(size.is_finite(), zero.lt(size));
    let d = select::<R>(ok, d, [zero, zero, one]);
    (scale(d[2], n), scale_add(d[0], t, scale(d[1], b)))
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

/// The shading normal at `strength` and what follows from it.
#[inline(always)]
pub fn shading<R: Real>(form: Form, at: Silhouette, f: &Fragment<R>, strength: R) -> Shading<R> {
    let two = strength.lit(2.0);
    let v = f.view;
    let m = scale_add(strength, f.bump, f.base);
    let (n, n_tangent) = match form {
        Form::Listing => (m.map(R::half), f.bump),
        Form::Corrected => {
            let (n, inverse_length) = unit_normal(m, f.normal, v);
            // d (m / |m|) = (dm - n (n . dm)) / |m|
            (n.map(R::half), scale(inverse_length, scale_add(-dot(n, f.bump), n, f.bump)))
        }
    };
    let (q, dq) = (dot(n, v).fixed(), dot(n_tangent, v));
    let (reflection, reflection_tangent) = match form {
        // Oddity 3: the two dot products look swapped.
        Form::Listing => {
            let twice = scale(two.fixed(), n).map(R::half);
            (sub(scale(q, v), twice).map(R::fixed), sub(scale(dq, v), scale(two, n_tangent)))
        }
        Form::Corrected => {
            (scale_add(-two * q, n, v).map(R::fixed), scale(-two, scale_add(dq, n, scale(q, n_tangent))))
        }
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

/// The light's contributions before their weights: each is linear in one weight of the model.
#[derive(Clone, Copy, Debug)]
pub struct Terms<R> {
    /// albedo E_d(n)
    pub diffuse: V3<R>,
    /// s E_s(n)
    pub side: V3<R>,
    /// a E_h(V)
    pub hilite: V3<R>,
    /// dapple E_s(R)
    pub mirror: V3<R>,
    /// dapple a E_s(R).a
    pub haze: R,
    /// albedo (max(0, n.L) - max(0, N.L))
    pub key: V3<R>,
    /// S.z
    pub silhouette: R,
}

/// A non-linear parameter whose derivative needs lookups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LookupParam {
    /// `normal_strength`
    NormalStrength,
    /// `specular_lobe`
    SpecularLobe,
    /// `environment_rotation`
    EnvironmentRotation,
    /// `key_azimuth`
    KeyAzimuth,
    /// `key_elevation`
    KeyElevation,
}

#[inline(always)]
fn rgb<R: Copy>(texel: [R; 4]) -> V3<R> {
    [texel[0], texel[1], texel[2]]
}

/// Which of the terms are wanted; the others are left 0 and cost nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as the terms")]
pub struct Wanted {
    pub diffuse: bool,
    pub side: bool,
    pub hilite: bool,
    pub mirror: bool,
    pub key: bool,
}

impl Wanted {
    /// Every term.
    pub const ALL: Self = Self { diffuse: true, side: true, hilite: true, mirror: true, key: true };
    /// No term.
    pub const NONE: Self = Self { diffuse: false, side: false, hilite: false, mirror: false, key: false };
}

/// Where a direction meets the cubes.
#[inline(always)]
fn point<R: Real>(direction: V3<R>) -> CubePoint<R::Wide> {
    CubePoint::new(direction.map(R::widen))
}

/// The lookup at a point.
#[inline(always)]
fn look_up<R: Real>(cube: &Cube<R::Texel>, at: &CubePoint<R::Wide>) -> [R; 4] {
    cube.sample_at(at).map(R::narrow)
}

/// The lookup at a point, and its derivative as the direction moves by `d`.
#[inline(always)]
fn look_up_with_slope<R: Real>(cube: &Cube<R::Texel>, at: &CubePoint<R::Wide>, d: V3<R>) -> ([R; 4], [R; 4]) {
    let (value, slope) = cube.sample_with_slope(at, at.tangent(d.map(R::widen)));
    (value.map(R::narrow), slope.map(R::narrow))
}

impl Fragment<f64> {
    /// The fragment in the number format that `like` is a number of.
    #[must_use]
    pub fn in_format<R: Real>(&self, like: R) -> Fragment<R> {
        let lit = |v: V3<f64>| v.map(|x| like.lit(x));
        let fragment = Fragment {
            base: lit(self.base),
            bump: lit(self.bump),
            normal: lit(self.normal),
            view: lit(self.view),
            occlusion: like.lit(self.occlusion),
            silhouette: like.lit(self.silhouette),
            dapple: like.lit(self.dapple),
            albedo: lit(self.albedo),
            specular: like.lit(self.specular),
            attenuator: like.lit(self.attenuator),
        };
        fragment.declared()
    }
}

impl<R: Real> Fragment<R> {
    /// The fragment with the types that the listing declares for what it reads: `half` textures, a `fixed`
    /// attenuator.
    #[must_use]
    #[inline(always)]
    pub fn declared(self) -> Self {
        Self {
            albedo: self.albedo.map(R::half),
            specular: self.specular.half(),
            attenuator: self.attenuator.fixed(),
            ..self
        }
    }
}

/// The wanted terms of a fragment.
#[inline(always)]
pub fn terms<R: Real>(lights: &Lights<'_, R>, f: &Fragment<R>, s: &Shading<R>, wanted: Wanted) -> Terms<R> {
    let zero = f.view[0].lit(0.0);
    let mut terms = Terms {
        diffuse: [zero; 3],
        side: [zero; 3],
        hilite: [zero; 3],
        mirror: [zero; 3],
        haze: zero,
        key: [zero; 3],
        silhouette: s.silhouette,
    };
    if (wanted.diffuse && lights.irradiance.is_some()) || (wanted.side && lights.side.is_some()) {
        let n = point(lights.turned(s.n));
        if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
            terms.diffuse = mul(f.albedo, rgb(look_up(cube, &n))).map(R::fixed);
        }
        if let (true, Some(cube)) = (wanted.side, lights.side) {
            terms.side = scale(f.specular, rgb(look_up(cube, &n))).map(R::fixed);
        }
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        let e = look_up(cube, &point(lights.turned(s.reflection)));
        terms.mirror = scale(f.dapple, rgb(e)).map(R::fixed);
        terms.haze = ((f.dapple * e[3]).fixed() * f.attenuator).fixed();
    }
    if let (true, Some(cube)) = (wanted.hilite, lights.hilite) {
        terms.hilite = scale(f.attenuator, rgb(look_up(cube, &point(lights.turned(f.view)))));
    }
    if let (true, Some(key)) = (wanted.key, lights.key) {
        let lambert = |n: V3<R>| dot(n, key.direction).max(zero);
        terms.key = scale(lambert(s.n) - lambert(f.normal), f.albedo);
    }
    terms
}

/// The wanted terms, and their derivative with respect to `normal_strength`: the same texels serve
/// both.
#[inline(always)]
pub fn terms_with_strength_tangent<R: Real>(
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    s: &Shading<R>,
    wanted: Wanted,
) -> (Terms<R>, Terms<R>) {
    let zero = f.view[0].lit(0.0);
    let unmoved = Wanted { diffuse: false, side: false, mirror: false, key: false, ..wanted };
    let mut terms = terms(lights, f, s, unmoved);
    let mut slope = Terms { hilite: [zero; 3], silhouette: s.silhouette_tangent, ..terms };
    if (wanted.diffuse && lights.irradiance.is_some()) || (wanted.side && lights.side.is_some()) {
        let n = point(lights.turned(s.n));
        let dn = lights.turned(s.n_tangent);
        if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
            let (e, de) = look_up_with_slope(cube, &n, dn);
            terms.diffuse = mul(f.albedo, rgb(e));
            slope.diffuse = mul(f.albedo, rgb(de));
        }
        if let (true, Some(cube)) = (wanted.side, lights.side) {
            let (e, de) = look_up_with_slope(cube, &n, dn);
            terms.side = scale(f.specular, rgb(e));
            slope.side = scale(f.specular, rgb(de));
        }
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        let r = point(lights.turned(s.reflection));
        let (e, de) = look_up_with_slope(cube, &r, lights.turned(s.reflection_tangent));
        terms.mirror = scale(f.dapple, rgb(e));
        slope.mirror = scale(f.dapple, rgb(de));
        terms.haze = f.dapple * f.attenuator * e[3];
        slope.haze = f.dapple * f.attenuator * de[3];
    }
    if let (true, Some(key)) = (wanted.key, lights.key) {
        let (bumped, smooth) = (dot(s.n, key.direction), dot(f.normal, key.direction));
        terms.key = scale(bumped.max(zero) - smooth.max(zero), f.albedo);
        slope.key = scale(R::select(zero.lt(bumped), dot(s.n_tangent, key.direction), zero), f.albedo);
    }
    (terms, slope)
}

/// The derivative of the terms with respect to a parameter other than `normal_strength`.
#[inline(always)]
pub fn terms_tangent<R: Real>(
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    s: &Shading<R>,
    param: LookupParam,
) -> Terms<R> {
    let zero = f.view[0].lit(0.0);
    let mut slope = Terms {
        diffuse: [zero; 3],
        side: [zero; 3],
        hilite: [zero; 3],
        mirror: [zero; 3],
        haze: zero,
        key: [zero; 3],
        silhouette: zero,
    };
    let (n, r) = (lights.turned(s.n), lights.turned(s.reflection));
    match param {
        LookupParam::NormalStrength => return terms_with_strength_tangent(lights, f, s, Wanted::ALL).1,
        LookupParam::SpecularLobe => {
            if let Some(cube) = lights.lobe_slope {
                if lights.side.is_some() {
                    slope.side = scale(f.specular, rgb(look_up(cube, &point(n))));
                }
                if lights.mirror.is_some() {
                    let e = look_up(cube, &point(r));
                    slope.mirror = scale(f.dapple, rgb(e));
                    slope.haze = f.dapple * f.attenuator * e[3];
                }
            }
        }
        LookupParam::EnvironmentRotation => {
            let turned =
                |cube: &Cube<R::Texel>, d: V3<R>| look_up_with_slope(cube, &point(d), lights.turning(d)).1;
            if let Some(cube) = lights.irradiance {
                slope.diffuse = mul(f.albedo, rgb(turned(cube, n)));
            }
            if let Some(cube) = lights.side {
                slope.side = scale(f.specular, rgb(turned(cube, n)));
            }
            if let Some(cube) = lights.mirror {
                let e = turned(cube, r);
                slope.mirror = scale(f.dapple, rgb(e));
                slope.haze = f.dapple * f.attenuator * e[3];
            }
            if let Some(cube) = lights.hilite {
                slope.hilite = scale(f.attenuator, rgb(turned(cube, lights.turned(f.view))));
            }
        }
        LookupParam::KeyAzimuth | LookupParam::KeyElevation => {
            if let Some(key) = lights.key {
                let moving = if param == LookupParam::KeyAzimuth { key.by_azimuth } else { key.by_elevation };
                let lambert = |n: V3<R>| R::select(zero.lt(dot(n, key.direction)), dot(n, moving), zero);
                slope.key = scale(lambert(s.n) - lambert(f.normal), f.albedo);
            }
        }
    }
    slope
}
