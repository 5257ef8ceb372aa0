//! The GPU engine: when it is taken, and over whose samples.

use std::time::Instant;

use super::super::graphics::Task as Doing;
use super::{
    FitEngine, FitEngineArguments, ObservedView, Prepared, Refusal, SelectedEngine, Selection, tell,
};
use crate::gpu::engine::{DeviceSampleError, DeviceSamples, GpuEngine, Memory, Task};
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
        selection: Selection,
        then: impl FnOnce(&SelectedEngine<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let must = selection.why.is_none();
        let mut gpu = match self.open() {
            Ok(gpu) if must || !gpu.is_software() => gpu,
            Ok(gpu) => {
                let selection = selection.but(&format!("{} is a program on the CPU", gpu.name()));
                return self.on_cpu(prepared, observed, selection, then);
            }
            Err(error) if must => return Err(refused(&error)),
            Err(error) => {
                tell(&format!("{error} The CPU engine makes the passes."));
                return self.on_cpu(prepared, observed, selection.but("none could be opened"), then);
            }
        };
        let mut resident = self.resident();
        loop {
            match self.engine_on(&gpu, prepared, &observed, resident) {
                Ok(engine) => {
                    let engine = FitEngine::Gpu(engine);
                    self.verify(prepared, &engine)?;
                    return then(&SelectedEngine { engine, selection });
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
                    gpu = self.open().map_err(|error| refused(&error))?;
                }
                Err(error) => return Err(refused(&error)),
            }
        }
    }

    /// Call `then` with an engine over samples that the adapter makes; where they have no room on it, over the
    /// CPU's, as many of which stay as may.
    pub(super) fn with_own_samples<T>(
        &self,
        prepared: &Prepared,
        then: impl FnOnce(&SelectedEngine<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        let gpu = self.open().map_err(|error| refused(&error))?;
        let content = Content {
            scene: &prepared.scene,
            illumination: &prepared.illumination,
            occlusion: prepared.occlusion.as_ref(),
            params: &prepared.scene.params,
        };
        let resident = self.resident();
        let error = match DeviceSamples::new(&gpu, content) {
            Ok((made, groups)) => {
                let observed = prepared.observed_with(groups)?;
                let (task, memory) = (task(prepared, &observed), Memory { part: None, resident });
                match GpuEngine::over_device_samples(&made, task, &prepared.start(), memory) {
                    Ok(engine) => {
                        let engine = FitEngine::Gpu(engine);
                        self.verify(prepared, &engine)?;
                        return then(&SelectedEngine { engine, selection: Selection::default() });
                    }
                    Err(error) => error,
                }
            }
            Err(DeviceSampleError::Gpu(error)) => error,
            Err(error) => return Err(error.into()),
        };
        if !matches!(error, GpuError::OutOfMemory { .. } | GpuError::SamplesStay { .. }) {
            return Err(refused(&error));
        }
        drop(gpu);
        tell(&format!("{error} The CPU makes the samples."));
        let start = Instant::now();
        let samples = prepared.traced()?;
        let selection =
            Selection { traced_seconds: Some(start.elapsed().as_secs_f64()), ..Selection::default() };
        let observed = prepared.observed_with(samples)?;
        self.with_gpu(prepared, observed, selection, then)
    }

    /// Most bytes that stay on the adapter, where that is limited.
    fn resident(&self) -> Option<u64> {
        self.device_memory.map(|megabytes| megabytes.saturating_mul(1_000_000))
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

fn refused(error: &GpuError) -> Refusal {
    Doing::Fit.refusal(error)
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
