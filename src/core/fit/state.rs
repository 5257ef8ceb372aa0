//! The state of a fit as a file, so that an interrupted one goes on to the same end.
//!
//! JSON, floats written so that they read back to the bit. `varpro` and `lm` keep all that their
//! next step depends on and go on as if nothing had happened; `lbfgs` and `nelder-mead` live inside
//! `argmin`, which keeps their curvature pairs and simplex to itself: they begin anew from the best
//! point found.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::fingerprint::{Difference, Fingerprint};
use super::linearisation::Linearisation;
use super::memory::Memory;
use super::options::{FitOptions, SolverKind};
use super::outcome::{Ending, Iteration};
use crate::engine::{Point, Unknown};
use crate::files;
use crate::model::effects::Form;
use crate::model::params::Param;
use crate::output::{self, OutputError};

/// The format's version.
const FORMAT: u32 = 2;

/// A state file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It cannot be read.
    #[error(
        "{}: the state of the interrupted fit cannot be read: {reason}. Name a run folder that a fit was \
         interrupted in, or start afresh.", path.display()
    )]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// It is not a state, or a damaged one.
    #[error("{}: this is not a state that a fit has left: {reason}. Start afresh.", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It is another fit's.
    #[error(
        "{}: this state belongs to another fit: its {what} differs ({found}; now {expected}). Resume with the \
         scene and options that the fit was started with, name another run folder, or start afresh.", path.display()
    )]
    Different {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
        /// The state's.
        found: String,
        /// The present fit's.
        expected: String,
    },
    /// It cannot be written.
    #[error(transparent)]
    Unwritable(#[from] OutputError),
}

/// One start's run of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The loss where it began.
    pub loss_start: f64,
    /// Coordinates of the best point so far.
    pub at: Vec<f64>,
    /// The loss there.
    pub loss: f64,
    /// Iterations done.
    pub iterations: u64,
    /// The loss after each.
    pub history: Vec<Iteration>,
    /// What `varpro` and `lm` remember.
    pub memory: Option<Memory>,
    /// The normal equations at the start, and at the end of the other solvers.
    pub model: Option<Linearisation>,
    /// How it ended, when it did.
    pub ending: Option<Ending>,
}

impl Run {
    /// A run that is about to begin where the pass `first` was made.
    #[must_use]
    pub fn beginning(first: Linearisation) -> Self {
        Self {
            loss_start: first.loss,
            at: first.at.clone(),
            loss: first.loss,
            iterations: 0,
            history: Vec::new(),
            memory: None,
            model: Some(first),
            ending: None,
        }
    }

    /// Whether there is nothing left to do within `max_iterations`.
    #[must_use]
    pub fn is_over(&self, max_iterations: u64) -> bool {
        match self.ending {
            Some(Ending::Converged | Ending::Stalled) => true,
            Some(Ending::RanOut) => self.iterations >= max_iterations,
            Some(Ending::Interrupted) | None => false,
        }
    }

    /// The normal equations at its end.
    #[must_use]
    pub fn model(&self) -> Option<&Linearisation> {
        self.model.as_ref().or(self.memory.as_ref().map(|memory| &memory.base))
    }

    fn check(&self, k: usize) -> Result<(), String> {
        let complete = |m: &Linearisation| {
            m.at.len() == k && m.gradient.len() == k && m.hessian.len() == k * k && m.weight > 0.0
        };
        if self.at.len() != k || !self.model().is_none_or(complete) {
            return Err(format!("its vectors are not of length {k}"));
        }
        if !self.model().is_none_or(Linearisation::is_of_products) {
            return Err("its normal equations are those of no Jacobian".to_owned());
        }
        if self.memory.as_ref().is_some_and(|memory| !memory.is_sound()) {
            return Err("the solver's memory is not sound".to_owned());
        }
        Ok(())
    }
}

/// All that a fit writes down between iterations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saved {
    format: u32,
    fingerprint: Fingerprint,
    solver: SolverKind,
    unknowns: Vec<String>,
    start: Vec<f64>,
    starts: u32,
    seed: u64,
    /// The pass at the given start.
    pub origin: Linearisation,
    /// The runs from each start so far; the last may still be going on.
    pub runs: Vec<Run>,
    /// Passes made.
    pub evaluations: u64,
    /// Seconds spent.
    pub seconds: f64,
}

impl Saved {
    /// The state before the first run.
    #[must_use]
    pub fn new(unknowns: &[Unknown], start: &Point, options: &FitOptions, origin: Linearisation) -> Self {
        Self {
            format: FORMAT,
            fingerprint: options.fingerprint.clone(),
            solver: options.solver,
            unknowns: unknowns.iter().map(Unknown::name).collect(),
            start: values(start),
            starts: options.starts.max(1),
            seed: options.seed,
            origin,
            runs: Vec::new(),
            evaluations: 0,
            seconds: 0.0,
        }
    }

