//! How many samples a pixel needs.

use super::quality::Swept;
use crate::StudyError;
use crate::engine::Objective;
use crate::timing::seconds_of;
use crate::tradeoff::axis::{Axis, Knob, Sweep};
use crate::tradeoff::bench::Bench;

/// Samples along a pixel's side.
pub(super) struct Samples;

impl Axis for Samples {
    fn name(&self) -> &'static str {
        "samples"
    }

    fn applies(&self, _: &Bench<'_>) -> Result<(), &'static str> {
        Ok(())
    }

    fn settable(&self) -> bool {
        true
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let point = bench.point();
        let pixels: u32 =
            bench.prepared.scene.views.iter().map(|view| view.camera.width * view.camera.height).sum();
        let swept = Swept {
            axis: self.name(),
            title: "Samples along a pixel's side",
            method: "Images of so many samples a side, n × n a pixel. Seconds are those of tracing the surface and of one pass over it, \
                     all views."
                .to_owned(),
            knob: Knob::SamplesPerAxis,
            values: &[1, 2, 3, 4, 6],
            count: ("million rays", &|n| 1e-6 * f64::from(n * n) * f64::from(pixels)),
        };
        swept.sweep(bench, &point, &|settings| {
            let mut engine = None;
            let tracing = seconds_of(|| engine = Some(bench.evaluate(settings)));
            let engine = engine.transpose()?.map(|evaluated| evaluated.live_engine());
            Ok(tracing + engine.map_or(0.0, |engine| seconds_of(|| engine.loss(&point))))
        })
    }
}
