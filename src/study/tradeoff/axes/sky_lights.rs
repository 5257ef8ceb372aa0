//! How many of the panorama's brightest spots are lights of their own, with shadows.

use std::time::Instant;

use crate::StudyError;
use crate::engine::{Objective, Point};
use crate::model::effects::Effect;
use crate::reference::Difference;
use crate::render::image::Image;
use crate::scene::Scene;
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::{Bench, Evaluated};

/// The number of lights.
pub(super) struct SkyLights;

/// How many, beside as many as the scene has; the most are the reference.
const COUNTS: [u32; 7] = [0, 1, 2, 4, 8, 16, 32];

/// How many the scene has.
fn own(bench: &Bench<'_>) -> u32 {
    bench.baked.scene.environment.as_ref().map_or(0, |environment| environment.spots.count)
}

/// All counts, the most last.
fn counts(bench: &Bench<'_>) -> Vec<u32> {
    let mut counts = [&COUNTS[..], &[own(bench)]].concat();
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// What was found with `count` lights at most.
struct Found {
    count: u32,
    /// How many there are: an even sky has fewer.
    lights: usize,
    seconds: f64,
    images: Vec<Image>,
}

impl SceneAxis for SkyLights {
    fn name(&self) -> &'static str {
        "sky_lights"
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let scene = &bench.baked.scene;
        let taken = scene.effects.has(Effect::Lights) && !scene.sky_lights.is_empty();
        taken.then_some(()).ok_or("no light is taken out of a panorama")
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // Each has bakes of its own, and a ray of shadow a sample and light.
        let each = rates.trace + rates.images + rates.pass + bench.baked.seconds.bake;
        let counts = counts(bench);
        let lights: u32 = counts.iter().sum();
        Ok(each * counts.len() as f64 + f64::from(lights) * (rates.trace + rates.pass))
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let found: Vec<Found> =
            COUNTS.into_iter().map(|count| with(bench, count)).collect::<Result<_, _>>()?;
        let exact = found.last().map(|last| last.images.clone()).unwrap_or_default();
        let (own, last) = (own(bench), found.len().saturating_sub(1));
        let setting = |(i, found): (usize, &Found)| Setting {
            name: found.count.to_string(),
            choose: None,
            error: Difference::of_all(&exact, &found.images),
            cost: found.seconds,
            time: None,
            counts: vec![("lights", found.lights as f64)],
            reference: i == last,
            present: found.count == own,
            pareto: false,
        };
        let mut settings: Vec<Setting> = found.iter().enumerate().map(setting).collect();
        mark_pareto(&mut settings);
        Ok(Sweep {
            axis: self.name(),
            title: "Lights taken out of the panorama",
            method: "Images with this number of the panorama's brightest spots as lights; the most are the reference. Seconds are those of \
                     baking, tracing and one pass, nothing cached."
                .to_owned(),
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}

/// The scene with `count` lights, baked and sampled anew; with as many as it has, as it stands.
fn with(bench: &Bench<'_>, count: u32) -> Result<Found, StudyError> {
    let scene = &bench.baked.scene;
    let named = |error| StudyError::Light { scene: scene.path.display().to_string(), error };
    let start = bench.point();
    let mut lit = Scene { params: start.params.clone(), ..Scene::clone(scene) };
    if count != own(bench) {
        lit = lit.with_spots(count).map_err(named)?;
    }
    let point = Point { params: lit.params.clone(), ..start };
    let lights = lit.sky_lights.len();
    let since = Instant::now();
    let evaluated = Evaluated::anew(lit)?;
    evaluated.live_engine()?.loss(&point);
    let seconds = since.elapsed().as_secs_f64();
    Ok(Found { count, lights, seconds, images: evaluated.images(&point)? })
}
