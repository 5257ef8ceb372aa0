//! What evaluates the passes of a fit, and how it is chosen.

use std::borrow::Cow;

use super::{Refusal, tell};
use crate::engine::Objective;
use crate::engine::cpu::CpuEngine;
use crate::engine::reference::{Reference, deviation};
use crate::engine::view::ObservedView;
use crate::prepare::Prepared;
use crate::progress;

/// How far an engine's sums may be from those in f64, relative to the largest entry that shares row and
/// column: a few hundred roundings of f32, of either sign.
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
    /// Part of the name of the graphics adapter to use [default: $WGPU_ADAPTER_NAME, or the fastest kind].
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

/// An engine, and why `auto` took it.
pub(super) struct Chosen<'g> {
    pub(super) engine: FitEngine<'g>,
    pub(super) why: Option<String>,
}

/// An engine over the views of a scene.
#[allow(clippy::large_enum_variant, reason = "there is one of them")]
pub(super) enum FitEngine<'g> {
    /// On the CPU.
    Cpu(CpuEngine),
    /// On a graphics adapter.
    #[cfg(feature = "gpu")]
    Gpu(crate::engine::gpu::GpuEngine<'g>),
    /// There is none without the feature.
    #[cfg(not(feature = "gpu"))]
    #[allow(dead_code, reason = "nothing can make it")]
    Gpu(std::convert::Infallible, std::marker::PhantomData<&'g ()>),
}

impl FitEngine<'_> {
    /// What solvers see of it.
    pub(super) fn objective(&self) -> &dyn Objective {
        match self {
            Self::Cpu(engine) => engine,
            #[cfg(feature = "gpu")]
            Self::Gpu(engine) => engine,
            #[cfg(not(feature = "gpu"))]
            Self::Gpu(never, _) => match *never {},
        }
    }

    /// The views.
    pub(super) fn views(&self) -> &[ObservedView] {
        match self {
            Self::Cpu(engine) => engine.views(),
            #[cfg(feature = "gpu")]
            Self::Gpu(engine) => engine.views(),
            #[cfg(not(feature = "gpu"))]
            Self::Gpu(never, _) => match *never {},
        }
    }

    /// The views with what their samples show, wherever those were made.
    pub(super) fn surfaced_views(&self) -> Result<Cow<'_, [ObservedView]>, Refusal> {
        #[cfg(feature = "gpu")]
        if let Self::Gpu(engine) = self
            && let Some((made, _)) = engine.device_samples()
        {
            let mut views = engine.views().to_vec();
            for (index, view) in views.iter_mut().enumerate() {
                view.samples.surface = made.read(index, &view.samples)?;
            }
            return Ok(Cow::Owned(views));
        }
        Ok(Cow::Borrowed(self.views()))
    }

    /// How many samples there are.
    pub(super) fn samples(&self) -> usize {
        #[cfg(feature = "gpu")]
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
            #[cfg(feature = "gpu")]
            Self::Gpu(engine) => engine.device_samples().map(|(_, seconds)| seconds),
            #[cfg(not(feature = "gpu"))]
            Self::Gpu(never, _) => match *never {},
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
            #[cfg(feature = "gpu")]
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
            #[cfg(not(feature = "gpu"))]
            Self::Gpu(never, _) => match *never {},
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
    pub(super) fn check_samples(&self, maps: bool) -> Result<(), Refusal> {
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

    /// Call `then` with the engine that was asked for, over the scene's views; without any, over samples that the
    /// adapter makes.
    pub(super) fn with_engine<T>(
        &self,
        prepared: &Prepared,
        observed: Option<Vec<ObservedView>>,
        then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let Some(observed) = observed else { return self.with_own_samples(prepared, then) };
        let (gpu, why) = self.wants_gpu(&observed);
        if gpu {
            return self.with_gpu(prepared, observed, why, then);
        }
        self.on_cpu(prepared, observed, why, then)
    }

    fn on_cpu<T>(
        &self,
        prepared: &Prepared,
        observed: Vec<ObservedView>,
        why: Option<String>,
        then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let engine = FitEngine::Cpu(prepared.engine_over(observed));
        self.check(prepared, &engine)?;
        then(&Chosen { engine, why })
    }

    /// Hold an engine against the model in f64, where that is asked for.
    fn check(&self, prepared: &Prepared, engine: &FitEngine<'_>) -> Result<(), Refusal> {
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
        );
        let want = reference.normal_equations(&point);
        let found = deviation(&objective.normal_equations(&point), &want, objective.unknowns());
        bar.finish_and_clear();
        let words = format!("{} of {} is off by {:.1e}", found.what, engine.name(), found.size);
        if found.size <= TOLERANCE {
            tell(&format!("verified against the model in f64: at most, {words}"));
            return Ok(());
        }
        Err(Refusal::failure(format!(
            "{}: the first pass differs from the model in f64: {words}, where {TOLERANCE:.0e} is allowed. Its driver \
             may compute wrongly: fit with --engine cpu, and please report it.",
            prepared.scene.path.display()
        )))
    }
}

