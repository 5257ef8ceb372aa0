//! What shines on a fragment: the cube maps, the environment's turn, and the key light.

use super::cube::Cube;
use super::effects::Effect;
use super::evaluate::Setup;
use super::params::{Param, Params};
use super::real::Real;
use super::vector::V3;

/// The lights of a scene; a cube that no enabled effect asks for is absent.
#[derive(Clone, Copy, Debug)]
pub struct Lights<'a, R: Real> {
    /// E_d.
    pub irradiance: Option<&'a Cube<R::Texel>>,
    /// E_s at the current `specular_lobe`, looked up along the normal (side specular).
    pub side: Option<&'a Cube<R::Texel>>,
    /// The same cube, looked up along the reflection.
    pub mirror: Option<&'a Cube<R::Texel>>,
    /// d E_s / d specular_lobe; only for its derivative.
    pub lobe_slope: Option<&'a Cube<R::Texel>>,
    /// E_h.
    pub hilite: Option<&'a Cube<R::Texel>>,
    /// Cosine and sine of `environment_rotation`; `None` when the environment is not turned.
    pub turn: Option<[R; 2]>,
    /// The key light's unit direction, and its derivatives by azimuth and elevation in degrees.
    pub key: Option<KeyLight<R>>,
}

/// Where the key light stands.
#[derive(Clone, Copy, Debug)]
pub struct KeyLight<R> {
    /// Unit vector towards the light.
    pub direction: V3<R>,
    /// d direction / d key_azimuth, a degree.
    pub by_azimuth: V3<R>,
    /// d direction / d key_elevation, a degree.
    pub by_elevation: V3<R>,
}

impl<R: Real> Lights<'_, R> {
    /// World to environment: Ry(r)^-1 d (MODEL 1).
    #[inline(always)]
    pub fn turned(&self, d: V3<R>) -> V3<R> {
        match self.turn {
            None => d,
            Some([cos, sin]) => [cos * d[0] - sin * d[2], d[1], sin * d[0] + cos * d[2]],
        }
    }

    /// How a turned direction moves with `environment_rotation`, a degree.
    #[inline(always)]
    pub(super) fn turning(&self, turned: V3<R>) -> V3<R> {
        let degree = turned[0].lit(std::f64::consts::PI / 180.0);
        [-degree * turned[2], turned[1].lit(0.0), degree * turned[0]]
    }
}

/// The cubes of a scene at the current `specular_lobe`; those that no effect asks for are absent.
#[derive(Clone, Copy, Debug)]
pub struct Cubes<'a, T> {
    /// E_d.
    pub irradiance: Option<&'a Cube<T>>,
    /// E_s.
    pub specular: Option<&'a Cube<T>>,
    /// d E_s / d specular_lobe.
    pub lobe_slope: Option<&'a Cube<T>>,
    /// E_h.
    pub hilite: Option<&'a Cube<T>>,
}

impl<'a, R: Real> Lights<'a, R> {
    /// The lights that the enabled effects ask for; `like` is any number of the evaluator's scalar.
    /// The environment is turned when its rotation is not 0, or `turning` is free.
    #[inline(always)]
    pub fn new(setup: Setup, params: &Params, cubes: Cubes<'a, R::Texel>, turning: bool, like: R) -> Self {
        let needs = setup.needs();
        let degrees = params.scalar(Param::EnvironmentRotation);
        let (sin, cos) = degrees.to_radians().sin_cos();
        Lights {
            irradiance: cubes.irradiance.filter(|_| needs.irradiance),
            side: cubes.specular.filter(|_| setup.effects.has(Effect::SideSpecular)),
            mirror: cubes.specular.filter(|_| needs.dapple),
            lobe_slope: cubes.lobe_slope,
            hilite: cubes.hilite.filter(|_| needs.hilite),
            turn: if turning || degrees != 0.0 { Some([like.lit(cos), like.lit(sin)]) } else { None },
            key: if needs.key_light { Some(KeyLight::new(params, like)) } else { None },
        }
    }
}

impl<R: Real> KeyLight<R> {
    /// The key light of `params`.
    #[inline(always)]
    pub fn new(params: &Params, like: R) -> Self {
        let degree = std::f64::consts::PI / 180.0;
        let (sa, ca) = params.scalar(Param::KeyAzimuth).to_radians().sin_cos();
        let (se, ce) = params.scalar(Param::KeyElevation).to_radians().sin_cos();
        let lit = |x: f64, y: f64, z: f64| [like.lit(x), like.lit(y), like.lit(z)];
        Self {
            direction: lit(ce * sa, se, ce * ca),
            by_azimuth: lit(degree * ce * ca, 0.0, -degree * ce * sa),
            by_elevation: lit(-degree * se * sa, degree * ce, -degree * se * ca),
        }
    }
}
