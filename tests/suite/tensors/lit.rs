//! Lights with their shadows, Fresnel, the sky that a point sees and light through thin parts on tensors: image and gradient
//! beside the processor's engine, over the same samples; what chooses cubes, likewise; and what tensors cannot move, told.

use burn::tensor::{Tensor, TensorData};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::residual::Residuals;
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::maps::{MapError, MapFunction, MapTask, fit_maps};
use skinfit::model::choices::{SpecularMap, SpecularModel, SpecularVisibility, SplitSum};
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Observed;
use skinfit::samples::ViewSamples;
use skinfit::scene::{MapKind, MapPrior};
use skinfit::shader::term::register;
use skinfit::tensor::{Input, Inputs, Scatter, Shade, Shaded, SharedDevice};

use super::bench::{numbers, shared};
use super::maps::small_with;
use crate::added_term::term;
use crate::lit::param;
use crate::sky::{brighter, effect, head_changed, on_cpu};

/// The built-in head under a lamp with its shadow, so small that light comes through it, with a target that it misses.
fn head(model: SpecularModel) -> Observed {
    let more = ["light_specular", "fresnel", "directional_occlusion", "transmission"].map(effect);
    let more = [&[Effect::NormalMap, Effect::Lights, Effect::Shadows][..], &more].concat();
    let baked = head_changed(&more, |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (20, 20);
        scene.metres_per_unit = 0.004;
        scene.choices.specular_model = model;
        if model == SpecularModel::Ggx {
            scene.choices.specular_map = SpecularMap::F0;
            scene.choices.split_sum = SplitSum::Exact;
            scene.choices.specular_visibility = SpecularVisibility::Cone;
        }
        for (name, value) in [
            ("transmission_unit", 4.0),
            ("transmission_length", 2.0),
            ("gloss", 0.4),
            ("f0", 0.06),
            ("fresnel_loss", 0.7),
            ("occlusion", 0.8),
            ("environment_rotation", 15.0),
        ] {
            scene.params.set(param(name), value);
        }
        scene.params.set_rgb(param("transmission_weight"), [0.7, 0.5, 0.9]);
        scene.params.set_rgb(param("specular_weight"), [0.9, 0.7, 0.5]);
        // What may be free decides what samples hold of a sky that turns.
        scene.fit.free = columns(model);
    });
    let target = brighter(on_cpu(&baked));
    baked.with_scene(|scene| scene.views[0].target = Some(target)).sample().unwrap().observe().unwrap()
}

/// Every way in which these effects move: weights a channel each, and what is looked up.
fn columns(model: SpecularModel) -> Vec<Column> {
    let rgb = ["specular_weight", "transmission_weight", "transmission_length", "light.side.color"];
    let mut one = vec![
        "base_weight",
        "rim_weight",
        "rim_exponent",
        "occlusion",
        "normal_strength",
        "environment_rotation",
        "f0",
        "fresnel_loss",
        "light.side.azimuth",
        "light.side.elevation",
    ];
    if model == SpecularModel::Ggx {
        one.push("f0_floor");
    }
    let each = rgb.into_iter().flat_map(|name| Column::per_channel(param(name)));
    each.chain(one.into_iter().map(|name| Column::tied(param(name)))).collect()
}

fn operation(shared: &SharedDevice, task: &Task, point: &Point, columns: &[Column]) -> (Shade, Inputs) {
    let views: Vec<&ViewSamples> = task.views.iter().map(|view| &view.samples).collect();
    let params = &point.params;
    let shaded = Shaded { setup: task.setup, params, columns, illumination: &task.illumination };
    Shade::new(shared, &shaded, &views, Scatter::Exact).unwrap()
}

/// The loss of an image, and its slope by every number of that.
fn loss(view: &ObservedView, task: &Task, image: &[f32]) -> (f64, Vec<f32>) {
    let residuals = Residuals::new(task.loss);
    let (mut loss, mut slopes, mut weights) = (0.0, vec![0.0; image.len()], 0.0);
    for slot in 0..image.len() / 4 {
        let weight = f64::from(view.pixel_weight(slot));
        for c in 0..3 {
            let (model, target) = (f64::from(image[4 * slot + c]), f64::from(view.target.number(c, slot)));
            let row = residuals.weigh(view.clip, model, target, weight);
            loss += row.loss;
            slopes[4 * slot + c] = 2.0 * row.scale * row.residual;
            weights += weight;
        }
    }
    (loss / weights, slopes.into_iter().map(|slope| (slope / weights) as f32).collect())
}

