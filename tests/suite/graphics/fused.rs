//! The fit engine on the adapter against the plain f64 model, and beside the CPU's.

use std::path::Path;

use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::reference::{Reference, deviation};
use skinfit::engine::view::ObservedView;
use skinfit::engine::{NormalEquations, Objective, Point, Unknown};
use skinfit::fit::{FitOptions, Tolerances, fit};
use skinfit::gpu::{Choice, Gpu, GpuError};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::{Column, Param};
use skinfit::model::terms::TermName;
use skinfit::prepare::{Observed, PrepareOptions};
use skinfit::samples::rows::Rows;
use skinfit::samples::surface_records::Asked;
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples};
use skinfit::scene::Loss;
use skinfit::scene::view::Clip;

use super::bench::{built_in, cache, gpu, open};
use crate::engine::{
    EVERYTHING, all_unknowns, assert_equal, assert_passes_equal, engine as cpu, illumination, names, params,
    single, task, view,
};

/// Views of several records a group, and of one: shaders read the latter a pixel ahead.
const SAMPLINGS: [fn(usize, u64) -> ObservedView; 2] = [view, single];

fn engine(
    gpu: &Gpu,
    setup: Setup,
    views: &[ObservedView],
    loss: Loss,
    unknowns: &[Unknown],
    at: &Point,
) -> GpuEngine {
    GpuEngine::new(gpu, task(setup, views, loss, unknowns), at, Memory::default()).unwrap()
}

const FULL: Setup = Setup::new(Form::Corrected, Silhouette::Bumped, EVERYTHING);

#[test]
fn normal_equations_equal_the_plain_model_for_every_form_silhouette_and_effect() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let views = [made(9, 1), made(4, 2)];
        let light = illumination();
        let point = Point { params: params(), gains: vec![1.0.into(), 1.2.into()] };
        let all = [EVERYTHING];
        // One effect at a time where the form and the silhouette are the defaults; all of them elsewhere. With the
        // normal map, as the samples have one.
        let single: Vec<Effects> =
            Effect::BUILT_IN.into_iter().map(|e| Effects::of(&[e, Effect::NormalMap])).collect();
        for form in Form::ALL {
            for silhouette in Silhouette::ALL {
                let default = form == Form::Corrected && silhouette == Silhouette::Fragment;
                for &effects in if default { single.as_slice() } else { &all } {
                    let setup = Setup::new(form, silhouette, effects);
                    if TermName::of(effects).is_empty() && !effects.needs(silhouette).haze {
                        let task = task(setup, &views, Loss::L2, &[]);
                        let refused = GpuEngine::new(gpu, task, &point, Memory::default()).map(|_| ());
                        assert!(matches!(refused, Err(GpuError::NothingShown)), "{effects:?} shows nothing");
                        continue;
                    }
                    // Those that the effects ask for: a fit frees no others.
                    let asked = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param.asked_for(effects));
                    let unknowns: Vec<Unknown> = all_unknowns(2)
                        .into_iter()
                        .filter(|u| asked(u) || matches!(u, Unknown::Gain(..)))
                        .collect();
                    let want = Reference::new(setup, &light, &views, Loss::L2, &unknowns)
                        .unwrap()
                        .normal_equations(&point);
                    let got =
                        engine(gpu, setup, &views, Loss::L2, &unknowns, &point).normal_equations(&point);
                    let what = format!("{form:?} {silhouette:?} {effects:?}");
                    assert_equal(&got, &want, &names(&unknowns), &what);
                }
            }
        }
    }
}

#[test]
fn every_parameter_alone_gives_the_same_answers() {
    let Some(gpu) = gpu() else { return };
    let views = [view(7, 3)];
    let light = illumination();
    let point = Point { params: params(), gains: vec![1.0.into()] };
    for unknown in all_unknowns(1) {
        let unknowns = [unknown];
        let want = Reference::new(FULL, &light, &views, Loss::RelativeL2, &unknowns)
            .unwrap()
            .normal_equations(&point);
        let got = engine(gpu, FULL, &views, Loss::RelativeL2, &unknowns, &point).normal_equations(&point);
        assert_equal(&got, &want, &names(&unknowns), &unknown.name());
    }
}

