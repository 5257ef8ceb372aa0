//! Slopes of a scene's loss: the f64 reference beside its finite differences, and the engines beside the reference.

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::reference::Reference;
use skinfit::engine::{Objective, Task, Unknown};
use skinfit::prepare::Observed;

use crate::graphics::bench::gpu;

/// How near slopes are to be.
pub(crate) struct Nearness {
    /// The step of finite differences, in each unknown's unit.
    pub(crate) step: f64,
    /// Of slopes and differences, as a share of both loss and slope.
    pub(crate) difference: f64,
    /// Of an engine's loss, as a share.
    pub(crate) loss: f64,
    /// Of an engine's slopes: as a share of each, and of the largest.
    pub(crate) slope: [f64; 2],
}

/// What f64 and f32 leave: a step's square and roundings of 1e-11; some tens of roundings in each residual.
pub(crate) const EXACT: Nearness = Nearness { step: 1e-5, difference: 1e-6, loss: 1e-5, slope: [1e-4, 1e-6] };

/// Every unknown moves the loss, by as much as differences say, on every engine.
pub(crate) fn assert_slopes(observed: &Observed, unknowns: &[Unknown], near: &Nearness, what: &str) {
    let task = || Task { unknowns: unknowns.to_vec(), ..observed.task() };
    let (own, point) = (task(), observed.start());
    let exact = Reference::new(own.setup, &own.illumination, &own.views, own.loss, unknowns).unwrap();
    let (loss, slopes) = exact.gradient(&point);
    for (unknown, slope) in unknowns.iter().zip(&slopes) {
        let at = |by: f64| {
            let mut moved = point.clone();
            unknown.set(&mut moved, unknown.get(&point) + by);
            exact.loss(&moved)
        };
        let difference = (at(near.step) - at(-near.step)) / (2.0 * near.step);
        let close = (slope - difference).abs() <= near.difference * (loss + slope.abs());
        assert!(close, "{what}: {}: {slope} {difference}", unknown.name());
        assert!(*slope != 0.0, "{what}: {} moves nothing", unknown.name());
    }
    let most = slopes.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    let check = |engine: &dyn Objective, name: &str| {
        let (got, gradient) = engine.gradient(&point);
        assert!((got - loss).abs() <= near.loss * loss, "{what}: {name}: {got} {loss}");
        for ((unknown, got), want) in unknowns.iter().zip(&gradient).zip(&slopes) {
            let close = (got - want).abs() <= near.slope[0] * want.abs() + near.slope[1] * most;
            assert!(close, "{what}: {name}: {}: {got} {want}", unknown.name());
        }
        // Without slopes an engine runs other code.
        let alone = engine.loss(&point);
        assert!((alone - loss).abs() <= near.loss * loss, "{what}: {name}, the loss alone: {alone} {loss}");
    };
    check(&CpuEngine::new(task()).unwrap(), "cpu");
    let Some(gpu) = gpu() else { return };
    check(&GpuEngine::new(gpu, task(), &point, Memory::default()).unwrap(), "gpu");
}
