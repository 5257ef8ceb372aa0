//! How many rays a vertex ambient occlusion needs.

use super::quality::{Swept, bake_seconds};
use crate::StudyError;
use crate::model::effects::{Effect, Effects};
use crate::tradeoff::axis::{Knob, Rates, SceneAxis, Sweep};
use crate::tradeoff::bench::Bench;
use crate::tradeoff::settings::Settings;

/// The number of occlusion rays.
pub(super) struct Rays;

impl SceneAxis for Rays {
    fn name(&self) -> &'static str {
        "rays"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let asked = scene.needs().occlusion;
        asked.then_some(()).ok_or("no effect asks for occlusion")
    }

    fn settable(&self) -> bool {
        true
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // The surface is traced once more, for the points that the samples show.
        let vertices = bench.baked.scene.mesh.positions.len() as f64;
        let count = |rays| counted(vertices, rays);
        let sweep = swept(&count);
        Ok(rates.trace + sweep.seconds(bench, rates, &|_| 0.0, &|settings| trace(bench, settings))?)
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let vertices = bench.baked.scene.mesh.positions.len() as f64;
        swept(&|rays| counted(vertices, rays))
            .sweep(bench, &bench.point(), &|settings| trace(bench, settings))
    }
}

/// Million rays.
fn counted(vertices: f64, rays: u32) -> f64 {
    1e-6 * vertices * f64::from(rays)
}

fn swept<'a>(count: &'a dyn Fn(u32) -> f64) -> Swept<'a> {
    Swept {
        axis: Rays.name(),
        title: "Rays a vertex for ambient occlusion",
        method: "Images with occlusion traced by this number of rays. Seconds are those of tracing, nothing cached."
            .to_owned(),
        knob: Knob::OcclusionRays,
        values: &[4, 8, 16, 32, 64, 128, 256, 1024],
        count: ("million rays", count),
        probe: 16,
    }
}

fn trace(bench: &Bench<'_>, settings: Settings) -> Result<f64, StudyError> {
    let mut scene = bench.scene(settings);
    // Occlusion is asked for by what it darkens; the cube is not counted.
    scene.effects = Effects::of(&[Effect::Occlusion, Effect::Hilite]);
    scene.quality.hilite_size = 4;
    bake_seconds(bench, &scene, "occlusion")
}
