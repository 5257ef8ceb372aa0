//! The effect that each light of a scene is: a term of its own, and its numbers as parameters.

use std::path::Path;

use glam::DVec3;

use super::Scene;
use super::animation::{Pose, mesh_file};
use super::error::{SceneError, Warnings, warn};
use super::file::{SceneFile, Source};
use super::gltf::Document;
use super::light::{Beam, Lamp, Light, LightKind};
use super::lights;
use super::settings::spots;
use super::sky_lights::sky_lights;
use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};
use crate::shader::term::{self, LightFamily, Problem, Term, TermError};

/// The effect of a light, known to this process from then on. Lights of one name and kind, of whatever scenes, are one
/// effect: their numbers are parameters.
///
/// # Errors
/// When a file of rules has taken its names.
pub(crate) fn effect_of(light: &Light, from_sky: bool) -> Result<&'static Term, TermError> {
    let family = match (&light.kind, from_sky) {
        (LightKind::Directional(_), true) => LightFamily::SkyBeam,
        (LightKind::Directional(_), false) => LightFamily::Beam,
        (LightKind::Point(_) | LightKind::Spot(..), _) => LightFamily::Lamp,
    };
    term::light(family, &light.member())
}

impl Light {
    /// The effect that it is as a light of a scene's own, known to this process from then on.
    ///
    /// # Errors
    /// When a file of rules, or a light of another kind, has taken its names.
    pub fn effect(&self) -> Result<Effect, TermError> {
        effect_of(self, false).map(|term| term.effect)
    }
}

/// The terms of a directional light called `beam` and of a point or spot light called `lamp`, for tables of the parameters
/// that lights bring with them; known to this process from then on.
///
/// # Errors
/// When a file of rules has taken their names.
pub fn families() -> Result<[&'static Term; 2], TermError> {
    let lamp = Lamp { position: DVec3::ZERO, intensity: [0.0; 3], range: None, radius: 0.0 };
    let beam = Beam { direction: DVec3::NEG_Y, irradiance: [0.0; 3], angular_diameter_degrees: 0.0 };
    let beam = Light { name: "beam".to_owned(), kind: LightKind::Directional(beam) };
    let lamp = Light { name: "lamp".to_owned(), kind: LightKind::Point(lamp) };
    Ok([effect_of(&beam, false)?, effect_of(&lamp, false)?])
}

/// The lights of a scene, each known as an effect.
pub(super) struct Lights {
    /// Those that the scene file and, where it says so, the mesh file name.
    pub(super) own: Vec<Light>,
    /// How many the panorama may yield.
    spots: u32,
    /// The effect that each is.
    pub(super) terms: Vec<&'static Term>,
}

impl Lights {
    /// Read them. `time` is that of the mesh file's animation.
    ///
    /// # Errors
    /// When one of them makes no sense, or a file of rules has taken its names.
    pub(super) fn read(
        source: &Source,
        file: &SceneFile,
        document: Option<(&Document, Option<f64>)>,
        warnings: &mut Warnings,
    ) -> Result<Self, SceneError> {
        let mut own = lights::plan(source, &file.light)?;
        if let Some((document, time)) = document.filter(|_| file.mesh.lights) {
            document.lights(time, &mut own, warnings)?;
        }
        let spots = file.environment.as_ref().map(|table| spots(source, table)).transpose()?;
        let spots = spots.map_or(0, |spots| spots.count);
        let of_sky = (1..=spots).map(|number| effect_of(&Light::of_sky(number), true));
        let terms = own.iter().map(|light| effect_of(light, false)).chain(of_sky).collect::<Result<_, _>>();
        let taken = |error: TermError| {
            let remedy = match error.problem {
                Problem::Taken { .. } => {
                    "Give the light, or what a file of [model] terms declares, another name".to_owned()
                }
                _ => error.problem.remedy(),
            };
            SceneError::new(&source.path, error.problem.to_string(), remedy)
        };
        Ok(Self { own, spots, terms: terms.map_err(taken)? })
    }

