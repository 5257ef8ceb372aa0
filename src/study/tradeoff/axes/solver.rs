//! How fast the solvers find the answer.

use super::fits::{Fits, MOST_ITERATIONS, expected_passes};
use crate::StudyError;
use crate::fit::SolverKind;
use crate::fit::outcome::Outcome;
use crate::tradeoff::axis::{Axis, Rates, Sweep, Trace};
use crate::tradeoff::bench::Bench;

/// The solvers.
pub(super) struct Solvers;

impl Axis for Solvers {
    fn name(&self) -> &'static str {
        "solver"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        super::pixels::Pixels.applies(bench)
    }

    fn seconds(&self, _: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        Ok(Fits::seconds(&SolverKind::ALL.map(|kind| expected_passes(kind) * rates.pass), rates))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let fits = Fits::new(bench)?;
        let runs: Vec<_> =
            SolverKind::ALL.into_iter().map(|kind| (kind.name().to_owned(), vec![1], kind)).collect();
        let (settings, outcomes) = fits.measure(&runs, 0)?;
        let trace = |(run, outcome): (&(String, Vec<usize>, SolverKind), &Outcome)| Trace {
            name: run.0.clone(),
            points: outcome.history.iter().map(|i| (i.evaluations, i.seconds, i.loss)).collect(),
        };
        Ok(Sweep {
            axis: self.name(),
            title: "Solver",
            method: format!(
                "Each solver from the scene's start values on all pixels, {MOST_ITERATIONS} iterations at most. The error is how different \
                 the images of its constants are from those of variable projection. Seconds are those of the fit; the curve shows the loss \
                 after so many seconds."
            ),
            cost: "seconds",
            settings,
            traces: runs.iter().zip(&outcomes).map(trace).collect(),
        })
    }
}