#[test]
fn every_loss_gives_the_plain_models_loss_gradient_and_normal_equations() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let mut views = [made(8, 4)];
        views[0].clip = Some(Clip { low: 0.1, high: 1.5 });
        let light = illumination();
        let unknowns: Vec<Unknown> =
            [Param::BaseWeight, Param::RimExponent, Param::NormalStrength, Param::HazeWeight]
                .map(|param| Unknown::Param(Column::tied(param)))
                .to_vec();
        let point = Point { params: params(), gains: vec![0.9.into()] };
        for loss in Loss::ALL {
            let plain =
                Reference::new(FULL, &light, &views, loss, &unknowns).unwrap().normal_equations(&point);
            let engine = engine(gpu, FULL, &views, loss, &unknowns, &point);
            assert_passes_equal(&engine, &plain, &point, loss.name());
        }
    }
}

/// A few unknowns that take every kind of tangent: weights, powers, normals.
fn some_unknowns() -> Vec<Unknown> {
    [Param::BaseWeight, Param::RimWeight, Param::RimExponent, Param::Occlusion, Param::NormalStrength]
        .map(|param| Unknown::Param(Column::tied(param)))
        .to_vec()
}

#[test]
fn sums_are_the_same_to_the_bit_from_run_to_run() {
    let Some(gpu) = gpu() else { return };
    let views = [view(300, 6), view(70, 7)];
    let point = Point { params: params(), gains: vec![1.0.into(), 1.1.into()] };
    let make = || engine(gpu, FULL, &views, Loss::Huber, &some_unknowns(), &point);
    let one = make();
    let first = one.normal_equations(&point);
    assert_eq!(one.normal_equations(&point), first);
    assert_eq!(make().normal_equations(&point), first);
}

#[test]
fn parts_and_streaming_give_the_same_sums() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let views = [made(100, 8), made(37, 9)];
        let unknowns = some_unknowns();
        let point = Point { params: params(), gains: vec![1.0.into(), 1.1.into()] };
        let make =
            |memory| GpuEngine::new(gpu, task(FULL, &views, Loss::L2, &unknowns), &point, memory).unwrap();
        let whole = make(Memory::default());
        let want = whole.normal_equations(&point);
        let (resident, streamed) = whole.bytes();
        assert_eq!(streamed, 0);
        let part = Some(resident / 5);
        for most in [None, Some(resident / 2), Some(0)] {
            let cut = make(Memory { part, resident: most });
            assert_eq!(cut.bytes().1 > 0, most.is_some());
            // The additions are cut elsewhere: a few roundings of f32 sums.
            assert_close(&cut.normal_equations(&point), &want, 1e-6);
            assert_eq!(cut.normal_equations(&point), cut.normal_equations(&point));
        }
        // Every third block of each part, short ones at their ends among them: wherever the parts are.
        let every_third = |most| {
            let mut cut = make(Memory { part, resident: most });
            cut.set_stride(3);
            cut.normal_equations(&point)
        };
        let resident_parts = every_third(None);
        assert!(resident_parts.count < want.count && resident_parts.loss > 0.0);
        assert_eq!(every_third(Some(resident / 2)), resident_parts);
        assert_eq!(every_third(Some(0)), resident_parts);
    }
}

#[test]
fn bytes_are_those_that_stand_on_the_device_and_that_a_pass_uploads() {
    let Some(gpu) = gpu() else { return };
    let views = [view(100, 8), view(37, 9)];
    let point = Point { params: params(), gains: vec![1.0.into(), 1.1.into()] };
    let unknowns = some_unknowns();
    let bytes = |resident| {
        let task = task(FULL, &views, Loss::L2, &unknowns);
        GpuEngine::new(gpu, task, &point, Memory { part: None, resident }).unwrap().bytes()
    };
    let of = |view: &ObservedView| {
        let rows = size_of_val(view.samples.surface.rows().all()) + size_of_val(view.target.all());
        (rows + size_of_val(view.weight.as_slice()) + size_of_val(view.samples.group_start.as_slice())) as u64
    };
    let [large, small] = [of(&views[0]), of(&views[1])];
    assert_eq!(bytes(None), (large + small, 0));
    // The second view's buffers are there for its uploads.
    assert_eq!(bytes(Some(large)), (large + small, small));
    // Both take turns in buffers for the larger one.
    assert_eq!(bytes(Some(0)), (large, large + small));
    // Terms that are kept take the samples' place.
    let kept = [Unknown::Param(Column::tied(Param::BaseWeight))];
    let engine = engine(gpu, FULL, &views, Loss::L2, &kept, &point);
    assert_eq!(engine.bytes(), (large + small, 0));
}

