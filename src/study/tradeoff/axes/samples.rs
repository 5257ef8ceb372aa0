//! How many samples a pixel needs.

use super::quality::Swept;
use crate::StudyError;
use crate::engine::Objective;
use crate::timing::seconds_of;
use crate::tradeoff::axis::{Knob, Rates, SceneAxis, Sweep};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// Samples along a pixel's side.
pub(super) struct Samples;

impl SceneAxis for Samples {
    fn name(&self) -> &'static str {
        "samples"
    }

    fn applies(&self, _: &Bench<'_>) -> Result<(), &'static str> {
        Ok(())
    }

    fn settable(&self) -> bool {
        true
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // What the scene's own samples take, images and all, others take by their number.
        let share = |n: u32| f64::from(n * n) / f64::from(bench.settings().quality.samples_per_axis.pow(2));
        let more = |n: u32| rates.trace * share(n) + rates.images * (share(n) - 1.0).max(0.0);
        let pixels = pixels(bench);
        swept(&|n| counted(pixels, n)).seconds(bench, rates, &more, &|settings| trace(bench, settings))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let pixels = pixels(bench);
        swept(&|n| counted(pixels, n)).sweep(bench, &bench.point(), &|settings| trace(bench, settings))
    }
}

fn pixels(bench: &Bench<'_>) -> u32 {
    bench.baked.scene.views.iter().map(|view| view.camera.width * view.camera.height).sum()
}

/// Million rays.
fn counted(pixels: u32, n: u32) -> f64 {
    1e-6 * f64::from(n * n) * f64::from(pixels)
}

fn swept<'a>(count: &'a dyn Fn(u32) -> f64) -> Swept<'a> {
    Swept {
        axis: Samples.name(),
        title: "Samples along a pixel's side",
        method: "Images of this number of samples a side, n × n a pixel. Seconds are those of tracing the surface and of one pass over it, \
                 all views."
            .to_owned(),
        knob: Knob::SamplesPerAxis,
        values: &[1, 2, 3, 4, 6],
        count: ("million rays", count),
        probe: 1,
    }
}

/// The seconds of tracing the surface anew, and of a pass over it.
fn trace(bench: &Bench<'_>, settings: Settings) -> Result<f64, StudyError> {
    let mut evaluated = None;
    let tracing = seconds_of(|| evaluated = Some(bench.evaluate_anew(settings)));
    let engine = evaluated.transpose()?.map(|evaluated| evaluated.live_engine()).transpose()?;
    Ok(tracing + engine.map_or(0.0, |engine| seconds_of(|| engine.loss(&bench.point()))))
}
