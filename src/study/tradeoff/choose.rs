//! The reverse of a sweep: the cheapest settings within an error, or the most accurate within a time.
//!
//! Along each axis of the scene file one setting is taken. Errors of different approximations are independent
//! enough that their squares add; seconds add. Whether they do is then measured: the scene with all settings
//! together is compared with the scene at every axis' reference. If it is off by more than the goal allows, less
//! is asked of the sum, and other settings are taken.

use serde::Serialize;

use super::axis::{Choose, Setting, Sweep};
use super::benches::{Benches, difference};
use super::settings::Settings;
use crate::StudyError;
use crate::reference::Difference;
use crate::report::number;

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// An error of the images, relative to their root mean square, at the least cost.
    Within(f64),
    /// Seconds of baking, tracing and a pass, with the least error.
    Seconds(f64),
}

/// Settings that meet the goal.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// The goal, in words.
    pub goal: String,
    /// The setting along each axis.
    pub settings: Vec<(&'static str, String)>,
    /// What a scene file must say; of several scenes each one's.
    #[serde(skip)]
    pub keys: Vec<Choose>,
    /// The error of all settings together, measured.
    pub error: Difference,
    /// The error that the sum of squares foretold.
    pub foretold: f64,
    /// The seconds of all axes together.
    pub seconds: f64,
    /// The seconds of every axis' reference.
    pub reference_seconds: f64,
}

/// A goal that no settings meet.
#[derive(Clone, Debug, Serialize)]
pub struct Missed {
    /// The goal, in words.
    pub goal: String,
    /// The least that was reached, in words.
    pub least: String,
}

/// What the search for settings ends with.
pub type Answer = Result<Choice, Missed>;

/// How often the choice is made again, with a smaller bound on the sum of the errors' squares.
const ATTEMPTS: usize = 24;
/// The factor on that bound, each time.
const TIGHTER: f64 = 0.8;

/// Choose a setting along each axis, and measure them together.
///
/// # Errors
/// When a stage fails.
pub fn choose(benches: &Benches<'_>, sweeps: &[Sweep], goal: Goal) -> Result<Answer, StudyError> {
    let axes: Vec<Vec<&Setting>> = sweeps.iter().map(candidates).filter(|axis| !axis.is_empty()).collect();
    let names: Vec<&'static str> =
        sweeps.iter().filter(|sweep| !candidates(sweep).is_empty()).map(|sweep| sweep.axis).collect();
    let references: Vec<&Setting> = sweeps.iter().flat_map(reference).collect();
    let exact = benches.images(&|own| settings(own, &references))?;
    let mut asked = match goal {
        Goal::Within(error) => error,
        Goal::Seconds(_) => f64::INFINITY,
    };
    let mut least = f64::INFINITY;
    for _ in 0..ATTEMPTS {
        let found = match goal {
            Goal::Within(_) => best(&axes, &|_, error| error <= asked, &|seconds, error| (seconds, error)),
            Goal::Seconds(most) => {
                best(&axes, &|seconds, _| seconds <= most, &|seconds, error| (error, seconds))
            }
        };
        let Some(found) = found else { break };
        let error = difference(&exact, &benches.images(&|own| settings(own, &found))?);
        let (seconds, foretold) = sums(&found);
        if matches!(goal, Goal::Within(most) if error.relative > most) {
            least = least.min(error.relative);
            asked *= TIGHTER;
            continue;
        }
        return Ok(Ok(Choice {
            goal: words(goal),
            settings: names.iter().copied().zip(found.iter().map(|setting| setting.name.clone())).collect(),
            keys: found.iter().filter_map(|setting| setting.choose).collect(),
            error,
            foretold,
            seconds,
            reference_seconds: sums(&references).0,
        }));
    }
    let least = match goal {
        Goal::Within(_) if least.is_finite() => {
            format!("those tried are off by {:.4}% or more", 100.0 * least)
        }
        Goal::Within(_) => "no settings' errors sum to so little".to_owned(),
        Goal::Seconds(_) => {
            let cheapest = best(&axes, &|_, _| true, &|seconds, error| (seconds, error));
            cheapest.map_or_else(String::new, |cheapest| least_time(&names, &cheapest))
        }
    };
    Ok(Err(Missed { goal: words(goal), least }))
}

