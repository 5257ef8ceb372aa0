//! The CPU engine against its rules evaluated in f64: images, losses, gradients and normal equations.

use std::sync::Arc;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::reference::{Reference, deviation};
use skinfit::engine::view::ObservedView;
use skinfit::engine::{NormalEquations, Objective, Point, Task, Unknown};
use skinfit::model::cube::{Cube, texel_direction};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::model::params::{Channels, Column, Param, Params};
use skinfit::samples::rows::{Row, Rows};
use skinfit::samples::surface_records::Asked;
use skinfit::samples::{LANES, SurfaceRecords, ViewSamples};
use skinfit::scene::Loss;

fn wavy(size: usize, phase: f64) -> Cube<f32> {
    Cube::from_fn(size, |face, column, row| {
        let [x, y, z] = texel_direction(face, column, row, size);
        let wave = |k: f64| (1.2 + (k * x + phase).sin() * (2.0 * y).cos() + 0.3 * z * k.sin()).abs() as f32;
        [wave(1.0), wave(1.7), wave(2.3), wave(3.1)]
    })
}

fn unit(rng: &mut StdRng) -> [f64; 3] {
    let v: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
    v.map(|x| x / length)
}

/// `groups` groups with 1 to 3 records each; about one sample in ten is padding.
pub(crate) fn view(groups: usize, seed: u64) -> ObservedView {
    sampled(groups, seed, |group| 1 + group % 3)
}

/// `groups` groups with one record each; the last lane is padding.
pub(crate) fn single(groups: usize, seed: u64) -> ObservedView {
    let mut view = sampled(groups, seed, |_| 1);
    for group in 0..groups {
        let slot = group * LANES + LANES - 1;
        let fragment = view.samples.surface.fragment(slot);
        view.samples.surface.set(slot, &fragment, 0.0);
        view.weight[group][LANES - 1] = 0.0;
    }
    view
}

fn sampled(groups: usize, seed: u64, records: impl Fn(usize) -> usize) -> ObservedView {
    let mut rng = StdRng::seed_from_u64(seed);
    let count = (0..groups).map(&records).sum();
    let mut samples = ViewSamples { group_start: vec![0], ..ViewSamples::default() };
    samples.surface = SurfaceRecords::new(Asked::EVERYTHING, count);
    let (mut target, mut weight) = (Rows::new(4, groups), vec![Row::ZERO; groups]);
    for group in 0..groups {
        let (first, records) = (samples.group_start[group] as usize, records(group));
        let mut shares = vec![[0.0_f32; LANES]; records];
        for lane in 0..LANES {
            let used = rng.random_range(1..=records);
            (0..used).for_each(|r| shares[r][lane] = 1.0 / used as f32);
        }
        for (record, row) in shares.iter().enumerate() {
            for (lane, &share) in row.iter().enumerate() {
                samples.surface.set((first + record) * LANES + lane, &fragment(&mut rng), share);
            }
        }
        samples.group_start.push((first + records) as u32);
        for lane in 0..LANES {
            target.record_mut(group).iter_mut().for_each(|row| row[lane] = rng.random_range(0.05..2.0));
            weight[group][lane] = if lane == 5 { 0.0 } else { rng.random_range(0.1..1.0) };
        }
    }
    ObservedView { samples, target, weight, clip: None }
}

fn fragment(rng: &mut StdRng) -> Fragment<f32> {
    let single = |v: [f64; 3]| v.map(|x| x as f32);
    let (normal, view, bump) = (single(unit(rng)), single(unit(rng)), single(unit(rng)));
    Fragment {
        base: normal,
        bump: bump.map(|x| 0.3 * x),
        normal,
        view,
        occlusion: rng.random_range(0.2..1.0),
        silhouette: rng.random_range(0.0..1.0),
        dapple: rng.random_range(0.0..1.0),
        albedo: std::array::from_fn(|_| rng.random_range(0.1..0.9)),
        specular: rng.random_range(0.0..1.0),
        attenuator: rng.random_range(0.0..1.0),
    }
}

pub(crate) fn illumination() -> Arc<Illumination> {
    Arc::new(Illumination {
        irradiance: Some(wavy(8, 0.3)),
        lobes: Some(LobeStack {
            exponents: vec![16.0, 32.0, 64.0],
            cubes: vec![wavy(16, 0.7), wavy(16, 1.1), wavy(16, 1.3)],
        }),
        hilite: Some(wavy(16, 2.1)),
        reflected: None,
    })
}

