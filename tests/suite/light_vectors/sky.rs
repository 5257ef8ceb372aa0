//! The sky that a point sees, and what the skin throws back by its albedo, on samples.

use skinfit::bake::harmonics::{Order, open_transfer};
use skinfit::bake::shadowed::{Turning, shadow_ratio};
use skinfit::model::choices::Bounces;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Param, Params};

use super::cases::{Case, Cases, Environment};
use super::evaluators::compare;
use super::read;
use crate::harmonics::case_light;
use crate::sky::effect;
use crate::vectors::reader::Node;

fn setup(more: &[Effect], bounces: Bounces) -> Setup {
    let effects = [&[Effect::Diffuse, effect("directional_occlusion")], more].concat();
    let mut setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&effects));
    setup.choices.bounces = bounces;
    setup
}

/// Light of 1 from everywhere.
const WHITE: Environment = Environment { irradiance: Some([1.0; 3]), lobe: None };

/// A sample that faces the eye.
fn facing<const N: usize>(more: [(&'static str, Vec<f64>); N]) -> Vec<(&'static str, Vec<f64>)> {
    let facing = [("base", vec![0.0, 0.0, 1.0]), ("view", vec![0.0, 0.0, -1.0])];
    facing.into_iter().chain(more).collect()
}

/// Under white light white skin shows the share of it that arrives, which bakes find of the file's transfer and light.
#[test]
fn samples_show_the_share_of_the_sky_that_the_vectors_say_and_how_it_turns_on_every_evaluator() {
    let vectors = read();
    let file = vectors.files["sh_transfer.json"].root();
    let (inputs, expected) = (file.at("inputs").at("cases").items(), file.at("expected").at("cases").items());
    let mut setup = setup(&[], Bounces::None);
    setup.choices.turning = true;
    let mut params = Params::defaults(Form::Corrected);
    params.set(Param::BaseWeight, 1.0);
    let case = |(at, case): (usize, &Node<'_>)| {
        let light = case_light(&vectors, &file, case);
        let open = open_transfer(Order::MOST, case.at("N").three());
        let transfer = expected[at].at("T").numbers();
        let [shadowed, open] = [&transfer, &open].map(|transfer| Turning::of(transfer, &light));
        let ratio = shadow_ratio(&shadowed, &open, light.mean(), 0.0);
        let fields = facing([
            ("sky_ratio", ratio.value.to_vec()),
            ("sky_cosine", vec![0.0; 3]),
            ("sky_sine", ratio.slope.to_vec()),
            ("sky_curve", vec![0.0; 3]),
        ]);
        Case { at, f32_rel: None, params: params.clone(), fields }
    };
    let cases = Cases {
        setup,
        environment: WHITE,
        columns: vec![Param::EnvironmentRotation],
        slopes: true,
        each: inputs.iter().enumerate().map(case).collect(),
        atlas: None,
    };
    compare(&file, &cases, |told| {
        let want = &expected[told.at];
        told.check(inputs[told.at].at("case").text(), told.rgb(), &want.at("ratio"));
        told.check_slope(Param::EnvironmentRotation, &want.at("d_ratio"));
    });
}

/// Three albedos are a sample's channels. Half of the occlusion counts, so that it moves; what it moves by is what is hidden, times
/// how the bounces move.
#[test]
fn samples_throw_light_back_as_the_vectors_say_on_every_evaluator() {
    const STRENGTH: f64 = 0.5;
    let vectors = read();
    let file = vectors.files["sh_bounce.json"].root();
    let [open, albedos] = ["occ", "albedo"].map(|key| file.at("inputs").at(key).numbers());
    let mut params = Params::defaults(Form::Corrected);
    params.set(Param::BaseWeight, 1.0);
    params.set(Param::Occlusion, STRENGTH);
    let (threes, rest) = albedos.as_chunks::<3>();
    assert!(rest.is_empty());
    let each = open.iter().enumerate().flat_map(|(i, open)| {
        let params = &params;
        threes.iter().enumerate().map(move |(j, albedo)| {
            let fields =
                facing([("albedo", albedo.to_vec()), ("sky_ratio", vec![1.0 - (1.0 - open) / STRENGTH; 3])]);
            Case { at: i * threes.len() + j, f32_rel: None, params: params.clone(), fields }
        })
    });
    let cases = Cases {
        setup: setup(&[Effect::Occlusion], Bounces::Polynomial),
        environment: WHITE,
        columns: vec![Param::Occlusion],
        slopes: true,
        each: each.collect(),
        atlas: None,
    };
    let expected = file.at("expected");
    let entry = |key: &str, at: usize, c: usize| {
        expected.at(key).item(at / threes.len()).item(at % threes.len() * 3 + c)
    };
    compare(&file, &cases, |told| {
        let (open, albedo) = (open[told.at / threes.len()], threes[told.at % threes.len()]);
        // Black skin shows nothing of either.
        for c in (0..3).filter(|&c| albedo[c] > 0.0) {
            let value = told.rgb()[c] / albedo[c];
            told.near.check("bounced", &[value], &entry("value", told.at, c));
            let hidden = (1.0 - open) / STRENGTH;
            // Where nothing is open both branches are 0, and either's slope is one.
            if open > 0.0 && hidden != 0.0 {
                let slope = told.slope(Param::Occlusion).unwrap()[c] / (-hidden * albedo[c]);
                told.near.check("by what is open", &[slope], &entry("d_occ", told.at, c));
            }
        }
    });
}
