//! How many rays a vertex ambient occlusion needs.

use super::quality::{Swept, bake_seconds};
use crate::StudyError;
use crate::model::effects::{Effect, Effects};
use crate::tradeoff::axis::{Axis, Knob, Sweep};
use crate::tradeoff::bench::Bench;

/// The number of occlusion rays.
pub(super) struct Rays;

impl Axis for Rays {
    fn name(&self) -> &'static str {
        "rays"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.prepared.scene;
        let asked = scene.effects.needs(scene.silhouette).occlusion;
        asked.then_some(()).ok_or("no effect asks for occlusion")
    }

    fn settable(&self) -> bool {
        true
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let vertices = bench.prepared.scene.mesh.positions.len() as f64;
        let swept = Swept {
            axis: self.name(),
            title: "Rays a vertex for ambient occlusion",
            method:
                "Images with occlusion traced by so many rays. Seconds are those of tracing, nothing cached."
                    .to_owned(),
            knob: Knob::OcclusionRays,
            values: &[4, 8, 16, 32, 64, 128, 256, 1024],
            count: ("million rays", &|rays| 1e-6 * vertices * f64::from(rays)),
        };
        swept.sweep(bench, &bench.point(), &|settings| {
            let mut scene = bench.scene(settings);
            // Occlusion is asked for by what it darkens; the cube is not counted.
            scene.effects = Effects::of(&[Effect::Occlusion, Effect::Hilite]);
            scene.quality.hilite_size = 4;
            bake_seconds(bench, &scene, "occlusion")
        })
    }
}
