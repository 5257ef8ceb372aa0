//! Light that scatters on tensors: images and slopes beside the processor's engine, blurs backwards beside the vectors, and maps
//! that what is computed in texels reads.

use std::sync::Arc;

use burn::tensor::{Tensor, TensorData};
use skinfit::bake::{Illumination, VertexOcclusion};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::{Objective, Point, Task};
use skinfit::maps::{MapError, MapFunction, MapTask, fit_maps};
use skinfit::model::diffusion::{Combined, DiffusionChoices, Lookup, Method, Seams, Taps, Unblurred};
use skinfit::model::effects::Effect;
use skinfit::prepare::Baked;
use skinfit::scene::{Loss, MapKind, MapPrior, Scene};
use skinfit::tensor::{Input, Inputs, Levels, Scatter, Shade, Shaded, SharedDevice};

use super::bench::{numbers, shared};
use super::lit::agree;
use super::maps::{albedo, difference, fit, observed, sampled, shrunk, targets, wavy};
use crate::diffused::{columns, head};
use crate::diffusion::{GivenLight, setup, taps_of};
use crate::light_vectors::read;
use crate::lit::param;
use crate::sky::{brighter, effect, head_changed, on_cpu};

/// The built-in head in scattered light, small, that a target misses.
fn small(choices: DiffusionChoices) -> skinfit::prepare::Observed {
    // A light's parameters are known once a scene was read.
    let _known = effect("diffusion");
    let baked = head(&["light_specular", "fresnel"].map(effect), |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (20, 20);
        scene.diffusion.light_map_size = 64;
        scene.choices.diffusion = choices;
        scene.fit.free = columns();
    });
    let target = brighter(on_cpu(&baked));
    baked.with_scene(|scene| scene.views[0].target = Some(target)).sample().unwrap().observe().unwrap()
}

#[test]
fn light_that_scatters_moves_tensors_as_it_moves_the_processors_engine_by_every_choice() {
    let Some(shared) = shared() else { return };
    let plain = DiffusionChoices::DEFAULT;
    for (choices, what) in [
        (plain, "default"),
        (DiffusionChoices { taps: Taps::Full, lookup: Lookup::Dilated, ..plain }, "full taps, one fetch"),
        (
            DiffusionChoices { combined: Combined::Map, unblurred: Unblurred::Pixel, ..plain },
            "combined in texels",
        ),
    ] {
        agree(shared, &small(choices), &columns(), what);
    }
}

fn tensor(shared: &SharedDevice, numbers: Vec<f32>, shape: [usize; 2]) -> Tensor<2> {
    Tensor::from_data(TensorData::new(numbers, shape), shared.device())
}

/// Of the vectors' atlas what the scattered light, weighed by the file's cotangent, is by each texel of the light map.
#[test]
fn blurs_go_backwards_as_the_vectors_say() {
    let Some(shared) = shared() else { return };
    let vectors = read();
    let mut compared = 0;
    for file in vectors.of_kind("diffusion2") {
        let expected = file.at("expected");
        let (Some(want), Some(levels)) = (expected.get("adjoint"), expected.get("levels")) else { continue };
        let mut light = GivenLight::mixed(&vectors, &file);
        let setup = setup(DiffusionChoices { taps: taps_of(&file), ..DiffusionChoices::DEFAULT });
        let size = light.texels.size;
        let covered = light.texels.charts.iter().filter(|&&chart| chart > 0).count();
        let dark = Illumination::default();
        let operation = |light: &GivenLight<'_>, scatter: Scatter| {
            let shaded = Shaded { setup, params: &light.params, columns: &[], illumination: &dark };
            Levels::new(shared, &shaded, &light.texels.atlas(&setup), scatter).unwrap()
        };
        let near = file.vector.tolerances().single;
        for scatter in [Scatter::Exact, Scatter::Fast] {
            let (made, inputs) = operation(&light, scatter);
            assert_eq!((made.texels(), made.numbers()), (covered, 12));
            let found = numbers(made.make(inputs).unwrap());
            for (k, level) in levels.items().iter().enumerate() {
                let own = found.chunks(12).flat_map(|texel| &texel[3 * k + 3..3 * k + 6]);
                let own: Vec<f64> = own.map(|&x| f64::from(x)).collect();
                near.check("level", &own, level);
            }
        }
        // The light map is the colour map: of a light of 1 everywhere, with the whole colour before the blurs.
        light.texels.fields.retain(|(name, _)| name.starts_with("dpd"));
        // Black would not move: a power of it stays.
        light.texels.fields.push(("albedo", vec![[0.5; 3]; size * size]));
        light.texels.fields.push(("given_ambient", vec![[1.0; 3]; size * size]));
        light.params.set(param("colour_mix"), 1.0);
        let cotangent = want.at("cotangent").wanted();
        let weights = [1, 2, 3].map(|k| light.params.rgb(param(&format!("diffusion_weight_{k}"))));
        // By each number of a texel's levels: L_0 + sum of w_k (L_k - L_0).
        let adjoint = |texel: usize| -> Vec<f32> {
            let by = |k: usize, c: usize| match k {
                0 => 1.0 - weights.iter().map(|weight| weight[c]).sum::<f64>(),
                k => weights[k - 1][c],
            };
            (0..12).map(|i| (cotangent[3 * texel + i % 3] * by(i / 3, i % 3)) as f32).collect()
        };
        let adjoint: Vec<f32> = (0..covered).flat_map(adjoint).collect();
        for scatter in [Scatter::Exact, Scatter::Fast] {
            let (made, inputs) = operation(&light, scatter);
            let gradient = || {
                let free = inputs.albedo.clone().autodiff().require_grad();
                let levels = made.make(Inputs { albedo: free.clone(), ..inputs.clone() }).unwrap();
                let adjoint = tensor(shared, adjoint.clone(), [covered, 12]);
                numbers(free.grad(&(levels * adjoint.autodiff()).sum().backward()).unwrap())
            };
            let got = gradient();
            let got_64: Vec<f64> = got.iter().copied().map(f64::from).collect();
            near.check("gradient by the light map", &got_64, &want.at("light_map_gradient"));
            if scatter == Scatter::Exact {
                assert!(got == gradient(), "the bits of sums depend on the order of threads");
            }
            compared += 1;
        }
    }
    assert!(compared >= 4, "{compared}");
}

