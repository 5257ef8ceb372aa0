//! Lights beside the environment, and the irradiance that they bring (MODEL 8; glTF's KHR_lights_punctual).

use glam::{DQuat, DVec3};

use super::numbers::{interval, short};
use crate::model::bearing::Bearing;
use crate::model::params::{LARGEST, Param, Params};

/// A light nearer than this, in scene units, is no brighter than there.
pub const NEAREST: f64 = 1e-4;
/// The least difference of cosines over which a spot's cone fades (KHR_lights_punctual's reference code).
pub const THINNEST_EDGE: f64 = 1e-3;

/// A light. What fits and exports call it is part of parameters' names.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Its name: letters, digits and `_`; unique in a scene, whatever the case.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
}

/// What a light is. Lengths are in scene units, colours linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Parallel light.
    Directional(Beam),
    /// The same towards all sides.
    Point(Lamp),
    /// A lamp that shines within a cone.
    Spot(Lamp, Cone),
}

/// Light from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Beam {
    /// The way the light travels; of length 0 it brings nothing.
    pub direction: DVec3,
    /// Irradiance on a surface that faces it: a white Lambert surface shows a radiance of this over pi.
    pub irradiance: [f64; 3],
    /// The width of its disc in the sky, which softens shadows.
    pub angular_diameter_degrees: f64,
}

/// Light from one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Where it stands.
    pub position: DVec3,
    /// Radiant intensity: the irradiance of a facing surface times the distance squared.
    pub intensity: [f64; 3],
    /// The distance at which its light has faded out; without one it never ends.
    pub range: Option<f64>,
    /// Of the sphere that it is, which softens shadows.
    pub radius: f64,
}

/// What a spot lights.
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    /// The way its axis points; of length 0 nothing is lit.
    pub direction: DVec3,
    /// Half the angle within which it is as bright as on its axis.
    pub inner_degrees: f64,
    /// Half the angle beyond which there is nothing.
    pub outer_degrees: f64,
}

/// A light that makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}. {remedy}.")]
pub struct LightError {
    /// Which of its properties, as a scene file calls it.
    pub key: &'static str,
    /// What is wrong, without its final stop.
    pub what: String,
    /// What to do, without its final stop.
    pub remedy: String,
}

impl Light {
    /// A light whose every number was checked, its directions made unit vectors.
    ///
    /// # Errors
    /// When its name is no part of a parameter's name, a number is out of bounds, or a direction has no length.
    pub fn new(name: &str, mut kind: LightKind) -> Result<Self, LightError> {
        check_name(name)?;
        match &mut kind {
            LightKind::Directional(beam) => {
                check_color("irradiance", beam.irradiance)?;
                let most = 90.0;
                check_number("angular_diameter_degrees", beam.angular_diameter_degrees, [0.0, most])?;
                beam.direction = checked_direction(beam.direction)?;
            }
            LightKind::Point(lamp) => lamp.check()?,
            LightKind::Spot(lamp, cone) => {
                lamp.check()?;
                cone.direction = checked_direction(cone.direction)?;
                check_cone(cone)?;
            }
        }
        Ok(Self { name: name.to_owned(), kind })
    }

    /// The light of the panorama with that number, before it is known where it stands.
    pub(crate) fn of_sky(number: u32) -> Self {
        let beam = Beam { direction: DVec3::NEG_Y, irradiance: [0.0; 3], angular_diameter_degrees: 0.0 };
        Self { name: format!("sky_{number}"), kind: LightKind::Directional(beam) }
    }

    /// Its name as part of parameters' names, effects and quantities.
    #[must_use]
    pub fn member(&self) -> String {
        self.name.to_ascii_lowercase()
    }

    /// The light where its parameters have it come from.
    #[must_use]
    pub fn moved(&self, params: &Params) -> Self {
        let angle = |key: &str| {
            let param = Param::from_name(&format!("light.{}.{key}", self.member()));
            param.map(|param| params.scalar(param))
        };
        let mut light = self.clone();
        if let LightKind::Directional(beam) = &mut light.kind
            && let (Some(azimuth), Some(elevation)) = (angle("azimuth"), angle("elevation"))
        {
            beam.direction = -DVec3::from_array(Bearing { azimuth, elevation }.direction());
        }
        light
    }

