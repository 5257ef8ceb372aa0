//! The search: how it goes about it, and what it goes on from.

use std::io::ErrorKind;
use std::path::Path;

use super::Arguments;
use super::Watch;
use super::scenes::Scenes;
use crate::cli::Refusal;
use crate::cli::fingerprint::fingerprint;
use crate::cli::interrupt::Interrupt;
use crate::cli::run_folder::RunFolder;
use crate::fit::fingerprint::Fingerprint;
use crate::fit::outcome::Outcome;
use crate::fit::state::Saved;
use crate::fit::state::StateError;
use crate::fit::{self, FitError, FitOptions, SolverKind};
use crate::output::OutputError;
use crate::prepare::JointScene;
use crate::progress;

/// How the unknowns are searched for: as the command line says, else as the fit that is resumed was
/// begun.
#[derive(Clone, Copy)]
pub(super) struct Solving {
    solver: SolverKind,
    pub(super) starts: u32,
    pub(super) seed: u64,
}

impl Solving {
    pub(super) fn of(arguments: &Arguments, folder: &Path) -> Result<Self, Refusal> {
        let (solver, starts, seed) = match arguments.resume {
            true => Saved::begun_with(&folder.join(STATE))?,
            false => (SolverKind::default(), 1, 0),
        };
        Ok(Self {
            solver: arguments.solver.as_deref().and_then(SolverKind::from_name).unwrap_or(solver),
            starts: arguments.starts.unwrap_or(starts),
            seed: arguments.seed.unwrap_or(seed),
        })
    }
}

/// What a fit goes on from, in its run folder.
const STATE: &str = "state.json";

/// Fit, with a progress line and Ctrl-C that keeps the state.
pub(super) fn solve(
    arguments: &Arguments,
    solving: Solving,
    folder: &RunFolder,
    scenes: &Scenes,
    interrupt: &Interrupt,
    watch: &mut Watch<'_>,
) -> Result<Outcome, Refusal> {
    let state = folder.path().join(STATE);
    let maps = arguments.maps.any();
    if maps {
        // A state holds no maps: what could be resumed from one is another fit, and so is that of an earlier run.
        match std::fs::remove_file(&state) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(OutputError::new(&state, &error).into());
            }
            _ => {}
        }
    }
    let options = FitOptions {
        solver: solving.solver,
        max_iterations: arguments.max_iterations,
        starts: solving.starts,
        seed: solving.seed,
        bounds: scenes.bounds(),
        effects: Some(scenes.effects()),
        fingerprint: fingerprint_of(scenes),
        resume: arguments.resume.then(|| state.clone()),
        state: (!maps).then_some(state),
        interrupt: Some(interrupt.watch()),
        widths: scenes.widths(),
        profile: true,
        ..FitOptions::default()
    };
    let bar = progress::spinner("fit");
    let outcome = fit::fit_watched(&scenes.joint, &scenes.start, &options, &mut |iteration, point| {
        watch(iteration, &scenes.points(point));
        bar.set_position(iteration.iteration);
        bar.set_message(format!("loss {:.6e}, {} passes", iteration.loss, iteration.evaluations));
    });
    bar.finish_and_clear();
    let files = scenes.files();
    outcome.map_err(|error| match error {
        // It names its file itself.
        FitError::State(StateError::Unwritable(error)) => Refusal::from(error),
        FitError::State(error) => with_option(&error, "without --resume"),
        FitError::Engine(fault) => Refusal::failure(format!(
            "{files}: {fault} What was found up to then is kept: go on with --resume."
        )),
        FitError::Solver { .. } => with_option(&format!("{files}: {error}"), "(--solver varpro)"),
        error => Refusal::new(format!("{files}: {error}")),
    })
}

/// What the fit is of: a scene's own items, or those of all scenes by their names.
fn fingerprint_of(scenes: &Scenes) -> Fingerprint {
    let of = |part: &JointScene| fingerprint(&part.baked.scene, &part.held);
    match scenes.parts.as_slice() {
        [part] => of(part),
        parts => {
            let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
            let all = Fingerprint::default().with("list of scenes", names.join(", "));
            parts.iter().fold(all, |all, part| all.with_all(&of(part), &part.name))
        }
    }
}

/// The library's advice, which ends its words, with the option that follows it.
fn with_option(words: &impl ToString, option: &str) -> Refusal {
    Refusal::new(format!("{} {option}.", words.to_string().trim_end_matches('.')))
}
