//! What evaluates the passes of a fit, and how it is chosen; `gpu`: on a graphics adapter.

mod gpu;

use std::sync::Arc;

use super::{Refusal, tell};
use crate::engine::Engine;
use crate::engine::reference::{Reference, deviation};
use crate::engine::view::ObservedView;
use crate::gpu::GpuError;
use crate::prepare::Observed;
use crate::progress;

/// How far an engine's sums may be from those in f64, relative to the geometric mean of the diagonal entries that
/// share row and column: a few hundred roundings of f32, of either sign. A robust loss' weights move with the
/// residual, whose roundings a small one makes large: that comes on top, by [`Reference::with_rounding`].
const TOLERANCE: f64 = 1e-5;

/// Which engine, and its options.
#[derive(clap::Args)]
#[command(next_help_heading = "Engine")]
pub(super) struct FitEngineArguments {
    /// What makes the passes: the CPU, the GPU, or `auto`: a graphics card where there are enough samples
    /// that opening it pays off.
    #[arg(long, value_name = "ENGINE", default_value = "auto", value_parser = ["auto", "cpu", "gpu"])]
    engine: String,
    /// What makes the GPU engine's samples of the surface: the CPU, which traces rays and uploads what they hit,
    /// or the GPU, whose rasteriser draws them where they are read.
    #[arg(long, value_name = "ENGINE", default_value = "cpu", value_parser = ["cpu", "gpu"])]
    samples: String,
    /// Part of the name of the graphics adapter to use; with it, `auto` makes the passes there whatever there is to
    /// do [default: $WGPU_ADAPTER_NAME, or the fastest kind].
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Most megabytes of samples that stay on the graphics adapter; the others are uploaded in each pass
    /// [default: as many as it takes].
    #[arg(long, value_name = "MB")]
    device_memory: Option<u64>,
    /// Hold the first pass against the model in f64 before the fit, and stop if they differ. Takes as long as
    /// some hundred passes.
    #[arg(long)]
    verify: bool,
}

/// An engine, and how it came to be taken.
pub(super) struct SelectedEngine {
    pub(super) engine: Box<dyn Engine>,
    /// Why `auto` took it.
    pub(super) why: Option<String>,
}

/// The views with what their samples show, wherever an engine has them.
pub(super) fn surfaced_views(engine: &dyn Engine) -> Result<Arc<[ObservedView]>, Refusal> {
    engine.surfaced_views().map_err(|error| match error.downcast_ref::<GpuError>() {
        Some(error) => super::graphics::Task::Fit.refusal(error),
        None => Refusal::failure(error.to_string()),
    })
}

impl FitEngineArguments {
    /// Whether an adapter may be opened.
    pub(super) fn may_be_gpu(&self) -> bool {
        self.engine != "cpu"
    }

    /// Whether the adapter makes the samples: then nobody else has to.
    pub(super) fn makes_samples(&self) -> bool {
        self.samples == "gpu"
    }

    /// Refuse what cannot be together; `maps`: whether whole maps are fitted, too.
    pub(super) fn check(&self, maps: bool) -> Result<(), Refusal> {
        let idle = [
            ("--device-memory", self.device_memory.is_some()),
            ("--adapter", self.adapter.is_some() && !maps),
        ];
        for (option, given) in idle {
            if given && !self.may_be_gpu() {
                return Err(Refusal::new(format!(
                    "{option} says how a graphics adapter is used, and --engine cpu uses none. Leave one of the two \
                     out."
                )));
            }
        }
        if self.makes_samples() && self.engine == "cpu" {
            return Err(Refusal::new(
                "--samples gpu leaves the samples on the adapter, where --engine cpu cannot read them. Leave one of \
                 the two out.",
            ));
        }
        if self.makes_samples() && maps {
            return Err(Refusal::new(
                "--samples gpu makes no samples that --maps could use. Leave one of the two out.",
            ));
        }
        Ok(())
    }

    /// Part of the adapter's name, where one is named.
    pub(super) fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// The requested engine over the scene's views.
    pub(super) fn select(&self, observed: &Observed) -> Result<SelectedEngine, Refusal> {
        let (gpu, why) = self.wants_gpu(&observed.views);
        let chosen = if gpu { self.on_gpu(observed, why)? } else { on_cpu(observed, why)? };
        self.verified(observed, chosen)
    }

    /// An engine, held against the model in f64 where that is requested.
    fn verified(&self, observed: &Observed, chosen: SelectedEngine) -> Result<SelectedEngine, Refusal> {
        if self.verify {
            verify(observed, &*chosen.engine)?;
        }
        Ok(chosen)
    }
}

fn on_cpu(observed: &Observed, why: Option<String>) -> Result<SelectedEngine, Refusal> {
    Ok(SelectedEngine { engine: Box::new(observed.engine()?), why })
}

/// Hold an engine against the model in f64.
fn verify(observed: &Observed, engine: &dyn Engine) -> Result<(), Refusal> {
    let point = observed.start();
    let bar = progress::spinner("verify");
    let views = surfaced_views(engine)?;
    let reference = Reference::new(
        observed.setup(),
        &observed.illumination,
        &views,
        observed.scene.fit.loss,
        engine.unknowns(),
    )
    .map_err(|error| Refusal::new(format!("--verify: {error}.")))?;
    let (want, moved) = reference.with_rounding(&point);
    let found = deviation(&engine.normal_equations(&point), &want, engine.unknowns());
    bar.finish_and_clear();
    let words = format!("{} of {} is off by {:.1e}", found.what, engine.name(), found.size);
    let most = TOLERANCE + moved;
    if found.size <= most {
        tell(&format!("verified against the model in f64: at most, {words}; {most:.1e} is allowed"));
        return Ok(());
    }
    let remedy = match engine.name() {
        "cpu" => "This is a fault of skinfit: please report it.",
        _ => "Its driver may compute wrongly: fit with --engine cpu, and please report it.",
    };
    Err(Refusal::failure(format!(
        "{}: the first pass differs from the model in f64: {words}, where {most:.1e} is allowed. {remedy}",
        observed.scene.path.display()
    )))
}
