//! Cases on the engines.
//!
//! Engines add residuals up. Each case is a view whose target is 1 below black: with all gains at 0 but one channel's of one
//! view, the gradient is how that channel moves, times what it shows and 1.

use std::ops::Range;
use std::sync::Arc;

use fearless_simd::Level;
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Engine, Point, Task, Unknown};
use skinfit::gpu::Gpu;
use skinfit::model::gain::Gain;
use skinfit::model::params::Column;
use skinfit::samples::ViewSamples;
use skinfit::samples::rows::{Row, Rows};
use skinfit::scene::Loss;

use super::cases::{Case, Cases, Shown};

const TARGET: f32 = -1.0;

/// Samples of which `count` pixels are observed.
fn observed(samples: ViewSamples, count: usize) -> ObservedView {
    let groups = samples.groups();
    let (mut target, mut weight) = (Rows::new(3, groups), vec![Row::ZERO; groups]);
    (0..3).for_each(|c| target.plane_mut(c).for_each(|number| *number = TARGET));
    let counts = weight.iter_mut().flat_map(|row| row.iter_mut());
    counts.take(count).for_each(|counts| *counts = 1.0);
    ObservedView { samples, target, weight, clip: None }
}

/// What cases differ in is free, whether or not slopes are wanted: nothing that it moves is kept.
fn task(cases: &Cases) -> Task {
    let view = |which: Range<usize>| observed(cases.samples(which.clone()), which.len());
    Task {
        setup: cases.setup,
        illumination: Arc::new(cases.environment.illumination()),
        views: cases.views().into_iter().map(view).collect::<Vec<_>>().into(),
        loss: Loss::L2,
        unknowns: cases.columns.iter().map(|&param| Unknown::Param(Column::tied(param))).collect(),
    }
}

/// Where a case is, each view with its gain.
fn point(cases: &Cases, case: &Case, gain: impl Fn(usize) -> Gain) -> Point {
    Point { params: case.params.clone(), gains: (0..cases.views().len()).map(gain).collect() }
}

fn shown_by<E: Engine>(
    cases: &Cases,
    engine: &E,
    image: impl Fn(&E, usize, &Point) -> Vec<Vec<f32>>,
) -> Vec<Shown> {
    let shown = |(i, case): (usize, &Case)| {
        let (view, slot) = cases.place(i);
        let planes = image(engine, view, &point(cases, case, |_| Gain::ONE));
        let rgb = [0, 1, 2].map(|c| f64::from(planes[c][slot]));
        let slopes = if cases.slopes { slopes(cases, engine, (case, view), rgb) } else { Vec::new() };
        Shown { rgb, slopes }
    };
    cases.each.iter().enumerate().map(shown).collect()
}

/// How a case that shows `rgb` moves with each unknown.
fn slopes(
    cases: &Cases,
    engine: &impl Engine,
    (case, view): (&Case, usize),
    rgb: [f64; 3],
) -> Vec<Option<[f64; 3]>> {
    let by_channel = [0, 1, 2].map(|c| {
        let one = Gain(std::array::from_fn(|channel| f64::from(u8::from(channel == c))));
        let picked = |other| if other == view { one } else { Gain([0.0; 3]) };
        let (_, gradient) = engine.gradient(&point(cases, case, picked));
        let residual = rgb[c] - f64::from(TARGET);
        // Of the mean of squares.
        gradient.into_iter().map(|slope| 0.5 * engine.weight() * slope / residual).collect::<Vec<f64>>()
    });
    (0..cases.columns.len()).map(|k| Some([0, 1, 2].map(|c| by_channel[c][k]))).collect()
}

/// On the processor, with the instructions of a level.
pub(super) fn on_processor(level: Level, cases: &Cases) -> Vec<Shown> {
    let mut engine = CpuEngine::new(task(cases)).unwrap();
    engine.set_level(level);
    shown_by(cases, &engine, CpuEngine::image)
}

/// On an adapter.
pub(super) fn on_adapter(gpu: &Gpu, cases: &Cases) -> Vec<Shown> {
    let start = point(cases, &cases.each[0], |_| Gain::ONE);
    let engine = GpuEngine::new(gpu, task(cases), &start, Memory::default()).unwrap();
    shown_by(cases, &engine, |engine, view, point| engine.image(view, point).unwrap())
}