#[cfg(feature = "gpu")]
mod gpu {
    use super::{Chosen, FitEngine, FitEngineArguments, ObservedView, Prepared, Refusal, tell};
    use crate::engine::gpu::{DeviceSampleError, DeviceSamples, GpuEngine, Memory, Task};
    use crate::gpu::upload::Content;
    use crate::gpu::{Choice, Gpu, GpuError};

    /// Samples from which `auto` takes a graphics card, for each thread of the CPU. A rule of thumb: 0.6 s for
    /// opening a device and compiling, ten passes at 30 ns a sample and thread.
    const WORTH_A_THREAD: usize = 2_000_000;

    impl FitEngineArguments {
        /// Whether the GPU is to be tried, and where `auto` decides, why.
        pub(super) fn wants_gpu(&self, observed: &[ObservedView]) -> (bool, Option<String>) {
            match self.engine.as_str() {
                "cpu" => (false, None),
                "gpu" => (true, None),
                _ if self.adapter.is_some() => (true, None),
                _ => {
                    let samples: usize = observed.iter().map(|view| view.samples.count()).sum();
                    let threads = rayon::current_num_threads();
                    let enough = WORTH_A_THREAD * threads;
                    let words = if samples < enough { "fewer than the" } else { "more than the" };
                    let why = format!(
                        "{samples} samples are {words} {enough} from which opening a graphics card pays off \
                         ({threads} threads)"
                    );
                    (samples >= enough, Some(why))
                }
            }
        }

        pub(super) fn with_gpu<T>(
            &self,
            prepared: &Prepared,
            observed: Vec<ObservedView>,
            why: Option<String>,
            then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
        ) -> Result<T, Refusal> {
            let must = why.is_none();
            let gpu = match self.open() {
                Ok(gpu) if must || !gpu.is_software() => gpu,
                Ok(gpu) => {
                    let why = why.map(|why| format!("{why}, but {} is a program on the CPU", gpu.name()));
                    return self.on_cpu(prepared, observed, why, then);
                }
                Err(error) if must => return Err(error.into()),
                Err(error) => {
                    tell(&format!("{error} The CPU engine makes the passes."));
                    let why = why.map(|why| format!("{why}, but none could be opened"));
                    return self.on_cpu(prepared, observed, why, then);
                }
            };
            let mut gpu = gpu;
            let mut resident = self.device_memory.map(|megabytes| megabytes * 1_000_000);
            loop {
                match self.engine_on(&gpu, prepared, &observed, resident) {
                    Ok(engine) => {
                        let engine = FitEngine::Gpu(engine);
                        self.check(prepared, &engine)?;
                        return then(&Chosen { engine, why });
                    }
                    // A device that ran out of memory is not to be trusted any more; half as much may fit.
                    Err(GpuError::OutOfMemory { .. }) if resident != Some(0) => {
                        let all: u64 = observed.iter().map(bytes).sum();
                        let most = resident.map_or(all, |most| most.min(all)) / 2;
                        resident = Some(if most < 16_000_000 { 0 } else { most });
                        tell(&format!(
                            "{}: out of memory; trying again with {} MB of samples on it.",
                            gpu.name(),
                            resident.unwrap_or_default() / 1_000_000
                        ));
                        gpu = self.open()?;
                    }
                    Err(error) => return Err(error.into()),
                }
            }
        }

