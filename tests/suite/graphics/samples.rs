//! Samples that the adapter makes, beside the CPU's.
//!
//! Both take the image's samples at the same places and group them alike. The CPU's rays hit triangles in f64; the
//! rasteriser snaps corners to a part of a sample and interpolates in f32.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use skinfit::engine::gpu::{DeviceSampleError, DeviceSamples, GpuEngine, Memory};
use skinfit::engine::reference::Reference;
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::gpu::{Choice, Gpu, GpuError};
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::samples::rows::Rows;
use skinfit::samples::surface_records::Unmade;
use skinfit::samples::{LANES, SampleError, ViewSamples};

use super::bench::*;
use super::parity::{pose, turn};
use crate::engine::{assert_equal, names};

/// Pixels along a side.
const SIZE: u32 = 96;

/// How far 99 of 100 samples' numbers may be off, and the median of all.
#[derive(Clone, Copy)]
struct Tolerance {
    median: f32,
    most: f32,
}

/// On a software adapter: the places of hits differ by roundings of f32, some 1e-7 of the image.
const fn software(field: &str) -> Tolerance {
    match field.as_bytes() {
        // A unit vector in f32, a few roundings of 6e-8 each; interpolated ones come from vertices that have as many.
        b"view" => Tolerance { median: 2e-7, most: 1e-6 },
        // The sum of three squares, each with the slope 2 of a square and with a share of its own.
        b"interpolated rim" => Tolerance { median: 5e-6, most: 2e-4 },
        // Frames turn by up to a radian from vertex to vertex, and a triangle is a sample or two: what is 1e-7 of the
        // image is 1e-5 of a triangle. Maps change by all their contrast from texel to texel, which are as small.
        _ => Tolerance { median: 5e-6, most: 5e-5 },
    }
}

/// On hardware: corners are snapped to 1/256 of a sample, so surfaces are read that far from where the ray hits.
const fn hardware(field: &str) -> Tolerance {
    match field.as_bytes() {
        // 1/256 of the angle between samples, 0.5 / 200 of a radian.
        b"view" => Tolerance { median: 1e-5, most: 1e-4 },
        // 1/256 of what changes from sample to sample: here up to all of the contrast.
        _ => Tolerance { median: 2e-3, most: 2e-2 },
    }
}

/// The share of samples that may lie on a neighbouring triangle, at a crease or where one part hides another: there
/// the nearest of two surfaces is a matter of rounding.
const CREASES: f64 = 0.003;
/// What is more than that off is such a sample.
const ANOTHER_TRIANGLE: f32 = 5e-2;

/// The share of outline pixels of which another number of samples may be covered: an outline passes within 1/256 of
/// a sample's place for one in a hundred.
const UNCOVERED: f64 = 0.03;

/// The slots of a view's samples by the pixel that they are of, in the order of its samples.
fn by_pixel(samples: &ViewSamples) -> BTreeMap<u32, Vec<usize>> {
    let mut pixels: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for group in 0..samples.groups() {
        let records = samples.group_start[group] as usize..samples.group_start[group + 1] as usize;
        for slot in records.flat_map(|record| record * LANES..(record + 1) * LANES) {
            let pixel = samples.pixel[group * LANES + slot % LANES];
            if pixel != u32::MAX && samples.surface.weight(slot) > 0.0 {
                pixels.entry(pixel).or_default().push(slot);
            }
        }
    }
    pixels
}

/// The first view's samples as the CPU makes them.
fn traced(baked: &Baked) -> ViewSamples {
    baked.clone().sample().unwrap().samples.remove(0)
}

/// And as the adapter does.
fn drawn(gpu: &Gpu, baked: &Baked) -> ViewSamples {
    let (made, groups) = DeviceSamples::new(gpu, Content::of(baked)).unwrap();
    let mut samples = groups.into_iter().next().unwrap();
    samples.surface = made.read(0, &samples).unwrap();
    assert_eq!(made.count(), samples.count());
    samples
}

/// What a sample's corners make of the rim: where a sample lies on a neighbouring triangle, its corners are others, and
/// this is nearly the same.
fn squared_rim(samples: &ViewSamples, slot: usize) -> f32 {
    let Unmade { corner_silhouettes, corner_shares, .. } = samples.surface.unmade(slot);
    corner_silhouettes.iter().zip(corner_shares).map(|(z, share)| share * z * z).sum()
}

