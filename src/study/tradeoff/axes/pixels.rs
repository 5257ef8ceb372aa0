//! How many pixels a fit needs.

use super::fits::{Fits, expected_passes};
use crate::StudyError;
use crate::fit::SolverKind;
use crate::tradeoff::axis::{Axis, Idle, Rates, Sweep};
use crate::tradeoff::benches::Benches;

/// Pixels used in a fit: every n-th block of them, or a coarse fit first and finer ones from there.
pub(super) struct Pixels;

/// Every how many-th block is read; several: one fit after another.
const STRIDES: [&[usize]; 9] = [&[128], &[64], &[32], &[16], &[8], &[4], &[2], &[16, 1], &[1]];

impl Axis for Pixels {
    fn name(&self) -> &'static str {
        "pixels"
    }

    fn applies(&self, benches: &Benches<'_>) -> Result<(), Idle> {
        Fits::apply(benches)
    }

    fn fits(&self) -> bool {
        true
    }

    fn seconds(&self, _: &Benches<'_>, rates: &[Rates]) -> Result<f64, StudyError> {
        let share = |strides: &[usize]| strides.iter().map(|&stride| 1.0 / stride as f64).sum::<f64>();
        Ok(Fits::seconds(&STRIDES.map(|strides| share(strides) * expected_passes(SolverKind::Varpro)), rates))
    }

    fn sweep(&self, benches: &Benches<'_>) -> Result<Sweep, StudyError> {
        let fits = Fits::new(benches)?;
        let name = |strides: &[usize]| {
            let part = |stride: &usize| if *stride == 1 { "all".to_owned() } else { format!("1/{stride}") };
            strides.iter().map(part).collect::<Vec<_>>().join(", then ")
        };
        // A scene of few pixels has few blocks to leave out.
        let runs: Vec<_> = STRIDES
            .into_iter()
            .filter(|strides| strides.iter().all(|&stride| stride == 1 || fits.blocks() / stride >= 8))
            .map(|strides| (name(strides), strides.to_vec(), SolverKind::Varpro))
            .collect();
        let settings = fits.measure(&runs, runs.len() - 1)?.0;
        Ok(Sweep {
            axis: self.name(),
            title: "Pixels used in a fit",
            method: format!(
                "A fit to every n-th block of pixels (128 of them), from the scene's start values; and one to a sixteenth whose answer is \
                     where a fit to all pixels starts. The error is how different the images of the fitted constants are from those fitted \
                     to all pixels. Seconds are those of the fit.{}",
                Fits::words(benches)
            ),
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}
