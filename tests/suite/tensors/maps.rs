//! Fits of whole maps on the built-in scene: a map that was changed is found again from images.

use std::path::Path;

use skinfit::demo;
use skinfit::engine::view::ObservedView;
use skinfit::maps::problem::read;
use skinfit::maps::{FittedMaps, MapError, MapTask, fit_maps};
use skinfit::model::effects::Effect;
use skinfit::prepare::{PrepareOptions, Prepared, Views};
use skinfit::render::shade::Shader;
use skinfit::samples::{LANES, TargetRows, ViewSamples, sample_views};
use skinfit::scene::maps::Map;
use skinfit::scene::view::{Target, View};
use skinfit::scene::{Loss, MapKind, MapPrior, MapSolver};

use super::bench::shared;

/// Pixels along a side, and texels of the maps: a few samples see each.
const PIXELS: u32 = 96;
const TEXELS: usize = 48;

/// The built-in scene, small: its first view, and maps of a few texels.
fn small() -> Prepared {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let scene = demo::kept_scene(&cache, Some(&cache)).unwrap();
    let options = PrepareOptions { views: Views::First, cache: Some(cache), ..PrepareOptions::default() };
    let mut prepared = Prepared::baked(&scene, &options).unwrap();
    let camera = &mut prepared.scene.views[0].camera;
    (camera.width, camera.height) = (PIXELS, PIXELS);
    let maps = &mut prepared.scene.maps;
    maps.color = maps.color.as_ref().map(shrunk);
    maps.specular = maps.specular.as_ref().map(shrunk);
    maps.attenuator = maps.attenuator.as_ref().map(shrunk);
    prepared.scene.fit.loss = Loss::L2;
    prepared.scene.fit.maps.rounds = 1;
    prepared.scene.fit.maps.steps = 30;
    for kind in MapKind::ALL {
        // Next to nothing is held: what the images say is to be found.
        let prior = prepared.scene.fit.maps.prior(kind);
        prepared.scene.fit.maps.set_prior(kind, MapPrior { smoothness: 0.0, closeness: 1e-9, ..prior });
    }
    prepared
}

/// Means of squares of texels.
fn shrunk<const C: usize>(map: &Map<C>) -> Map<C> {
    let step = map.width / TEXELS;
    let mean = |i: usize| {
        let (x, y) = (i % TEXELS * step, i / TEXELS * step);
        let texels = (0..step * step).map(|k| map.texels[(y + k / step) * map.width + x + k % step]);
        texels.fold([0.0; C], |sum, texel| std::array::from_fn(|c| sum[c] + texel[c] / (step * step) as f32))
    };
    Map { width: TEXELS, height: TEXELS, texels: (0..TEXELS * TEXELS).map(mean).collect() }
}

fn sampled(prepared: &Prepared) -> Vec<ViewSamples> {
    sample_views(&prepared.scene, &prepared.scene.mesh.pose(), prepared.occlusion.as_ref()).unwrap()
}

/// What the scene looks like as it is, to be met by the samples of another.
fn targets(truth: &Prepared) -> Vec<(View, Target)> {
    let shader = Shader::new(truth.setup(), &truth.illumination, &truth.scene.params);
    let samples = sampled(truth);
    (truth.scene.views.iter().zip(&samples))
        .map(|(view, samples)| {
            let image = shader.shade(samples, &view.camera, 1.0).image;
            let target = Target { rgb: image.rgb, alpha: Some(image.alpha), mask: None, clipped_at: None };
            (view.clone(), target)
        })
        .collect()
}

fn observed(changed: &Prepared, targets: &[(View, Target)]) -> Vec<ObservedView> {
    (sampled(changed).into_iter().zip(targets))
        .map(|(samples, (view, target))| {
            let view = View { target: Some(target.clone()), ..view.clone() };
            let rows = TargetRows::new(&view, &samples).unwrap().unwrap();
            ObservedView { samples, target: rows.rgb, weight: rows.weight, clip: rows.clip }
        })
        .collect()
}