/// Image and gradient on tensors beside those of the processor's engine.
pub(super) fn agree(shared: &SharedDevice, observed: &Observed, columns: &[Column], what: &str) {
    agree_at(shared, (observed.task(), &observed.start()), columns, what);
}

/// The same of a task at a point.
pub(crate) fn agree_at(shared: &SharedDevice, (task, point): (Task, &Point), columns: &[Column], what: &str) {
    let unknowns = columns.iter().copied().map(Unknown::Param).collect();
    let task = Task { unknowns, ..task };
    let view = task.views[0].clone();
    let engine = CpuEngine::new(task.clone()).unwrap();
    let (shade, inputs) = operation(shared, &task, point, columns);
    let image = numbers(shade.image(inputs.clone()).unwrap());
    let planes = engine.image(0, point);
    let brightest = planes.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
    let mut compared = 0;
    for slot in (0..image.len() / 4).filter(|&slot| view.pixel_weight(slot) > 0.0) {
        for c in 0..3 {
            let (got, want) = (image[4 * slot + c], planes[c][slot]);
            // Some hundred roundings of f32 each, of a lobe that is some ten times as bright at its peak.
            assert!((got - want).abs() <= 1e-4 * want.abs() + 1e-5 * brightest, "{what}: {got} {want}");
            compared += 1;
        }
    }
    assert!(compared > 300, "{compared}");
    let (want_loss, want) = engine.gradient(point);
    let (got_loss, slopes) = loss(&view, &task, &image);
    // Sums over a thousand residuals of such an image.
    assert!((got_loss - want_loss).abs() <= 1e-5 * want_loss, "{what}: {got_loss} {want_loss}");
    let shape = [shade.slots(), 4];
    let slopes = Tensor::<2>::from_data(TensorData::new(slopes, shape), shared.device());
    let free = inputs.columns.clone().autodiff().require_grad();
    let mut tracked = Inputs { columns: free.clone(), ..inputs };
    if let Some((levels, start)) = shade.levels() {
        tracked.levels = levels.make(Inputs { columns: free.clone(), ..start.clone() }).unwrap();
    }
    let gradients = (shade.image(tracked).unwrap() * slopes.autodiff()).sum().backward();
    let got = numbers(free.grad(&gradients).unwrap());
    let most = want.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    for ((column, got), want) in columns.iter().zip(got).zip(want) {
        let name = Unknown::Param(*column).name();
        // As between the engines (`slopes::EXACT`), of residuals that cancel ten times as far: the target is near.
        let near = 1e-3 * want.abs() + 1e-5 * most;
        assert!((f64::from(got) - want).abs() <= near, "{what}: {name}: {got} {want}");
        assert!(want != 0.0, "{what}: {name} moves nothing");
    }
}

#[test]
fn lights_shadows_and_fresnel_move_tensors_as_they_move_the_processors_engine() {
    let Some(shared) = shared() else { return };
    for model in SpecularModel::ALL {
        agree(shared, &head(model), &columns(model), &format!("{model:?}"));
    }
}

#[test]
fn a_term_that_only_these_tests_know_moves_tensors_as_it_moves_the_processors_engine() {
    let Some(shared) = shared() else { return };
    let term = term();
    let columns: Vec<Column> = term
        .params
        .iter()
        .flat_map(|&param| Column::per_channel(param))
        .chain([Column::tied(param("base_weight"))])
        .collect();
    let baked = head_changed(&[term.effect], |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (20, 20);
        scene.params.set_rgb(term.params[0], [0.9, 0.6, 0.4]);
        scene.params.set(term.params[1], 0.07);
        scene.fit.free.clone_from(&columns);
    });
    let target = brighter(on_cpu(&baked));
    let observed =
        baked.with_scene(|scene| scene.views[0].target = Some(target)).sample().unwrap().observe().unwrap();
    agree(shared, &observed, &columns, "an added term");
}

