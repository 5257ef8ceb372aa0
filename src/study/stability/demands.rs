//! Hard cases of engines and fits: clipped targets, nothing to compare, what no pixel asks for, ten million
//! pixels (MODEL 7's last rows).

use std::sync::Arc;

use super::case::FragmentInputs;
use super::engine_factory::EngineFactory;
use super::lights::LightBox;
use super::objectives::{ordinary_task, targets, view};
use crate::bake::Illumination;
use crate::engine::view::ObservedView;
use crate::engine::{NormalEquations, Point, Task, Unknown};
use crate::fit::outcome::Outcome;
use crate::fit::{FitError, FitOptions, fit};
use crate::model::cube::Cube;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::fragment::Fragment;
use crate::model::gain::Gain;
use crate::model::params::{Column, Param, Params};
use crate::samples::rows::Row;
use crate::samples::surface_records::Asked;
use crate::samples::{LANES, SurfaceRecords, ViewSamples};
use crate::scene::Loss;
use crate::scene::view::Clip;

/// What a demand needs beside the engine.
pub struct Circumstances<'a> {
    /// The lights.
    pub lights: &'a LightBox,
    /// Pixels of the case that sums over many.
    pub pixels: usize,
}

/// How a demand was met: how far the engine is from what is wanted (relative, with what is allowed), or in
/// what way it failed.
pub type Met = Result<(f64, f64), String>;

/// Something that every engine must do.
pub struct Demand {
    /// Its name in tables.
    pub name: &'static str,
    /// What is hard about it.
    pub hard: &'static str,
    /// The check.
    pub check: fn(&dyn EngineFactory, &Circumstances<'_>) -> Met,
}

/// Every demand.
pub const DEMANDS: [Demand; 7] = [
    Demand {
        name: "target clipped at white",
        hard: "beyond the clip nothing is asked: no loss, no gradient",
        check: |engine, given| clipped(engine, given, Clip { low: -1.0, high: 1e-3 }, 1e-3),
    },
    Demand {
        name: "target clipped at black",
        hard: "below the clip nothing is asked: no loss, no gradient",
        check: |engine, given| clipped(engine, given, Clip { low: 1e6, high: 2e6 }, 1e6),
    },
    Demand {
        name: "parameter without a pixel",
        hard: "where S.z is 0 nothing tells the rim's exponent: it stays, and is told so",
        check: unidentifiable,
    },
    Demand { name: "empty mask", hard: "no pixel counts: a clear error, sums of 0", check: empty_mask },
    Demand { name: "all-zero target", hard: "the best weight is at its bound of 0", check: black_target },
    Demand { name: "one pixel", hard: "one residual, one unknown: the exact answer", check: one_pixel },
    Demand {
        name: "many pixels",
        hard: "sums of as many numbers stay within 1e-6, the same for any number of threads",
        check: many_pixels,
    },
];

fn equations(engine: &dyn EngineFactory, task: &Task, point: &Point) -> Result<NormalEquations, String> {
    let mut equations = None;
    engine.with(task, point, &mut |objective| equations = Some(objective.normal_equations(point)))?;
    equations.ok_or_else(|| "no engine was made".to_owned())
}

fn finite(equations: &NormalEquations) -> Result<(), String> {
    let scalars = [equations.loss, equations.residual, equations.weight];
    if scalars.iter().chain(&equations.jtr).chain(&equations.jtj).all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err("sums are not finite".to_owned())
    }
}

/// Every fragment is beyond the clip of `target`: loss, gradient and normal equations are 0.
fn clipped(engine: &dyn EngineFactory, given: &Circumstances<'_>, clip: Clip, target: f32) -> Met {
    for loss in Loss::ALL {
        let (task, point) = ordinary_task(&[FragmentInputs::ORDINARY; 20], given.lights);
        let (clip, target) = (Some(clip), targets(&[target; 4], 2));
        let view = ObservedView { clip, target, ..task.views[0].clone() };
        let task = Task { loss, views: Arc::new([view]), ..task };
        let equations = equations(engine, &task, &point)?;
        finite(&equations)?;
        let largest = [equations.loss, equations.residual].into_iter();
        let largest = largest.chain(equations.jtr).chain(equations.jtj).fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest != 0.0 {
            return Err(format!("{} asks for {largest:e} beyond the clip", loss.name()));
        }
    }
    Ok((0.0, 0.0))
}

/// A flat grey surface under an even light of 1: its value is `base_weight` times its albedo.
fn grey(fragments: &[FragmentInputs], target: f32, free: &[Param]) -> (Task, Point) {
    let effects = Effects::of(&[Effect::Diffuse, Effect::Rim]);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let even = Cube::from_fn(2, |_, _, _| [1.0_f32; 4]);
    let task = Task {
        setup,
        illumination: Arc::new(Illumination { irradiance: Some(even), ..Illumination::default() }),
        views: Arc::new([ObservedView {
            target: targets(&[target; 3], fragments.len().div_ceil(LANES)),
            ..view(setup, fragments, [0.0; 4])
        }]),
        loss: Loss::L2,
        unknowns: free.iter().map(|&p| Unknown::Param(Column::tied(p))).collect(),
    };
    (task, Point { params: Params::defaults(Form::Corrected), gains: vec![Gain::ONE] })
}

/// Facing the eye, where there is no rim.
const FACING: FragmentInputs = FragmentInputs {
    texel: [0.5, 0.5, 1.0],
    view: [0.0, 0.0, -1.0],
    silhouette: 0.0,
    albedo: [0.5; 3],
    ..FragmentInputs::ORDINARY
};

