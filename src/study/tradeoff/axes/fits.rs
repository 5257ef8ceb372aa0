//! Fits of a scene's constants, timed beside one another.

use std::cell::RefCell;

use super::quality::ROUNDS;
use crate::StudyError;
use crate::engine::{BLOCK, Point};
use crate::fit::outcome::Outcome;
use crate::fit::{self, FitOptions, SolverKind};
use crate::reference::Difference;
use crate::render::image::Image;
use crate::subject::Subject;
use crate::timing::{Job, interleaved};
use crate::tradeoff::axis::{Idle, Rates, Setting, mark_pareto};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::benches::Benches;

/// A solver that has not ended by then is stopped; the best of them take some ten iterations.
pub(super) const MOST_ITERATIONS: u64 = 300;

/// About how many passes over the samples a solver takes; those that converge late are stopped.
pub(super) fn expected_passes(solver: SolverKind) -> f64 {
    match solver {
        SolverKind::Varpro | SolverKind::Lm => 12.0,
        // One an iteration, and now and then one more.
        SolverKind::Lbfgs | SolverKind::Adam => 1.1 * MOST_ITERATIONS as f64,
        // The simplex tries two places in most of its iterations.
        SolverKind::NelderMead => 1.7 * MOST_ITERATIONS as f64,
    }
}

/// Fits of a scene's constants, from the same start in different ways.
pub(super) struct Fits {
    subject: Subject,
}

/// What a fit is called, on every how many-th block of pixels it reads (one fit after another), and its solver.
type Run = (String, Vec<usize>, SolverKind);

impl Fits {
    pub(super) fn new(benches: &Benches<'_>) -> Result<Self, StudyError> {
        Ok(Self { subject: benches.to_fit()? })
    }

    /// Whether every scene has something to be fitted to.
    pub(super) fn apply(benches: &Benches<'_>) -> Result<(), Idle> {
        let targets = |bench: &Bench<'_>| bench.baked.scene.views.iter().any(|view| view.target.is_some());
        let all = benches.scenes.iter().all(targets);
        all.then_some(()).ok_or(Idle::Unasked("no view names a target to fit to"))
    }

    /// What the fits are of and what they leave out, for the words on how they were measured.
    pub(super) fn words(benches: &Benches<'_>) -> String {
        let several = match benches.names().as_slice() {
            [] => String::new(),
            names => format!(" Scenes: {}, fitted as one skin.", names.join(", ")),
        };
        match benches.held_out().as_slice() {
            [] => several,
            held => format!("{several} No fit sees {}; errors are of all views.", held.join(", ")),
        }
    }

    /// The seconds that [`Self::measure`] takes for runs of `passes` passes over all scenes.
    pub(super) fn seconds(passes: &[f64], rates: &[Rates]) -> f64 {
        let (pass, images) =
            rates.iter().fold((0.0, 0.0), |(pass, images), rates| (pass + rates.pass, images + rates.images));
        let runs: Vec<f64> = passes.iter().map(|passes| passes * pass).collect();
        ROUNDS.expected(&runs) + (1 + runs.len()) as f64 * images
    }

    /// How many blocks of pixels there are.
    pub(super) fn blocks(&self) -> usize {
        let views = self.subject.scenes.joint.engines().flat_map(|engine| engine.views().iter());
        views.map(|view| view.samples.groups().div_ceil(BLOCK)).sum()
    }

    /// Each run's setting, beside that of run `reference`, and how it ended.
    pub(super) fn measure(
        &self,
        runs: &[Run],
        reference: usize,
    ) -> Result<(Vec<Setting>, Vec<Outcome>), StudyError> {
        let outcomes: Vec<RefCell<Option<(Outcome, u64)>>> =
            runs.iter().map(|_| RefCell::new(None)).collect();
        let mut works: Vec<Box<dyn FnMut() -> Result<f64, StudyError> + '_>> = Vec::new();
        for (run, slot) in runs.iter().zip(&outcomes) {
            works.push(Box::new(move || {
                let (outcome, seconds, passes) = self.fit(run)?;
                *slot.borrow_mut() = Some((outcome, passes));
                Ok(seconds)
            }));
        }
        let mut jobs: Vec<Job<'_, StudyError>> =
            works.iter_mut().map(|job| &mut **job as Job<'_, StudyError>).collect();
        let timed = interleaved(ROUNDS, &mut jobs)?;
        drop(jobs);
        drop(works);
        let outcomes: Vec<(Outcome, u64)> = outcomes.into_iter().filter_map(RefCell::into_inner).collect();
        let images = |point: &Point| -> Result<Vec<Image>, StudyError> {
            Ok([self.subject.images(point)?, self.subject.held_out_images(point)?].concat())
        };
        let best = images(&outcomes[reference].0.end)?;
        let setting = |(i, (outcome, passes)): (usize, &(Outcome, u64))| -> Result<Setting, StudyError> {
            Ok(Setting {
                name: runs[i].0.clone(),
                choose: None,
                error: Difference::of_all(&best, &images(&outcome.end)?),
                cost: timed[i].seconds.median,
                time: Some(timed[i]),
                counts: vec![("passes", *passes as f64), ("loss", outcome.loss_end)],
                reference: i == reference,
                present: false,
                pareto: false,
            })
        };
        let mut settings: Vec<Setting> =
            outcomes.iter().enumerate().map(setting).collect::<Result<_, StudyError>>()?;
        mark_pareto(&mut settings);
        Ok((settings, outcomes.into_iter().map(|(outcome, _)| outcome).collect()))
    }

    /// One run: its last outcome, the seconds and passes of all its fits.
    fn fit(&self, (_, strides, solver): &Run) -> Result<(Outcome, f64, u64), StudyError> {
        let mut start = self.subject.scenes.start.clone();
        let (mut seconds, mut passes, mut last) = (0.0, 0, None);
        // Terms that earlier fits kept would be a present.
        let mut objective = self.subject.objective_anew()?;
        for &stride in strides {
            objective.set_stride(stride);
            let options = FitOptions {
                solver: *solver,
                max_iterations: Some(MOST_ITERATIONS),
                bounds: self.subject.scenes.bounds(),
                effects: Some(self.subject.scenes.effects()),
                ..FitOptions::default()
            };
            let outcome = fit::fit(&objective, &start, &options, &mut |_| {})
                .map_err(|error| StudyError::Fit { scene: self.subject.scenes.files(), error })?;
            seconds += outcome.seconds;
            passes += outcome.evaluations;
            start = outcome.end.clone();
            last = Some(outcome);
        }
        let outcome = last.map_or_else(|| self.subject.fit(&FitOptions::default()), Ok)?;
        Ok((outcome, seconds, passes))
    }
}
