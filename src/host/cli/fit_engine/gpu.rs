//! The GPU engine: when it is taken, and over whose samples.

use std::sync::Arc;

use super::super::graphics::Task as Doing;
use super::{FitEngineArguments, Observed, ObservedView, Refusal, SelectedEngine, on_cpu, tell};
use crate::gpu::engine::{DeviceSampleError, DeviceSamples, GpuEngine, Memory};
use crate::gpu::upload::Content;
use crate::gpu::{Choice, Gpu, GpuError};
use crate::prepare::Baked;

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

    /// The engine on an adapter; on the CPU where `auto` wanted one that does not make it faster.
    pub(super) fn on_gpu(&self, observed: &Observed, why: Option<String>) -> Result<SelectedEngine, Refusal> {
        let must = why.is_none();
        let but = |words: &str| why.as_ref().map(|why| format!("{why}, but {words}"));
        let mut gpu = match self.open() {
            Ok(gpu) if must || !gpu.is_software() => gpu,
            Ok(gpu) => {
                return on_cpu(observed, but(&format!("{} is a program on the CPU", gpu.name())));
            }
            Err(error) if must => return Err(refused(&error)),
            Err(error) => {
                tell(&format!("{error} The CPU engine makes the passes."));
                return on_cpu(observed, but("none could be opened"));
            }
        };
        let mut resident = self.resident();
        loop {
            let memory = Memory { part: None, resident };
            match GpuEngine::new(&gpu, observed.task(), &observed.start(), memory) {
                Ok(engine) => return Ok(SelectedEngine { engine: Box::new(engine), why }),
                // A device that ran out of memory is not to be trusted any more; half as much may fit.
                Err(GpuError::OutOfMemory { .. }) if resident != Some(0) => {
                    let all: u64 = observed.views.iter().map(bytes).sum();
                    let most = resident.map_or(all, |most| most.min(all)) / 2;
                    resident = Some(if most < 16_000_000 { 0 } else { most });
                    tell(&format!(
                        "{}: out of memory; trying again with {} MB of samples on it.",
                        gpu.name(),
                        resident.unwrap_or_default() / 1_000_000
                    ));
                    gpu = self.open().map_err(|error| refused(&error))?;
                }
                Err(error) => return Err(refused(&error)),
            }
        }
    }

    /// The engine over samples that the adapter makes; where they have no room on it, over the CPU's, as many of
    /// which stay as may. With it come the views, all of which have a target.
    pub(in crate::cli) fn over_own_samples(
        &self,
        baked: Baked,
    ) -> Result<(Observed, SelectedEngine), Refusal> {
        let (observed, chosen) = match self.with_own_samples(baked.clone())? {
            Ok((observed, engine)) => (observed, SelectedEngine { engine: Box::new(engine), why: None }),
            Err(
                error @ (GpuError::OutOfMemory { .. }
                | GpuError::SamplesStay { .. }
                | GpuError::CpuAlone { .. }),
            ) => {
                tell(&format!("{error} The CPU makes the samples."));
                let observed = baked.sample()?.observe()?;
                let chosen = self.on_gpu(&observed, None)?;
                (observed, chosen)
            }
            Err(error) => return Err(refused(&error)),
        };
        let chosen = self.verified(&observed, chosen)?;
        Ok((observed, chosen))
    }

    /// The views and the engine over the adapter's samples, or what the adapter refused.
    fn with_own_samples(&self, baked: Baked) -> Result<Result<(Observed, GpuEngine), GpuError>, Refusal> {
        let gpu = self.open().map_err(|error| refused(&error))?;
        let (made, groups) = match DeviceSamples::new(&gpu, Content::of(&baked)) {
            Ok(made) => made,
            Err(DeviceSampleError::Gpu(error)) => return Ok(Err(error)),
            Err(error) => return Err(error.into()),
        };
        let observed = baked.observe(groups)?;
        let memory = Memory { part: None, resident: self.resident() };
        let engine =
            GpuEngine::over_device_samples(Arc::new(made), observed.task(), &observed.start(), memory);
        Ok(engine.map(|engine| (observed, engine)))
    }

    /// Most bytes that stay on the adapter, where that is limited.
    fn resident(&self) -> Option<u64> {
        self.device_memory.map(|megabytes| megabytes.saturating_mul(1_000_000))
    }

    fn open(&self) -> Result<Gpu, GpuError> {
        Gpu::open(&Choice { name: self.adapter.clone(), ..Choice::default() })
    }
}

fn refused(error: &GpuError) -> Refusal {
    Doing::Fit.refusal(error)
}

fn bytes(view: &ObservedView) -> u64 {
    size_of_val(view.samples.surface.rows().all()) as u64
}