/// The constants held, and the changed scene's maps fitted to images of the true one.
fn fit(
    truth: &Prepared,
    changed: &Prepared,
    kind: MapKind,
    open: Option<Vec<f32>>,
) -> Result<FittedMaps, MapError> {
    let observed = observed(changed, &targets(truth));
    let posed = changed.scene.mesh.pose();
    let weights: Vec<f32> = changed.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
    let task = MapTask {
        scene: &changed.scene,
        posed: &posed,
        illumination: changed.illumination.clone(),
        open: open.or_else(|| changed.occlusion.as_ref().map(|occlusion| occlusion.posed(&weights))),
        observed,
        held_out: None,
        kinds: vec![kind],
        start: changed.start(),
        unknowns: Vec::new(),
    };
    fit_maps(shared().unwrap(), task, &mut |_| {})
}

/// The root mean square of how far two scenes' samples differ in what `of` reads, by their shares of pixels.
fn difference(a: &ViewSamples, b: &ViewSamples, of: fn(&ViewSamples, usize) -> [f32; 3]) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for slot in 0..a.records() * LANES {
        let share = f64::from(a.surface.weight(slot));
        let squares = of(a, slot).iter().zip(of(b, slot)).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        sum += share * squares;
        weight += share;
    }
    (sum / weight).sqrt()
}

fn albedo(view: &ViewSamples, slot: usize) -> [f32; 3] {
    view.surface.fragment(slot).albedo
}

/// A change that no prior expects: waves over the map.
fn wavy(texel: usize) -> f32 {
    1.0 + 0.25 * (0.9 * (texel % TEXELS) as f32).sin() * (0.7 * (texel / TEXELS) as f32).cos()
}

#[test]
fn a_changed_colour_map_is_found_again() {
    if shared().is_none() {
        return;
    }
    let (truth, mut changed) = (small(), small());
    let map = changed.scene.maps.color.as_mut().unwrap();
    for (i, texel) in map.texels.iter_mut().enumerate() {
        *texel = texel.map(|x| (0.9 * x * wavy(i)).min(1.0));
    }
    let (seen, start) = (sampled(&truth).remove(0), sampled(&changed).remove(0));
    let fitted = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let before = difference(&seen, &start, albedo);
    let after = difference(&seen, &fitted.observed[0].samples, albedo);
    // Thirty steps of conjugate gradients; texels that are seen by a corner of a sample alone come last.
    assert!(before > 0.03 && after < 0.1 * before, "{before} -> {after}");
    let step = &fitted.history[0];
    assert!(step.after < 1e-3 * step.before, "{step:?}");
    // What no sample sees stays where it was: nothing but the start speaks for it.
    let layer = &fitted.layers[0];
    let (then, now) = (read(layer.start.clone()).unwrap(), read(layer.value.clone()).unwrap());
    let unseen = then.iter().zip(&now).filter(|(a, b)| a == b).count();
    assert!(unseen > then.len() / 4, "{unseen} of {}", then.len());
    assert!(now.iter().all(|x| (0.0..=1.0).contains(x)));
}