    /// What it is called in scene files.
    #[must_use]
    pub const fn type_name(&self) -> &'static str {
        match self.kind {
            LightKind::Directional(_) => "directional",
            LightKind::Point(_) => "point",
            LightKind::Spot(..) => "spot",
        }
    }

    /// Its irradiance or intensity: what a factor on its colour scales.
    #[must_use]
    #[inline]
    pub const fn strength(&self) -> [f64; 3] {
        match &self.kind {
            LightKind::Directional(beam) => beam.irradiance,
            LightKind::Point(lamp) | LightKind::Spot(lamp, _) => lamp.intensity,
        }
    }

    /// The unit vector L from `x` towards the light; 0 where it has no direction.
    #[must_use]
    #[inline]
    pub fn towards(&self, x: DVec3) -> DVec3 {
        match &self.kind {
            LightKind::Directional(beam) => -unit(beam.direction),
            LightKind::Point(lamp) | LightKind::Spot(lamp, _) => unit(lamp.position - x),
        }
    }

    /// What of its strength is left at `x`, were nothing in the way: 1 of parallel light, and otherwise what distance,
    /// range and cone leave, in 1 / scene units squared. 0 where the light has no direction.
    #[must_use]
    #[inline]
    pub fn attenuation(&self, x: DVec3) -> f64 {
        let towards = self.towards(x);
        if towards == DVec3::ZERO {
            return 0.0;
        }
        match &self.kind {
            LightKind::Directional(_) => 1.0,
            LightKind::Point(lamp) => lamp.attenuation(x),
            LightKind::Spot(lamp, cone) => lamp.attenuation(x) * cone.factor(-towards),
        }
    }

    /// Where parallel light comes from; of lamps it depends on the place.
    #[must_use]
    pub fn bearing(&self) -> Option<Bearing> {
        match &self.kind {
            LightKind::Directional(_) => Some(Bearing::of(self.towards(DVec3::ZERO).to_array())),
            LightKind::Point(_) | LightKind::Spot(..) => None,
        }
    }

    /// The light turned by `degrees` about +Y, by the right-hand rule.
    #[must_use]
    pub fn turned(&self, degrees: f64) -> Self {
        let turn = DQuat::from_rotation_y(degrees.to_radians());
        let mut light = self.clone();
        match &mut light.kind {
            LightKind::Directional(beam) => beam.direction = turn * beam.direction,
            LightKind::Point(lamp) => lamp.position = turn * lamp.position,
            LightKind::Spot(lamp, cone) => {
                lamp.position = turn * lamp.position;
                cone.direction = turn * cone.direction;
            }
        }
        light
    }
}

impl Lamp {
    #[inline]
    fn attenuation(&self, x: DVec3) -> f64 {
        let distance = (self.position - x).length();
        let faded = self.range.map_or(1.0, |range| (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0));
        faded / distance.max(NEAREST).powi(2)
    }

    fn check(&self) -> Result<(), LightError> {
        check_color("intensity", self.intensity)?;
        for x in self.position.to_array() {
            check_number("position", x, [-LARGEST, LARGEST])?;
        }
        check_number("radius", self.radius, [0.0, LARGEST])?;
        match self.range {
            Some(range) if !(range > 0.0 && range <= LARGEST) => Err(LightError {
                key: "range",
                what: format!("range = {} is out of bounds", short(range)),
                remedy: "Give a distance above 0, or leave it out: the light then never ends".to_owned(),
            }),
            _ => Ok(()),
        }
    }
}

impl Cone {
    /// What it leaves of light that travels along the unit vector `along`.
    #[inline]
    fn factor(&self, along: DVec3) -> f64 {
        let [inner, outer] = [self.inner_degrees, self.outer_degrees].map(|angle| angle.to_radians().cos());
        let t = (unit(self.direction).dot(along) - outer) / (inner - outer).max(THINNEST_EDGE);
        t.clamp(0.0, 1.0).powi(2)
    }
}

