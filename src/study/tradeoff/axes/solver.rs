//! How fast the solvers find the answer.

use super::fits::{Fits, MOST_ITERATIONS, expected_passes};
use crate::StudyError;
use crate::fit::SolverKind;
use crate::fit::outcome::Outcome;
use crate::tradeoff::axis::{Axis, Idle, Rates, Sweep, Trace};
use crate::tradeoff::benches::Benches;

/// The solvers.
pub(super) struct Solvers;

impl Axis for Solvers {
    fn name(&self) -> &'static str {
        "solver"
    }

    fn applies(&self, benches: &Benches<'_>) -> Result<(), Idle> {
        Fits::apply(benches)
    }

    fn fits(&self) -> bool {
        true
    }

    fn seconds(&self, _: &Benches<'_>, rates: &[Rates]) -> Result<f64, StudyError> {
        Ok(Fits::seconds(&SolverKind::ALL.map(expected_passes), rates))
    }

    fn sweep(&self, benches: &Benches<'_>) -> Result<Sweep, StudyError> {
        let fits = Fits::new(benches)?;
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
                 after this number of seconds.{}",
                Fits::words(benches)
            ),
            cost: "seconds",
            settings,
            traces: runs.iter().zip(&outcomes).map(trace).collect(),
        })
    }
}
