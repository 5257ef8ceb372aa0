//! Fits of whole maps on the built-in scene: a map that was changed is found again from images.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use skinfit::bake::{Illumination, VertexOcclusion};
use skinfit::demo;
use skinfit::engine::Unknown;
use skinfit::engine::view::ObservedView;
use skinfit::maps::layer::{Layer, LayerParts};
use skinfit::maps::parts::Cut;
use skinfit::maps::problem::read;
use skinfit::maps::{FittedMaps, Grid, MapError, MapTask, fit_maps};
use skinfit::model::cube::Cube;
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::model::texture_filter::TextureFilter;
use skinfit::prepare::{Baked, Loaded, PrepareOptions};
use skinfit::render::shade::Shader;
use skinfit::samples::{LANES, TargetRows, ViewSamples};
use skinfit::scene::maps::Map;
use skinfit::scene::mesh::PosedMesh;
use skinfit::scene::view::{Target, View};
use skinfit::scene::{Loss, MapKind, MapPrior, MapSolver, Scene};
use skinfit::tensor::Input;
use skinfit::tensor::footprint::{texel_pairs, texels};

use super::bench::{matrix, shared};
use crate::plain::wrapped::mirrored;

/// Pixels along a side, and texels of the maps: a few samples see each.
const PIXELS: u32 = 96;
const TEXELS: usize = 48;

/// The built-in scene, small: its first view, and maps of a few texels.
fn small() -> Baked {
    small_of(1)
}

/// Of its first `views` views.
fn small_of(views: usize) -> Baked {
    small_with(views, false, |_| ())
}

/// The same, changed before anything is baked, which is for a `fit` of what is free where that is wanted.
pub(super) fn small_with(views: usize, fit: bool, change: impl FnOnce(&mut Scene)) -> Baked {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let scene = demo::kept_scene(&cache, Some(&cache)).unwrap();
    let options = PrepareOptions { cache: Some(cache), fit, ..PrepareOptions::default() };
    let mut loaded = Loaded::read(&scene, &options).unwrap();
    loaded.gains.truncate(views);
    let scene = &mut loaded.scene;
    scene.views.truncate(views);
    for View { camera, .. } in &mut scene.views {
        (camera.width, camera.height) = (PIXELS, PIXELS);
    }
    let maps = &mut scene.maps;
    maps.color = maps.color.as_ref().map(shrunk);
    maps.specular = maps.specular.as_ref().map(shrunk);
    maps.attenuator = maps.attenuator.as_ref().map(shrunk);
    scene.fit.loss = Loss::L2;
    scene.fit.maps.rounds = 1;
    scene.fit.maps.steps = 30;
    for kind in MapKind::ALL {
        // Next to nothing is held: what the images say is to be found.
        let prior = scene.fit.maps.prior(kind);
        scene.fit.maps.set_prior(kind, MapPrior { smoothness: 0.0, closeness: 1e-9, ..prior });
    }
    change(scene);
    loaded.bake().unwrap()
}

/// The scene with a colour map of `factor` times its radiance.
fn darkened(baked: Baked, factor: f32) -> Baked {
    baked.with_scene(|scene| darken(&mut scene.maps.color, factor))
}

fn darken<const C: usize>(map: &mut Option<Map<C>>, factor: f32) {
    map.as_mut().unwrap().texels.iter_mut().for_each(|texel| *texel = texel.map(|x| factor * x));
}

/// Means of squares of texels.
pub(super) fn shrunk<const C: usize>(map: &Map<C>) -> Map<C> {
    let step = map.width / TEXELS;
    let mean = |i: usize| {
        let (x, y) = (i % TEXELS * step, i / TEXELS * step);
        let texels = (0..step * step).map(|k| map.texels[(y + k / step) * map.width + x + k % step]);
        texels.fold([0.0; C], |sum, texel| std::array::from_fn(|c| sum[c] + texel[c] / (step * step) as f32))
    };
    Map { width: TEXELS, height: TEXELS, texels: (0..TEXELS * TEXELS).map(mean).collect() }
}

pub(super) fn sampled(baked: &Baked) -> Vec<ViewSamples> {
    baked.clone().sample().unwrap().samples
}

/// What the scene looks like as it is, to be met by the samples of another.
pub(super) fn targets(truth: &Baked) -> Vec<(View, Target)> {
    let shader = Shader::new(truth.setup(), &truth.illumination, &truth.scene.params).unwrap();
    let samples = sampled(truth);
    (truth.scene.views.iter().zip(&samples))
        .map(|(view, samples)| {
            let image = shader.shade(samples, &view.camera, 1.0).image;
            let alpha = Some(image.alpha);
            let target = Target { rgb: image.rgb, alpha, haze: None, mask: None, clipped_at: None };
            (view.clone(), target)
        })
        .collect()
}

