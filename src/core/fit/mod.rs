//! The solvers, and what is known of the answer afterwards.
//!
//! - [`options`]: how a fit is to be done; `error`: why it cannot be
//! - [`coordinates`], [`linearisation`]: what solvers step in, and what one pass tells them
//! - [`bounded`]: the bounded least-squares step; [`room`]: where it may go
//! - [`lm`], [`memory`]: Levenberg-Marquardt; `recent`: where a loss is too rough for it; [`varpro`]: what makes it variable
//!   projection
//! - [`transform`], [`unbounded`]: bounds and costs for `argmin`'s own solvers
//! - `adam`: Adam, as one of `argmin`'s solvers
//! - `drive`: the executor, watched
//! - [`state`]: interrupted fits, resumed; [`fingerprint`]: by fits of the same alone
//! - [`starts`]: where the other starts of a multi-start fit begin
//! - [`statistics`]: standard errors and correlations; [`error_basis`]: what they rest on; [`sandwich`]: where
//!   neighbouring residuals are alike; `null_space`: what is undetermined; [`profile`]: how far the loss lets an unknown go
//! - `held`: what bounds and full wholes hold of an answer; [`outcome`]: what a fit yields
//! - [`params_file`]: what was fitted, as `params.toml`

use std::sync::atomic::Ordering;

use web_time::Instant;

mod adam;
pub mod bounded;
pub mod coordinates;
mod drive;
mod error;
pub mod error_basis;
pub mod fingerprint;
mod held;
pub mod linearisation;
pub mod lm;
pub mod memory;
mod null_space;
pub mod options;
pub mod outcome;
pub mod params_file;
pub mod profile;
mod recent;
pub mod room;
pub mod sandwich;
pub mod starts;
pub mod state;
pub mod statistics;
pub mod transform;
pub mod unbounded;
pub mod varpro;

pub use error::FitError;
pub use options::{FitOptions, SolverKind, Tolerances};

use coordinates::Coordinates;
use drive::Log;
use error_basis::ErrorBasis;
use held::{at_bounds, full_shares};
use linearisation::{Linearisation, Passes};
use outcome::{Ending, Iteration, Outcome, StartOutcome, UnknownOutcome};
use profile::{Answer, Profile};
use state::{Run, Saved};
use statistics::Statistics;

use crate::engine::{Objective, Point};

/// Fit `objective` from `start`; `progress` is told each iteration of each start.
///
/// Without unknowns the outcome is the start and its loss. More unknowns than residuals, or unknowns
/// that nothing depends on, are no error: the outcome names what is undetermined.
///
/// # Errors
/// When nothing has weight, the start is outside its bounds or its loss is not finite, the state cannot
/// be read, written or is another fit's, or a solver fails.
pub fn fit(
    objective: &dyn Objective,
    start: &Point,
    options: &FitOptions,
    progress: &mut dyn FnMut(&Iteration),
) -> Result<Outcome, FitError> {
    fit_watched(objective, start, options, &mut |iteration, _| progress(iteration))
}

/// As [`fit`]; `watch` is told the point that each iteration has led to, too. The fit goes on when it returns.
///
/// # Errors
/// As of [`fit`].
pub fn fit_watched(
    objective: &dyn Objective,
    start: &Point,
    options: &FitOptions,
    watch: &mut dyn FnMut(&Iteration, &Point),
) -> Result<Outcome, FitError> {
    let clock = Instant::now();
    let coordinates = Coordinates::within(objective.unknowns(), start, options.limits());
    check_bounds(&coordinates, start)?;
    let saved = match &options.resume {
        Some(path) => Saved::read(path, objective.unknowns(), start, options)?,
        None => begin(objective, start, options, &coordinates)?,
    };
    let passes = Passes::new(objective, &coordinates, saved.evaluations);
    let mut log = Log::new(saved, &passes, options, watch, clock);
    for index in 0..options.starts.max(1) {
        if index > 0 && log.interrupted() {
            break;
        }
        if log.saved.runs.len() <= index as usize {
            let run = begin_run(&passes, &log.saved.origin, options.seed, index);
            passes.check()?;
            log.saved.runs.push(run);
        }
        let most = options.max_iterations.unwrap_or(options.solver.default_iterations());
        if coordinates.unknowns().is_empty() {
            log.saved.runs[index as usize].ending = Some(Ending::Converged);
        } else if !log.saved.runs[index as usize].is_over(most) {
            drive::run(options.solver, &mut log).map_err(|error| of_resumed(error, options))?;
        }
    }
    log.write()?;
    let saved = log.saved;
    Ok(conclude(objective, &coordinates, start, options, &saved))
}

/// A solver that fails where a state has left it was led there by numbers that no fit has left.
fn of_resumed(error: FitError, options: &FitOptions) -> FitError {
    match (error, &options.resume) {
        (FitError::Solver { solver, reason }, Some(path)) => {
            let reason = format!("the solver {solver} fails from there, as {reason}");
            state::StateError::Corrupt { path: path.clone(), reason }.into()
        }
        (error, _) => error,
    }
}

fn check_bounds(coordinates: &Coordinates, start: &Point) -> Result<(), FitError> {
    for (unknown, &(lower, upper)) in coordinates.unknowns().iter().zip(coordinates.bounds()) {
        let value = unknown.get(start);
        if !(lower..=upper).contains(&value) || !value.is_finite() {
            return Err(FitError::OutOfBounds { name: unknown.name(), value, lower, upper });
        }
    }
    Ok(())
}

