//! Light that comes through the skin, on samples.

use skinfit::model::bearing::Bearing;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::model::transmission::FARTHEST;

use super::cases::{Case, Cases, Environment};
use super::evaluators::compare;
use super::read;
use crate::lights::beam;
use crate::lit::param;
use crate::sky::effect;
use crate::vectors::reader::Node;

/// Along which way both lights shine: they face the far side.
const TOWARD: Bearing = Bearing { azimuth: 30.0, elevation: 20.0 };

const LIGHTS: [(&str, &str); 2] =
    [("vector_beam", "light_vector_beam_depth"), ("vector_beam_2", "light_vector_beam_2_depth")];

/// What samples hold of no end.
fn depth(d: &Node<'_>) -> f64 {
    if d.number().is_finite() { d.number() } else { FARTHEST }
}

/// A case as a sample that shows nothing else.
fn case((at, case): (usize, &Node<'_>)) -> Case {
    let mut params = Params::defaults(Form::Corrected);
    params.set(Param::BaseWeight, 0.0);
    for name in ["transmission_weight", "transmission_length"] {
        params.set_rgb(param(name), case.at(name).three());
    }
    let out = TOWARD.direction().map(|x| -x);
    let mut fields = vec![
        ("base", out.to_vec()),
        ("view", TOWARD.direction().to_vec()),
        ("albedo", case.at("albedo").three().to_vec()),
        ("thickness", vec![depth(&case.at("d"))]),
    ];
    let lights = case.at("lights").items();
    for (i, (name, field)) in LIGHTS.into_iter().enumerate() {
        let own = |key: &str| param(&format!("light.{name}.{key}"));
        params.set(own("azimuth"), TOWARD.azimuth);
        params.set(own("elevation"), TOWARD.elevation);
        params.set(own("irradiance"), 1.0);
        let light = lights.get(i);
        params.set_rgb(own("color"), light.map_or([0.0; 3], |light| light.at("irradiance").three()));
        fields.push((field, vec![light.map_or(FARTHEST, |light| depth(&light.at("d")))]));
    }
    Case { at, f32_rel: None, params, fields }
}

#[test]
fn light_comes_through_samples_as_the_vectors_say_and_moves_as_it_does_on_every_evaluator() {
    let vectors = read();
    let file = vectors.one("transmission");
    let (inputs, expected) = (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
    let [first, second] = LIGHTS.map(|(name, _)| beam(name));
    let effects = [Effect::Diffuse, Effect::Lights, first, second, effect("transmission")];
    let ambient = |case: &Node<'_>| case.at("ambient").three();
    let irradiance = ambient(&inputs[0]);
    // One environment for all.
    assert!(inputs.iter().all(|case| ambient(case) == irradiance));
    let moved = [
        "transmission_weight",
        "transmission_length",
        "light.vector_beam.color",
        "light.vector_beam_2.color",
    ];
    let cases = Cases {
        setup: Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&effects)),
        environment: Environment { irradiance: Some(irradiance), lobe: None },
        columns: moved.map(param).to_vec(),
        slopes: true,
        each: inputs.iter().enumerate().map(case).collect(),
        atlas: None,
    };
    compare(&file, &cases, |told| {
        let want = &expected[told.at];
        told.check(inputs[told.at].at("case").text(), told.rgb(), &want.at("value"));
        for name in ["transmission_weight", "transmission_length"] {
            told.check_slope(param(name), &want.at(&format!("d_{name}")));
        }
    });
}