pub(crate) const EVERYTHING: Effects = Effects::SURFACE.with(Effect::Haze).with(Effect::KeyLight);

pub(crate) fn params() -> Params {
    let mut params = Params::defaults(Form::Corrected);
    params.set_rgb(Param::RimWeight, [0.9, 0.45, 0.3]);
    params.set(Param::RimExponent, 2.6);
    params.set(Param::Reflection, 0.2);
    params.set(Param::Occlusion, 0.8);
    params.set(Param::NormalStrength, 1.3);
    params.set(Param::SpecularLobe, 40.0);
    params.set(Param::EnvironmentRotation, 20.0);
    params.set(Param::KeyAzimuth, 30.0);
    params.set_rgb(Param::KeyColor, [0.5, 0.4, 0.3]);
    params.set(Param::HazeWeight, 0.5);
    params
}

pub(crate) fn all_unknowns(gains: usize) -> Vec<Unknown> {
    let columns = Param::built_in().flat_map(|p| match p {
        Param::RimWeight => Column::per_channel(p).to_vec(),
        _ => vec![Column::tied(p)],
    });
    columns.map(Unknown::Param).chain((1..gains).map(|view| Unknown::Gain(view, Channels::Tied))).collect()
}

/// f32 evaluation of a few hundred roundings, of either sign, against f64: 1e-5 of the largest entry
/// that shares the row and the column.
pub(crate) fn assert_equal(got: &NormalEquations, want: &NormalEquations, names: &[String], what: &str) {
    assert_equal_but_for(0.0, got, want, names, what);
}

/// As [`assert_equal`], where the entries of J^T J may be off by a share more: what [`Reference::with_rounding`] says that
/// the residuals' roundings do to a robust loss' weights.
pub(crate) fn assert_equal_but_for(
    moved: f64,
    got: &NormalEquations,
    want: &NormalEquations,
    names: &[String],
    what: &str,
) {
    let k = names.len();
    let within = |share: f64, g: f64, w: f64, scale: f64| (g - w).abs() <= share * scale + 1e-12;
    let close = |g: f64, w: f64, scale: f64| within(1e-5, g, w, scale);
    assert!(close(got.loss, want.loss, want.loss), "{what}: loss {} {}", got.loss, want.loss);
    assert!(close(got.residual, want.residual, want.residual), "{what}: residual");
    assert_eq!(got.count, want.count, "{what}");
    assert!(close(got.weight, want.weight, want.weight), "{what}: weight");
    for a in 0..k {
        let size = want.jtj[a * k + a].sqrt();
        let scale = size * want.residual.sqrt();
        assert!(
            close(got.jtr[a], want.jtr[a], scale),
            "{what}: J^T r of {}: {} {}",
            names[a],
            got.jtr[a],
            want.jtr[a]
        );
        for b in 0..k {
            let scale = size * want.jtj[b * k + b].sqrt();
            let (g, w) = (got.jtj[a * k + b], want.jtj[a * k + b]);
            assert!(
                within(1e-5 + moved, g, w, scale),
                "{what}: J^T J of {} and {}: {g} {w}",
                names[a],
                names[b]
            );
        }
    }
}

/// A fit under the waves of [`illumination`].
pub(crate) fn task(setup: Setup, views: &[ObservedView], loss: Loss, unknowns: &[Unknown]) -> Task {
    Task { setup, illumination: illumination(), views: views.into(), loss, unknowns: unknowns.to_vec() }
}

pub(crate) fn engine(
    setup: Setup,
    views: &[ObservedView],
    loss: Loss,
    unknowns: &[Unknown],
    keep: bool,
) -> CpuEngine {
    CpuEngine::with_kept_terms(task(setup, views, loss, unknowns), keep).unwrap()
}

pub(crate) fn names(unknowns: &[Unknown]) -> Vec<String> {
    unknowns.iter().map(Unknown::name).collect()
}