/// The built-in head with a colour map of few texels, half of whose colour is blurred, under a lamp; its occlusion is a vertex'
/// own.
fn with_maps(change: impl FnOnce(&mut Scene)) -> Baked {
    let _known = effect("diffusion");
    let effects = [&[Effect::Lights][..], &["diffusion"].map(effect)].concat();
    head_changed(&effects, |scene| {
        scene.diffusion.light_map_size = 64;
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (48, 48);
        scene.maps.color = scene.maps.color.as_ref().map(shrunk);
        for (name, value) in [("diffusion_radius_1", 3.0), ("diffusion_radius_2", 6.0), ("colour_mix", 0.5)] {
            scene.params.set(param(name), value);
        }
        scene.fit.loss = Loss::L2;
        scene.fit.maps.rounds = 1;
        scene.fit.maps.steps = 30;
        for kind in MapKind::ALL {
            let prior = scene.fit.maps.prior(kind);
            scene.fit.maps.set_prior(kind, MapPrior { smoothness: 0.0, closeness: 1e-9, ..prior });
        }
        change(scene);
    })
}

/// The processor's loss of a scene against targets.
fn loss(baked: &Baked, seen: &[(skinfit::scene::view::View, skinfit::scene::view::Target)]) -> f64 {
    let task = Task {
        setup: baked.setup(),
        illumination: Arc::clone(&baked.illumination),
        views: observed(baked, seen).into(),
        loss: Loss::L2,
        unknowns: Vec::new(),
    };
    let start: Point = baked.start();
    CpuEngine::new(task).unwrap().loss(&start)
}

#[test]
fn maps_move_scattered_light_as_scenes_do_that_are_sampled_anew_with_other_maps() {
    let Some(shared) = shared() else { return };
    let truth = with_maps(|_| ());
    let seen = targets(&truth);
    // Somewhere else, so that the loss has a slope.
    let colored = |step: f32| {
        truth.clone().with_scene(|scene| {
            let texels = scene.maps.color.as_mut().unwrap().texels.iter_mut().enumerate();
            texels.for_each(|(i, texel)| *texel = texel.map(|x| (0.7 + step * (wavy(i) - 0.9)) * x));
        })
    };
    let opened = |step: f32| {
        let mut occlusion = VertexOcclusion::clone(truth.occlusion.as_ref().unwrap());
        let change = |(i, open): (usize, &mut f32)| *open *= 0.7 + step * ((7 * i % 13) as f32 / 13.0 - 0.3);
        occlusion.base.iter_mut().enumerate().for_each(change);
        Baked { occlusion: Some(Arc::new(occlusion)), ..truth.clone() }
    };
    let check = |kind: MapKind, moved: &dyn Fn(f32) -> Baked, map: &dyn Fn(&Baked) -> Vec<f32>| {
        const STEP: f32 = 1.0 / 16.0;
        let here = moved(0.0);
        let posed = here.scene.mesh.pose();
        let task = MapTask::new(&here, &posed, observed(&here, &seen), vec![kind]);
        let function = MapFunction::new(shared, task).unwrap();
        let (value, gradients) = function.loss_and_gradient(&here.start(), vec![None]).unwrap();
        // Samples in several parts look the same levels up.
        let task = MapTask::new(&here, &posed, observed(&here, &seen), vec![kind]);
        let parts = MapFunction::new(shared, MapTask { most_samples: Some(1000), ..task }).unwrap();
        let (in_parts, of_parts) = parts.loss_and_gradient(&here.start(), vec![None]).unwrap();
        assert!((in_parts - value).abs() < 1e-6 * value, "{in_parts} {value}");
        let largest = gradients.maps[0].iter().fold(0.0_f32, |most, slope| most.max(slope.abs()));
        let pairs = gradients.maps[0].iter().zip(&of_parts.maps[0]);
        // Sums of f32 in another order.
        pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-5 * largest, "{a} {b}"));
        let [low, high] = [-STEP, STEP].map(|step| loss(&moved(step), &seen));
        let way = map(&moved(STEP)).into_iter().zip(map(&moved(-STEP)));
        let slopes = gradients.maps[0].iter().zip(way);
        let got: f64 = slopes.map(|(slope, (high, low))| f64::from(*slope) * f64::from(high - low)).sum();
        let (want, name) = (high - low, kind.name());
        // The loss is of the second degree in occlusion; in colours, some of which are roots, steps of a sixteenth bend it by a
        // thousandth.
        assert!((value - loss(&here, &seen)).abs() < 1e-4 * value, "{name}: {value}");
        assert!(
            (got - want).abs() < 3e-3 * want.abs() && want.abs() > 0.02 * value,
            "{name}: {got} {want} of {value}"
        );
    };
    check(MapKind::Color, &colored, &|baked| {
        baked.scene.maps.color.as_ref().unwrap().texels.as_flattened().to_vec()
    });
    check(MapKind::Occlusion, &opened, &|baked| {
        let weights: Vec<f32> = baked.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
        baked.occlusion.as_ref().unwrap().posed(&weights)
    });
}

