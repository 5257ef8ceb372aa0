//! Lobes of lights, and of a white environment, on samples.

use skinfit::model::choices::{Choices, SkinReflection, SpecularModel, SpecularVisibility, SplitSum};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};
use skinfit::scene::LightKind;

use super::cases::{Case, Cases, Environment};
use super::evaluators::compare;
use super::read;
use crate::lights::{LAMP, known};
use crate::lit::param;
use crate::sky::effect;
use crate::vectors::reader::{Node, Tolerance};

fn setup(effects: &[Effect], choose: impl FnOnce(&mut Choices)) -> Setup {
    let mut setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(effects));
    choose(&mut setup.choices);
    setup
}

/// A case as a black sample in a lamp as bright at it as the file's light: E has the cosine in it, as has what a sample makes of
/// a strength.
fn lit((at, case): (usize, &Node<'_>)) -> Case {
    let [n, view, toward] = ["n", "V", "L"].map(|key| case.at(key).three());
    let mut params = Params::defaults(Form::Corrected);
    params.set(Param::BaseWeight, 0.0);
    params.set_rgb(param("specular_weight"), case.at("specular_weight").three());
    for name in ["roughness", "gloss", "f0"] {
        params.set(param(name), case.at(name).number());
    }
    let cosine: f64 = (0..3).map(|i| n[i] * toward[i]).sum();
    let irradiance = case.at("E").three();
    params.set(param("light.vector_lamp.irradiance"), 1.0);
    params.set_rgb(
        param("light.vector_lamp.color"),
        irradiance.map(|rgb| if cosine > 0.0 { rgb / cosine } else { 1.0 }),
    );
    let fields = vec![
        ("base", n.to_vec()),
        ("view", view.to_vec()),
        ("specular", vec![case.at("s").number()]),
        ("light_vector_lamp_found_toward", toward.to_vec()),
        ("light_vector_lamp_found_arriving", vec![1.0]),
    ];
    Case { at, f32_rel: case.get("f32_rel").map(|rel| rel.number()), params, fields }
}

#[test]
fn samples_mirror_lights_as_the_vectors_say_and_move_as_they_do_on_every_evaluator() {
    let vectors = read();
    let lamp = known("vector_lamp", LightKind::Point(LAMP));
    for (model, name) in
        [(SpecularModel::Kelemen, "specular_lights.json"), (SpecularModel::Ggx, "specular_lights_ggx.json")]
    {
        let file = vectors.files[name].root();
        let (inputs, expected) =
            (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
        let effects = [Effect::Lights, lamp, effect("light_specular")];
        let moved = ["specular_weight", "roughness", "gloss", "f0", "light.vector_lamp.color"];
        let cases = Cases {
            setup: setup(&effects, |choices| choices.specular_model = model),
            environment: Environment::default(),
            columns: moved.map(param).to_vec(),
            slopes: true,
            each: inputs.iter().enumerate().map(lit).collect(),
            atlas: None,
        };
        compare(&file, &cases, |told| {
            let want = &expected[told.at];
            told.check(inputs[told.at].at("case").text(), told.rgb(), &want.at("radiance"));
            for name in ["specular_weight", "roughness", "gloss"] {
                told.check_slope(param(name), &want.at(&format!("d_{name}")));
            }
            // At f0 = 0 a root of 1e-12 stands for 0, which counts some twenty fold.
            if let Some(slope) = told.slope(param("f0")) {
                told.near.times(4.0).check("by f0", &slope, &want.at("d_f0"));
            }
        });
    }
}

#[test]
fn samples_mirror_a_white_environment_as_the_vectors_say_on_every_evaluator() {
    let vectors = read();
    let fresnel = [effect("fresnel")];
    // The fits' stated error, of two sums for Schlick's factor at f0 = 1, and in 32 bits some roundings of sums of up to 5.
    for (model, split_sum, name, values, stated) in [
        (SpecularModel::Kelemen, SplitSum::Schlick, "specular_split_sum.json", "furnace", 2.0 * 2.1e-4),
        (SpecularModel::Ggx, SplitSum::Exact, "specular_split_sum_ggx.json", "es_dielectric", 3.2e-4),
    ] {
        let file = vectors.files[name].root();
        let [views, roughnesses, f0s] = ["NV", "m", "f0"].map(|key| file.at("inputs").at(key).numbers());
        let mut each = Vec::new();
        for (i, &f0) in f0s.iter().enumerate() {
            for (j, &view) in views.iter().enumerate() {
                for (k, &m) in roughnesses.iter().enumerate() {
                    let mut params = Params::defaults(Form::Corrected);
                    for (name, value) in
                        [("specular_weight", 1.0), ("roughness", m), ("gloss", 0.0), ("f0", f0)]
                    {
                        params.set(param(name), value);
                    }
                    let fields = vec![
                        ("base", vec![0.0, 0.0, 1.0]),
                        ("view", vec![(1.0 - view * view).sqrt(), 0.0, -view]),
                    ];
                    let at = (i * views.len() + j) * roughnesses.len() + k;
                    each.push(Case { at, f32_rel: None, params, fields });
                }
            }
        }
        let choose = |choices: &mut Choices| {
            *choices = Choices {
                specular_model: model,
                split_sum,
                specular_visibility: SpecularVisibility::None,
                skin_reflection: SkinReflection::None,
                ..*choices
            };
        };
        let cases = Cases {
            setup: setup(&fresnel, choose),
            environment: Environment { irradiance: None, lobe: Some(model) },
            columns: ["roughness", "f0"].map(param).to_vec(),
            slopes: false,
            each,
            atlas: None,
        };
        let near = Tolerance { abs: stated, rel: 0.0 };
        let expected = file.at("expected").at(values);
        let expected: Vec<Node<'_>> =
            expected.items().iter().flat_map(Node::items).flat_map(|row| row.items()).collect();
        compare(&file, &cases, |told| {
            // White in all channels.
            told.rgb().iter().for_each(|&shown| near.check(values, &[shown], &expected[told.at]));
        });
    }
}
