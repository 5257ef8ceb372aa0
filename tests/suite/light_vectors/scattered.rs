//! Light that scatters, on samples that look up the vectors' atlas.

use skinfit::model::diffusion::DiffusionChoices;
use skinfit::model::params::Param;
use skinfit::shader::domain::{CHART, UV};

use super::cases::{Case, Cases, Environment};
use super::evaluators::compare_on_engines;
use super::read;
use crate::diffusion::{GivenLight, given, setup, taps_of};
use crate::lit::param;
use crate::vectors::reader::Node;

/// A file's lookups as samples of its atlas.
fn cases(light: &GivenLight<'_>, file: &Node<'_>, columns: Vec<Param>) -> Cases {
    let setup = setup(DiffusionChoices { taps: taps_of(file), ..DiffusionChoices::DEFAULT });
    let each = light.lookups().into_iter().enumerate().map(|(at, lookup)| Case {
        at,
        f32_rel: None,
        params: light.params.clone(),
        fields: vec![
            ("base", vec![0.0, 0.0, 1.0]),
            ("view", vec![0.0, 0.0, -1.0]),
            ("albedo", lookup.albedo.to_vec()),
            (UV, lookup.uv.to_vec()),
            (CHART, vec![f64::from(lookup.chart)]),
        ],
    });
    Cases {
        setup,
        environment: Environment::default(),
        columns,
        slopes: true,
        each: each.collect(),
        atlas: Some(light.texels.atlas(&setup)),
    }
}

#[test]
fn samples_look_scattered_light_up_as_the_vectors_say_and_move_as_they_do_on_every_engine() {
    let vectors = read();
    let mut files = 0;
    for file in vectors.of_kind("diffusion2") {
        if file.get("constants").and_then(|constants| constants.get("taps")).is_none() {
            continue;
        }
        let light = GivenLight::mixed(&vectors, &file);
        let expected = file.at("expected");
        let jacobian = expected.at("jacobian");
        let columns = jacobian.at("columns").items();
        let own = |name: &Node<'_>| match name.text() {
            "light_color" => given().params[0],
            name => param(name),
        };
        let columns: Vec<Param> = columns.iter().map(own).collect();
        let (finals, slopes) = (expected.at("final"), jacobian.at("J"));
        compare_on_engines(&file, &cases(&light, &file, columns.clone()), |told| {
            told.check("final", told.rgb(), &finals.item(told.at));
            let row = slopes.item(told.at);
            for (k, &param) in columns.iter().enumerate() {
                let Some(slope) = told.slope(param) else { continue };
                for (c, slope) in slope.into_iter().enumerate() {
                    // As beside the rules: taps of a wide blur move by many texels for a millimetre.
                    let near = told.near.times(10.0);
                    near.check(param.name(), &[slope], &row.item(c).item(k));
                }
            }
        });
        files += 1;
    }
    assert_eq!(files, 8);
}
