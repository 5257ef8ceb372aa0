//! The outcome in words: the fitted values, and what to do where they are not the best.

use std::path::Path;

use super::Arguments;
use super::scenes::Scenes;
use crate::cli::maps::MapsLeft;
use crate::cli::{Refusal, say};
use crate::engine::Engine;
use crate::fit::outcome::{Ending, Outcome};
use crate::fit::profile::Profile;
use crate::report::errors::{basis_in_words, profile_in_words};
use crate::report::json::Summary;
use crate::report::misfit::Misfit;
use crate::report::{RunInfo, held_out};

/// Seconds of a run.
#[derive(Clone, Copy)]
pub(super) struct Times {
    /// From the command's beginning to its last file.
    pub(super) whole: f64,
    /// Of making the samples.
    pub(super) samples: f64,
}

/// How the run went: the fitted values, what made the passes and the samples, and where it is.
pub(super) fn tell_run(
    folder: &Path,
    scenes: &Scenes,
    run: &RunInfo,
    outcome: &Outcome,
    summary: &Summary,
    times: Times,
) -> Result<(), Refusal> {
    tell_outcome(outcome, run, times.whole)?;
    tell_misfit(&summary.misfit)?;
    if let Some(words) = held_out(summary) {
        say(&words)?;
    }
    if let Some(engine) = scenes.joint.engines().find(|engine| engine.name() == "gpu") {
        let by = if engine.own_sample_seconds().is_some() { "GPU" } else { "CPU" };
        say(&format!("{} samples made by the {by} in {:.3} s", run.samples, times.samples))?;
    }
    for (part, why) in scenes.parts.iter().zip(&scenes.whys) {
        let name = scenes.engine(part).map_or("", Engine::name);
        let whose = if scenes.several() { format!("{}: ", part.name) } else { String::new() };
        if let Some(why) = why {
            say(&format!("{whose}passes on the {}: {why}", name.to_uppercase()))?;
        }
    }
    say(&format!("{}: final loss {:.6e}", folder.display(), outcome.loss_end))
}

/// The fitted values as a small table, and how the fit ended, `whole` seconds into the command.
fn tell_outcome(outcome: &Outcome, run: &RunInfo, whole: f64) -> Result<(), Refusal> {
    for unknown in &outcome.unknowns {
        let name = run.label(&unknown.unknown.name());
        let unit = unknown.unknown.column().map_or("", |column| column.param.info().unit);
        let error = match unknown.std_error {
            Some(error) => match unknown.noise_error.filter(|noise| error > 1.05 * noise) {
                Some(noise) => format!("+- {error:.2e} (noise {noise:.1e})"),
                None => format!("+- {error:.2e}"),
            },
            None if !unknown.identifiable => "not determined by the images".to_owned(),
            None if unknown.at_bound => "at its bound".to_owned(),
            None => String::new(),
        };
        say(format!("{name:>22} {:>12.6}  {error:<11}  {unit}", unknown.value).trim_end())?;
    }
    let basis = basis_in_words(outcome.errors, outcome.most_over_noise());
    let named = |profile: &Profile| Profile { name: run.label(&profile.name), ..profile.clone() };
    let profile = outcome.profile.as_ref().and_then(|profile| profile_in_words(&named(profile)));
    for words in basis.into_iter().chain(profile) {
        say(&words)?;
    }
    let ending = outcome.ending.words();
    let fitting = match outcome.seconds {
        // A fit that goes on took time before.
        fit if fit > whole => format!("and {fit:.2} s of fitting with what was done before"),
        fit => format!("{fit:.2} s of them the fit's"),
    };
    let count = |n: u64, one: &str, more: &str| format!("{n} {}", if n == 1 { one } else { more });
    say(&format!(
        "{ending} after {} and {} over the samples; loss {:.6e} -> {:.6e}; {whole:.2} s, {fitting}",
        count(outcome.iterations, "iteration", "iterations"),
        count(outcome.evaluations, "pass", "passes"),
        outcome.loss_start,
        outcome.loss_end
    ))
}

/// How good what it ended at is, in a line, and below it where it is wrong, the largest misfit first.
fn tell_misfit(misfit: &Misfit) -> Result<(), Refusal> {
    let line: Vec<String> =
        misfit.explained_in_words().into_iter().chain(misfit.largest_in_words()).collect();
    if !line.is_empty() {
        say(&line.join("; "))?;
    }
    misfit.told().try_for_each(|place| say(&format!("  {}", place.sentence())))
}

/// What to do about a fit that did not converge.
pub(super) fn advice(outcome: &Outcome) -> Option<String> {
    let iterations = outcome.iterations;
    match outcome.ending {
        Ending::Converged => None,
        Ending::RanOut => Some(format!(
            "the fit ran out after {iterations} iterations and has not converged. Go on with the same command, --resume and a greater \
             --max-iterations."
        )),
        Ending::Stalled => Some(
            "the fit stalled: no step lowers the loss, yet it has not converged. Try --solver lm, or --starts 8."
                .to_owned(),
        ),
        Ending::Interrupted => {
            Some(format!("the fit was interrupted after {iterations} iterations. Go on with the same command and --resume."))
        }
    }
}

/// What to do about a fit of maps that did not end well: no state of it is kept.
pub(super) fn advice_on_maps(
    arguments: &Arguments,
    folder: &Path,
    left: &MapsLeft,
    outcome: &Outcome,
) -> Option<String> {
    if left.evidence.interrupted {
        return Some(format!(
            "the fit of the maps was interrupted. {}",
            arguments.maps.advice(folder, &arguments.held.hold_out)
        ));
    }
    let iterations = outcome.iterations;
    match outcome.ending {
        Ending::Interrupted => Some(format!(
            "the last solve of the constants was interrupted after {iterations} iterations; the maps are fitted. {}",
            arguments.maps.advice(folder, &arguments.held.hold_out)
        )),
        Ending::RanOut => Some(format!(
            "the last solve of the constants ran out after {iterations} iterations and has not converged. Fit again \
             with a greater --max-iterations."
        )),
        Ending::Converged | Ending::Stalled => advice(outcome),
    }
}