fn assert_close(got: &NormalEquations, want: &NormalEquations, tolerance: f64) {
    let k = want.jtr.len();
    let close = |g: f64, w: f64, scale: f64| assert!((g - w).abs() <= tolerance * scale, "{g} {w}");
    close(got.loss, want.loss, want.loss);
    close(got.residual, want.residual, want.residual);
    assert_eq!((got.weight, got.count), (want.weight, want.count));
    for a in 0..k {
        close(got.jtr[a], want.jtr[a], (want.jtj[a * k + a] * want.residual).sqrt());
        for b in 0..k {
            close(
                got.jtj[a * k + b],
                want.jtj[a * k + b],
                (want.jtj[a * k + a] * want.jtj[b * k + b]).sqrt(),
            );
        }
    }
}

/// `view`, `times` times over.
fn repeated(view: &ObservedView, times: usize) -> ObservedView {
    let repeat = |rows: &Rows| {
        let records = times * rows.all().len() / rows.stride();
        let mut repeated = Rows::new(rows.stride(), records);
        let from = rows.all().chunks_exact(rows.stride()).cycle();
        for (record, from) in (0..records).zip(from) {
            repeated.record_mut(record).copy_from_slice(from);
        }
        repeated
    };
    let records = view.samples.records() as u32;
    let starts = &view.samples.group_start[..view.samples.groups()];
    let mut large = view.clone();
    large.target = repeat(&view.target);
    large.weight = view.weight.repeat(times);
    *large.samples.surface.rows_mut() = repeat(view.samples.surface.rows());
    large.samples.group_start = (0..times as u32)
        .flat_map(|k| starts.iter().map(move |start| start + k * records))
        .chain([times as u32 * records])
        .collect();
    large
}

#[test]
fn a_million_and_ten_million_samples_keep_six_digits() {
    let Some(gpu) = gpu() else { return };
    // 500 groups of 16, over and over: their sums are multiples of the first's.
    let small = [view(500, 10)];
    let (unknowns, light) = (some_unknowns(), illumination());
    let point = Point { params: params(), gains: vec![1.0.into()] };
    let once = Reference::new(FULL, &light, &small, Loss::L2, &unknowns).unwrap().normal_equations(&point);
    let samples = small[0].samples.records() * LANES;
    for least in [1_000_000, 10_000_000] {
        let times = (least as usize).div_ceil(samples);
        let large = [repeated(&small[0], times)];
        let got = engine(gpu, FULL, &large, Loss::L2, &unknowns, &point).normal_equations(&point);
        let mut want = once.clone();
        want.jtj
            .iter_mut()
            .chain(&mut want.jtr)
            .chain([&mut want.residual, &mut want.weight])
            .for_each(|x| *x *= times as f64);
        want.count *= times as u64;
        assert_eq!(got.count, want.count);
        let got = NormalEquations { weight: want.weight, ..got };
        let off = deviation(&got, &want, &unknowns).size;
        println!("{} samples: {off:.1e}", times * samples);
        crate::figures::measured(&format!("fused {least} samples"), (times * samples) as f64);
        crate::figures::measured(&format!("fused {least}"), off);
        // Every copy rounds alike, so what remains is the mean rounding of 24,000 residuals: 6e-8 times some
        // tens of operations over the root of their number, and that of the last sums. A thread adds some tens of
        // products at a million samples, some hundreds at ten: of either sign, 6e-8 times the root of their number,
        // and again over the root of the number of threads.
        assert_close(&got, &want, 1e-6);
    }
}

#[test]
fn strides_read_the_pixels_that_the_cpu_engine_reads() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let views = [made(130, 11)];
        let unknowns = some_unknowns();
        let point = Point { params: params(), gains: vec![1.0.into()] };
        let mut ours = engine(gpu, FULL, &views, Loss::L2, &unknowns, &point);
        let mut theirs = cpu(FULL, &views, Loss::L2, &unknowns, true);
        for stride in [4, 3, 1] {
            ours.set_stride(stride);
            theirs.set_stride(stride);
            assert_equal(
                &ours.normal_equations(&point),
                &theirs.normal_equations(&point),
                &names(&unknowns),
                &format!("every {stride}th block"),
            );
        }
    }
}