#[test]
fn normal_equations_equal_the_plain_model_for_every_form_silhouette_and_effect() {
    let views = [view(9, 1), view(4, 2)];
    let light = illumination();
    let unknowns = all_unknowns(2);
    // The samples hold a bump, which without the effect no rule reads.
    let mut sets: Vec<Effects> =
        Effect::BUILT_IN.into_iter().map(|e| Effects::of(&[e, Effect::NormalMap])).collect();
    sets.extend([EVERYTHING, EVERYTHING.without(Effect::Rim), EVERYTHING.without(Effect::Occlusion)]);
    for form in Form::ALL {
        for silhouette in Silhouette::ALL {
            for &effects in &sets {
                let setup = Setup::new(form, silhouette, effects);
                let point = Point { params: params(), gains: vec![1.0.into(), 1.2.into()] };
                let plain = Reference::new(setup, &light, &views, Loss::L2, &unknowns).unwrap();
                let got = engine(setup, &views, Loss::L2, &unknowns, true).normal_equations(&point);
                let what = format!("{form:?} {silhouette:?} {effects:?}");
                assert_equal(&got, &plain.normal_equations(&point), &names(&unknowns), &what);
            }
        }
    }
}

#[test]
fn any_subset_of_free_parameters_keeps_the_same_answers() {
    let views = [view(7, 3)];
    let light = illumination();
    let all = all_unknowns(1);
    let point = Point { params: params(), gains: vec![1.0.into()] };
    for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
        let setup = Setup::new(Form::Corrected, silhouette, EVERYTHING);
        // Each lookup parameter alone beside the linear ones, none of them, and every unknown alone.
        let lookups = [
            Param::NormalStrength,
            Param::SpecularLobe,
            Param::EnvironmentRotation,
            Param::KeyAzimuth,
            Param::KeyElevation,
        ];
        let is_lookup = |u: &Unknown| matches!(u, Unknown::Param(c) if lookups.contains(&c.param));
        let mut subsets: Vec<Vec<Unknown>> = all.iter().map(|&u| vec![u]).collect();
        let cheap: Vec<Unknown> = all.iter().copied().filter(|u| !is_lookup(u)).collect();
        for &unknown in all.iter().filter(|u| is_lookup(u)) {
            subsets.push(cheap.iter().copied().chain([unknown]).collect());
        }
        subsets.push(cheap);
        for unknowns in subsets {
            for keep in [true, false] {
                let plain = Reference::new(setup, &light, &views, Loss::RelativeL2, &unknowns).unwrap();
                let got = engine(setup, &views, Loss::RelativeL2, &unknowns, keep).normal_equations(&point);
                let what = format!("{silhouette:?} keep {keep} {:?}", names(&unknowns));
                assert_equal(&got, &plain.normal_equations(&point), &names(&unknowns), &what);
            }
        }
    }
}

/// With a target of colours alone.
fn without_alpha(mut view: ObservedView) -> ObservedView {
    let groups = view.samples.groups();
    let mut target = Rows::new(3, groups);
    for group in 0..groups {
        target.record_mut(group).copy_from_slice(&view.target.record(group)[..3]);
    }
    view.target = target;
    view
}

#[test]
fn plans_that_are_compiled_ahead_say_what_the_rules_say() {
    let light = illumination();
    let hazy = Effects::SURFACE.with(Effect::Haze);
    let smooth = Effects::SURFACE.without(Effect::NormalMap);
    let setups = [
        (Form::Corrected, Silhouette::Fragment, Effects::SURFACE, true),
        (Form::Corrected, Silhouette::Fragment, hazy, false),
        (Form::Corrected, Silhouette::Bumped, hazy, false),
        (Form::Corrected, Silhouette::Fragment, smooth, false),
        (Form::Listing, Silhouette::Vertex, Effects::SURFACE, false),
    ];
    // One of several samples a pixel, and one of which every pixel is a sample and counts alike.
    let mut alike = single(6, 5);
    let mut surface = SurfaceRecords::new(Asked { weight: false, ..Asked::EVERYTHING }, 6);
    for slot in 0..6 * LANES {
        surface.set(slot, &alike.samples.surface.fragment(slot), 1.0);
    }
    (alike.samples.surface, alike.weight) = (surface, Vec::new());
    let hazy_views = [alike, view(9, 4)];
    let coloured = hazy_views.clone().map(without_alpha);
    let weights = |u: &Unknown| matches!(u, Unknown::Param(c) if c.param.info().linear || c.param == Param::RimExponent);
    let moving: [&[Param]; 4] = [
        &[],
        &[Param::SpecularLobe],
        &[Param::NormalStrength, Param::SpecularLobe],
        &[Param::NormalStrength, Param::SpecularLobe, Param::EnvironmentRotation],
    ];
    for (form, silhouette, effects, turns) in setups {
        let setup = Setup::new(form, silhouette, effects);
        let views = if effects.has(Effect::Haze) { &hazy_views } else { &coloured };
        for moving in moving.iter().take(if turns { 4 } else { 3 }) {
            // A parameter that no effect asks for is free beside those that are.
            let moves = |u: &Unknown| matches!(u, Unknown::Param(c) if moving.contains(&c.param));
            let unknowns: Vec<Unknown> = all_unknowns(2)
                .into_iter()
                .filter(|u| weights(u) || moves(u) || matches!(u, Unknown::Gain(..)))
                .collect();
            for loss in [Loss::L2, Loss::RelativeL2] {
                let mut point = Point { params: params(), gains: vec![1.0.into(), 1.2.into()] };
                let turned = moving.contains(&Param::EnvironmentRotation);
                point.params.set(Param::EnvironmentRotation, if turned { 20.0 } else { 0.0 });
                let what = format!("{setup:?} {moving:?} {loss:?}");
                let engine = engine(setup, views, loss, &unknowns, true);
                assert!(engine.is_compiled_ahead(&point), "{what}");
                let plain = Reference::new(setup, &light, views, loss, &unknowns).unwrap();
                assert_passes_equal(&engine, &plain.normal_equations(&point), &point, &what);
                // Held at an angle, the environment is turned by rules that no plan of these has.
                point.params.set(Param::EnvironmentRotation, 20.0);
                let want = plain.normal_equations(&point);
                assert_equal(&engine.normal_equations(&point), &want, &names(&unknowns), &what);
            }
        }
    }
}