/// The pass at the start, which every solver and the sensitivities begin from.
fn begin(
    objective: &dyn Objective,
    start: &Point,
    options: &FitOptions,
    coordinates: &Coordinates,
) -> Result<Saved, FitError> {
    let passes = Passes::new(objective, coordinates, 0);
    let origin = passes.linearise(coordinates.origin());
    passes.check()?;
    if origin.count == 0 || origin.weight.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        return Err(FitError::Empty);
    }
    if let Some((what, value)) = first_not_finite(coordinates, &origin) {
        return Err(FitError::NotFinite { what, value });
    }
    let mut saved = Saved::new(coordinates.unknowns(), start, options, origin);
    saved.evaluations = passes.count();
    Ok(saved)
}

/// The first number of a pass that is none, and what it is: named where it is found, as most fits find none.
fn first_not_finite(coordinates: &Coordinates, origin: &Linearisation) -> Option<(String, f64)> {
    let derivative = |i: usize| format!("derivative of the loss by {}", coordinates.unknowns()[i].name());
    let k = origin.len().max(1);
    let gradient = origin.gradient.iter().enumerate();
    let derivatives = gradient.chain(origin.hessian.iter().enumerate().map(|(ij, h)| (ij / k, h)));
    if !origin.loss.is_finite() {
        return Some(("loss".to_owned(), origin.loss));
    }
    let (i, &value) = { derivatives }.find(|(_, value)| !value.is_finite())?;
    Some((derivative(i), value))
}

/// The run from start `index`. A drawn start whose loss is not finite is pulled towards the given
/// one, whose loss is.
fn begin_run(passes: &Passes<'_>, origin: &Linearisation, seed: u64, index: u32) -> Run {
    let mut at = starts::draw(passes.coordinates(), seed, index);
    let attempts = if index == 0 { 0 } else { 8 };
    for _ in 0..attempts {
        let first = passes.linearise(&at);
        if first.is_finite() {
            return Run::beginning(first);
        }
        at = at.iter().zip(&origin.at).map(|(u, o)| 0.5 * (u + o)).collect();
    }
    Run::beginning(origin.clone())
}

/// The best run, and what is known of it.
fn conclude(
    objective: &dyn Objective,
    coordinates: &Coordinates,
    start: &Point,
    options: &FitOptions,
    saved: &Saved,
) -> Outcome {
    let clock = Instant::now();
    let best = saved.runs.iter().min_by(|a, b| a.loss.total_cmp(&b.loss));
    let untouched = Run::beginning(saved.origin.clone());
    let best = best.unwrap_or(&untouched);
    let model = best.model().unwrap_or(&saved.origin);
    let at_bound = at_bounds(coordinates, &best.at);
    let end = coordinates.point(&best.at);
    let stop = || options.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::SeqCst));
    let wanted = !options.widths.is_empty() && !model.is_empty() && !stop();
    let pulls = if wanted { objective.pulls(&coordinates.point(&model.at), &options.widths) } else { None };
    let known = Statistics::new(coordinates, model, &at_bound, objective.rounding(), pulls.as_ref());
    let profile = if options.profile && ending(saved, best) == Ending::Converged {
        profile_of(objective, coordinates, model, &known, &stop)
    } else {
        None
    };
    let unknowns = coordinates.unknowns().iter().enumerate().map(|(i, unknown)| UnknownOutcome {
        unknown: *unknown,
        start: unknown.get(start),
        value: unknown.get(&end),
        bounds: coordinates.bounds()[i],
        std_error: known.std_errors[i],
        noise_error: known.noise_errors[i],
        identifiable: known.identifiable[i],
        at_bound: at_bound[i],
        sensitivity: sensitivity(coordinates, &saved.origin, i),
    });
    Outcome {
        solver: options.solver.name(),
        start: start.clone(),
        loss_start: saved.origin.loss,
        loss_end: best.loss,
        unknowns: unknowns.collect(),
        correlations: known.correlations,
        errors: known.basis,
        profile,
        undetermined: known.undetermined,
        full_shares: full_shares(coordinates, &best.at, &at_bound),
        history: best.history.clone(),
        iterations: best.iterations,
        evaluations: saved.evaluations,
        seconds: saved.seconds + clock.elapsed().as_secs_f64(),
        starts: saved.runs.iter().map(start_outcome).collect(),
        ending: ending(saved, best),
        end,
    }
}

/// The profile of the weakest unknown, where residuals are more than roundings.
fn profile_of(
    objective: &dyn Objective,
    coordinates: &Coordinates,
    model: &Linearisation,
    known: &Statistics,
    stop: &dyn Fn() -> bool,
) -> Option<Profile> {
    if known.basis == ErrorBasis::Rounding || stop() {
        return None;
    }
    let error = |i: usize| known.std_errors[i].map(|error| error / coordinates.slope(i, model.at[i]));
    let errors: Vec<Option<f64>> = (0..model.len()).map(error).collect();
    let answer = Answer { model, errors: &errors, unit: &known.unit };
    let weakest = profile::weakest(coordinates, &answer)?;
    profile::profile(&Passes::new(objective, coordinates, 0), &answer, weakest, stop)
}

fn sensitivity(coordinates: &Coordinates, origin: &Linearisation, i: usize) -> f64 {
    (origin.curvature(i) / origin.weight).sqrt() / coordinates.slope(i, origin.at[i])
}

fn start_outcome(run: &Run) -> StartOutcome {
    let ending = run.ending.unwrap_or(Ending::Interrupted);
    StartOutcome { loss_start: run.loss_start, loss_end: run.loss, ending }
}

/// A fit is interrupted if any of its starts is, or was not reached; else it ended as its best did.
fn ending(saved: &Saved, best: &Run) -> Ending {
    if saved.is_complete() { best.ending.unwrap_or(Ending::Interrupted) } else { Ending::Interrupted }
}