#[test]
fn a_lost_device_ends_a_fit_with_its_reason_and_keeps_the_state() {
    let Some(gpu) = open(&Choice::default()) else { return };
    let views = [view(8, 12)];
    let unknowns = some_unknowns();
    let point = Point { params: params(), gains: vec![1.0.into()] };
    let engine = engine(&gpu, FULL, &views, Loss::L2, &unknowns, &point);
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state.json");
    let mut options = FitOptions { state: Some(state.clone()), ..Default::default() };
    let mut lost = 0;
    let error = fit(&engine, &point, &options, &mut |iteration| {
        if iteration.iteration == 1 {
            gpu.close();
            lost += 1;
        }
    })
    .unwrap_err();
    assert_eq!(lost, 1);
    assert!(matches!(error, skinfit::fit::FitError::Engine(_)), "{error}");
    assert!(error.to_string().contains("device was lost"), "{error}");
    // What was found before it stands, and another engine goes on from there.
    options.resume = Some(state);
    let outcome = fit(&cpu(FULL, &views, Loss::L2, &unknowns, true), &point, &options, &mut |_| {}).unwrap();
    assert!(outcome.loss_end < outcome.loss_start);
}

#[test]
fn kept_terms_follow_the_parameters_that_are_held() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let views = [made(40, 13)];
        let light = illumination();
        let unknowns: Vec<Unknown> =
            [Param::BaseWeight, Param::RimExponent, Param::Hilite, Param::HazeWeight]
                .map(|param| Unknown::Param(Column::tied(param)))
                .to_vec();
        let mut point = Point { params: params(), gains: vec![1.0.into()] };
        let ours = engine(gpu, FULL, &views, Loss::L2, &unknowns, &point);
        let plain = Reference::new(FULL, &light, &views, Loss::L2, &unknowns).unwrap();
        for strength in [1.3, 0.4, 0.4, 1.3] {
            point.params.set(Param::NormalStrength, strength);
            let what = format!("normal_strength {strength}");
            assert_equal(
                &ours.normal_equations(&point),
                &plain.normal_equations(&point),
                &names(&unknowns),
                &what,
            );
        }
    }
}

/// `view` with less of each sample, with its first channels alone, and perhaps with all pixels counting alike.
fn lean(view: &ObservedView, asked: Asked, channels: usize, weighted: bool) -> ObservedView {
    let from = &view.samples.surface;
    let mut surface = SurfaceRecords::new(asked, view.samples.records());
    (0..from.slots()).for_each(|slot| surface.set(slot, &from.fragment(slot), from.weight(slot)));
    let mut target = Rows::new(channels, view.samples.groups());
    for group in 0..view.samples.groups() {
        target.record_mut(group).copy_from_slice(&view.target.record(group)[..channels]);
    }
    let weight = if weighted { view.weight.clone() } else { Vec::new() };
    ObservedView { samples: ViewSamples { surface, ..view.samples.clone() }, target, weight, clip: view.clip }
}

#[test]
fn records_and_targets_of_every_length_are_read_as_they_were_written() {
    let Some(gpu) = gpu() else { return };
    let all = Asked::EVERYTHING;
    let no_dapple = Asked { dapple: false, ..all };
    let no_specular = Asked { specular: false, ..no_dapple };
    let no_attenuator = Asked { attenuator: false, ..no_specular };
    // Rows are read in fours, on an adapter: one left over, none, three, two; of targets none or all.
    for (rows, asked, channels, weighted) in [
        (21, all, 4, false),
        (20, no_dapple, 3, true),
        (19, no_specular, 3, false),
        (18, no_attenuator, 4, true),
    ] {
        for made in SAMPLINGS {
            let views = [lean(&made(21, 14), asked, channels, weighted)];
            assert_eq!(views[0].samples.surface.rows().stride(), rows);
            let light = illumination();
            let point = Point { params: params(), gains: vec![1.1.into()] };
            // Over the samples, and over their terms.
            for moves in [&[Param::NormalStrength][..], &[]] {
                let weights = [Param::BaseWeight, Param::RimWeight, Param::SideSpecular, Param::Hilite];
                let unknowns: Vec<Unknown> =
                    weights.iter().chain(moves).map(|&param| Unknown::Param(Column::tied(param))).collect();
                let plain = Reference::new(FULL, &light, &views, Loss::L2, &unknowns).unwrap();
                let ours = engine(gpu, FULL, &views, Loss::L2, &unknowns, &point);
                let what = format!("{rows} rows, {channels} channels, {moves:?}");
                assert_passes_equal(&ours, &plain.normal_equations(&point), &point, &what);
            }
        }
    }
}

