//! The CPU engine and the filter of environments at every SIMD level that this machine can run: on a machine with
//! AVX-512 what AVX2 and SSE2 machines will compute is tested too.

use skinfit::bake::prefilter::Prefilter;
use skinfit::engine::reference::Reference;
use skinfit::engine::{NormalEquations, Objective, Point};
use skinfit::fit::{FitOptions, fit};
use skinfit::model::cube::{Cube, texel_direction};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::samples::LANES;
use skinfit::scene::Loss;
use skinfit::simd::{Level, levels, name};

use crate::engine::{
    EVERYTHING, all_unknowns, assert_equal_but_for, engine, illumination, names, params, view,
};

/// What levels may differ by, as a share of what an entry is summed of. SSE2 rounds the product of a multiply-add by
/// 2^-24, where the others do not, and the processors' estimates of reciprocals, refined once, are good to 2^-23: of
/// the hundred operations that lie between a sample and its column a few of them add up. Sums over samples average
/// them out rather than add them up.
const LEVELS: f64 = 2e-6;

/// The point that the engines are asked at.
fn point() -> Point {
    Point { params: params(), gains: vec![1.0.into(), 1.2.into()] }
}

/// The greatest difference of two engines' sums, as a share of what its entry is summed of.
fn difference(a: &NormalEquations, b: &NormalEquations) -> f64 {
    let k = a.jtr.len();
    let size = |i: usize| a.jtj[i * k + i].sqrt();
    let off = |x: f64, y: f64, scale: f64| if x == y { 0.0 } else { (x - y).abs() / scale };
    let mut worst = off(a.loss, b.loss, a.loss).max(off(a.residual, b.residual, a.residual));
    for i in 0..k {
        worst = worst.max(off(a.jtr[i], b.jtr[i], size(i) * a.residual.sqrt()));
        for j in 0..k {
            worst = worst.max(off(a.jtj[i * k + j], b.jtj[i * k + j], size(i) * size(j)));
        }
    }
    worst
}

#[test]
fn every_level_gives_the_plain_models_passes_and_images_and_the_others_but_for_roundings() {
    // Groups of one record and of several, more than a chunk of them, and a remainder.
    let views = [view(83, 31), view(6, 32)];
    let light = illumination();
    let unknowns = all_unknowns(2);
    let single: Vec<Effects> = [Effect::Diffuse, Effect::Hilite, Effect::Reflection, Effect::KeyLight]
        .map(|effect| Effects::of(&[effect, Effect::NormalMap]))
        .to_vec();
    let mut cases = Vec::new();
    for form in Form::ALL {
        for silhouette in Silhouette::ALL {
            cases.push((Setup::new(form, silhouette, EVERYTHING), Loss::L2));
        }
    }
    let setup = |effects| Setup::new(Form::Corrected, Silhouette::Bumped, effects);
    cases.extend(Loss::ALL.map(|loss| (setup(EVERYTHING), loss)));
    cases.extend(single.into_iter().map(|effects| (setup(effects), Loss::L2)));
    let mut worst = 0.0_f64;
    for (setup, loss) in cases {
        let point = point();
        let plain = Reference::new(setup, &light, &views, loss, &unknowns).unwrap();
        let (want, moved) = plain.with_rounding(&point);
        let mut best: Option<NormalEquations> = None;
        for level in levels() {
            let what = format!("{} {setup:?} {}", name(level), loss.name());
            let mut engine = engine(setup, &views, loss, &unknowns, true);
            engine.set_level(level);
            let got = engine.normal_equations(&point);
            assert_equal_but_for(moved, &got, &want, &names(&unknowns), &what);
            let (alone, gradient) = engine.gradient(&point);
            let only = engine.loss(&point);
            for found in [alone, only] {
                // The same pixels summed without their columns.
                assert!((found - got.loss).abs() <= 1e-6 * got.loss, "{what}: {found} {}", got.loss);
            }
            for (k, g) in gradient.iter().enumerate() {
                let scale = 2.0 * (got.jtj[k * unknowns.len() + k] * got.residual).sqrt() / got.weight;
                let wanted = 2.0 * got.jtr[k] / got.weight;
                assert!((g - wanted).abs() <= 1e-6 * scale, "{what} {}: {g} {wanted}", unknowns[k].name());
            }
            match &best {
                None => best = Some(got),
                Some(best) => {
                    let off = difference(best, &got);
                    worst = worst.max(off);
                    // The weights of a robust loss move with residuals, whose roundings small ones make large: each level
                    // is within 1e-5 and what these move of the rules in f64, and so within twice that of another.
                    let robust = matches!(loss, Loss::Huber | Loss::Smape);
                    assert!(
                        off <= if robust { 2.0 * (1e-5 + moved) } else { LEVELS },
                        "{what}: {off:e} from {}",
                        name(levels()[0])
                    );
                }
            }
        }
    }
    println!("levels differ by at most {worst:.1e}");
    // Were it nothing, no other level would have run.
    assert!(levels().len() == 1 || worst > 0.0);
}

