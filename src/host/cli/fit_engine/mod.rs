//! What evaluates the passes of a fit, and how it is chosen; `gpu`: on a graphics adapter.

mod gpu;

use std::borrow::Cow;

use super::{Refusal, tell};
use crate::engine::Objective;
use crate::engine::cpu::CpuEngine;
use crate::engine::reference::{Reference, deviation};
use crate::engine::view::ObservedView;
use crate::prepare::Prepared;
use crate::progress;

/// How far an engine's sums may be from those in f64, relative to the geometric mean of the diagonal entries that
/// share row and column: a few hundred roundings of f32, of either sign. A robust loss' weights move with the
/// residual, whose roundings a small one makes large: that comes on top, by [`Reference::with_rounding`].
const TOLERANCE: f64 = 1e-5;

/// Which engine, and its options.
#[derive(clap::Args)]
#[command(next_help_heading = "Engine")]
pub(super) struct FitEngineArguments {
    /// What makes the passes: the CPU, the GPU, or `auto`: a graphics card where there are so many samples
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
pub(super) struct SelectedEngine<'g> {
    pub(super) engine: FitEngine<'g>,
    pub(super) selection: Selection,
}

/// How an engine came to be taken.
#[derive(Default)]
pub(super) struct Selection {
    /// Why `auto` took it.
    pub(super) why: Option<String>,
    /// What it took to trace its samples, where the adapter had no room for its own.
    traced_seconds: Option<f64>,
}

impl Selection {
    fn but(self, words: &str) -> Self {
        Self { why: self.why.map(|why| format!("{why}, but {words}")), ..self }
    }
}

impl SelectedEngine<'_> {
    /// The seconds that making the samples took, where it was done for the engine.
    pub(super) fn sample_seconds(&self) -> Option<f64> {
        self.engine.own_sample_seconds().or(self.selection.traced_seconds)
    }
}

/// An engine over the views of a scene.
#[allow(clippy::large_enum_variant, reason = "there is one of them")]
pub(super) enum FitEngine<'g> {
    /// On the CPU.
    Cpu(CpuEngine),
    /// On a graphics adapter.
    Gpu(crate::gpu::engine::GpuEngine<'g>),
}

impl FitEngine<'_> {
    /// What solvers see of it.
    pub(super) fn objective(&self) -> &dyn Objective {
        match self {
            Self::Cpu(engine) => engine,
            Self::Gpu(engine) => engine,
        }
    }

    /// The views.
    pub(super) fn views(&self) -> &[ObservedView] {
        match self {
            Self::Cpu(engine) => engine.views(),
            Self::Gpu(engine) => engine.views(),
        }
    }

    /// The views with what their samples show, wherever those were made.
    pub(super) fn surfaced_views(&self) -> Result<Cow<'_, [ObservedView]>, Refusal> {
        if let Self::Gpu(engine) = self
            && let Some((made, _)) = engine.device_samples()
        {
            let mut views = engine.views().to_vec();
            for (index, view) in views.iter_mut().enumerate() {
                let read = made.read(index, &view.samples);
                view.samples.surface = read.map_err(|error| super::graphics::Task::Fit.refusal(&error))?;
            }
            return Ok(Cow::Owned(views));
        }
        Ok(Cow::Borrowed(self.views()))
    }

    /// How many samples there are.
    pub(super) fn samples(&self) -> usize {
        if let Self::Gpu(engine) = self
            && let Some((made, _)) = engine.device_samples()
        {
            return made.count();
        }
        self.views().iter().map(|view| view.samples.count()).sum()
    }

    /// The seconds that making the samples on the adapter took, where it made them.
    pub(super) fn own_sample_seconds(&self) -> Option<f64> {
        match self {
            Self::Cpu(_) => None,
            Self::Gpu(engine) => engine.device_samples().map(|(_, seconds)| seconds),
        }
    }

    /// `cpu` or `gpu`.
    pub(super) const fn name(&self) -> &'static str {
        match self {
            Self::Cpu(_) => "cpu",
            Self::Gpu(..) => "gpu",
        }
    }

    /// What it ran on, for the report.
    pub(super) fn provenance(&self) -> Vec<(String, String)> {
        match self {
            Self::Cpu(_) => vec![
                ("threads".to_owned(), rayon::current_num_threads().to_string()),
                ("instructions".to_owned(), crate::simd::instructions()),
            ],
            Self::Gpu(engine) => {
                let (resident, streamed) = engine.bytes();
                let own = engine.device_samples().is_some();
                let samples = if own { "made by the adapter" } else { "made by the CPU and uploaded" };
                vec![
                    ("adapter".to_owned(), engine.adapter().to_owned()),
                    ("samples".to_owned(), samples.to_owned()),
                    ("bytes on the device".to_owned(), resident.to_string()),
                    ("bytes uploaded a pass".to_owned(), streamed.to_string()),
                ]
            }
        }
    }
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

    /// Call `then` with the requested engine, over the scene's views; without any, over samples that the
    /// adapter makes.
    pub(super) fn with_engine<T>(
        &self,
        prepared: &Prepared,
        observed: Option<Vec<ObservedView>>,
        then: impl FnOnce(&SelectedEngine<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let Some(observed) = observed else { return self.with_own_samples(prepared, then) };
        let (gpu, why) = self.wants_gpu(&observed);
        let selection = Selection { why, ..Selection::default() };
        if gpu {
            return self.with_gpu(prepared, observed, selection, then);
        }
        self.on_cpu(prepared, observed, selection, then)
    }

    fn on_cpu<T>(
        &self,
        prepared: &Prepared,
        observed: Vec<ObservedView>,
        selection: Selection,
        then: impl FnOnce(&SelectedEngine<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let engine = FitEngine::Cpu(prepared.engine_over(observed)?);
        self.verify(prepared, &engine)?;
        then(&SelectedEngine { engine, selection })
    }

    /// Hold an engine against the model in f64, where that is requested.
    fn verify(&self, prepared: &Prepared, engine: &FitEngine<'_>) -> Result<(), Refusal> {
        if !self.verify {
            return Ok(());
        }
        let (objective, point) = (engine.objective(), prepared.start());
        let bar = progress::spinner("verify");
        let views = engine.surfaced_views()?;
        let reference = Reference::new(
            prepared.setup(),
            &prepared.illumination,
            &views,
            prepared.scene.fit.loss,
            objective.unknowns(),
        )
        .map_err(|error| Refusal::new(format!("--verify: {error}.")))?;
        let (want, moved) = reference.with_rounding(&point);
        let found = deviation(&objective.normal_equations(&point), &want, objective.unknowns());
        bar.finish_and_clear();
        let words = format!("{} of {} is off by {:.1e}", found.what, engine.name(), found.size);
        let most = TOLERANCE + moved;
        if found.size <= most {
            tell(&format!("verified against the model in f64: at most, {words}; {most:.1e} is allowed"));
            return Ok(());
        }
        let remedy = match engine {
            FitEngine::Cpu(_) => "This is a fault of skinfit: please report it.",
            FitEngine::Gpu(..) => {
                "Its driver may compute wrongly: fit with --engine cpu, and please report it."
            }
        };
        Err(Refusal::failure(format!(
            "{}: the first pass differs from the model in f64: {words}, where {most:.1e} is allowed. {remedy}",
            prepared.scene.path.display()
        )))
    }
}