    /// What the state at `path` was begun with: solver, number of starts, seed.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn begun_with(path: &Path) -> Result<(SolverKind, u32, u64), StateError> {
        let saved = Self::parse(path)?;
        Ok((saved.solver, saved.starts, saved.seed))
    }

    /// Whether every start ran to an end of its own.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let ended = |run: &Run| !matches!(run.ending, None | Some(Ending::Interrupted));
        self.runs.len() >= self.starts as usize && self.runs.iter().all(ended)
    }

    /// Write it, whole or not at all.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), StateError> {
        let text = serde_json::to_vec(self).map_err(|error| OutputError::new(path, &error))?;
        Ok(output::write(path, &text)?)
    }

    /// Read the state of a fit of `unknowns` from `start` with `options`.
    ///
    /// # Errors
    /// When it cannot be read, is damaged, or is the state of another fit.
    pub fn read(
        path: &Path,
        unknowns: &[Unknown],
        start: &Point,
        options: &FitOptions,
    ) -> Result<Self, StateError> {
        let saved = Self::parse(path)?;
        let now = Self::new(unknowns, start, options, saved.origin.clone());
        saved.belongs_to(&now, path)?;
        saved.check().map_err(|reason| StateError::Corrupt { path: path.to_owned(), reason })?;
        Ok(saved)
    }

    fn parse(path: &Path) -> Result<Self, StateError> {
        let unreadable =
            |e: std::io::Error| StateError::Unreadable { path: path.to_owned(), reason: e.to_string() };
        let corrupt = |reason: String| StateError::Corrupt { path: path.to_owned(), reason };
        let bytes = files::read(path).map_err(unreadable)?;
        if let Ok(Versioned { format }) = serde_json::from_slice(&bytes)
            && format != FORMAT
        {
            return Err(different(path, "format", &format.to_string(), FORMAT.to_string()));
        }
        // Keys of the file stand in what is said of it: what they hold must not break the paragraph.
        let said = |e: serde_json::Error| e.to_string().replace(char::is_control, " ");
        serde_json::from_slice(&bytes).map_err(|e| corrupt(said(e)))
    }

    fn belongs_to(&self, now: &Self, path: &Path) -> Result<(), StateError> {
        let same = |what, found: String, expected: String| {
            if found == expected { Ok(()) } else { Err(different(path, what, &found, expected)) }
        };
        same("solver", self.solver.name().to_owned(), now.solver.name().to_owned())?;
        same("list of unknowns", self.unknowns.join(" "), now.unknowns.join(" "))?;
        if let Some(Difference { what, was, is }) = self.fingerprint.difference(&now.fingerprint) {
            return Err(different(path, &what, &was, is));
        }
        if self.start != now.start {
            let (was, is) = first_difference(&self.start, &now.start);
            same("start", was, is)?;
        }
        same("number of starts", self.starts.to_string(), now.starts.to_string())?;
        same("seed", self.seed.to_string(), now.seed.to_string())
    }

    fn check(&self) -> Result<(), String> {
        let k = self.unknowns.len();
        if self.runs.len() > self.starts as usize {
            return Err("it holds more runs than starts".to_owned());
        }
        let origin = Run::beginning(self.origin.clone());
        std::iter::once(&origin).chain(&self.runs).try_for_each(|run| run.check(k))
    }
}

/// A state of any version.
#[derive(Deserialize)]
struct Versioned {
    format: u32,
}

fn different(path: &Path, what: &str, found: &str, expected: String) -> StateError {
    // What a file holds must not break the paragraph.
    let found = found.replace(char::is_control, " ");
    StateError::Different { path: path.to_owned(), what: what.to_owned(), found, expected }
}

/// The first of two points' values that differs, named.
fn first_difference(was: &[f64], is: &[f64]) -> (String, String) {
    let at = was.iter().zip(is).position(|(a, b)| a != b).unwrap_or(was.len().min(is.len()));
    let name = Param::built_in().nth(at / 3).map_or("gain, added parameter or scene's own", Param::name);
    let say = |values: &[f64]| match values.get(at) {
        Some(value) => format!("{name} {value}"),
        None => format!("{} views", values.len().saturating_sub(3 * Param::COUNT)),
    };
    (say(was), say(is))
}

/// Every number of a point, in order: parameters, gains, and what scenes have of their own. Of added parameters those
/// alone that are not at their defaults: which of them there are depends on what else the process has read.
fn values(point: &Point) -> Vec<f64> {
    let said =
        |param: &Param| param.is_built_in() || point.params.rgb(*param) != param.default_rgb(Form::Corrected);
    let params = Param::all().filter(said).flat_map(|param| point.params.rgb(param));
    let own = point.params.own();
    let own = own.filter(|(_, param, rgb)| param.is_built_in() || *rgb != param.default_rgb(Form::Corrected));
    let own = own.flat_map(|(_, _, rgb)| rgb);
    let gains =
        point.gains.iter().flat_map(|gain| gain.scalar().map_or(gain.0.to_vec(), |factor| vec![factor]));
    params.chain(gains).chain(own).collect()
}
