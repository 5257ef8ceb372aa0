//! Tradeoffs: error against time for every approximation that the tool has.
//!
//! - [`axis`]: what an approximation's sweep is, and how long it will take; [`axes`]: each of them, a file each
//! - [`mod@bench`]: a scene at other settings: baked, sampled, shaded; [`benches`]: all scenes of a study
//! - [`settings`]: what of a scene sweeps change; `pooled`: the sweeps of several scenes as one
//! - [`mod@choose`]: the cheapest settings within an error, or the best within a time
//! - [`files`]: the table, `results.csv`, `results.json`, plots; [`page`]: `report.html`

pub mod axes;
pub mod axis;
pub mod bench;
pub mod benches;
pub mod choose;
pub mod files;
pub mod page;
mod pooled;
pub mod settings;

use std::path::PathBuf;

use super::StudyError;
use crate::fit::params_file::Foreign;
use crate::progress;
use axis::{Axis, Idle, Sweep};
use bench::Bench;
use benches::Benches;
use choose::{Answer, Choice, Goal, Missed, choose};

/// What is to be swept, and how.
#[derive(Clone, Debug, Default)]
pub struct TradeoffOptions {
    /// Which axes, by name; none: every one.
    pub axes: Vec<String>,
    /// A parameter file to take constants from, instead of the scene's start values.
    pub params: Option<PathBuf>,
    /// What the study's fits leave out: views, scenes, or `SCENE/VIEW`.
    pub hold_out: Vec<String>,
    /// Where bakes are kept.
    pub cache: Option<PathBuf>,
    /// What is looked for beside the sweeps.
    pub goal: Option<Goal>,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// The scenes' names, where there are several.
    pub scenes: Vec<String>,
    /// The views that the study's fits left out.
    pub held_out: Vec<String>,
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
    /// When the study so far cannot be kept.
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

/// Sweep the axes of a scene, or of several of one skin. A `watcher` is told how long it will take, and of each axis once it is measured.
///
/// # Errors
/// When a stage refuses its input, there is a goal and nothing to choose, or something is held out and no axis fits.
pub fn tradeoff(
    scenes: &[PathBuf],
    options: &TradeoffOptions,
    mut watcher: Option<&mut dyn Watcher>,
) -> Result<Tradeoff, StudyError> {
    let (params, cache) = (options.params.as_deref(), options.cache.as_deref());
    let benches = Benches::new(scenes, params, cache, &options.hold_out)?;
    let mut warnings = Vec::new();
    for bench in &benches.scenes {
        warnings.extend(bench.baked.warnings.iter().cloned());
        warnings.extend(foreign(bench));
    }
    let axes = applying(&benches, options, &mut warnings)?;
    check_goal(options.goal, &axes)?;
    check_hold_out(options, &axes)?;
    if let Some(watcher) = &mut watcher {
        watcher.estimated(&estimated(&benches, &axes)?);
    }
    let pending = axes.iter().map(|axis| axis.name()).collect();
    let (scenes, held_out) = (benches.names(), benches.held_out());
    let mut found = Tradeoff { scenes, held_out, sweeps: Vec::new(), answer: None, pending, warnings };
    let bar = progress::bar("axes", axes.len() as u64);
    for axis in axes {
        bar.set_message(axis.name());
        found.sweeps.push(axis.sweep(&benches)?);
        found.pending.remove(0);
        if let Some(watcher) = &mut watcher {
            watcher.measured(&found)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    found.answer = options.goal.map(|goal| choose(&benches, &found.sweeps, goal)).transpose()?;
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
    benches: &Benches<'_>,
    options: &TradeoffOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<&'static dyn Axis>, StudyError> {
    let wanted =
        |axis: &&dyn Axis| options.axes.is_empty() || options.axes.iter().any(|name| name == axis.name());
    let mut axes: Vec<&'static dyn Axis> = Vec::new();
    let (mut unasked, mut apart): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    for axis in axes::all().into_iter().filter(wanted) {
        let all = options.axes.is_empty();
        match axis.applies(benches) {
            Ok(()) => axes.push(axis),
            Err(Idle::Unasked(why)) if all => unasked.push(format!("{}: {why}", axis.name())),
            Err(Idle::Apart(why)) if all => apart.push(format!("{}: {why}", axis.name())),
            Err(Idle::Unasked(why)) => return Err(StudyError::Idle { axis: axis.name(), why }),
            Err(Idle::Apart(why)) => return Err(StudyError::Apart { axis: axis.name(), why }),
        }
    }
    if !unasked.is_empty() {
        warnings.push(format!("Left out, as the scene does not ask for it: {}.", unasked.join("; ")));
    }
    if !apart.is_empty() {
        let apart = apart.join("; ");
        warnings.push(format!("Left out, as the scenes cannot be taken together along it: {apart}."));
    }
    Ok(axes)
}

/// About how many seconds each axis will take.
fn estimated(
    benches: &Benches<'_>,
    axes: &[&'static dyn Axis],
) -> Result<Vec<(&'static str, f64)>, StudyError> {
    let bar = progress::bar("estimate", axes.len() as u64);
    let rates = benches.rates()?;
    let estimate = |axis: &&'static dyn Axis| {
        let seconds = axis.seconds(benches, &rates);
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
    let settable: Vec<&dyn Axis> = axes::all().into_iter().filter(|axis| axis.settable()).collect();
    Err(StudyError::NothingToSet { goal, swept: names(axes), settable: names(&settable) })
}

/// Refuse to hold something out where no axis fits anything.
fn check_hold_out(options: &TradeoffOptions, axes: &[&dyn Axis]) -> Result<(), StudyError> {
    if options.hold_out.is_empty() || axes.iter().any(|axis| axis.fits()) {
        return Ok(());
    }
    let fitting: Vec<&dyn Axis> = axes::all().into_iter().filter(|axis| axis.fits()).collect();
    Err(StudyError::NothingFitted { swept: names(axes), fitting: names(&fitting) })
}

/// The axes' names.
fn names(axes: &[&dyn Axis]) -> String {
    axes.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ")
}
