//! The fit of maps, as the command's arguments and the scene say.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::found::MapsFound;
use super::pictures::MapPictures;
use super::{MapArguments, MapRun};
use crate::cli::graphics::tensor_words;
use crate::cli::{Refusal, say};
use crate::engine::Point;
use crate::engine::view::ObservedView;
use crate::gpu::Choice;
use crate::maps::fit::MapStep;
use crate::maps::{FittedMaps, MapError, MapTask, fit_maps};
use crate::model::gain::Gain;
use crate::prepare::{Baked, Observed, StageSeconds};
use crate::progress;
use crate::render::shade::Shader;
use crate::report::compared::compared;
use crate::report::maps::MapView;
use crate::report::metrics::Comparison;
use crate::tensor::{SharedDevice, TensorError};
use skinfit_core::program::shading::ShadingError;

impl MapArguments {
    /// Fit the requested maps: samples, cubes, constants and free columns are then those of the fitted maps,
    /// and a view that was held out is gone.
    pub(in crate::cli) fn fit(
        &self,
        observed: Observed,
        run: &MapRun<'_>,
    ) -> Result<(Observed, Option<MapsFound>), Refusal> {
        if self.maps.is_empty() {
            return Ok((observed, None));
        }
        let clock = Instant::now();
        let Observed { baked, views } = observed;
        let held_out = run.held_out;
        let choice = Choice { name: run.adapter.map(str::to_owned), ..Choice::default() };
        let shared = SharedDevice::open(&choice).map_err(|error| Refusal::new(tensor_words(&error)))?;
        let posed = baked.scene.mesh.pose();
        let interrupt = Some(Arc::clone(&run.interrupt));
        let task = MapTask::new(&baked, &posed, views.to_vec(), self.kinds());
        let task = MapTask { held_out, interrupt, ..task };
        let settings = baked.scene.fit.maps.clone();
        let found = told(&shared, task, settings.rounds, run.quiet)
            .map_err(|error| refusal(&error, &baked.scene.path))?;
        let gained = gained(&baked, &views, &found, held_out)?;
        let maps = found.layers.iter().map(|layer| MapPictures::new(layer, &posed));
        let maps = maps.collect::<Result<Vec<_>, _>>()?;
        let FittedMaps { illumination, observed: mut views, constants, history, interrupted, .. } = found;
        let Point { params, mut gains } = constants;
        if let Some(view) = held_out {
            views.remove(view);
            gains.remove(view);
        }
        let baked = baked.with_scene(|scene| {
            scene.params = params;
            held_out.map(|view| scene.views.remove(view));
        });
        let seconds = StageSeconds { maps: clock.elapsed().as_secs_f64(), ..baked.seconds };
        let baked = Baked { illumination: Arc::new(illumination), gains, seconds, ..baked };
        let adapter = shared.gpu().name().to_owned();
        let found = MapsFound { views: gained, maps, history, adapter, settings, interrupted };
        Ok((Observed { baked, views: views.into() }, Some(found)))
    }
}

/// Fit, with a progress line, and a line for each round that stays.
fn told(shared: &SharedDevice, task: MapTask<'_>, rounds: u32, quiet: bool) -> Result<FittedMaps, MapError> {
    let bar = progress::spinner("maps");
    let mut tell = |step: &MapStep| {
        bar.inc(1);
        bar.set_message(format!("round {} {}: loss {:.6e}", step.round, step.what, step.after));
        if step.what == "constants" && !quiet {
            let MapStep { round, after, seconds, .. } = step;
            let line = format!("maps, round {round} of {rounds}: loss {after:.6e}, {seconds:.1} s");
            // A line that cannot be written will be heard of when the fit is over.
            bar.suspend(|| drop(say(&line)));
        }
    };
    let found = fit_maps(shared, task, &mut tell);
    bar.finish_and_clear();
    found
}

fn refusal(error: &MapError, scene: &Path) -> Refusal {
    let what = match error {
        MapError::Tensor(error) => tensor_words(error),
        error => error.to_string(),
    };
    // The library's advice ends its words; the option that follows it comes after.
    let option = match error {
        MapError::TooLarge { .. } | MapError::OutOfMemory { .. } => Some("--adapter"),
        MapError::Unread { .. }
        | MapError::Beside { .. }
        | MapError::InTexels { .. }
        | MapError::Sharpness { .. }
        | MapError::NotUnwrapped { .. } => Some("--maps"),
        MapError::Tensor(_)
        | MapError::Filtered { .. }
        | MapError::LaidOut { .. }
        | MapError::Length { .. }
        | MapError::NoView { .. }
        | MapError::NotFinite { .. }
        | MapError::Constants(_)
        | MapError::Shading(_) => None,
    };
    let option = option.map(|option| format!(" ({option})")).unwrap_or_default();
    let words = format!("{}: {}{option}.", scene.display(), what.trim_end_matches('.'));
    match error {
        // What the scene asks for, and not what the adapter has.
        MapError::Tensor(TensorError::Levels { .. } | TensorError::Model(_)) => Refusal::new(words),
        MapError::Tensor(_) | MapError::OutOfMemory { .. } | MapError::NotFinite { .. } => {
            Refusal::failure(words)
        }
        MapError::Constants(_)
        | MapError::Shading(_)
        | MapError::TooLarge { .. }
        | MapError::Unread { .. }
        | MapError::Beside { .. }
        | MapError::InTexels { .. }
        | MapError::Sharpness { .. }
        | MapError::Filtered { .. }
        | MapError::LaidOut { .. }
        | MapError::Length { .. }
        | MapError::NoView { .. }
        | MapError::NotUnwrapped { .. } => Refusal::new(words),
    }
}

/// How well each view is met by the maps of the start and by the fitted ones, each with their best constants.
fn gained(
    baked: &Baked,
    before: &[ObservedView],
    found: &FittedMaps,
    held_out: Option<usize>,
) -> Result<Vec<MapView>, ShadingError> {
    let initial = Shader::new(baked.setup(), &baked.illumination, &found.initial.params)?;
    let fitted = Shader::new(baked.setup(), &found.illumination, &found.constants.params)?;
    let views = baked.scene.views.iter().enumerate();
    let scored = views
        .map(|(i, view)| {
            let scores = |shader: &Shader, observed: &ObservedView, gain: Gain| {
                let image = shader.shade(&observed.samples, &view.camera, gain).image;
                let (target, coverage) = compared(view, observed, &image);
                Comparison::new(&target, &image, &coverage).scores()
            };
            MapView {
                name: view.name.clone(),
                held_out: held_out == Some(i),
                before: scores(&initial, &before[i], found.initial.gains[i]),
                after: scores(&fitted, &found.observed[i], found.constants.gains[i]),
            }
        })
        .collect();
    Ok(scored)
}