/// The image is linear in each cube, so that a difference of any length is its slope.
#[test]
fn every_cube_that_a_lit_scene_looks_up_gets_the_slope_that_differences_show() {
    let Some(shared) = shared() else { return };
    let observed = head(SpecularModel::Kelemen);
    let (shade, inputs) = operation(shared, &observed.task(), &observed.start(), &[]);
    let image = numbers(shade.image(inputs.clone()).unwrap());
    // Any weights that do not repeat with the pixels.
    let weights: Vec<f32> = (0..image.len()).map(|i| ((7 * i % 23) as f32 - 9.0) / 11.0).collect();
    let tensor = |numbers: Vec<f32>, shape: [usize; 2]| {
        Tensor::<2>::from_data(TensorData::new(numbers, shape), shared.device())
    };
    let set = |inputs: &mut Inputs, input: Input, with: Tensor<2>| match input {
        Input::Irradiance => inputs.irradiance = with,
        Input::Reflected => inputs.reflected = with,
        _ => inputs.glossy = with,
    };
    for (input, texels) in [
        (Input::Irradiance, inputs.irradiance.clone()),
        (Input::Reflected, inputs.reflected.clone()),
        (Input::Glossy, inputs.glossy.clone()),
    ] {
        assert!(shade.reads(input), "{input:?}");
        let mut moved = inputs.clone();
        let shape = [texels.dims()[0], 4];
        let step: Vec<f32> = numbers(texels.clone())
            .iter()
            .enumerate()
            .map(|(i, x)| x * ((5 * i % 17) as f32 / 9.0 - 0.6))
            .collect();
        set(&mut moved, input, texels.clone() + tensor(step.clone(), shape));
        let stepped = numbers(shade.image(moved).unwrap());
        let want: f64 =
            (0..image.len()).map(|i| f64::from(weights[i]) * f64::from(stepped[i] - image[i])).sum();
        let mut tracked = inputs.clone();
        let free = texels.autodiff().require_grad();
        set(&mut tracked, input, free.clone());
        let loss = shade.image(tracked).unwrap() * tensor(weights.clone(), [shade.slots(), 4]).autodiff();
        let slopes = numbers(free.grad(&loss.sum().backward()).unwrap());
        let got: f64 =
            slopes.iter().zip(&step).map(|(slope, step)| f64::from(*slope) * f64::from(*step)).sum();
        // Differences of f32 images, each rounded to 1e-7 of values that the differences are parts of.
        let size: f64 = image.iter().map(|x| f64::from(x.abs())).sum();
        assert!((got - want).abs() <= 1e-3 * want.abs() + 1e-6 * size, "{input:?}: {got} {want}");
        // A hundred times what rounding may be.
        assert!(want.abs() > 1e-4 * size, "{input:?}: {want} of {size} moves too little to be seen");
    }
}

/// Light of a cube that a rule finds by itself.
const BACKLIGHT: &str = "\
// Light of the far side, looked up by its direction.
//
// effect: backlight, light of the far side
// parameter: backlight_weight = 0.5 in [0, inf), linear; weight of that light; these tests

// gives: backlight_found
// when: backlight
// cost: 44
// uses: cube, vector
// reads: irradiance_faces
fn backlight_from_faces(n: vec3f) -> vec3f {
    return sample_faces(irradiance_faces, irradiance_faces_size(), cube_place(-n)).rgb;
}

// gives: backlight_part
// adds: backlight
// when: backlight
// cost: 3
fn backlight_of_light(backlight_found: vec3f, backlight_weight: f32) -> vec3f {
    return backlight_weight * backlight_found;
}
";

#[test]
fn a_cube_that_a_rule_looks_up_at_a_place_of_its_own_is_refused_where_it_is_tracked_and_not_elsewhere() {
    let Some(shared) = shared() else { return };
    let term = register("backlight", BACKLIGHT).unwrap();
    let columns = vec![Column::tied(term.params[0])];
    let baked = head_changed(&[term.effect], |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (20, 20);
        scene.fit.free.clone_from(&columns);
    });
    let target = brighter(on_cpu(&baked));
    let observed =
        baked.with_scene(|scene| scene.views[0].target = Some(target)).sample().unwrap().observe().unwrap();
    agree(shared, &observed, &columns, "a cube looked up by direction");
    let (shade, inputs) = operation(shared, &observed.task(), &observed.start(), &[]);
    let irradiance = inputs.irradiance.clone().autodiff().require_grad();
    let error = shade.image(Inputs { irradiance, ..inputs }).unwrap_err().to_string();
    assert!(
        error.contains("`irradiance`") && error.contains("backlight_found") && error.contains("`_place`"),
        "{error}"
    );
}

