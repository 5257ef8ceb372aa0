//! The rounds over maps and constants.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use burn::tensor::{Tensor, TensorData};

use super::evaluate::input_of;
use super::layer::Layer;
use super::layers::{layers, take_back};
use super::parts::{cuts, most_samples, shades};
use super::problem::{Observed, Problem};
use super::task::MapTask;
use super::{MapError, adam, cg};
use crate::bake::Illumination;
use crate::bake::stacks::Stack;
use crate::engine::cpu::CpuEngine;
use crate::engine::view::ObservedView;
use crate::engine::{Point, Task, Unknown};
use crate::fit::{self, FitOptions};
use crate::model::cube::Cube;
use crate::model::evaluate::Setup;
use crate::model::params::{Column, Param};
use crate::samples::ViewSamples;
use crate::samples::rows::Row;
use crate::scene::{MapSolver, Scene};
use crate::{Input, Shaded, SharedDevice, TensorError};

/// What was found.
pub struct FittedMaps {
    /// The maps: where they started and where they are.
    pub layers: Vec<Layer>,
    /// The constants that the maps of the start ask for.
    pub initial: Point,
    /// The constants.
    pub constants: Point,
    /// The cubes.
    pub illumination: Illumination,
    /// The views, their samples as the fitted maps show them.
    pub observed: Vec<ObservedView>,
    /// How it went: for each round each layer and then the constants.
    pub history: Vec<MapStep>,
    /// Whether somebody stopped it.
    pub interrupted: bool,
}

/// One step of a round.
#[derive(Clone, Debug, PartialEq)]
pub struct MapStep {
    /// The round, from 1.
    pub round: u32,
    /// The map, or `constants`.
    pub what: &'static str,
    /// The loss before it, priors of that map included.
    pub before: f64,
    /// The loss after it.
    pub after: f64,
    /// What of that are the map's priors, and not the images.
    pub prior: f64,
    /// Seconds since the start.
    pub seconds: f64,
}

/// Fit maps and constants by turns. `told` hears of each step.
///
/// # Errors
/// When no effect reads a map, a constant is free that maps hold, the device fails, or the constants cannot be fitted.
pub fn fit_maps(
    shared: &SharedDevice,
    task: MapTask<'_>,
    told: &mut dyn FnMut(&MapStep),
) -> Result<FittedMaps, MapError> {
    let clock = Instant::now();
    // Told before the constants are fitted, which takes a while.
    task.check()?;
    let fixed = Fixed::of(&task);
    let (initial, _) = fixed.solve_constants(&task.illumination, &task.observed, &task.start)?;
    let problem = problem(shared, &task, &fixed, &initial)?;
    let MapTask { scene, illumination, observed, .. } = task;
    let mut rounds = Rounds {
        shared,
        fixed,
        problem,
        constants: initial.clone(),
        illumination,
        observed,
        history: Vec::new(),
        clock,
        told,
    };
    for round in 1..=scene.fit.maps.rounds {
        if !rounds.fixed.stopped() {
            rounds.round(round)?;
        }
    }
    let interrupted = rounds.fixed.stopped();
    let Rounds { problem, constants, illumination, observed, history, .. } = rounds;
    Ok(FittedMaps {
        layers: problem.layers,
        initial,
        constants,
        illumination,
        observed,
        history,
        interrupted,
    })
}

/// The problem at the constants that the maps of the start ask for.
fn problem(
    shared: &SharedDevice,
    task: &MapTask<'_>,
    fixed: &Fixed<'_>,
    initial: &Point,
) -> Result<Problem, MapError> {
    let views: Vec<&ViewSamples> = task.observed.iter().map(|view| &view.samples).collect();
    let Fixed { setup, columns, .. } = fixed;
    let fields = setup.needs().fields;
    let cuts = cuts(&views, task.most_samples.unwrap_or_else(|| most_samples(shared, fields)));
    let shaded = Shaded { setup: *setup, params: &initial.params, columns, illumination: &task.illumination };
    let parts = shades(shared, &shaded, &views, &cuts)?;
    let reads = |input: Input| parts.iter().all(|(shade, _)| shade.reads(input));
    let levels = parts.iter().find_map(|(shade, _)| shade.levels()).cloned();
    let lobe = initial.params.scalar(Param::SpecularLobe);
    let layers = layers(shared, task, &cuts, &reads, (lobe, levels.as_ref().map(|(levels, _)| levels)))?;
    Ok(Problem::new(shared, parts, layers, levels)?)
}

/// What is the same in every round.
struct Fixed<'a> {
    scene: &'a Scene,
    setup: Setup,
    /// What the shading operation takes of the constants. Asked for once: an effect may be added meanwhile.
    columns: Vec<Column>,
    unknowns: Vec<Unknown>,
    held_out: Option<usize>,
    interrupt: Option<Arc<AtomicBool>>,
}

impl<'a> Fixed<'a> {
    fn of(task: &MapTask<'a>) -> Self {
        Self {
            scene: task.scene,
            setup: task.scene.setup(),
            columns: all_columns(),
            unknowns: task.unknowns.clone(),
            held_out: task.held_out,
            interrupt: task.interrupt.clone(),
        }
    }