/// Loss, gradient and normal equations of an engine, each by its own pass, against the plain model's.
pub(crate) fn assert_passes_equal(
    engine: &dyn Objective,
    plain: &NormalEquations,
    point: &Point,
    what: &str,
) {
    let unknowns = engine.unknowns();
    assert_equal(&engine.normal_equations(point), plain, &names(unknowns), what);
    let (value, gradient) = engine.gradient(point);
    // The same sum by two passes, which need not contract the same multiplications and additions: some
    // roundings of f32 a residual, of either sign.
    assert!((value / engine.loss(point) - 1.0).abs() < 1e-6, "{what}");
    for (k, g) in gradient.iter().enumerate() {
        let want = 2.0 * plain.jtr[k] / plain.weight;
        let scale = 2.0 * (plain.jtj[k * unknowns.len() + k] * plain.residual).sqrt() / plain.weight;
        // As in `assert_equal`.
        assert!((g - want).abs() <= 1e-5 * scale, "{what} {}: {g} {want}", unknowns[k].name());
    }
}

#[test]
fn every_loss_gives_the_plain_models_loss_gradient_and_normal_equations() {
    let mut views = [view(8, 4)];
    let light = illumination();
    views[0].clip = Some(skinfit::scene::view::Clip { low: 0.1, high: 1.5 });
    let unknowns = all_unknowns(1);
    let setup = Setup::new(Form::Corrected, Silhouette::Bumped, EVERYTHING);
    let point = Point { params: params(), gains: vec![0.9.into()] };
    for loss in Loss::ALL {
        let plain = Reference::new(setup, &light, &views, loss, &unknowns).unwrap().normal_equations(&point);
        let engine = engine(setup, &views, loss, &unknowns, true);
        assert_passes_equal(&engine, &plain, &point, loss.name());
    }
}

#[test]
fn what_roundings_may_do_to_a_robust_loss_is_known() {
    // Residuals of a hundredth and less, many of them about SMAPE's corner.
    let mut near = [view(60, 14)];
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, EVERYTHING);
    let light = illumination();
    let unknowns = [Param::BaseWeight, Param::RimWeight, Param::Hilite, Param::RimExponent]
        .map(|param| Unknown::Param(Column::tied(param)));
    let mut point = Point { params: params(), gains: vec![1.0.into()] };
    let image = engine(setup, &near, Loss::L2, &unknowns, true).image(0, &point);
    let mut rng = StdRng::seed_from_u64(15);
    for (channel, plane) in image.iter().enumerate() {
        for (slot, value) in plane.iter().enumerate() {
            let off = 10.0_f32.powf(rng.random_range(-6.0..-2.0)) * [-1.0, 1.0][slot % 2];
            near[0].target.record_mut(slot / LANES)[channel][slot % LANES] = value + off;
        }
    }
    for loss in Loss::ALL {
        let plain = Reference::new(setup, &light, &near, loss, &unknowns).unwrap();
        let engine = engine(setup, &near, loss, &unknowns, true);
        let (want, moved) = plain.with_rounding(&point);
        let found = deviation(&engine.normal_equations(&point), &want, &unknowns);
        println!("{}: {} off by {:.1e}, {moved:.1e} explained", loss.name(), found.what, found.size);
        if loss == Loss::L2 {
            assert_eq!(moved, 0.0, "{}", loss.name());
            continue;
        }
        // The residuals themselves are as small as roundings here, so J^T r is not looked at.
        let jtj =
            |sums: NormalEquations| NormalEquations { loss: 1.0, residual: 1.0, jtr: vec![0.0; 4], ..sums };
        let off = |sums: NormalEquations| deviation(&jtj(sums), &jtj(want.clone()), &unknowns).size;
        let most = 1e-5 + moved;
        assert!(off(engine.normal_equations(&point)) < most, "{}: {most:e}", loss.name());
        // Residuals this small are squares to Huber's loss, whose weights stay; those of SMAPE and of the relative loss
        // tell a hundredth more light.
        let before = point.params.scalar(Param::BaseWeight);
        point.params.set(Param::BaseWeight, 1.01 * before);
        let told = off(engine.normal_equations(&point)) > most;
        assert_eq!(told, matches!(loss, Loss::Smape | Loss::RelativeL2), "{}: {most:e}", loss.name());
        point.params.set(Param::BaseWeight, before);
    }
}