fn solve(engine: &dyn EngineFactory, task: &Task, point: &Point) -> Result<Outcome, FitError> {
    let mut outcome = None;
    let made = engine.with(task, point, &mut |objective| {
        outcome = Some(fit(objective, point, &FitOptions::default(), &mut |_| {}));
    });
    let lost = |reason: String| FitError::Solver { solver: "none", reason };
    made.map_err(lost)?;
    outcome.unwrap_or_else(|| Err(lost("no engine was made".to_owned())))
}

fn unidentifiable(engine: &dyn EngineFactory, _: &Circumstances<'_>) -> Met {
    let (task, point) = grey(&[FACING; 20], 0.25, &[Param::BaseWeight, Param::RimExponent]);
    let outcome = solve(engine, &task, &point).map_err(|error| error.to_string())?;
    let [base, exponent] = &outcome.unknowns[..] else { return Err("unknowns are lost".to_owned()) };
    if exponent.value != exponent.start || exponent.identifiable {
        return Err(format!("rim_exponent went from {} to {}", exponent.start, exponent.value));
    }
    // 0.5 x 0.5 = 0.25 is exact in an f32; the solver's last step is tested by 1e-5.
    Ok(((base.value - 0.5).abs(), 1e-5))
}

fn empty_mask(engine: &dyn EngineFactory, _: &Circumstances<'_>) -> Met {
    let (task, point) = grey(&[FACING; 20], 0.25, &[Param::BaseWeight]);
    let seen = task.views[0].clone();
    let view = ObservedView { weight: vec![Row::ZERO; seen.weight.len()], ..seen };
    let task = Task { views: Arc::new([view]), ..task };
    finite(&equations(engine, &task, &point)?)?;
    match solve(engine, &task, &point) {
        Err(FitError::Empty) => Ok((0.0, 0.0)),
        Err(other) => Err(format!("another error: {other}")),
        Ok(_) => Err("a fit of nothing was not refused".to_owned()),
    }
}

fn black_target(engine: &dyn EngineFactory, _: &Circumstances<'_>) -> Met {
    let mut worst = 0.0_f64;
    for loss in Loss::ALL {
        let (task, point) = grey(&[FACING; 20], 0.0, &[Param::BaseWeight]);
        let task = Task { loss, ..task };
        let outcome = solve(engine, &task, &point).map_err(|error| error.to_string())?;
        worst = worst.max(outcome.unknowns[0].value.abs());
        if !outcome.loss_end.is_finite() {
            return Err(format!("{} ends at {}", loss.name(), outcome.loss_end));
        }
    }
    // Robust losses close in by a factor an iteration, until one gains less than 1e-8 of the loss.
    Ok((worst, 1e-4))
}

fn one_pixel(engine: &dyn EngineFactory, _: &Circumstances<'_>) -> Met {
    let (task, point) = grey(&[FACING], 0.375, &[Param::BaseWeight]);
    let outcome = solve(engine, &task, &point).map_err(|error| error.to_string())?;
    Ok(((outcome.unknowns[0].value - 0.75).abs(), 1e-5))
}

/// Values of pixel `i`: some 2^16 of them, so that none repeats within a chunk.
fn shade_of(i: usize) -> f32 {
    0.25 + (i % 65_521) as f32 / 131_072.0
}

/// One number that differs from pixel to pixel, and as few others as there can be.
fn many_pixels(engine: &dyn EngineFactory, given: &Circumstances<'_>) -> Met {
    let groups = given.pixels.div_ceil(LANES);
    let count = groups * LANES;
    let (task, point) = grey(&[FACING], 0.0, &[Param::BaseWeight]);
    let facing = FACING.fragment(task.setup, 0.0_f32);
    let mut surface = SurfaceRecords::new(Asked { albedo: true, ..Asked::default() }, groups);
    for slot in 0..count {
        surface.set(slot, &Fragment { albedo: [shade_of(slot); 3], ..facing }, 1.0);
    }
    let samples = ViewSamples {
        group_start: (0..=groups as u32).collect(),
        pixel: (0..count as u32).collect(),
        surface,
        ..ViewSamples::default()
    };
    let target = targets(&[0.0; 3], groups);
    let view = ObservedView { samples, target, weight: Vec::new(), clip: None };
    let task = Task { views: Arc::new([view]), ..task };
    // The same numbers, summed in pairs in f64.
    let want = pairwise(0, count, &|i| f64::from(shade_of(i)).powi(2)) * 3.0;
    let mut sums: Vec<NormalEquations> = Vec::new();
    let pools = [1, 2, 5].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build());
    engine.with(&task, &point, &mut |objective| {
        let one = |pool: &rayon::ThreadPool| pool.install(|| objective.normal_equations(&point));
        sums = pools.iter().flatten().map(one).collect();
    })?;
    let mut worst = 0.0_f64;
    for got in &sums {
        finite(got)?;
        if *got != sums[0] {
            return Err("other sums for another number of threads".to_owned());
        }
        let all = [got.residual, got.jtr[0], got.jtj[0]];
        worst = all.iter().fold(worst, |most, sum| most.max((sum / want - 1.0).abs()));
    }
    if sums.len() == 3 { Ok((worst, 1e-6)) } else { Err("a thread pool could not be made".to_owned()) }
}

fn pairwise(first: usize, end: usize, term: &impl Fn(usize) -> f64) -> f64 {
    if end - first <= 64 {
        return (first..end).map(term).sum();
    }
    let middle = first + (end - first) / 2;
    pairwise(first, middle, term) + pairwise(middle, end, term)
}