    /// Those of a scene file, for what reads nothing else of its files: of the mesh file, where it names some.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub(super) fn of_file(source: &Source, file: &SceneFile) -> Result<Self, SceneError> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let document = file.mesh.lights.then(|| mesh_file(source, file, folder)).transpose()?;
        let time = Pose::check(source, file)?.time();
        Self::read(source, file, document.as_ref().map(|document| (document, time)), &mut Warnings::new())
    }

    /// Whether there is one.
    pub(super) fn any(&self) -> bool {
        !self.terms.is_empty()
    }

    /// Those effects, and each light's where lights are on and none of them is named by itself.
    pub(super) fn switched(&self, effects: Effects) -> Effects {
        let listed = self.terms.iter().any(|term| effects.has(term.effect));
        if listed || !effects.has(Effect::Lights) {
            return effects;
        }
        self.terms.iter().fold(effects, |effects, term| effects.with(term.effect))
    }

    /// Say so where they do not shine, unless who reads the scene has `chosen` its effects and not the file.
    pub(super) fn idle(&self, path: &Path, effects: Effects, chosen: bool, warnings: &mut Warnings) {
        let lights = effects.has(Effect::Lights);
        if !self.terms.is_empty() && !lights && !chosen {
            warn(warnings, path, "has lights, but the effect `lights` is off: they do not shine");
        }
        if self.terms.is_empty() && lights {
            warn(warnings, path, "has no light: the effect `lights` does nothing");
        }
    }

    /// Whether some of them come out of the panorama.
    pub(super) const fn are_of_sky(&self) -> bool {
        self.spots > 0
    }
}

impl Scene {
    /// The same scene with `count` of its panorama's brightest spots as lights; fewer, where it has no more.
    ///
    /// # Errors
    /// When a file of rules has taken the name of one.
    pub fn with_spots(mut self, count: u32) -> Result<Self, TermError> {
        let named = |light: &Light| effect_of(light, true).map(|term| term.effect);
        for light in &self.sky_lights {
            self.effects = self.effects.without(named(light)?);
        }
        let Some(environment) = &mut self.environment else { return Ok(self) };
        environment.spots.count = count;
        self.sky_lights = sky_lights(environment).lights_in_world(environment);
        for light in &self.sky_lights {
            self.effects = self.effects.with(named(light)?);
            set(light, &mut self.params, |_| false);
        }
        Ok(self)
    }
}

/// Set the parameters that a light's numbers are, but for those that `given` says the scene file gives.
pub(super) fn set(light: &Light, params: &mut Params, given: impl Fn(&str) -> bool) {
    let mut set = |key: &str, values: [f64; 3]| {
        let name = format!("light.{}.{key}", light.member());
        if let Some(param) = Param::from_name(&name).filter(|_| !given(&name)) {
            params.set_rgb(param, values);
        }
    };
    set("irradiance", light.strength());
    if let LightKind::Point(lamp) | LightKind::Spot(lamp, _) = &light.kind {
        set("position", lamp.position.to_array());
        set("range", [lamp.range.unwrap_or(0.0); 3]);
        let (axis, [inner, outer]) = match &light.kind {
            LightKind::Spot(_, cone) => {
                let cosine = |degrees: f64| degrees.to_radians().cos();
                (cone.direction.to_array(), [cosine(cone.inner_degrees), cosine(cone.outer_degrees)])
            }
            // No cosine is below -1: a point shines everywhere.
            _ => ([0.0; 3], [-1.0, -2.0]),
        };
        set("axis", axis);
        set("cone", [inner, outer, 0.0]);
    }
    if let Some(bearing) = light.bearing() {
        set("azimuth", [bearing.azimuth; 3]);
        set("elevation", [bearing.elevation; 3]);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::light::{Beam, Lamp};

    #[test]
    fn every_kind_of_light_is_a_term() {
        let beam = LightKind::Directional(Beam {
            direction: DVec3::NEG_Y,
            irradiance: [1.0; 3],
            angular_diameter_degrees: 0.0,
        });
        let lamp =
            LightKind::Point(Lamp { position: DVec3::Y, intensity: [1.0; 3], range: None, radius: 0.0 });
        for (name, kind, from_sky) in [
            ("checked_sky", beam.clone(), true),
            ("checked_beam", beam, false),
            ("checked_lamp", lamp, false),
        ] {
            let light = Light::new(name, kind).unwrap();
            assert!(effect_of(&light, from_sky).is_ok(), "{name}");
        }
    }
}
