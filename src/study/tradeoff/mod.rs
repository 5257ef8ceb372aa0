//! Tradeoffs: error against time for every approximation that the tool has.
//!
//! - [`axis`]: what an approximation's sweep is; [`axes`]: each of them, a file each
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
    /// What the user should know.
    pub warnings: Vec<String>,
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

/// Sweep a scene's axes.
///
/// # Errors
/// When a stage refuses its input, or there is a goal and nothing to choose.
pub fn tradeoff(scene: &Path, options: &TradeoffOptions) -> Result<Tradeoff, StudyError> {
    let bench = Bench::new(scene, options.params.as_deref(), options.cache.as_deref())?;
    let wanted =
        |axis: &&dyn Axis| options.axes.is_empty() || options.axes.iter().any(|name| name == axis.name());
    let all = axes::all();
    let mut warnings = bench.prepared.warnings.clone();
    let (mut axes, mut idle): (Vec<&dyn Axis>, Vec<String>) = (Vec::new(), Vec::new());
    for axis in all.iter().copied().filter(wanted) {
        match axis.applies(&bench) {
            Ok(()) => axes.push(axis),
            Err(why) if options.axes.is_empty() => idle.push(format!("{}: {why}", axis.name())),
            Err(why) => return Err(StudyError::Idle { axis: axis.name(), why }),
        }
    }
    if !idle.is_empty() {
        warnings.push(format!("Left out, as the scene does not ask for it: {}.", idle.join("; ")));
    }
    check_goal(options.goal, &axes)?;
    let bar = progress::bar("axes", axes.len() as u64);
    let mut sweeps = Vec::new();
    for axis in axes {
        bar.set_message(axis.name());
        sweeps.push(axis.sweep(&bench)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let answer = options.goal.map(|goal| choose(&bench, &sweeps, goal)).transpose()?;
    Ok(Tradeoff { sweeps, answer, warnings })
}

/// Refuse a goal that no sweep of these axes could meet, before anything is measured.
fn check_goal(goal: Option<Goal>, axes: &[&dyn Axis]) -> Result<(), StudyError> {
    let goal = match goal {
        Some(Goal::Within(_)) => "--within",
        Some(Goal::Seconds(_)) => "--budget",
        None => return Ok(()),
    };
    if axes.iter().any(|axis| axis.settable()) {
        return Ok(());
    }
    let names = |axes: &[&dyn Axis]| axes.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ");
    let settable: Vec<&dyn Axis> = axes::all().into_iter().filter(|axis| axis.settable()).collect();
    Err(StudyError::NothingToSet { goal, swept: names(axes), settable: names(&settable) })
}
