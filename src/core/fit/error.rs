//! Why a fit cannot be done.

use super::linearisation::EngineFault;
use super::state::StateError;

/// A fit cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// Nothing to compare with.
    #[error(
        "the fit has nothing to compare: no pixel has a weight above 0. Check that the views' targets and masks \
         overlap the mesh."
    )]
    Empty,
    /// The start is no place to begin at.
    #[error(
        "the {what} at the start is {value}, which is not a finite number. Check the start values, the \
         targets, the environment (its intensity too) and the maps for extreme numbers."
    )]
    NotFinite {
        /// The loss or its derivative, named.
        what: String,
        /// Its value.
        value: f64,
    },
    /// A start value is outside its bounds.
    #[error(
        "the start value of {name} is {value}, outside its bounds {lower} to {upper}. Choose one inside."
    )]
    OutOfBounds {
        /// The unknown.
        name: String,
        /// Its value.
        value: f64,
        /// Its least value.
        lower: f64,
        /// Its greatest value.
        upper: f64,
    },
    /// The state file cannot be used.
    #[error(transparent)]
    State(#[from] StateError),
    /// The engine failed.
    #[error("{0} What was found up to then is kept, and the fit can go on from there.")]
    Engine(#[from] EngineFault),
    /// The solver failed.
    #[error("the solver {solver} failed: {reason}. Try another one.")]
    Solver {
        /// Its name.
        solver: &'static str,
        /// What it says.
        reason: String,
    },
}
