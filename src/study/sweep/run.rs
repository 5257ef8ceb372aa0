//! One job, from its scene to its figures.

use std::path::Path;

use super::command::Command;
use super::inputs::{Inputs, JobError};
use super::job::Job;
use super::result::{Figures, Findings, add_constant, number};
use super::studies;
use crate::StudyError;
use crate::engine::cpu::CpuEngine;
use crate::engine::{Objective as _, Task, Unknown};
use crate::fit::outcome::Outcome;
use crate::fit::{FitOptions, SolverKind, fit};
use crate::prepare::{Observed, PrepareOptions};
use crate::scene::Loss;
use crate::stability::lights::LightBox;
use crate::stability::scene::SweptScene;
use crate::stability::{Study, evaluators, kept};

/// Run a job. The figures, but for those that are times, are the same for any number of threads.
///
/// # Errors
/// When a stage refuses its input.
pub fn run(job: &Job, inputs: Inputs<'_>) -> Result<Findings, JobError> {
    let Inputs { scene, cache, .. } = inputs;
    let whole = |figures| Findings { figures, rows: Vec::new() };
    match job.command {
        Command::Fit => run_fit(job, scene, cache).map(whole),
        Command::Ablate => studies::ablation(job, inputs),
        Command::Tradeoff => studies::tradeoffs(job, inputs),
        Command::Stability => run_stability(job, scene, cache).map(whole),
    }
}

fn run_fit(job: &Job, scene: &Path, cache: Option<&Path>) -> Result<Figures, JobError> {
    let options = PrepareOptions { cache: cache.map(Path::to_owned), ..PrepareOptions::default() };
    let observed = Observed::new(scene, &options)?;
    let engine = observed.engine()?;
    let solver = job.get("solver").and_then(toml::Value::as_str).and_then(SolverKind::from_name);
    let options = FitOptions {
        solver: solver.unwrap_or_default(),
        max_iterations: job.whole("max_iterations"),
        starts: job.whole("starts").and_then(|n| u32::try_from(n).ok()).unwrap_or(1),
        seed: job.whole("seed").unwrap_or(0),
        bounds: vec![observed.scene.fit.bounds.clone()],
        effects: Some(observed.scene.effects),
        widths: observed.image_widths(),
        ..FitOptions::default()
    };
    let outcome = fit(&engine, &observed.start(), &options, &mut |_| {})?;
    let squares = Task { loss: Loss::L2, unknowns: Vec::new(), ..observed.task() };
    let squares = CpuEngine::new(squares).map_err(StudyError::from)?;
    let view = |index: usize| observed.scene.views.get(index).map_or("?", |view| &view.name);
    Ok(fit_figures(&outcome, squares.loss(&outcome.end).sqrt(), view))
}

fn fit_figures<'a>(outcome: &Outcome, rmse: f64, view: impl Fn(usize) -> &'a str) -> Figures {
    let mut figures = Figures::from([
        ("ending".to_owned(), outcome.ending.words().into()),
        ("evaluations".to_owned(), outcome.evaluations.into()),
        ("iterations".to_owned(), outcome.iterations.into()),
        ("loss_end".to_owned(), number(outcome.loss_end)),
        ("loss_start".to_owned(), number(outcome.loss_start)),
        // Whatever was minimised: the root of the mean squared difference of linear radiance.
        ("rmse".to_owned(), number(rmse)),
    ]);
    for unknown in &outcome.unknowns {
        let name = match unknown.unknown {
            Unknown::Gain(index, channels) => format!("gain.{}{}", view(index), channels.suffix()),
            other => other.name(),
        };
        add_constant(&mut figures, &name, unknown.value, unknown.std_error);
    }
    figures
}

fn run_stability(job: &Job, scene: &Path, cache: Option<&Path>) -> Result<Figures, JobError> {
    let swept = SweptScene::read(String::new(), scene, cache)?;
    let whole =
        |key: &str, default: u64| usize::try_from(job.whole(key).unwrap_or(default)).unwrap_or(usize::MAX);
    let study = Study {
        scenes: vec![swept],
        lights: LightBox::new(None),
        kept: kept::built_in()?,
        seed: job.whole("seed").unwrap_or(0),
        cases: whole("cases", 10_000),
        pixels: whole("pixels", 10_000_000),
    };
    // The evaluators that every machine has.
    let report = study.run(&evaluators(), &|_| {});
    let mut figures = Figures::from([
        ("failures".to_owned(), report.failures().join("; ").into()),
        ("new_cases".to_owned(), report.found.len().into()),
    ]);
    for (index, name) in report.evaluators.iter().enumerate() {
        let tally = &report.random[index];
        figures.insert(format!("tried.{name}"), tally.tried.into());
        figures.insert(format!("failed.{name}"), tally.failed.into());
        figures.insert(format!("deviation.{name}"), number(tally.worst.deviation));
    }
    Ok(figures)
}