pub(super) fn observed(changed: &Baked, targets: &[(View, Target)]) -> Vec<ObservedView> {
    (sampled(changed).into_iter().zip(targets))
        .map(|(samples, (view, target))| {
            let view = View { target: Some(target.clone()), ..view.clone() };
            let rows = TargetRows::new(&view, &samples).unwrap().unwrap();
            ObservedView { samples, target: rows.channels, weight: rows.weight, clip: rows.clip }
        })
        .collect()
}

/// The constants held, and the changed scene's maps fitted to images of the true one.
pub(super) fn fit(
    truth: &Baked,
    changed: &Baked,
    kind: MapKind,
    open: Option<Vec<f32>>,
) -> Result<FittedMaps, MapError> {
    let posed = changed.scene.mesh.pose();
    let mut task = task(changed, &posed, observed(changed, &targets(truth)), kind);
    task.open = open.or(task.open);
    fit_maps(shared().unwrap(), task, &mut |_| {})
}

/// The maps of `changed` to be fitted to what was observed, its constants held.
fn task<'a>(
    changed: &'a Baked,
    posed: &'a PosedMesh,
    observed: Vec<ObservedView>,
    kind: MapKind,
) -> MapTask<'a> {
    MapTask { unknowns: Vec::new(), ..MapTask::new(changed, posed, observed, vec![kind]) }
}

/// The root mean square of how far two scenes' samples differ in what `of` reads, by their shares of pixels.
pub(super) fn difference(a: &ViewSamples, b: &ViewSamples, of: fn(&ViewSamples, usize) -> [f32; 3]) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for slot in 0..a.records() * LANES {
        let share = f64::from(a.surface.weight(slot));
        let squares = of(a, slot).iter().zip(of(b, slot)).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        sum += share * squares;
        weight += share;
    }
    (sum / weight).sqrt()
}

pub(super) fn albedo(view: &ViewSamples, slot: usize) -> [f32; 3] {
    view.surface.fragment(slot).albedo
}

/// A change that no prior expects: waves over the map.
pub(super) fn wavy(texel: usize) -> f32 {
    1.0 + 0.25 * (0.9 * (texel % TEXELS) as f32).sin() * (0.7 * (texel / TEXELS) as f32).cos()
}