fn compare(name: &str, gpu: &Gpu, baked: &Baked) {
    let (want, got) = (traced(baked), drawn(gpu, baked));
    assert_eq!(got.surface.places(), want.surface.places(), "{name}");
    let (ours, want_pixels) = (by_pixel(&got), by_pixel(&want));
    let full = baked.scene.quality.samples_per_axis.pow(2) as usize;
    let width = baked.scene.views[0].camera.width;
    // Pixels are on the outline where a sample of theirs or a neighbour shows no mesh.
    let beside = |pixel: u32| [pixel + 1, pixel.wrapping_sub(1), pixel + width, pixel.wrapping_sub(width)];
    let (mut outline, mut uncovered) =
        (0, ours.keys().filter(|pixel| !want_pixels.contains_key(pixel)).count());
    let mut pairs = Vec::new();
    for (pixel, theirs) in &want_pixels {
        let ours = ours.get(pixel).map_or(&[][..], Vec::as_slice);
        let open = theirs.len() < full || beside(*pixel).iter().any(|other| !want_pixels.contains_key(other));
        outline += usize::from(open);
        if ours.len() == theirs.len() {
            pairs.extend(ours.iter().copied().zip(theirs.iter().copied()));
        } else {
            uncovered += 1;
        }
    }
    println!("{name}: {} samples, {outline} outline pixels, {uncovered} covered otherwise", pairs.len());
    assert!(pairs.len() > 3000, "{name}");
    assert!(uncovered as f64 <= UNCOVERED * outline as f64, "{name}: {uncovered} of {outline}");
    for &(i, j) in &pairs {
        assert_eq!(got.surface.weight(i), want.surface.weight(j), "{name}");
    }
    let corners = |field: &str| field.starts_with("corner_");
    let places = want.surface.places();
    let rim = places.corner_shares.map(|_| ("interpolated rim", 0, 0));
    for (field, row, size) in places.fields().filter(|(field, ..)| !corners(field)).chain(rim) {
        let (ours, theirs) = (got.surface.rows(), want.surface.rows());
        let off = |&(i, j): &(usize, usize)| {
            let off = |row: usize| (ours.number(row, i) - theirs.number(row, j)).abs();
            let of_corners = || (squared_rim(&got, i) - squared_rim(&want, j)).abs();
            if size == 0 { of_corners() } else { (row..row + size).map(off).fold(0.0, f32::max) }
        };
        let mut errors: Vec<f32> = pairs.iter().map(off).collect();
        assert!(errors.iter().all(|error| error.is_finite()), "{name}: {field}");
        errors.sort_by(f32::total_cmp);
        let Tolerance { median, most } = if gpu.is_software() { software(field) } else { hardware(field) };
        let figures = [
            ("median", quantile(&errors, 0.5), median),
            ("99 %", quantile(&errors, 0.99), most),
            ("all but those at creases", quantile(&errors, 1.0 - CREASES), ANOTHER_TRIANGLE),
        ];
        println!("  {field}: {figures:?}, greatest {:?}", errors.last());
        for (what, found, most) in figures {
            assert!(found <= most, "{name}: {field}: {what}: {found} > {most}");
        }
    }
}

/// The built-in head, moved by its morph targets and bones.
fn moved(form: Form, silhouette: Silhouette) -> Baked {
    read_as(baked(&built_in(), everything(), SIZE), form, silhouette).with_scene(pose).with_scene(turn)
}

#[test]
fn every_field_holds_what_the_rays_hit() {
    let Some(gpu) = gpu() else { return };
    for (form, silhouette) in [
        (Form::Corrected, Silhouette::Fragment),
        (Form::Corrected, Silhouette::Bumped),
        (Form::Listing, Silhouette::Vertex),
    ] {
        compare(&format!("{} {}", form.name(), silhouette.name()), gpu, &moved(form, silhouette));
    }
    // Two normals, and a normal for the dapple in its place.
    let other = moved(Form::Corrected, Silhouette::Fragment).with_scene(|scene| {
        scene.lookups = Lookups::Smooth;
        scene.dapple = Dapple::new([0.48, -0.36, 0.8], 30.0, false);
        scene.fit.free.push(Column::tied(Param::EnvironmentRotation));
    });
    compare("smooth lookups, a dapple that turns", gpu, &other);
    let still = baked(&built_in(), SURFACE, SIZE);
    compare("still", gpu, &still);
    let single = still.with_scene(|scene| scene.quality.samples_per_axis = 1);
    compare("one sample a pixel", gpu, &single);
    // Without a normal map, the base is the whole normal: unit, or as interpolated.
    for form in Form::ALL {
        let plain =
            read_as(baked(&built_in(), Effects::of(&[Effect::Diffuse]), SIZE), form, Silhouette::Fragment);
        compare(&format!("diffuse alone, {}", form.name()), gpu, &plain);
    }
}