    fn stopped(&self) -> bool {
        self.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::SeqCst))
    }

    /// The best constants for the maps as they are, and the loss before and after.
    fn solve_constants(
        &self,
        illumination: &Illumination,
        observed: &[ObservedView],
        start: &Point,
    ) -> Result<(Point, (f64, f64)), MapError> {
        let mut views = observed.to_vec();
        if let Some(view) = self.held_out {
            // It stays in its place, for the gains' sake, and counts nothing.
            let groups = views[view].samples.groups();
            views[view].weight = vec![Row::ZERO; groups];
        }
        let engine = CpuEngine::new(Task {
            setup: self.setup,
            illumination: Arc::new(illumination.clone()),
            views: views.into(),
            loss: self.scene.fit.loss,
            unknowns: self.unknowns.clone(),
        })?;
        let bounds = vec![self.scene.fit.bounds.clone()];
        let effects = Some(self.setup.effects);
        let options =
            FitOptions { bounds, effects, interrupt: self.interrupt.clone(), ..FitOptions::default() };
        let outcome = fit::fit(&engine, start, &options, &mut |_| {})?;
        Ok((outcome.end, (outcome.loss_start, outcome.loss_end)))
    }
}

/// The rounds: where they are, and how they went.
struct Rounds<'a, 't> {
    shared: &'a SharedDevice,
    fixed: Fixed<'a>,
    problem: Problem,
    constants: Point,
    illumination: Illumination,
    observed: Vec<ObservedView>,
    history: Vec<MapStep>,
    clock: Instant,
    told: &'t mut dyn FnMut(&MapStep),
}

impl Rounds<'_, '_> {
    /// Each layer, then the constants, as far as nobody interrupts.
    fn round(&mut self, round: u32) -> Result<(), MapError> {
        for index in 0..self.problem.layers.len() {
            if !self.fixed.stopped() {
                self.layer(round, index)?;
            }
        }
        take_back(&self.problem, &mut self.observed, &mut self.illumination, &self.constants)?;
        if self.fixed.stopped() { Ok(()) } else { self.solve_constants(round) }
    }

    fn layer(&mut self, round: u32, index: usize) -> Result<(), MapError> {
        let settings = &self.fixed.scene.fit;
        let held_out = self.fixed.held_out;
        let of = |(i, view)| Observed { view, gain: self.constants.gains[i], counts: held_out != Some(i) };
        let seen: Vec<Observed<'_>> = self.observed.iter().enumerate().map(of).collect();
        let before = self.problem.loss(&seen, settings.loss)? + self.problem.prior(index)?;
        self.problem.reweight(self.shared, &seen, settings.loss)?;
        let (steps, stopped) = (settings.maps.steps as usize, || self.fixed.stopped());
        match settings.maps.solver {
            MapSolver::ConjugateGradients => cg::solve(&mut self.problem, index, steps, &stopped)?,
            MapSolver::Adam => adam::solve(&mut self.problem, index, steps, settings.maps.rate, &stopped)?,
        };
        let prior = self.problem.prior(index)?;
        let after = self.problem.loss(&seen, settings.loss)? + prior;
        self.shared.gpu().check().map_err(TensorError::from)?;
        self.step(round, self.problem.layers[index].name, (before, after), prior);
        Ok(())
    }

    fn solve_constants(&mut self, round: u32) -> Result<(), MapError> {
        let (next, losses) =
            self.fixed.solve_constants(&self.illumination, &self.observed, &self.constants)?;
        self.constants = next;
        let columns = column_tensor(self.shared, &self.fixed.columns, &self.constants);
        let cube = |stack: Stack| {
            let (cube, _) = stack.at(&self.illumination, stack.place(&self.constants.params))?;
            Some((input_of(stack), cube_tensor(self.shared, &cube)))
        };
        let read = Stack::ALL.into_iter().filter(|stack| self.problem.reads(input_of(*stack)));
        let cubes: Vec<_> = read.filter_map(cube).collect();
        self.problem.set_constants(&columns, &cubes)?;
        self.step(round, "constants", losses, 0.0);
        Ok(())
    }

    fn step(&mut self, round: u32, what: &'static str, (before, after): (f64, f64), prior: f64) {
        let seconds = self.clock.elapsed().as_secs_f64();
        let step = MapStep { round, what, before, after, prior, seconds };
        (self.told)(&step);
        self.history.push(step);
    }
}

/// Every parameter but the exponent of E_s, which acts through its cube alone; each channel its own.
fn all_columns() -> Vec<Column> {
    let of = |param: Param| {
        if param.info().rgb { Column::per_channel(param).to_vec() } else { vec![Column::tied(param)] }
    };
    Param::all().filter(|&param| param != Param::SpecularLobe).flat_map(of).collect()
}

/// The columns' values.
pub(super) fn column_tensor(shared: &SharedDevice, columns: &[Column], point: &Point) -> Tensor<1> {
    let values: Vec<f32> = columns.iter().map(|column| column.get(&point.params) as f32).collect();
    let count = values.len();
    Tensor::from_data(TensorData::new(values, [count]), shared.device())
}

/// A cube with its borders, as the shading operation takes it.
pub(super) fn cube_tensor(shared: &SharedDevice, cube: &Cube<f32>) -> Tensor<2> {
    let texels = cube.padded().as_flattened().to_vec();
    let rows = texels.len() / 4;
    Tensor::from_data(TensorData::new(texels, [rows, 4]), shared.device())
}
