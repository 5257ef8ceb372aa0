//! The planned rules of cases, in any kind of number.

use skinfit::engine::face_sizes;
use skinfit::model::params::Param;
use skinfit::shader::Facts;
use skinfit::shader::tangent::chain::Seed;
use skinfit_core::program::lower::Natives;
use skinfit_core::program::shading::{Shading, constant};
use skinfit_core::program::steps::{Rounding, Steps};

use super::cases::{Case, Cases, Environment, Shown};
use crate::by_rules::{Kind, Number, in_kind};

/// What they make of each case.
pub(super) fn shown(kind: Kind, cases: &Cases) -> Vec<Shown> {
    let turned = cases.columns.contains(&Param::EnvironmentRotation);
    let facts = Facts::of_samples(cases.setup, face_sizes(&cases.environment.illumination()), turned);
    let moved = if cases.slopes { &cases.columns[..] } else { &[] };
    let seeds: Vec<Seed> = moved.iter().map(|&param| Seed::of_param(param)).collect();
    let shading = Shading::new(&facts, &seeds, |_| None, Natives::Written).unwrap();
    let outputs = [&[shading.value], &shading.tangents[..]].concat().concat();
    let steps = Steps::new(&shading.graph, &outputs, |_| Rounding::Plain);
    in_kind!(kind, like => shown_in(&steps, cases, like))
}

fn shown_in<R: Number>(steps: &Steps, cases: &Cases, like: R) -> Vec<Shown> {
    let Environment { irradiance, lobe } = cases.environment;
    let irradiance = irradiance.map(|rgb| Environment::cube(rgb, R::texel));
    let reflected = lobe.map(|_| Environment::cube([1.0; 3], R::texel));
    let cube = |name: &str| {
        let cube = match name {
            "irradiance_faces" => &irradiance,
            "reflected_faces" => &reflected,
            other => panic!("there is no cube {other}"),
        };
        cube.as_ref().unwrap_or_else(|| panic!("{name} is not given"))
    };
    let shade = |case: &Case| {
        let setting = steps.setting(like, |input| constant(input, &case.params).unwrap(), cube);
        let mut registers = Vec::new();
        steps.run(&setting, like, &mut registers, |place| {
            let input = &steps.fields()[place];
            like.lit(case.number(&input.name, input.component))
        });
        let numbers: Vec<f64> = steps.outputs(&setting, &registers).map(|x| x.unpack()[0]).collect();
        let mut colours = numbers.chunks(4).map(|rgba| [rgba[0], rgba[1], rgba[2]]);
        Shown { rgb: colours.next().unwrap(), slopes: colours.map(Some).collect() }
    };
    cases.each.iter().map(shade).collect()
}