#[test]
fn shared_scenes_hold_what_the_rays_hit() {
    let (Some(gpu), Some(folder)) = (gpu(), crate::common::data()) else { return };
    compare("lps_forest", gpu, &baked(&folder.join("lps_forest/scene.toml"), everything(), SIZE));
}

#[test]
fn what_is_beyond_a_texture_is_drawn_in_tiles() {
    // 192 samples a side in tiles of 74: neither words nor groups end where tiles do.
    let Some(gpu) = open(&Choice { max_side: Some(75), ..Choice::default() }) else { return };
    let baked = baked(&built_in(), SURFACE, SIZE);
    // Maps that such a device takes.
    let baked = baked.with_scene(|scene| scene.maps = Default::default());
    let baked = Baked { illumination: Arc::default(), ..baked };
    compare("tiles", &gpu, &baked);
}

/// The views of a scene with the targets of the CPU's samples at other parameters.
fn observed(baked: &Baked, groups: Vec<ViewSamples>) -> Vec<ObservedView> {
    let view = |samples: ViewSamples| {
        let mut target = Rows::new(3, samples.groups());
        for (row, slot) in (0..3).flat_map(|row| (0..LANES * samples.groups()).map(move |slot| (row, slot))) {
            target.record_mut(slot / LANES)[row][slot % LANES] =
                0.2 + 0.1 * ((slot * 7 + row * 3) % 5) as f32;
        }
        ObservedView { samples, target, ..ObservedView::default() }
    };
    assert_eq!(groups.len(), baked.scene.views.len());
    groups.into_iter().map(view).collect()
}

#[test]
fn passes_over_them_equal_the_plain_model_in_parts_and_when_terms_are_kept() {
    let Some(gpu) = gpu() else { return };
    let baked = moved(Form::Corrected, Silhouette::Fragment);
    let (made, groups) = DeviceSamples::new(gpu, Content::of(&baked)).unwrap();
    let made = Arc::new(made);
    let views = observed(&baked, groups);
    let mut read = views.clone();
    read[0].samples.surface = made.read(0, &views[0].samples).unwrap();
    let loss = skinfit::scene::Loss::L2;
    let columns = |params: &[Param]| -> Vec<Unknown> {
        params.iter().map(|&param| Unknown::Param(Column::tied(param))).collect()
    };
    // With terms kept, a strength that changes has the samples made anew.
    let kept = columns(&[Param::BaseWeight, Param::RimExponent, Param::Hilite]);
    let live = columns(&[Param::BaseWeight, Param::NormalStrength]);
    let bytes = 4 * LANES as u64 * read[0].samples.surface.rows().all().len() as u64;
    for (unknowns, part) in [(&kept, None), (&kept, Some(bytes / 3)), (&live, Some(bytes / 3))] {
        let mut point = baked.start();
        let task = Task { loss, unknowns: unknowns.clone(), ..baked.task_over(&*views) };
        let memory = Memory { part, resident: None };
        let engine = GpuEngine::over_device_samples(Arc::clone(&made), task, &point, memory).unwrap();
        let plain = Reference::new(baked.setup(), &baked.illumination, &read, loss, unknowns).unwrap();
        for strength in [1.4, 0.6] {
            point.params.set(Param::NormalStrength, strength);
            let what = format!("{part:?} {strength}");
            let (got, want) = (engine.normal_equations(&point), plain.normal_equations(&point));
            assert_equal(&got, &want, &names(unknowns), &what);
        }
        let times = engine.shade_times(&point, 3).unwrap();
        assert_eq!(times.len(), if gpu.timestamps() || gpu.is_software() { 3 } else { 0 });
        assert!(times.iter().all(|&milliseconds| milliseconds > 0.0), "{times:?}");
    }
}

