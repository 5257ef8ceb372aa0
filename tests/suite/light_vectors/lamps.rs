//! Lights of each kind: their rules alone, and what they bring to samples.

use std::f64::consts::PI;

use glam::DVec3;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::scene::LightKind;

use super::cases::{Case, Cases, Environment};
use super::evaluators::compare;
use super::read;
use crate::by_rules::{Function, Kind};
use crate::lights::{LAMP, beam, known, light_of};
use crate::lit::param;
use crate::vectors::reader::{Node, Tolerance, Tolerances};

const BEAM: &str = "vector_beam";
const POINT: &str = "vector_lamp";

fn effects() -> Effects {
    Effects::of(&[Effect::Lights, beam(BEAM), known(POINT, LightKind::Point(LAMP))])
}

/// The parameter of a light.
fn own(light: &str, key: &str) -> Param {
    param(&format!("light.{light}.{key}"))
}

/// Which of the two a case's is.
const fn name_of(kind: &LightKind) -> &'static str {
    match kind {
        LightKind::Directional(_) => BEAM,
        LightKind::Point(_) | LightKind::Spot(..) => POINT,
    }
}

fn f32_rel(case: &Node<'_>) -> Option<f64> {
    case.get("f32_rel").map(|rel| rel.number())
}

/// Azimuth and elevation of a case's beam, where it has a direction.
fn bearing(case: &Node<'_>) -> Option<[f64; 2]> {
    let inputs = case.at("light");
    let (light, _) = light_of(&inputs);
    let bearing = light.bearing().filter(|_| light.towards(DVec3::ZERO) != DVec3::ZERO)?;
    // Straight above a direction has lost its azimuth: one that is given counts.
    let azimuth = inputs.get("azimuth").map_or(bearing.azimuth, |azimuth| azimuth.number());
    Some([azimuth, bearing.elevation])
}