#[test]
fn a_changed_colour_map_is_found_again() {
    if shared().is_none() {
        return;
    }
    let truth = small();
    let changed = small().with_scene(|scene| {
        for (i, texel) in scene.maps.color.as_mut().unwrap().texels.iter_mut().enumerate() {
            *texel = texel.map(|x| (0.9 * x * wavy(i)).min(1.0));
        }
    });
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
fn textures_that_samples_see_filtered_are_refused() {
    if shared().is_none() {
        return;
    }
    for filter in [TextureFilter::Trilinear, TextureFilter::Anisotropic] {
        let filtered = || small().with_scene(|scene| scene.quality.texture_filter = filter);
        let error = fit(&filtered(), &filtered(), MapKind::Color, None).err().unwrap();
        assert!(matches!(error, MapError::Filtered { map: "color", .. }), "{error}");
        assert!(error.to_string().contains(filter.name()), "{error}");
        // What is no texture is read as ever.
        let occlusion = fit(&filtered(), &filtered(), MapKind::Occlusion, None);
        assert!(occlusion.is_ok(), "{:?}", occlusion.err());
    }
}

#[test]
fn textures_that_are_laid_out_anew_are_refused() {
    if shared().is_none() {
        return;
    }
    let layout = mirrored().maps.layout;
    let laid_out = || small().with_scene(|scene| scene.maps.layout = layout);
    let error = fit(&laid_out(), &laid_out(), MapKind::Color, None).err().unwrap();
    assert!(matches!(error, MapError::LaidOut { map: "color" }), "{error}");
    // What is no texture is fitted as ever.
    let occlusion = fit(&laid_out(), &laid_out(), MapKind::Occlusion, None);
    assert!(occlusion.is_ok(), "{:?}", occlusion.err());
}

#[test]
fn every_kind_of_map_explains_what_was_changed_in_it() {
    if shared().is_none() {
        return;
    }
    let truth = small();
    for kind in MapKind::ALL {
        let (baked, mut open) = (small(), None);
        let changed = match kind {
            MapKind::Color => darkened(baked, 0.8),
            MapKind::Specular => baked.with_scene(|scene| darken(&mut scene.maps.specular, 0.6)),
            MapKind::Attenuator => baked.with_scene(|scene| darken(&mut scene.maps.attenuator, 0.6)),
            MapKind::Occlusion => {
                let mut occlusion = VertexOcclusion::clone(baked.occlusion.as_ref().unwrap());
                occlusion.base.iter_mut().for_each(|o| *o *= 0.8);
                let weights: Vec<f32> = baked.scene.mesh.morphs.iter().map(|morph| morph.weight).collect();
                open = Some(occlusion.posed(&weights));
                Baked { occlusion: Some(Arc::new(occlusion)), ..baked }
            }
            MapKind::Environment => {
                let dim = |cube: &Cube<f32>| cube.map(|texel| texel.map(|x| 0.8 * x));
                let light = Illumination {
                    irradiance: baked.illumination.irradiance.as_ref().map(dim),
                    hilite: baked.illumination.hilite.as_ref().map(dim),
                    lobes: baked.illumination.lobes.clone(),
                    reflected: None,
                };
                Baked { illumination: Arc::new(light), ..baked }
            }
        };
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
    let (truth, changed) = (small(), darkened(small(), 0.9));
    let by_cg = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let changed = changed.with_scene(|scene| {
        scene.fit.maps.solver = MapSolver::Adam;
        scene.fit.maps.steps = 200;
    });
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
    let (truth, changed) = (small(), darkened(small(), 0.5));
    let prior = changed.scene.fit.maps.prior(MapKind::Color);
    let with_prior =
        |baked: Baked, prior| baked.with_scene(|scene| scene.fit.maps.set_prior(MapKind::Color, prior));
    let changed = with_prior(changed, MapPrior { upper: 0.25, ..prior });
    let fitted = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let now = read(fitted.layers[0].value.clone()).unwrap();
    assert!(now.iter().all(|x| (0.0..=0.25).contains(x)));
    assert!(now.iter().filter(|&&x| x == 0.25).count() > 100, "the bound is not met");
    let changed = with_prior(changed, MapPrior { closeness: 1e6, ..prior });
    let held = fit(&truth, &changed, MapKind::Color, None).unwrap();
    let (then, now) =
        (read(held.layers[0].start.clone()).unwrap(), read(held.layers[0].value.clone()).unwrap());
    // The images pull with less than 1e-6 of the prior's weight.
    assert!(then.iter().zip(&now).all(|(a, b)| (a - b).abs() < 1e-5));
}

/// Two views of a scene whose colour map is darker than in the targets.
fn darker() -> (Baked, Vec<(View, Target)>) {
    let truth = small_of(2);
    let changed = darkened(small_of(2), 0.9).with_scene(|scene| {
        scene.fit.maps.rounds = 2;
        scene.fit.maps.steps = 3;
    });
    let targets = targets(&truth);
    (changed, targets)
}

fn values(found: &FittedMaps) -> Vec<f32> {
    found.layers.iter().flat_map(|layer| read(layer.value.clone()).unwrap()).collect()
}

#[test]
fn a_view_that_is_held_out_counts_nothing_for_maps_and_constants() {
    let Some(shared) = shared() else { return };
    let (changed, targets) = darker();
    let posed = changed.scene.mesh.pose();
    let mut other = targets.clone();
    other[1].1.rgb.iter_mut().for_each(|rgb| *rgb = [rgb[1] + 0.1, 0.5 * rgb[2], 0.3]);
    let free = [Param::BaseWeight, Param::Hilite, Param::RimExponent];
    let unknowns = free.map(|param| Unknown::Param(Column::tied(param))).to_vec();
    let fit = |targets: &[(View, Target)], held_out| {
        let unknowns = unknowns.clone();
        let task = task(&changed, &posed, observed(&changed, targets), MapKind::Color);
        fit_maps(shared, MapTask { held_out, unknowns, ..task }, &mut |_| {}).unwrap()
    };
    let [as_it_is, as_another] = [&targets, &other].map(|targets| fit(targets, Some(1)));
    let apart = |a: &FittedMaps, b: &FittedMaps| {
        let texels = values(a).iter().zip(values(b)).fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
        let constant = |unknown: &Unknown| (unknown.get(&a.constants) - unknown.get(&b.constants)).abs();
        (texels, unknowns.iter().map(constant).fold(0.0, f64::max))
    };
    // burn adds a tensor up in an order that is not always the same; some steps later that is a few roundings.
    let (texels, constant) = apart(&as_it_is, &as_another);
    assert!(texels < 1e-4 && constant < 1e-4, "{texels} {constant}");
    // Where the view counts, both are moved by far more.
    let (texels, constant) = apart(&as_it_is, &fit(&other, None));
    assert!(texels > 0.05 && constant > 0.01, "{texels} {constant}");
}

#[test]
fn samples_in_parts_give_the_same_maps() {
    let Some(shared) = shared() else { return };
    let (changed, targets) = darker();
    let posed = changed.scene.mesh.pose();
    for kind in [MapKind::Color, MapKind::Occlusion, MapKind::Environment] {
        let fit = |most_samples| {
            let task = task(&changed, &posed, observed(&changed, &targets), kind);
            fit_maps(shared, MapTask { most_samples, ..task }, &mut |_| {}).unwrap()
        };
        // A view has some twenty thousand samples.
        let (whole, parts) = (fit(None), fit(Some(7_000)));
        assert!(parts.layers[0].footprints.len() > 4);
        let first = whole.history[0].before;
        for (a, b) in whole.history.iter().zip(&parts.history) {
            // A few roundings of sums of f32, of the size that the loss begins with.
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * first;
            assert!(a.what == b.what && near(a.before, b.before) && near(a.after, b.after), "{a:?} {b:?}");
        }
        assert!(whole.history[0].after < 0.5 * whole.history[0].before, "{:?}", whole.history[0]);
    }
}

#[test]
fn an_interrupted_fit_leaves_what_its_steps_have_found() {
    let Some(shared) = shared() else { return };
    let (changed, targets) = darker();
    let posed = changed.scene.mesh.pose();
    let flag = Arc::new(AtomicBool::new(false));
    let task = task(&changed, &posed, observed(&changed, &targets), MapKind::Color);
    let task =
        MapTask { kinds: vec![MapKind::Color, MapKind::Specular], interrupt: Some(flag.clone()), ..task };
    let found = fit_maps(shared, task, &mut |_| flag.store(true, Ordering::SeqCst)).unwrap();
    assert!(found.interrupted);
    let steps: Vec<_> = found.history.iter().map(|step| step.what).collect();
    assert_eq!(steps, ["color"]);
    let [color, specular] = [0, 1].map(|layer| {
        let layer = &found.layers[layer];
        read(layer.start.clone()).unwrap() != read(layer.value.clone()).unwrap()
    });
    assert!(color && !specular);
    // The samples show the map as it is.
    let before = &sampled(&changed)[0];
    assert!(difference(before, &found.observed[0].samples, albedo) > 1e-3);
}

#[test]
fn the_priors_are_the_weighted_means_of_squares() {
    let Some(shared) = shared() else { return };
    // Three texels in a row, of one channel and of three: two pairs of neighbours.
    for channels in [1, 3] {
        let (start, value) = ([0.2, 0.5, 0.9], [0.5, 0.4, 0.9]);
        let change: [f64; 3] = [0.3, -0.1, 0.0];
        let spread = |x: [f64; 3]| -> Vec<f64> { x.iter().flat_map(|&x| vec![x; channels]).collect() };
        let input = if channels == 1 { Input::Specular } else { Input::Albedo };
        for (smoothness, closeness) in [(0.7, 0.0), (0.0, 0.3), (0.7, 0.3)] {
            let parts = LayerParts {
                name: "row",
                input,
                grid: Grid::Texels { width: 3, height: 1 },
                footprint: texels(3, 1, []),
                in_atlas: None,
                pairs: texel_pairs(3, 1),
                start: spread(start).into_iter().map(|x| x as f32).collect(),
                prior: MapPrior { smoothness, closeness, lower: 0.0, upper: 1.0 },
            };
            let layer = Layer::new(shared, parts, &[Cut::default()]).unwrap();
            let found = layer.penalty(matrix(&spread(value), channels, shared.device())).unwrap();
            let rough = ((change[0] - change[1]).powi(2) + (change[1] - change[2]).powi(2)) / 2.0;
            let close = change.iter().map(|d| d * d).sum::<f64>() / 3.0;
            let wanted = smoothness * rough + closeness * close;
            // A handful of roundings of f32.
            assert!(
                (f64::from(read(found).unwrap()[0]) / wanted - 1.0).abs() < 1e-5,
                "{channels} {smoothness}"
            );
        }
    }
}

#[test]
fn a_mesh_whose_texture_coordinates_are_all_the_same_has_no_texels_to_fit() {
    let Some(shared) = shared() else { return };
    let (changed, targets) = darker();
    let mut posed = changed.scene.mesh.pose();
    posed.uvs.iter_mut().for_each(|uv| *uv = glam::Vec2::ZERO);
    let task = task(&changed, &posed, observed(&changed, &targets), MapKind::Color);
    let Err(error) = fit_maps(shared, task, &mut |_| {}) else { panic!("it was fitted") };
    assert!(error.to_string().contains("no texture coordinates"), "{error}");
}

#[test]
fn a_map_that_nothing_reads_is_refused() {
    if shared().is_none() {
        return;
    }
    let without = |scene: &mut Scene| scene.effects = scene.effects.without(Effect::SideSpecular);
    let (truth, changed) = (small().with_scene(without), small().with_scene(without));
    let Err(error) = fit(&truth, &changed, MapKind::Specular, None) else { panic!("it was fitted") };
    assert!(error.to_string().contains("side_specular"), "{error}");
}