/// What the cheapest settings take, in words.
fn least_time(names: &[&str], cheapest: &[&Setting]) -> String {
    let settings = names.iter().zip(cheapest).map(|(axis, setting)| format!("{axis} {}", setting.name));
    let settings: Vec<String> = settings.collect();
    format!("the cheapest take {:.3} ms ({})", 1e3 * sums(cheapest).0, settings.join(", "))
}

fn words(goal: Goal) -> String {
    match goal {
        Goal::Within(error) => format!("within {:.4}%", 100.0 * error),
        Goal::Seconds(seconds) => format!("within {} ms", number(1e3 * seconds, 3)),
    }
}

/// The settings of an axis that a scene file can have; only those that are Pareto-optimal are worth choosing,
/// and the reference is always there.
fn candidates(sweep: &Sweep) -> Vec<&Setting> {
    sweep.settings.iter().filter(|s| s.choose.is_some() && (s.pareto || s.reference)).collect()
}

fn reference(sweep: &Sweep) -> Option<&Setting> {
    sweep.settings.iter().find(|setting| setting.reference && setting.choose.is_some())
}

/// The scene's own settings with these in their place.
fn settings(mut settings: Settings, chosen: &[&Setting]) -> Settings {
    for choose in chosen.iter().filter_map(|setting| setting.choose) {
        match choose {
            Choose::Quality(knob, value) => *knob.of(&mut settings.quality) = value,
            Choose::Silhouette(silhouette) => settings.silhouette = silhouette,
        }
    }
    settings
}

/// The seconds of a setting, where its cost is a time; operations of a shader take none of it.
fn seconds_of(setting: &Setting) -> f64 {
    // Of what a scene file can have, whatever was timed has its cost in seconds.
    setting.time.map_or(0.0, |_| setting.cost)
}

/// Seconds, and the root of the sum of squared errors.
fn sums(settings: &[&Setting]) -> (f64, f64) {
    let seconds = settings.iter().map(|setting| seconds_of(setting)).sum();
    (seconds, settings.iter().map(|setting| setting.error.relative.powi(2)).sum::<f64>().sqrt())
}

/// The combination that is `allowed` and first by `order`: axis by axis, keeping only what nothing beats in
/// both seconds and error.
fn best<'a>(
    axes: &[Vec<&'a Setting>],
    allowed: &dyn Fn(f64, f64) -> bool,
    order: &dyn Fn(f64, f64) -> (f64, f64),
) -> Option<Vec<&'a Setting>> {
    let mut kept: Vec<Vec<&Setting>> = vec![Vec::new()];
    for axis in axes {
        let longer = kept.iter().flat_map(|chosen| {
            axis.iter().map(move |setting| chosen.iter().copied().chain([*setting]).collect::<Vec<_>>())
        });
        let mut longer: Vec<(f64, f64, Vec<&Setting>)> =
            longer.map(|chosen| (sums(&chosen).0, sums(&chosen).1, chosen)).collect();
        // By seconds, then error: what follows must be more accurate to be kept.
        longer.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut least = f64::INFINITY;
        longer.retain(|(_, error, _)| {
            let better = *error < least;
            least = least.min(*error);
            better
        });
        kept = longer.into_iter().map(|(_, _, chosen)| chosen).collect();
    }
    let key = |chosen: &Vec<&Setting>| {
        let (seconds, error) = sums(chosen);
        order(seconds, error)
    };
    let allowed = kept.into_iter().filter(|chosen| {
        let (seconds, error) = sums(chosen);
        allowed(seconds, error)
    });
    allowed.min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal))
}