#[test]
fn every_level_shows_the_plain_models_image() {
    let views = [view(70, 33)];
    let light = illumination();
    for form in Form::ALL {
        let setup = Setup::new(form, Silhouette::Bumped, EVERYTHING);
        let point = Point { params: params(), gains: vec![1.5.into()] };
        let plain = Reference::new(setup, &light, &views, Loss::L2, &[]).unwrap();
        for level in levels() {
            let mut engine = engine(setup, &views, Loss::L2, &[], true);
            engine.set_level(level);
            let image = engine.image(0, &point);
            for slot in 0..views[0].samples.groups() * LANES {
                let pixel = plain.pixel(0, slot, &point.params);
                for c in 0..4 {
                    let (got, want) = (f64::from(image[c][slot]), 1.5 * pixel[c].0);
                    // The conformance vectors' own figures for f32: 2e-6 + 2e-5 relative.
                    let what = || format!("{} {form:?} {slot} {c}: {got} {want}", name(level));
                    assert!((got - want).abs() < 2e-6 + 2e-5 * want.abs(), "{}", what());
                }
            }
        }
    }
}

#[test]
fn sums_are_the_same_to_the_bit_for_any_number_of_threads_at_every_level() {
    let views = [view(300, 34)];
    let unknowns = all_unknowns(1);
    let setup = Setup::new(Form::Corrected, Silhouette::Bumped, EVERYTHING);
    for level in levels() {
        let mut engine = engine(setup, &views, Loss::Huber, &unknowns, true);
        engine.set_level(level);
        let with_threads = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| engine.normal_equations(&point()))
        };
        assert_eq!(with_threads(1), with_threads(3), "{}", name(level));
    }
}

#[test]
fn fits_end_at_the_same_constants_whatever_instructions_ran() {
    let mut views = [view(120, 35)];
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, EVERYTHING);
    let unknowns = all_unknowns(1);
    let truth = Point { params: params(), gains: vec![1.0.into()] };
    // Targets that the model does not meet, so that a loss is left.
    let image = engine(setup, &views, Loss::L2, &unknowns, true).image(0, &truth);
    for (channel, plane) in image.iter().enumerate() {
        for (slot, value) in plane.iter().enumerate() {
            let off = 0.02 * (((slot * 7 + channel * 3) % 11) as f32 - 5.0) / 5.0;
            views[0].target.record_mut(slot / LANES)[channel][slot % LANES] = value + off;
        }
    }
    let mut start = truth.clone();
    start.params = skinfit::model::params::Params::defaults(Form::Corrected);
    let at = |level: Level| {
        let mut engine = engine(setup, &views, Loss::L2, &unknowns, true);
        engine.set_level(level);
        fit(&engine, &start, &FitOptions::default(), &mut |_| {}).unwrap()
    };
    let best = at(levels()[0]);
    assert!(best.loss_end < 0.1 * best.loss_start, "{} of {}", best.loss_end, best.loss_start);
    for level in levels().into_iter().skip(1) {
        let other = at(level);
        // Near a minimum the loss feels the constants' differences squared: what is left is the sums' own rounding.
        let off = (other.loss_end / best.loss_end - 1.0).abs();
        assert!(off < 1e-6, "{}: loss {} {}", name(level), other.loss_end, best.loss_end);
        for (a, b) in best.unknowns.iter().zip(&other.unknowns) {
            if let (Some(error), true) = (a.std_error, a.identifiable) {
                // A fit ends where a step would gain less than it can measure, a hundredth of a standard error.
                let off = (a.value - b.value).abs();
                assert!(off <= 0.01 * error, "{} {}: {} {}", name(level), a.unknown.name(), a.value, b.value);
            }
        }
    }
}

#[test]
fn environments_are_filtered_alike_at_every_level() {
    // A sky with a sun of a few texels, which no lobe may miss.
    let filter = Prefilter::new(&Cube::from_fn(32, |face, column, row| {
        let [x, y, _] = texel_direction(face, column, row, 32);
        let sun = if face == 2 && (20..22).contains(&column) && row == 9 { 500.0 } else { 0.0 };
        [0.5 + 0.3 * x + sun, 0.6 + 0.2 * y + 0.8 * sun, 0.4 + 0.5 * sun, 0.0]
    }));
    for exponent in [1.0, 32.0, 900.0] {
        let cube = |level: Level| filter.lobe_at(level, 16, exponent, |_| {});
        let best = cube(levels()[0]);
        for level in levels().into_iter().skip(1) {
            let other = cube(level);
            for (face, row, column) in (0..6 * 16 * 16).map(|i| (i / 256, i / 16 % 16, i % 16)) {
                let (a, b) = (best.texel(face, column, row), other.texel(face, column, row));
                let direction = texel_direction(face, column, row, 16);
                for c in 0..4 {
                    // Weights are powers in f32, each off by some 1e-6 at exponents of a thousand; sums are f64.
                    let off = (a[c] - b[c]).abs();
                    let most = 2e-6 * a[c].abs() + 1e-6;
                    assert!(off <= most, "{} {exponent} {direction:?}: {a:?} {b:?}", name(level));
                }
            }
        }
    }
}