/// A case as a white sample in one of two lights, the other black; `None` where no sample is like it: a beam has a direction,
/// and the normal of a sample without one is what faces the eye.
fn case((at, case): (usize, &Node<'_>)) -> Option<Case> {
    let (light, color) = light_of(&case.at("light"));
    let [x, n] = ["x", "n"].map(|key| DVec3::from_array(case.at(key).three()));
    let name = name_of(&light.kind);
    let mut params = Params::defaults(Form::Corrected);
    // Of albedo / pi times what arrives.
    params.set(Param::BaseWeight, PI);
    for either in [BEAM, POINT] {
        params.set_rgb(own(either, "irradiance"), light.strength());
        params.set_rgb(own(either, "color"), if either == name { color } else { [0.0; 3] });
    }
    if name == BEAM {
        let [azimuth, elevation] = bearing(case)?;
        params.set(own(BEAM, "azimuth"), azimuth);
        params.set(own(BEAM, "elevation"), elevation);
    }
    let [toward, arriving] = [light.towards(x), DVec3::splat(light.attenuation(x))];
    let fields = vec![
        ("base", n.to_array().to_vec()),
        ("view", (-n).to_array().to_vec()),
        ("light_vector_lamp_found_toward", toward.to_array().to_vec()),
        ("light_vector_lamp_found_arriving", vec![arriving.x]),
    ];
    (n != DVec3::ZERO).then(|| Case { at, f32_rel: f32_rel(case), params, fields })
}

#[test]
fn samples_are_lit_as_the_vectors_say_and_move_as_they_do_on_every_evaluator() {
    let vectors = read();
    let file = vectors.one("light");
    let (inputs, expected) = (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects());
    let [azimuth, elevation] = ["azimuth", "elevation"].map(|key| own(BEAM, key));
    let cases = Cases {
        setup,
        environment: Environment::default(),
        columns: vec![own(BEAM, "color"), own(POINT, "color"), azimuth, elevation],
        slopes: true,
        each: inputs.iter().enumerate().filter_map(case).collect(),
        atlas: None,
    };
    assert_eq!(inputs.len() - cases.each.len(), 2);
    compare(&file, &cases, |told| {
        let (given, want) = (&inputs[told.at], &expected[told.at]);
        let name = name_of(&light_of(&given.at("light")).0.kind);
        told.check(given.at("case").text(), told.rgb(), &want.at("E"));
        told.check_slope(own(name, "color"), &want.at("d_color"));
        // Where a light just touches the surface, roundings decide whether it moves.
        let [n, toward] = [given.at("n"), want.at("L")].map(|node| DVec3::from_array(node.three()));
        if name == BEAM && (told.on.is_exact() || n.dot(toward) != 0.0) {
            told.check_slope(azimuth, &want.at("d_azimuth"));
            told.check_slope(elevation, &want.at("d_elevation"));
        }
    });
}

/// The rules of a light, alone.
struct Rules {
    bearing: Function,
    toward: Function,
    reach: Function,
    facing: Function,
}

impl Rules {
    fn new() -> Self {
        let of = |name: &str, arguments: &[usize]| Function::of_rule(effects(), name, arguments);
        Self {
            bearing: of("light_vector_beam_direction", &[1, 1]),
            toward: of("light_vector_lamp_direction", &[3, 3]),
            reach: of("light_vector_lamp_attenuation", &[3, 3, 3, 3, 3, 1]),
            facing: of("light_vector_lamp_cosine", &[3, 3, 1]),
        }
    }

    /// The direction towards a case's light, and what it brings of its strength.
    fn of(&self, kind: Kind, case: &Node<'_>) -> Option<(Vec<f64>, f64)> {
        let (light, _) = light_of(&case.at("light"));
        let [x, n] = ["x", "n"].map(|key| case.at(key).three());
        let (lamp, cone) = match &light.kind {
            LightKind::Directional(_) => {
                let [azimuth, elevation] = bearing(case)?;
                let toward = self.bearing.of_kind(kind, &[&[azimuth], &[elevation]]);
                let facing = PI * self.facing.of_kind(kind, &[&n, &toward, &[1.0]])[0];
                return Some((toward, facing));
            }
            LightKind::Point(lamp) => (lamp, None),
            LightKind::Spot(lamp, cone) => (lamp, Some(cone)),
        };
        let position = lamp.position.to_array();
        let axis = cone.map_or(DVec3::ZERO, |cone| cone.direction.normalize_or_zero()).to_array();
        let cosines = cone.map_or([-1.0, -2.0, 0.0], |cone| {
            let [inner, outer] =
                [cone.inner_degrees, cone.outer_degrees].map(|angle| angle.to_radians().cos());
            [inner, outer, 0.0]
        });
        let toward = self.toward.of_kind(kind, &[&x, &position]);
        let range = [lamp.range.unwrap_or(0.0)];
        let reach = self.reach.of_kind(kind, &[&x, &toward, &position, &axis, &cosines, &range]);
        let facing = PI * self.facing.of_kind(kind, &[&n, &toward, &reach])[0];
        Some((toward, facing))
    }
}

#[test]
fn rules_of_distance_range_and_cone_are_those_of_the_vectors_in_every_kind_of_number() {
    let vectors = read();
    let file = vectors.one("light");
    let rules = Rules::new();
    let (inputs, expected) = (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
    for kind in Kind::all() {
        let mut compared = 0;
        for (case, want) in inputs.iter().zip(&expected) {
            // A beam without a direction has no angles.
            let Some((toward, facing)) = rules.of(kind, case) else { continue };
            let given = file.vector.tolerances();
            let rel = f32_rel(case).unwrap_or(given.single.rel);
            let near = kind.near(Tolerances { single: Tolerance { rel, ..given.single }, ..given });
            let (light, color) = light_of(&case.at("light"));
            let strength = light.strength();
            near.check(&format!("L in {kind:?}"), &toward, &want.at("L"));
            let irradiance = [0, 1, 2].map(|c| color[c] * strength[c] * facing);
            near.check(&format!("E in {kind:?}"), &irradiance, &want.at("E"));
            compared += 1;
        }
        assert_eq!(compared, inputs.len() - 1);
    }
}