#[test]
fn images_equal_the_cpu_engines() {
    let Some(gpu) = gpu() else { return };
    for made in SAMPLINGS {
        let views = [made(9, 5), made(30, 6)];
        for form in Form::ALL {
            let setup = Setup { form, ..FULL };
            let point = Point { params: params(), gains: vec![1.5.into(), 0.8.into()] };
            let ours = engine(gpu, setup, &views, Loss::L2, &[], &point);
            let theirs = cpu(setup, &views, Loss::L2, &[], true);
            for index in 0..2 {
                let (got, want) = (ours.image(index, &point).unwrap(), theirs.image(index, &point));
                assert_eq!(got.len(), want.len());
                for (c, (got, want)) in got.iter().zip(&want).enumerate() {
                    for (slot, (g, w)) in got.iter().zip(want).enumerate() {
                        // The vectors' own figures for f32, once for each engine.
                        assert!(
                            (g - w).abs() < 4e-6 + 4e-5 * w.abs(),
                            "{form:?} {index} {c} {slot}: {g} {w}"
                        );
                    }
                }
            }
        }
    }
}

/// As users fit, but on to where the roundings of the sums are all that is left: a fit's usual stop, a thirtieth of
/// a standard error from there, is another point for each engine.
fn to_the_end() -> FitOptions {
    let tolerances = Tolerances { gain: 1e-13, error: 1e-4, ..Tolerances::default() };
    FitOptions { tolerances, ..FitOptions::default() }
}

/// Fit a scene on both engines from its start.
fn fit_on_both(gpu: &Gpu, scene: &Path) {
    let options = PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() };
    let observed = Observed::new(scene, &options).unwrap();
    let start = observed.start();
    let ours = GpuEngine::new(gpu, observed.task(), &start, Memory::default()).unwrap();
    let theirs = observed.engine().unwrap();
    let [ours, theirs] = [&ours as &dyn Objective, &theirs]
        .map(|engine| fit(engine, &start, &to_the_end(), &mut |_| {}).unwrap());
    let what = scene.display();
    // Both stop where a step promises nothing; their sums differ by roundings of f32, some 1e-7, which the
    // loss of noise-free targets consists of.
    let floor = 1e-12;
    let off = (ours.loss_end - theirs.loss_end).abs();
    assert!(off <= 1e-6 * theirs.loss_end + floor, "{what}: loss {} {}", ours.loss_end, theirs.loss_end);
    for (a, b) in ours.unknowns.iter().zip(&theirs.unknowns) {
        // Of what the images determine; the rest may stand anywhere. A twentieth of a standard error changes the loss by
        // 0.05^2 / residuals of itself, 5e-9 with the half million of these scenes: less than its sums' roundings.
        if a.identifiable && b.identifiable {
            let off = (a.value - b.value).abs();
            let most = (1e-4 * b.value.abs().max(1e-2)).max(0.05 * b.std_error.unwrap_or(0.0));
            assert!(
                off <= most,
                "{what}: {} {} {}, std error {:?}",
                a.unknown.name(),
                a.value,
                b.value,
                b.std_error
            );
        }
    }
}

#[test]
fn fits_of_built_in_and_shared_scenes_end_where_the_cpu_engines_do() {
    let Some(gpu) = gpu() else { return };
    fit_on_both(gpu, &built_in());
    let Some(folder) = crate::common::data() else { return };
    for scene in ["lps_forest", "lps_sunrise"] {
        fit_on_both(gpu, &folder.join(scene).join("scene.toml"));
    }
}

#[test]
fn tiles_of_every_view_pull_as_the_cpu_engines_do() {
    let Some(gpu) = gpu() else { return };
    // The printed listing interpolates its rim.
    let scene = built_in();
    let text = std::fs::read_to_string(&scene).unwrap();
    let listing = scene.with_file_name("listing.toml");
    let changed = text.replacen("form = \"corrected\"", "form = \"listing\"", 1);
    assert_ne!(changed, text);
    std::fs::write(&listing, changed).unwrap();
    for scene in [scene, listing] {
        let options = PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() };
        let observed = Observed::new(&scene, &options).unwrap();
        assert!(observed.views.len() > 1);
        let (start, widths) = (observed.start(), observed.image_widths());
        let ours = GpuEngine::new(gpu, observed.task(), &start, Memory::default()).unwrap();
        let theirs = observed.engine().unwrap();
        let [ours, theirs] =
            [&ours as &dyn Objective, &theirs].map(|engine| engine.pulls(&start, &widths).unwrap());
        assert_eq!(ours.tiles.len(), theirs.tiles.len());
        for (a, b) in ours.tiles.iter().zip(&theirs.tiles) {
            assert_eq!((a.view, a.column, a.row), (b.view, b.column, b.row));
            for (a, b) in a.pull.iter().zip(&b.pull) {
                // Sums of at most 64 pixels' rows in f32, of a size up to 1.
                assert!((a - b).abs() <= 1e-4 * (1.0 + b.abs()), "{}: {a} {b}", scene.display());
            }
        }
    }
}
