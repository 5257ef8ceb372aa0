//! Tradeoffs: error against time for every approximation that the tool has.
//!
//! - [`axis`]: what an approximation's sweep is, and how long it will take; [`axes`]: each of them, a file each
//! - [`mod@bench`]: a scene at other settings: baked, sampled, shaded
//! - [`mod@choose`]: the cheapest settings within an error, or the best within a time
//! - [`files`]: the table, `results.csv`, `results.json`, plots; [`page`]: `report.html`

pub mod axes;
pub mod axis;
pub mod bench;
pub mod choose;
pub mod files;
pub mod page;

use std::path::{Path, PathBuf};

use super::StudyError;
use crate::fit::params_file::Foreign;
use crate::progress;
use axis::{Axis, Sweep};
use bench::Bench;
use choose::{Answer, Choice, Goal, Missed, choose};

/// What is to be swept, and how.
#[derive(Clone, Debug, Default)]
pub struct TradeoffOptions {
    /// Which axes, by name; none: every one.
    pub axes: Vec<String>,
    /// A parameter file to take constants from, instead of the scene's start values.
    pub params: Option<PathBuf>,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
    /// What is looked for beside the sweeps.
    pub goal: Option<Goal>,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// The sweeps, in the order of documentation.
    pub sweeps: Vec<Sweep>,
    /// The settings that meet the goal, where there is one, or that none do.
    pub answer: Option<Answer>,
    /// Axes that are still to be measured.
    pub pending: Vec<&'static str>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Who is told how a study goes on.
pub trait Watcher {
    /// About how many seconds each axis will take, before the first of them is swept.
    fn estimated(&mut self, seconds: &[(&'static str, f64)]);
    /// One more axis is measured; the others are still `pending`.
    ///
    /// # Errors
    /// When what there is cannot be kept.
    fn measured(&mut self, so_far: &Tradeoff) -> Result<(), StudyError>;
}

impl Tradeoff {
    /// The settings that meet the goal.
    #[must_use]
    pub fn choice(&self) -> Option<&Choice> {
        self.answer.as_ref()?.as_ref().ok()
    }

    /// That no settings meet the goal.
    #[must_use]
    pub fn missed(&self) -> Option<&Missed> {
        self.answer.as_ref()?.as_ref().err()
    }
}

/// Sweep a scene's axes. A `watcher` is told how long it will take, and of each axis once it is measured.
///
/// # Errors
/// When a stage refuses its input, or there is a goal and nothing to choose.
pub fn tradeoff(
    scene: &Path,
    options: &TradeoffOptions,
    mut watcher: Option<&mut dyn Watcher>,
) -> Result<Tradeoff, StudyError> {
    let bench = Bench::new(scene, options.params.as_deref(), options.cache.as_deref())?;
    let mut warnings = bench.baked.warnings.clone();
    warnings.extend(foreign(&bench));
    let axes = applying(&bench, options, &mut warnings)?;
    check_goal(options.goal, &axes)?;
    if let Some(watcher) = &mut watcher {
        watcher.estimated(&estimated(&bench, &axes)?);
    }
    let pending = axes.iter().map(|axis| axis.name()).collect();
    let mut found = Tradeoff { sweeps: Vec::new(), answer: None, pending, warnings };
    let bar = progress::bar("axes", axes.len() as u64);
    for axis in axes {
        bar.set_message(axis.name());
        found.sweeps.push(axis.sweep(&bench)?);
        found.pending.remove(0);
        if let Some(watcher) = &mut watcher {
            watcher.measured(&found)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    found.answer = options.goal.map(|goal| choose(&bench, &found.sweeps, goal)).transpose()?;
    Ok(found)
}

/// What is to be said of constants that were fitted with other effects than are measured.
fn foreign(bench: &Bench<'_>) -> Option<String> {
    let scene = &bench.baked.scene;
    let foreign = Foreign {
        file: bench.params?,
        fitted: bench.baked.fitted,
        scene: &scene.path,
        effects: scene.effects,
        params: &scene.params,
        chosen: &[],
    };
    foreign.words("measured", "If that is not meant, name the scene that was fitted.", true)
}

/// The axes that are wanted and that the scene asks for; what is left out is a warning, unless it was named.
fn applying(
    bench: &Bench<'_>,
    options: &TradeoffOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<&'static dyn Axis>, StudyError> {
    let wanted =
        |axis: &&dyn Axis| options.axes.is_empty() || options.axes.iter().any(|name| name == axis.name());
    let (mut axes, mut idle): (Vec<&'static dyn Axis>, Vec<String>) = (Vec::new(), Vec::new());
    for axis in axes::all().into_iter().filter(wanted) {
        match axis.applies(bench) {
            Ok(()) => axes.push(axis),
            Err(why) if options.axes.is_empty() => idle.push(format!("{}: {why}", axis.name())),
            Err(why) => return Err(StudyError::Idle { axis: axis.name(), why }),
        }
    }
    if !idle.is_empty() {
        warnings.push(format!("Left out, as the scene does not ask for it: {}.", idle.join("; ")));
    }
    Ok(axes)
}

/// About how many seconds each axis will take.
fn estimated(bench: &Bench<'_>, axes: &[&'static dyn Axis]) -> Result<Vec<(&'static str, f64)>, StudyError> {
    let bar = progress::bar("estimate", axes.len() as u64);
    let rates = bench.rates()?;
    let estimate = |axis: &&'static dyn Axis| {
        let seconds = axis.seconds(bench, rates);
        bar.inc(1);
        Ok((axis.name(), seconds?))
    };
    let seconds = axes.iter().map(estimate).collect();
    bar.finish_and_clear();
    seconds
}

/// Refuse a goal that no sweep of these axes could meet, before anything is measured.
fn check_goal(goal: Option<Goal>, axes: &[&dyn Axis]) -> Result<(), StudyError> {
    let goal = match goal {
        Some(Goal::Within(_)) => "an error to stay within",
        Some(Goal::Seconds(_)) => "a budget of time",
        None => return Ok(()),
    };
    if axes.iter().any(|axis| axis.settable()) {
        return Ok(());
    }
    let names = |axes: &[&dyn Axis]| axes.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ");
    let settable: Vec<&dyn Axis> = axes::all().into_iter().filter(|axis| axis.settable()).collect();
    Err(StudyError::NothingToSet { goal, swept: names(axes), settable: names(&settable) })
}
