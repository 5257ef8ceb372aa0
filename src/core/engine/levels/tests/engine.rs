//! The engine over samples that look levels up, beside the f64 model and its differences.

use super::*;
use crate::bake::LobeStack;
use crate::engine::reference::{Reference, deviation};
use crate::engine::{NormalEquations, Objective};
use crate::model::cube::Cube;
use crate::model::effects::Effect;

/// Entries of normal equations within a share of the diagonal's that share row and column.
fn assert_alike(got: &NormalEquations, want: &NormalEquations, unknowns: &[Unknown], most: f64) {
    let off = deviation(got, want, unknowns);
    assert!(off.size < most, "{}: {}", off.what, off.size);
}

#[test]
fn the_engine_is_the_f64_model_and_its_gradient_the_losses_slope() {
    let setup = setup(&[hills(), furrows()]);
    let ([weight, radius], [width, depth]) =
        ([0, 1].map(|i| hills().params[i]), [0, 1].map(|i| furrows().params[i]));
    let unknowns = free(&[
        Column::per_channel(weight)[0],
        Column::per_channel(weight)[2],
        Column::tied(radius),
        Column::tied(width),
        Column::tied(depth),
    ]);
    let truth = start(&[(weight, 0.7), (radius, 1.9), (width, 0.08), (depth, 1.2)]);
    let here = start(&[(weight, 0.5), (radius, 1.4), (width, 0.06), (depth, 1.5)]);
    let engine = engine_for(setup, unknowns.clone(), &truth);
    let light = Illumination::default();
    let model = Reference::new(setup, &light, engine.views(), Loss::L2, &unknowns).unwrap();
    let reference = model.normal_equations(&here);
    let got = engine.normal_equations(&here);
    // Levels and what is made of them round to some 1e-7 of 1; residuals are a tenth of that 1.
    assert_alike(&got, &reference, &unknowns, 3e-5);
    let (_, gradient) = engine.gradient(&here);
    for (unknown, slope) in unknowns.iter().zip(&gradient) {
        let at = |by: f64| {
            let mut moved = here.clone();
            unknown.set(&mut moved, unknown.get(&here) + by);
            model.loss(&moved)
        };
        let step = 1e-6;
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // Losses near 0.01 round to 1e-18; the engine's sums to 1e-6 of themselves.
        assert!(
            (slope - difference).abs() < 1e-4 * (1e-3 + difference.abs()),
            "{}: {slope} {difference}",
            unknown.name()
        );
    }
    // Whatever the threads.
    let pools = [1, 3].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    let [one, three] = pools.map(|pool| {
        pool.install(|| {
            let views = Arc::clone(engine.views());
            let task =
                Task { setup, illumination: dark(), views, loss: Loss::L2, unknowns: unknowns.clone() };
            CpuEngine::new(task).unwrap().normal_equations(&here)
        })
    });
    assert_eq!(one, three);
    assert_eq!(one, got);
}

#[test]
fn levels_move_with_the_light_as_the_losses_do() {
    // Smooth over the cube, so that differences tell its slope.
    let cube = |k: f64| {
        Cube::from_fn(16, |face, column, row| {
            let [s, t] = [column, row].map(|i| (i as f64 + 0.5) / 16.0);
            [1.0, 1.3, 1.7, 2.0].map(|c| (0.6 + 0.4 * (c * s + k * t + 0.5 * face as f64).sin()) as f32)
        })
    };
    let lobes = LobeStack { exponents: vec![8.0, 16.0], cubes: vec![cube(0.7), cube(1.9)] };
    let light =
        Illumination { irradiance: Some(cube(0.3)), lobes: Some(lobes), hilite: None, reflected: None };
    // Parameters of the light are free where a built-in effect asks for them.
    let effects = [dunes().effect, Effect::Occlusion, Effect::Diffuse, Effect::SideSpecular];
    let effects = Effects::of(&effects);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let params = [Param::EnvironmentRotation, Param::SpecularLobe, Param::Occlusion, dunes().params[0]];
    let unknowns = free(&params.map(Column::tied));
    let mut target = Rows::new(3, LANES);
    (0..3).for_each(|channel| target.plane_mut(channel).for_each(|x| *x = 0.3));
    let task = Task { illumination: Arc::new(light.clone()), ..task(setup, target, unknowns.clone()) };
    let here = start(&[(params[0], 11.0), (params[1], 11.0), (params[2], 0.7), (params[3], 1.4)]);
    let model = Reference::new(setup, &light, &task.views, Loss::L2, &unknowns).unwrap();
    let engine = CpuEngine::new(task.clone()).unwrap();
    // As above; lookups round a little more.
    assert_alike(&engine.normal_equations(&here), &model.normal_equations(&here), &unknowns, 1e-4);
    let (_, gradient) = model.gradient(&here);
    for (unknown, slope) in unknowns.iter().zip(gradient) {
        let at = |by: f64| {
            let mut moved = here.clone();
            unknown.set(&mut moved, unknown.get(&here) + by);
            model.loss(&moved)
        };
        // The cube between two exponents is made in f32: a step over which it moves by more than that rounds.
        let step = if *unknown == unknowns[1] { 1e-2 } else { 1e-5 };
        let difference = (at(step) - at(-step)) / (2.0 * step);
        // A lookup's slope changes from texel to texel: a few of the atlas' cross one within the step.
        let most = 1e-3;
        assert!(
            (slope - difference).abs() < most * (1e-3 + difference.abs()),
            "{}: {slope} {difference}",
            unknown.name()
        );
    }
    // What moves them has them made again, and nothing else.
    let made = engine.levels_made();
    let mut moved = here.clone();
    moved.params.set(Param::BaseWeight, 0.3);
    engine.loss(&moved);
    assert_eq!(engine.levels_made(), made);
    moved.params.set(Param::EnvironmentRotation, 12.0);
    engine.loss(&moved);
    assert_eq!(engine.levels_made(), made + 1);
}

#[test]
fn what_has_no_texels_makes_none_and_samples_without_them_are_refused() {
    let plain = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::of(&[Effect::KeyLight]));
    let view =
        ObservedView { samples: samples(None), target: Rows::new(3, LANES), weight: Vec::new(), clip: None };
    let task = |setup| {
        let views = Arc::from([view.clone()]);
        Task { setup, illumination: dark(), views, loss: Loss::L2, unknowns: Vec::new() }
    };
    let engine = CpuEngine::new(task(plain)).unwrap();
    engine.loss(&start(&[]));
    assert_eq!(engine.levels_made(), 0);
    let error = CpuEngine::new(task(setup(&[hills()]))).unwrap_err().to_string();
    assert!(error.contains("hills") && error.contains("Leave the effect out"), "{error}");
}
