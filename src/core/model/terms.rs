//! The light's terms along a fragment's normal, reflection and view, and how they move with the
//! parameters that move lookups.

use super::cube::{Cube, CubePoint, Footprint};
use super::fragment::{Fragment, Shading};
use super::lights::Lights;
use super::params::Param;
use super::real::Real;
use super::vector::{V3, dot, mul, scale};

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

impl<R: Real> Terms<R> {
    /// No light, at a silhouette.
    #[inline(always)]
    pub fn none(silhouette: R) -> Self {
        let zero = silhouette.lit(0.0);
        let dark = [zero; 3];
        Self { diffuse: dark, side: dark, hilite: dark, mirror: dark, haze: zero, key: dark, silhouette }
    }
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

impl LookupParam {
    /// The parameter of the table, if its derivative needs lookups.
    #[must_use]
    pub const fn from_param(param: Param) -> Option<Self> {
        match param {
            Param::NormalStrength => Some(Self::NormalStrength),
            Param::SpecularLobe => Some(Self::SpecularLobe),
            Param::EnvironmentRotation => Some(Self::EnvironmentRotation),
            Param::KeyAzimuth => Some(Self::KeyAzimuth),
            Param::KeyElevation => Some(Self::KeyElevation),
            _ => None,
        }
    }
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
    cube.sample_at(&cube.footprint(at)).map(R::narrow)
}

/// The wanted terms of a fragment.
///
/// First where every lookup falls, then the lookups: a processor that works ahead then has all their
/// texels to ask for at once.
#[inline(always)]
pub fn terms<R: Real>(lights: &Lights<'_, R>, f: &Fragment<R>, s: &Shading<R>, wanted: Wanted) -> Terms<R> {
    let zero = f.view[0].lit(0.0);
    let origin = zero.widen();
    let nowhere = Footprint { first: origin, place: [origin; 2] };
    let (mut diffuse, mut side, mut mirror, mut hilite) = (nowhere, nowhere, nowhere, nowhere);
    if (wanted.diffuse && lights.irradiance.is_some()) || (wanted.side && lights.side.is_some()) {
        let n = point(lights.turned(s.n));
        if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
            diffuse = cube.footprint(&n);
        }
        if let (true, Some(cube)) = (wanted.side, lights.side) {
            side = cube.footprint(&n);
        }
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        mirror = cube.footprint(&point(lights.turned(s.reflection)));
    }
    if let (true, Some(cube)) = (wanted.hilite, lights.hilite) {
        hilite = cube.footprint(&point(lights.turned(f.view)));
    }

    let mut terms = Terms::none(s.silhouette);
    let read = |cube: &Cube<R::Texel>, at: &Footprint<R::Wide>| cube.sample_at(at).map(R::narrow);
    if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
        terms.diffuse = mul(f.albedo, rgb(read(cube, &diffuse)));
    }
    if let (true, Some(cube)) = (wanted.side, lights.side) {
        terms.side = scale(f.specular, rgb(read(cube, &side)));
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        let e = read(cube, &mirror);
        terms.mirror = scale(f.dapple, rgb(e));
        terms.haze = f.dapple * e[3] * f.attenuator;
    }
    if let (true, Some(cube)) = (wanted.hilite, lights.hilite) {
        terms.hilite = scale(f.attenuator, rgb(read(cube, &hilite)));
    }
    if let (true, Some(key)) = (wanted.key, lights.key) {
        let lambert = |n: V3<R>| dot(n, key.direction).max(zero);
        terms.key = scale(lambert(s.n) - lambert(f.normal), f.albedo);
    }
    terms
}

/// Where a lookup falls in its cube, and how that moves with `normal_strength`.
#[derive(Clone, Copy)]
struct Lookup<R> {
    at: Footprint<R>,
    /// In texels.
    tangent: [R; 2],
}

impl<R: Real> Lookup<R> {
    #[inline(always)]
    fn new(cube: &Cube<R::Texel>, point: &CubePoint<R>, tangent: [R; 2]) -> Self {
        Self { at: cube.footprint(point), tangent: cube.texels(tangent) }
    }

    /// The lookup, and its derivative, as numbers of a kind that is addressed so.
    #[inline(always)]
    fn read<N: Real<Texel = R::Texel, Wide = R>>(&self, cube: &Cube<R::Texel>) -> ([N; 4], [N; 4]) {
        let (value, slope) = cube.sample_with_slope(&self.at, self.tangent);
        (value.map(N::narrow), slope.map(N::narrow))
    }
}

/// The wanted terms, and their derivative with respect to `normal_strength`: the same texels serve
/// both.
///
/// First where every lookup falls, then the lookups: a processor that works ahead then has all their
/// texels to ask for at once.
#[inline(always)]
pub fn terms_with_strength_tangent<R: Real>(
    lights: &Lights<'_, R>,
    f: &Fragment<R>,
    s: &Shading<R>,
    wanted: Wanted,
) -> (Terms<R>, Terms<R>) {
    let zero = f.view[0].lit(0.0);
    let origin = zero.widen();
    let nowhere = Lookup { at: Footprint { first: origin, place: [origin; 2] }, tangent: [origin; 2] };
    let (mut diffuse, mut side, mut mirror, mut hilite) = (nowhere, nowhere, nowhere, nowhere.at);
    if (wanted.diffuse && lights.irradiance.is_some()) || (wanted.side && lights.side.is_some()) {
        let n = point(lights.turned(s.n));
        let tangent = n.tangent(lights.turned(s.n_tangent).map(R::widen));
        if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
            diffuse = Lookup::new(cube, &n, tangent);
        }
        if let (true, Some(cube)) = (wanted.side, lights.side) {
            side = Lookup::new(cube, &n, tangent);
        }
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        let r = point(lights.turned(s.reflection));
        mirror = Lookup::new(cube, &r, r.tangent(lights.turned(s.reflection_tangent).map(R::widen)));
    }
    if let (true, Some(cube)) = (wanted.hilite, lights.hilite) {
        hilite = cube.footprint(&point(lights.turned(f.view)));
    }

    let mut terms = Terms::none(s.silhouette);
    let mut slope = Terms::none(s.silhouette_tangent);
    if let (true, Some(cube)) = (wanted.diffuse, lights.irradiance) {
        let (e, de) = diffuse.read(cube);
        terms.diffuse = mul(f.albedo, rgb(e));
        slope.diffuse = mul(f.albedo, rgb(de));
    }
    if let (true, Some(cube)) = (wanted.side, lights.side) {
        let (e, de) = side.read(cube);
        terms.side = scale(f.specular, rgb(e));
        slope.side = scale(f.specular, rgb(de));
    }
    if let (true, Some(cube)) = (wanted.mirror, lights.mirror) {
        let (e, de) = mirror.read(cube);
        terms.mirror = scale(f.dapple, rgb(e));
        slope.mirror = scale(f.dapple, rgb(de));
        terms.haze = f.dapple * f.attenuator * e[3];
        slope.haze = f.dapple * f.attenuator * de[3];
    }
    if let (true, Some(cube)) = (wanted.hilite, lights.hilite) {
        terms.hilite = scale(f.attenuator, rgb(cube.sample_at(&hilite).map(R::narrow)));
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
    let mut slope = Terms::none(zero);
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
            let turned = |cube: &Cube<R::Texel>, d: V3<R>| -> [R; 4] {
                let at = point(d);
                let tangent = cube.texels(at.tangent(lights.turning(d).map(R::widen)));
                cube.sample_with_slope(&cube.footprint(&at), tangent).1.map(R::narrow)
            };
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