#[test]
fn every_kind_of_map_explains_what_was_changed_in_it() {
    if shared().is_none() {
        return;
    }
    let truth = small();
    for kind in MapKind::ALL {
        let mut changed = small();
        let mut open = None;
        match kind {
            MapKind::Color => changed
                .scene
                .maps
                .color
                .as_mut()
                .unwrap()
                .texels
                .iter_mut()
                .for_each(|t| *t = t.map(|x| 0.8 * x)),
            MapKind::Specular => {
                changed.scene.maps.specular.as_mut().unwrap().texels.iter_mut().for_each(|t| t[0] *= 0.6);
            }
            MapKind::Attenuator => {
                changed.scene.maps.attenuator.as_mut().unwrap().texels.iter_mut().for_each(|t| t[0] *= 0.6);
            }
            MapKind::Occlusion => {
                let base = &mut changed.occlusion.as_mut().unwrap().base;
                base.iter_mut().for_each(|o| *o *= 0.8);
                let weights: Vec<f32> = changed.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
                open = changed.occlusion.as_ref().map(|occlusion| occlusion.posed(&weights));
            }
            MapKind::Environment => {
                let dim = |cube: &skinfit::model::cube::Cube<f32>| cube.map(|texel| texel.map(|x| 0.8 * x));
                let light = &mut changed.illumination;
                light.irradiance = light.irradiance.as_ref().map(dim);
                light.hilite = light.hilite.as_ref().map(dim);
            }
        }
        let fitted = fit(&truth, &changed, kind, open).unwrap();
        let (first, last) =
            (fitted.history[0].before, fitted.history.iter().rfind(|s| s.what != "constants").unwrap().after);
        // A tenth of the light is moved by some of them, a hundredth by others: all of it comes back but for what the
        // bounds and thirty steps leave.
        assert!(last < 0.02 * first, "{}: {first} -> {last}", kind.name());
        let names: Vec<&str> = fitted.layers.iter().map(|layer| layer.name).collect();
        let cubes = ["irradiance", "lobe", "hilite"];
        assert_eq!(names, if kind == MapKind::Environment { cubes.to_vec() } else { vec![kind.name()] });
    }
}

#[test]
fn conjugate_gradients_and_adam_go_to_the_same_place() {
    if shared().is_none() {
        return;
    }
    let (truth, mut changed) = (small(), small());
    changed.scene.maps.color.as_mut().unwrap().texels.iter_mut().for_each(|t| *t = t.map(|x| 0.9 * x));
    let by_cg = fit(&truth, &changed, MapKind::Color, None).unwrap();
    changed.scene.fit.maps.solver = MapSolver::Adam;
    changed.scene.fit.maps.steps = 200;
    let by_adam = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let apart = difference(&by_cg.observed[0].samples, &by_adam.observed[0].samples, albedo);
    let moved = difference(&by_cg.observed[0].samples, &sampled(&changed)[0], albedo);
    // Adam's last steps are as long as its rate.
    assert!(apart < 0.2 * moved, "{apart} of {moved}");
}

#[test]
fn bounds_and_priors_hold() {
    if shared().is_none() {
        return;
    }
    let (truth, mut changed) = (small(), small());
    changed.scene.maps.color.as_mut().unwrap().texels.iter_mut().for_each(|t| *t = t.map(|x| 0.5 * x));
    let prior = changed.scene.fit.maps.prior(MapKind::Color);
    changed.scene.fit.maps.set_prior(MapKind::Color, MapPrior { upper: 0.25, ..prior });
    let fitted = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let now = read(fitted.layers[0].value.clone()).unwrap();
    assert!(now.iter().all(|x| (0.0..=0.25).contains(x)));
    assert!(now.iter().filter(|&&x| x == 0.25).count() > 100, "the bound is not met");
    changed.scene.fit.maps.set_prior(MapKind::Color, MapPrior { closeness: 1e6, ..prior });
    let held = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let (then, now) =
        (read(held.layers[0].start.clone()).unwrap(), read(held.layers[0].value.clone()).unwrap());
    // The images pull with less than 1e-6 of the prior's weight.
    assert!(then.iter().zip(&now).all(|(a, b)| (a - b).abs() < 1e-5));
}

#[test]
fn a_map_that_nothing_reads_is_refused() {
    if shared().is_none() {
        return;
    }
    let (truth, mut changed) = (small(), small());
    changed.scene.effects = changed.scene.effects.without(Effect::SideSpecular);
    let truth =
        Prepared { scene: skinfit::scene::Scene { effects: changed.scene.effects, ..truth.scene }, ..truth };
    let Err(error) = fit(&truth, &changed, MapKind::Specular, None) else { panic!("it was fitted") };
    assert!(error.to_string().contains("side_specular"), "{error}");
}