#[test]
fn images_equal_the_plain_model() {
    let views = [view(9, 5)];
    let light = illumination();
    for form in Form::ALL {
        let setup = Setup::new(form, Silhouette::Bumped, EVERYTHING);
        let point = Point { params: params(), gains: vec![1.5.into()] };
        let plain = Reference::new(setup, &light, &views, Loss::L2, &[]).unwrap();
        let image = engine(setup, &views, Loss::L2, &[], true).image(0, &point);
        for slot in 0..views[0].samples.groups() * LANES {
            let pixel = plain.pixel(0, slot, &point.params);
            for c in 0..4 {
                let (got, want) = (f64::from(image[c][slot]), 1.5 * pixel[c].0);
                // The vectors' own figures for f32: 2e-6 + 2e-5 relative.
                assert!((got - want).abs() < 2e-6 + 2e-5 * want.abs(), "{form:?} {slot} {c}: {got} {want}");
            }
        }
    }
}

#[test]
fn sums_are_the_same_to_the_bit_for_any_number_of_threads() {
    let views = [view(300, 6), view(70, 7)];
    let unknowns = all_unknowns(2);
    let setup = Setup::new(Form::Corrected, Silhouette::Bumped, EVERYTHING);
    let engine = engine(setup, &views, Loss::Huber, &unknowns, true);
    let point = Point { params: params(), gains: vec![1.0.into(), 1.1.into()] };
    let with_threads = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| (engine.normal_equations(&point), engine.gradient(&point)))
    };
    let one = with_threads(1);
    for threads in [2, 3, 7] {
        assert_eq!(with_threads(threads), one, "{threads} threads");
    }
}

#[test]
fn a_stride_reads_every_nth_block_of_pixels_and_no_other() {
    let whole = view(128, 8);
    let unknowns = all_unknowns(1);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, EVERYTHING);
    let point = Point { params: params(), gains: vec![1.0.into()] };
    let groups = whole.samples.groups();
    let mut coarse = engine(setup, std::slice::from_ref(&whole), Loss::L2, &unknowns, true);
    let full = coarse.normal_equations(&point);
    let (blocks, names, light) = (coarse.blocks(), names(&unknowns), illumination());
    assert!(blocks >= 8 && groups.is_multiple_of(blocks), "{groups} groups in {blocks} blocks");
    for stride in [2, 3, 4, blocks + 1] {
        // The same view, of which the blocks that are read are all that counts.
        let mut read = whole.clone();
        for group in (0..groups).filter(|group| !(group / (groups / blocks)).is_multiple_of(stride)) {
            read.weight[group] = Row::ZERO;
        }
        coarse.set_stride(stride);
        let got = coarse.normal_equations(&point);
        let read = [read];
        let want =
            Reference::new(setup, &light, &read, Loss::L2, &unknowns).unwrap().normal_equations(&point);
        assert_equal(&got, &want, &names, &format!("stride {stride}"));
        assert!(got.count < full.count);
        // The same pixels summed without their columns: f32 products in another order.
        let loss = coarse.loss(&point);
        assert!((loss - got.loss).abs() <= 1e-6 * got.loss, "{loss} {}", got.loss);
    }
    coarse.set_stride(1);
    assert_eq!(coarse.normal_equations(&point), full, "every block again");
}