/// Fit a scene over both kinds of samples; parameters may differ by that share of their value.
fn fit_both_ways(gpu: &Gpu, scene: &Path, share: f64) {
    let options = PrepareOptions { fit: true, cache: Some(cache()), ..PrepareOptions::default() };
    let baked = Baked::new(scene, &options).unwrap().keep_targets().unwrap();
    let (made, groups) = DeviceSamples::new(gpu, Content::of(&baked)).unwrap();
    let (made, drawn) = (Arc::new(made), baked.clone().observe(groups).unwrap());
    let traced = baked.sample().unwrap().observe().unwrap();
    let start: Point = traced.start();
    let ours = GpuEngine::over_device_samples(made, drawn.task(), &start, Memory::default()).unwrap();
    let theirs = GpuEngine::new(gpu, traced.task(), &start, Memory::default()).unwrap();
    let [ours, theirs] =
        [&ours, &theirs].map(|engine| fit(engine, &start, &FitOptions::default(), &mut |_| {}).unwrap());
    let what = scene.display();
    println!("{what}: loss {} {} from {}", ours.loss_end, theirs.loss_end, theirs.loss_start);
    // Where one part of the mesh hides another, a sample in some thousands sees the one instead of the other: a
    // quarter of a pixel that is off by a third of its radiance, in a pixel of a thousand, are 1e-5 of the squares.
    // That is all the loss that is left of targets without noise.
    let off = (ours.loss_end - theirs.loss_end).abs();
    assert!(off <= 1e-4 * theirs.loss_end + 3e-5 * theirs.loss_start, "{what}");
    for (a, b) in ours.unknowns.iter().zip(&theirs.unknowns).filter(|(a, b)| a.identifiable && b.identifiable)
    {
        let error = a.std_error.unwrap_or(0.0).max(b.std_error.unwrap_or(0.0));
        let (off, most) = ((a.value - b.value).abs(), (share * b.value.abs().max(1e-2)).max(0.05 * error));
        println!("  {}: {} {}, {:.1e} of {most:.1e}", a.unknown.name(), a.value, b.value, off);
        assert!(off <= most, "{what}: {}", a.unknown.name());
    }
}

#[test]
fn fits_over_them_end_where_those_over_the_cpus_do() {
    let Some(gpu) = gpu() else { return };
    // The targets are the CPU's samples, without noise. What other samples see in the place of a few is an error of
    // the regressors, and not of the targets: it draws the rim's and hilite's constants, which live where the mesh
    // hides itself, towards 0 by its share of their squares, some 1/256 of the samples there; standard errors do not
    // know of it.
    fit_both_ways(gpu, &built_in(), 1e-3);
    let Some(folder) = crate::common::data() else { return };
    // Targets that the model does not meet: what samples differ by is lost beside that.
    for scene in ["lps_forest", "lps_sunrise"] {
        fit_both_ways(gpu, &folder.join(scene).join("scene.toml"), 1e-4);
    }
}

#[test]
fn what_cannot_be_made_is_refused() {
    let Some(gpu) = gpu() else { return };
    let baked = baked(&built_in(), SURFACE, SIZE);
    let (made, groups) = DeviceSamples::new(gpu, Content::of(&baked)).unwrap();
    let views = observed(&baked, groups);
    let task = Task { unknowns: Vec::new(), ..baked.task_over(views) };
    let memory = Memory { part: None, resident: Some(1000) };
    let refused = GpuEngine::over_device_samples(Arc::new(made), task, &baked.start(), memory).map(|_| ());
    assert!(matches!(refused, Err(GpuError::SamplesStay { most: 1000, .. })), "{refused:?}");
    let words = refused.unwrap_err().to_string();
    assert!(words.contains("1000 may stay there"), "{words}");
    let refusal = |baked: &Baked| DeviceSamples::new(gpu, Content::of(baked)).map(|_| ()).unwrap_err();
    let baked = baked.with_scene(|scene| {
        let camera = &mut scene.views[0].camera;
        camera.world_to_camera = glam::DMat4::from_rotation_y(3.1) * camera.world_to_camera;
    });
    let error = refusal(&baked);
    assert!(matches!(error, DeviceSampleError::Samples(SampleError::NothingVisible { .. })), "{error}");
    let error = refusal(&baked.with_scene(|scene| scene.mesh.uvs.clear()));
    assert!(matches!(error, DeviceSampleError::Samples(SampleError::NoUvs { .. })), "{error}");
}
