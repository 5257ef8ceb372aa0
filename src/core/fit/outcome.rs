//! What a fit yields, for reports, files and the next fit.

use serde::{Deserialize, Serialize};

use super::error_basis::ErrorBasis;
use super::profile::Profile;
use crate::engine::{Point, Unknown};

/// A finished (or interrupted) fit.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which solver ran: `varpro`, `lm`, `lbfgs` or `nelder-mead`.
    pub solver: &'static str,
    /// Where the fit began.
    pub start: Point,
    /// Where it ended.
    pub end: Point,
    /// The loss at the start.
    pub loss_start: f64,
    /// The loss at the end.
    pub loss_end: f64,
    /// What is known of each unknown.
    pub unknowns: Vec<UnknownOutcome>,
    /// Correlation matrix of the unknowns, row-major, K x K; 0 beside unknowns without a variance.
    pub correlations: Vec<f64>,
    /// What the standard errors rest on.
    pub errors: ErrorBasis,
    /// How far the loss lets the weakest unknown go, where there is a weak one and the profile was requested.
    pub profile: Option<Profile>,
    /// Directions in which the loss does not change: the images cannot determine these.
    pub undetermined: Vec<Direction>,
    /// Unknowns that are shares of a whole and add up to all that there is, by their names; those of each whole together.
    pub full_shares: Vec<Vec<String>>,
    /// The loss after each iteration.
    pub history: Vec<Iteration>,
    /// Iterations of the start that won.
    pub iterations: u64,
    /// Passes over the samples, of all starts together.
    pub evaluations: u64,
    /// Seconds spent, before an interruption and after it.
    pub seconds: f64,
    /// How each start of a multi-start fit fared, in order; the first is the given one.
    pub starts: Vec<StartOutcome>,
    /// How it ended.
    pub ending: Ending,
}

impl Outcome {
    /// What is known of the unknown of that name, as reports have it: `base_weight`, of a parameter that is free in
    /// each channel `hilite.r`, of a view's factor `gain.1`. `None` where it was not free.
    #[must_use]
    pub fn constant(&self, name: &str) -> Option<&UnknownOutcome> {
        self.unknowns.iter().find(|outcome| outcome.unknown.name() == name)
    }
}

impl Outcome {
    /// By how many times the most the standard errors exceed those of independent residuals; `None` without any.
    #[must_use]
    pub fn most_over_noise(&self) -> Option<f64> {
        let ratio = |u: &UnknownOutcome| Some(u.std_error? / u.noise_error.filter(|e| *e > 0.0)?);
        self.unknowns.iter().filter_map(ratio).reduce(f64::max)
    }
}

/// How one of several starts fared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartOutcome {
    /// The loss where it began.
    pub loss_start: f64,
    /// The loss where it ended.
    pub loss_end: f64,
    /// How it ended.
    pub ending: Ending,
}

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The step, the gradient or the predicted gain fell below its tolerance.
    Converged,
    /// The iterations ran out.
    RanOut,
    /// No step lowers the loss, yet no tolerance was met.
    Stalled,
    /// Somebody pressed Ctrl-C; the state was kept.
    Interrupted,
}

impl Ending {
    /// How the fit ended, in a word or a few.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::RanOut => "ran out of iterations",
            Self::Stalled => "stalled",
            Self::Interrupted => "interrupted",
        }
    }
}

/// What is known of one unknown.
#[derive(Clone, Debug)]
pub struct UnknownOutcome {
    /// Which.
    pub unknown: Unknown,
    /// Its value at the start.
    pub start: f64,
    /// Its value at the end.
    pub value: f64,
    /// Least and greatest value that it might have had.
    pub bounds: (f64, f64),
    /// One standard error; `None` at a bound or when unidentifiable.
    pub std_error: Option<f64>,
    /// What it were if residuals were independent.
    pub noise_error: Option<f64>,
    /// Whether the images determine it.
    pub identifiable: bool,
    /// Whether it ended on a bound.
    pub at_bound: bool,
    /// At the start: the root of the loss' second derivative with respect to it, that is by how
    /// much the (weighted) image changes, root mean square, when it changes by 1.
    pub sensitivity: f64,
}

/// A combination of unknowns, with a unit vector of (name, component).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Direction {
    /// The components, largest first; those below 1% are left out.
    pub components: Vec<(String, f64)>,
}

/// One iteration of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// Its number, from 0 for the start.
    pub iteration: u64,
    /// Passes over the samples so far.
    pub evaluations: u64,
    /// The loss after it.
    pub loss: f64,
    /// Seconds since the start.
    pub seconds: f64,
}