/// `v` at unit length; 0 where it has none, or is not finite.
#[inline]
fn unit(v: DVec3) -> DVec3 {
    // By its greatest component first, so that no square underflows or overflows.
    let largest = v.abs().max_element();
    if largest > 0.0 && largest.is_finite() { (v / largest).normalize() } else { DVec3::ZERO }
}

/// Longer ones make tables hard to read.
const LONGEST_NAME: usize = 64;

/// Whether parameters' names may hold a light's: identifiers of every language that constants are exported to.
pub(super) fn is_name(name: &str) -> bool {
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    name.len() <= LONGEST_NAME
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(letter)
        && name.split('_').all(|part| !part.is_empty())
}

fn check_name(name: &str) -> Result<(), LightError> {
    if is_name(name) {
        return Ok(());
    }
    Err(LightError {
        key: "name",
        what: format!(
            "the light's name {name:?} cannot be part of a parameter's name, as in light.key.color"
        ),
        remedy: format!(
            "Use up to {LONGEST_NAME} letters (a to z, A to Z), digits and single `_` between them, beginning with a letter"
        ),
    })
}

fn check_number(key: &'static str, number: f64, [least, most]: [f64; 2]) -> Result<(), LightError> {
    if (least..=most).contains(&number) {
        return Ok(());
    }
    Err(LightError {
        key,
        what: format!("{key} = {} is out of bounds", short(number)),
        remedy: format!("Give a finite number in {}", interval(least, most)),
    })
}

fn check_color(key: &'static str, rgb: [f64; 3]) -> Result<(), LightError> {
    match rgb.iter().find(|c| !(0.0..=LARGEST).contains(*c)) {
        None => Ok(()),
        Some(&c) => Err(LightError {
            key,
            what: format!("{key} holds {}", short(c)),
            remedy: format!("Give three linear values in {}", interval(0.0, LARGEST)),
        }),
    }
}

/// A direction at unit length.
fn checked_direction(direction: DVec3) -> Result<DVec3, LightError> {
    let found = unit(direction);
    if direction.is_finite() && found != DVec3::ZERO {
        return Ok(found);
    }
    let [x, y, z] = direction.to_array().map(short);
    Err(LightError {
        key: "direction",
        what: format!("direction = [{x}, {y}, {z}] points nowhere"),
        remedy: "Give three finite numbers, not all 0: the way the light travels".to_owned(),
    })
}

