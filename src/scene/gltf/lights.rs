//! The lights of a file's nodes: KHR_lights_punctual, placed in the world.

use glam::{DMat4, DVec3};
use serde_json::Value;

use super::document::Document;
use crate::error::{SceneError, Warnings, warn};
use crate::light::{Beam, Cone, Lamp, Light, LightKind, is_name};
use crate::lights::{DEFAULT_CONE, is_skys, same_name};
use crate::suggestion;

const EXTENSION: &str = "KHR_lights_punctual";

/// What the extension holds at the file's root.
#[derive(serde::Deserialize)]
struct Lights {
    lights: Vec<Punctual>,
}

/// A light of the file. Its intensity is in lux or candela, which are taken as they stand.
#[derive(serde::Deserialize)]
struct Punctual {
    #[serde(rename = "type")]
    kind: String,
    name: Option<String>,
    #[serde(default = "white")]
    color: [f64; 3],
    #[serde(default = "one")]
    intensity: f64,
    range: Option<f64>,
    #[serde(default)]
    spot: Spot,
}

/// Half angles in radians.
#[derive(Default, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
struct Spot {
    inner_cone_angle: Option<f64>,
    outer_cone_angle: Option<f64>,
}

/// What the extension holds at a node.
#[derive(serde::Deserialize)]
struct AtNode {
    light: usize,
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}

impl Punctual {
    /// The light of a node that stands at `world`: it shines along the node's -Z.
    fn placed(&self, world: DMat4) -> Result<LightKind, (String, String)> {
        let strength = self.color.map(|c| c * self.intensity);
        let direction = world.transform_vector3(DVec3::NEG_Z);
        let lamp = || Lamp {
            position: world.w_axis.truncate(),
            intensity: strength,
            range: self.range,
            radius: 0.0,
        };
        match self.kind.as_str() {
            "directional" => Ok(LightKind::Directional(Beam {
                direction,
                irradiance: strength,
                angular_diameter_degrees: 0.0,
            })),
            "point" => Ok(LightKind::Point(lamp())),
            "spot" => {
                let Spot { inner_cone_angle, outer_cone_angle } = self.spot;
                let [inner, outer] = DEFAULT_CONE;
                let degrees = |angle: Option<f64>, default| angle.map_or(default, f64::to_degrees);
                let (inner_degrees, outer_degrees) =
                    (degrees(inner_cone_angle, inner), degrees(outer_cone_angle, outer));
                Ok(LightKind::Spot(lamp(), Cone { direction, inner_degrees, outer_degrees }))
            }
            other => {
                let known = suggestion(other, &["directional", "point", "spot"]);
                Err((format!("has a light of the unknown type `{other}`"), known))
            }
        }
    }
}

impl Document {
    /// Add the lights of the scene's nodes, at the nodes' `time` as meshes are.
    ///
    /// They are called as their nodes are; what cannot be part of a parameter's name becomes `_`, and a name that is
    /// taken gets a number, with a warning each.
    pub(crate) fn lights(
        &self,
        time: Option<f64>,
        lights: &mut Vec<Light>,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let nodes = self.nodes(time)?;
        let all = self.punctual_lights()?;
        let before = lights.len();
        for &i in &nodes.in_scene {
            let node = &self.root.nodes[i];
            let others = node.extensions.as_ref().map(|extensions| &extensions.others);
            let Some(value) = others.and_then(|others| others.get(EXTENSION)) else { continue };
            let at = format!("node {i}");
            let AtNode { light } = self.parsed(value, &at)?;
            let of_file = all.get(light).ok_or_else(|| {
                let what = format!("refers to light {light}, but there are {}", all.len());
                self.error(what, "The file is damaged: export it anew").at(&at)
            })?;
            let refuse =
                |what: String, remedy: &str| self.error(what, remedy).at(format!("light {light}, {at}"));
            let given =
                node.name.as_ref().or(of_file.name.as_ref()).cloned().unwrap_or(format!("light_{light}"));
            let kind = of_file.placed(nodes.world[i]).map_err(|(what, remedy)| refuse(what, &remedy))?;
            let name = free_name(&given, lights);
            if name != given {
                let message =
                    format!("the light of node {i}, {given:?}, is called `{name}` in parameters' names");
                warn(warnings, &self.path, message);
            }
            lights.push(
                Light::new(&name, kind)
                    .map_err(|error| refuse(format!("has a light whose {}", error.what), &error.remedy))?,
            );
        }
        if lights.len() == before {
            warn(
                warnings,
                &self.path,
                format!("has no lights ({EXTENSION}) at its nodes, which the scene asks for"),
            );
        }
        Ok(())
    }

    /// The lights that nodes may refer to.
    fn punctual_lights(&self) -> Result<Vec<Punctual>, SceneError> {
        let others = self.root.extensions.as_ref().map(|extensions| &extensions.others);
        match others.and_then(|others| others.get(EXTENSION)) {
            Some(value) => Ok(self.parsed::<Lights>(value, EXTENSION)?.lights),
            None => Ok(Vec::new()),
        }
    }

    fn parsed<T: serde::de::DeserializeOwned>(&self, value: &Value, place: &str) -> Result<T, SceneError> {
        T::deserialize(value).map_err(|error| {
            let what = format!("holds what is not {EXTENSION}: {error}");
            self.error(what, "Export the lights anew, or take `lights = true` out of [mesh]").at(place)
        })
    }
}

/// A name that parameters may have and none of `lights` has, as near to `given` as it can be.
fn free_name(given: &str, lights: &[Light]) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    // Room for a number behind it.
    let name: String = given.chars().take(48).map(letter).collect();
    let mut name = name.split('_').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_");
    if !is_name(&name) {
        name = if name.is_empty() { "light".to_owned() } else { format!("light_{name}") };
    }
    let taken = |name: &str| is_skys(name) || lights.iter().any(|light| same_name(&light.name, name));
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.clone()).chain(numbered).find(|name| !taken(name)).unwrap_or(name)
}