        /// Call `then` with an engine over samples that the adapter makes; where they have no room on it, over the
        /// CPU's, as many of which stay as may.
        pub(super) fn with_own_samples<T>(
            &self,
            prepared: &Prepared,
            then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
        ) -> Result<T, Refusal> {
            let gpu = self.open()?;
            let content = Content {
                scene: &prepared.scene,
                illumination: &prepared.illumination,
                occlusion: prepared.occlusion.as_ref(),
                params: &prepared.scene.params,
            };
            let resident = self.device_memory.map(|megabytes| megabytes * 1_000_000);
            let error = match DeviceSamples::new(&gpu, content) {
                Ok((made, groups)) => {
                    let observed = prepared.observed_with(groups)?;
                    let (task, memory) = (task(prepared, &observed), Memory { part: None, resident });
                    match GpuEngine::over_device_samples(&made, task, &prepared.start(), memory) {
                        Ok(engine) => {
                            let engine = FitEngine::Gpu(engine);
                            self.check(prepared, &engine)?;
                            return then(&Chosen { engine, why: None });
                        }
                        Err(error) => error,
                    }
                }
                Err(DeviceSampleError::Gpu(error)) => error,
                Err(error) => return Err(error.into()),
            };
            if !matches!(error, GpuError::OutOfMemory { .. } | GpuError::SamplesStay { .. }) {
                return Err(error.into());
            }
            drop(gpu);
            tell(&format!("{error} The CPU makes the samples."));
            let observed = prepared.observed_with(prepared.traced()?)?;
            self.with_gpu(prepared, observed, None, then)
        }

        fn open(&self) -> Result<Gpu, GpuError> {
            Gpu::open(&Choice { name: self.adapter.clone(), ..Choice::default() })
        }

        fn engine_on<'g>(
            &self,
            gpu: &'g Gpu,
            prepared: &Prepared,
            observed: &'g [ObservedView],
            resident: Option<u64>,
        ) -> Result<GpuEngine<'g>, GpuError> {
            let memory = Memory { part: None, resident };
            GpuEngine::new(gpu, task(prepared, observed), &prepared.start(), memory)
        }
    }

    fn task<'v>(prepared: &Prepared, observed: &'v [ObservedView]) -> Task<'v> {
        Task {
            setup: prepared.setup(),
            illumination: prepared.illumination.clone(),
            views: observed,
            loss: prepared.scene.fit.loss,
            unknowns: prepared.unknowns(),
        }
    }

    fn bytes(view: &ObservedView) -> u64 {
        size_of_val(view.samples.surface.rows().all()) as u64
    }
}

#[cfg(not(feature = "gpu"))]
mod gpu {
    use super::{Chosen, FitEngineArguments, ObservedView, Prepared, Refusal};

    impl FitEngineArguments {
        pub(super) fn wants_gpu(&self, _observed: &[ObservedView]) -> (bool, Option<String>) {
            let asked = self.engine == "gpu" || self.adapter.is_some() || self.device_memory.is_some();
            (asked, (!asked).then(|| "this skinfit was built without its GPU engine".to_owned()))
        }

        pub(super) fn with_gpu<T>(
            &self,
            _prepared: &Prepared,
            _observed: Vec<ObservedView>,
            _why: Option<String>,
            _then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
        ) -> Result<T, Refusal> {
            Err(without())
        }

        pub(super) fn with_own_samples<T>(
            &self,
            _prepared: &Prepared,
            _then: impl FnOnce(&Chosen<'_>) -> Result<T, Refusal>,
        ) -> Result<T, Refusal> {
            Err(without())
        }
    }

    fn without() -> Refusal {
        Refusal::new(
            "this skinfit was built without its GPU engine. Build it with the feature `gpu` (a default one), or fit \
             with --engine cpu.",
        )
    }
}