fn check_cone(cone: &Cone) -> Result<(), LightError> {
    let Cone { inner_degrees, outer_degrees, .. } = *cone;
    if !(outer_degrees > 0.0 && outer_degrees <= 90.0) {
        return Err(LightError {
            key: "outer_degrees",
            what: format!("outer_degrees = {} is out of bounds", short(outer_degrees)),
            remedy: "Give half the cone's angle: degrees above 0, up to 90".to_owned(),
        });
    }
    if !(0.0..=outer_degrees).contains(&inner_degrees) {
        return Err(LightError {
            key: "inner_degrees",
            what: format!(
                "inner_degrees = {} is not between 0 and outer_degrees, which is {}",
                short(inner_degrees),
                short(outer_degrees)
            ),
            remedy:
                "Give half the angle within which the spot is fully bright: not below 0, and no more than \
                     outer_degrees"
                    .to_owned(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp() -> Lamp {
        Lamp {
            position: DVec3::new(1.0, 2.0, -1.0),
            intensity: [3.0, 2.0, 1.0],
            range: Some(9.0),
            radius: 0.1,
        }
    }

    fn cone() -> Cone {
        Cone { direction: DVec3::NEG_Y, inner_degrees: 20.0, outer_degrees: 40.0 }
    }

    fn beam() -> Beam {
        Beam { direction: DVec3::new(0.0, -2.0, 0.0), irradiance: [1.0; 3], angular_diameter_degrees: 0.5 }
    }

    #[test]
    fn hard_places_are_dark_or_finite_and_never_nan() {
        let far = f64::MAX;
        let lights = [
            LightKind::Directional(Beam { direction: DVec3::ZERO, ..beam() }),
            LightKind::Directional(Beam { direction: DVec3::splat(f64::NAN), ..beam() }),
            LightKind::Point(lamp()),
            LightKind::Spot(lamp(), cone()),
            LightKind::Spot(lamp(), Cone { direction: DVec3::ZERO, outer_degrees: 90.0, ..cone() }),
        ];
        for kind in lights {
            let light = Light { name: "l".to_owned(), kind };
            for x in [lamp().position, DVec3::ZERO, DVec3::splat(far), lamp().position + 1e-200 * DVec3::X] {
                let left = light.attenuation(x);
                assert!(left.is_finite() && left >= 0.0, "{light:?} {x}: {left}");
                assert!(light.towards(x).is_finite(), "{light:?} {x}");
            }
        }
        // A light that has no direction brings nothing, were the surface at it.
        let at = Light { name: "l".to_owned(), kind: LightKind::Point(lamp()) };
        assert_eq!((at.towards(lamp().position), at.attenuation(lamp().position)), (DVec3::ZERO, 0.0));
    }

    #[test]
    fn a_turn_takes_minus_z_to_minus_x_as_it_does_the_environment() {
        let light =
            Light::new("sky", LightKind::Directional(Beam { direction: DVec3::Z, ..beam() })).unwrap();
        let turned = light.turned(90.0);
        // A rounding of pi.
        assert!((turned.towards(DVec3::ZERO) - DVec3::NEG_X).length() < 1e-15);
        assert!((turned.bearing().unwrap().azimuth + 90.0).abs() < 1e-12);
        let spot = Light::new("spot", LightKind::Spot(lamp(), cone())).unwrap().turned(90.0);
        let x = DVec3::new(-1.0, 0.0, -1.0);
        assert!((spot.attenuation(x) - 0.25 * (1.0 - (2.0_f64 / 9.0).powi(4))).abs() < 1e-15);
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_its_key() {
        type Change = fn(&mut Lamp, &mut Cone);
        let cases: [(&str, Change); 12] = [
            ("intensity", |lamp, _| lamp.intensity[1] = -1.0),
            ("intensity", |lamp, _| lamp.intensity[2] = f64::INFINITY),
            ("position", |lamp, _| lamp.position.x = f64::NAN),
            ("radius", |lamp, _| lamp.radius = -0.1),
            ("range", |lamp, _| lamp.range = Some(0.0)),
            ("range", |lamp, _| lamp.range = Some(f64::NAN)),
            ("direction", |_, cone| cone.direction = DVec3::ZERO),
            ("direction", |_, cone| cone.direction.y = f64::INFINITY),
            ("outer_degrees", |_, cone| cone.outer_degrees = 0.0),
            ("outer_degrees", |_, cone| cone.outer_degrees = 91.0),
            ("inner_degrees", |_, cone| cone.inner_degrees = 40.1),
            ("inner_degrees", |_, cone| cone.inner_degrees = f64::NAN),
        ];
        for (key, change) in cases {
            let (mut lamp, mut cone) = (lamp(), cone());
            change(&mut lamp, &mut cone);
            let error = Light::new("spot", LightKind::Spot(lamp, cone)).unwrap_err();
            assert_eq!(error.key, key, "{error}");
        }
        for name in ["", "key light", "1st", "_key", "k\u{e9}y", "a.b", &"a".repeat(65)] {
            let error = Light::new(name, LightKind::Point(lamp())).unwrap_err();
            assert!(error.key == "name" && error.to_string().contains("light.key.color"), "{error}");
        }
        assert!(Light::new("Key_2", LightKind::Spot(lamp(), cone())).is_ok());
        let unit = Light::new("key", LightKind::Directional(beam())).unwrap();
        assert_eq!(unit.kind, LightKind::Directional(Beam { direction: DVec3::NEG_Y, ..beam() }));
    }
}
