//! How many pixels a fit needs.

use super::fits::{Fits, expected_passes};
use crate::StudyError;
use crate::fit::SolverKind;
use crate::tradeoff::axis::{Axis, Rates, Sweep};
use crate::tradeoff::bench::Bench;

/// Pixels used in a fit: every n-th block of them, or a coarse fit first and finer ones from there.
pub(super) struct Pixels;

/// Every how many-th block is read; several: one fit after another.
const STRIDES: [&[usize]; 9] = [&[128], &[64], &[32], &[16], &[8], &[4], &[2], &[16, 1], &[1]];

impl Axis for Pixels {
    fn name(&self) -> &'static str {
        "pixels"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let targets = bench.baked.scene.views.iter().any(|view| view.target.is_some());
        targets.then_some(()).ok_or("no view names a target to fit to")
    }

    fn seconds(&self, _: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        let share = |strides: &[usize]| strides.iter().map(|&stride| 1.0 / stride as f64).sum::<f64>();
        let passes = STRIDES.map(|strides| share(strides) * rates.pass);
        Ok(Fits::seconds(&passes.map(|pass| pass * expected_passes(SolverKind::Varpro)), rates))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let fits = Fits::new(bench)?;
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
            method: "A fit to every n-th block of pixels (128 of them), from the scene's start values; and one to a sixteenth whose answer is \
                     where a fit to all pixels starts. The error is how different the images of the fitted constants are from those fitted \
                     to all pixels. Seconds are those of the fit."
                .to_owned(),
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}