/// E_s, and E_r where the specular map is black and where it is white, are other cubes wherever these constants are.
#[test]
fn constants_that_choose_cubes_move_functions_of_maps_as_they_move_the_processors_engine() {
    let Some(shared) = shared() else { return };
    for model in SpecularModel::ALL {
        let names = ["roughness", "gloss", "specular_lobe", "base_weight"];
        let free: Vec<Column> = names.map(|name| Column::tied(param(name))).to_vec();
        let baked = small_with(1, true, |scene| {
            let camera = &mut scene.views[0].camera;
            (camera.width, camera.height) = (32, 32);
            scene.effects = scene.effects.with(effect("fresnel"));
            scene.choices.specular_model = model;
            scene.params.set(param("gloss"), 0.4);
            scene.fit.free.clone_from(&free);
            scene.fit.maps.rounds = 2;
            scene.fit.maps.steps = 2;
            let prior = scene.fit.maps.prior(MapKind::Color);
            let none = MapPrior { smoothness: 0.0, closeness: 0.0, ..prior };
            scene.fit.maps.set_prior(MapKind::Color, none);
        });
        let target = brighter(on_cpu(&baked));
        let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
        let observed = baked.sample().unwrap().observe().unwrap();
        let (task, point) = (observed.task(), observed.start());
        let posed = observed.scene.mesh.pose();
        let maps = MapTask::new(&observed, &posed, task.views.to_vec(), vec![MapKind::Color]);
        let function = MapFunction::new(shared, maps).unwrap();
        let (got_loss, got) = function.loss_and_gradient(&point, vec![None]).unwrap();
        let (want_loss, want) = CpuEngine::new(task).unwrap().gradient(&point);
        assert!((got_loss - want_loss).abs() <= 1e-5 * want_loss, "{got_loss} {want_loss}");
        for ((name, got), want) in names.iter().zip(&got.constants).zip(want) {
            // As in `agree`.
            assert!(
                (got - want).abs() <= 1e-3 * want.abs() && want != 0.0,
                "{model:?}: {name}: {got} {want}"
            );
        }
        // A fit of maps takes these constants with it, from a place that the target is not of.
        let away = |point: &Point| {
            let mut params = point.params.clone();
            params.set(param("roughness"), 0.45);
            Point { params, ..point.clone() }
        };
        let maps = MapTask::new(&observed, &posed, observed.task().views.to_vec(), vec![MapKind::Color]);
        let start = away(&maps.start);
        let fitted = fit_maps(shared, MapTask { start, ..maps }, &mut |_| {}).unwrap();
        // Cubes and constants are the same for maps and for constants: each step begins where the last one ended.
        for pair in fitted.history.windows(2) {
            let (last, next) = (pair[0].after, pair[1].before);
            assert!((next - last).abs() <= 1e-3 * last, "{model:?}: {:?}", fitted.history);
        }
        let moved = fitted.constants.params.scalar(param("roughness")) - 0.45;
        assert!(moved.abs() > 1e-3 && fitted.history.len() > 2, "{moved} {:?}", fitted.history);
    }
}

#[test]
fn a_constant_that_acts_through_a_fitted_cube_or_a_cube_alone_is_refused_by_name() {
    let Some(shared) = shared() else { return };
    let lobe = Column::tied(Param::SpecularLobe);
    let baked = head_changed(&[Effect::SideSpecular], |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (20, 20);
        scene.fit.free = vec![lobe];
    });
    let target = brighter(on_cpu(&baked));
    let observed =
        baked.with_scene(|scene| scene.views[0].target = Some(target)).sample().unwrap().observe().unwrap();
    let (task, params) = (observed.task(), observed.start().params);
    let views: Vec<&ViewSamples> = task.views.iter().map(|view| &view.samples).collect();
    let shaded =
        Shaded { setup: task.setup, params: &params, columns: &[lobe], illumination: &task.illumination };
    let error = Shade::new(shared, &shaded, &views, Scatter::Exact).unwrap_err().to_string();
    assert!(error.contains("specular_lobe") && error.contains("cube"), "{error}");
    let posed = observed.scene.mesh.pose();
    let maps = MapTask::new(&observed, &posed, task.views.to_vec(), vec![MapKind::Environment]);
    let error = MapFunction::new(shared, maps).err().unwrap();
    assert!(matches!(error, MapError::Sharpness { param: "specular_lobe" }), "{error}");
    assert!(error.to_string().contains("the environment"), "{error}");
}