#[test]
fn a_changed_colour_map_is_found_again_through_light_that_scatters() {
    if shared().is_none() {
        return;
    }
    let truth = with_maps(|_| ());
    let changed = with_maps(|scene| {
        for (i, texel) in scene.maps.color.as_mut().unwrap().texels.iter_mut().enumerate() {
            *texel = texel.map(|x| (0.8 * x * wavy(i)).min(1.0));
        }
    });
    let (before, seen) = (sampled(&changed).remove(0), sampled(&truth).remove(0));
    let fitted = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let [before, after] =
        [&before, &fitted.observed[0].samples].map(|samples| difference(&seen, samples, albedo));
    let step = &fitted.history[0];
    assert!(step.after < 1e-2 * step.before, "{step:?}");
    assert!(before > 0.03 && after < 0.3 * before, "{before} -> {after}");
    // The atlas that comes back with the views is of the fitted map: what the processor makes of it is as near.
    let task = Task {
        setup: changed.setup(),
        illumination: Arc::clone(&changed.illumination),
        views: fitted.observed.clone().into(),
        loss: Loss::L2,
        unknowns: Vec::new(),
    };
    let left = CpuEngine::new(task).unwrap().loss(&changed.start());
    assert!((left - (step.after - step.prior)).abs() < 1e-3 * step.before, "{left} {step:?}");
}

#[test]
fn what_tensors_do_not_make_in_texels_is_refused_by_name() {
    let Some(shared) = shared() else { return };
    let plain = DiffusionChoices::DEFAULT;
    for (choices, remedy) in [
        (DiffusionChoices { method: Method::Surface, ..plain }, "method = \"separable\""),
        (DiffusionChoices { seams: Seams::Joined, ..plain }, "seams = \"cut\""),
    ] {
        let observed = small(choices);
        let (task, params) = (observed.task(), observed.start().params);
        let shaded =
            Shaded { setup: task.setup, params: &params, columns: &[], illumination: &task.illumination };
        let views: Vec<_> = task.views.iter().map(|view| &view.samples).collect();
        let error = Shade::new(shared, &shaded, &views, Scatter::Exact).unwrap_err().to_string();
        assert!(error.contains(remedy) && error.contains("[diffusion]"), "{error}");
    }
    let baked = with_maps(|_| ());
    let posed = baked.scene.mesh.pose();
    let seen = targets(&baked);
    let task = MapTask::new(&baked, &posed, observed(&baked, &seen), vec![MapKind::Environment]);
    let error = fit_maps(shared, MapTask { unknowns: Vec::new(), ..task }, &mut |_| {}).err().unwrap();
    assert!(matches!(error, MapError::InTexels { map: "environment", effect: "diffusion" }), "{error}");
    // A cube that texels look up is held, and that is told.
    let views = sampled(&baked);
    let params = baked.start().params;
    let shaded =
        Shaded { setup: baked.setup(), params: &params, columns: &[], illumination: &baked.illumination };
    let (shade, _) = Shade::new(shared, &shaded, &[&views[0]], Scatter::Exact).unwrap();
    let (levels, inputs) = shade.levels().unwrap();
    assert!(levels.reads(Input::Irradiance));
    let irradiance = inputs.irradiance.clone().autodiff().require_grad();
    let error = levels.make(Inputs { irradiance, ..inputs.clone() }).unwrap_err().to_string();
    assert!(error.contains("`irradiance`") && error.contains("texels"), "{error}");
}
