//! The time of a case, taken in turns with the whole model's.

use super::GpuTiming;
use crate::StudyError;
use crate::engine::Point;
use crate::subject::{LivePass, Subject};
use crate::timing::{Rounds, Timed, interleaved, seconds_of};

/// The whole model, ready to be timed beside a case.
pub struct Clocks {
    whole: LivePass,
    gpu: gpu::Clock,
    /// Why the renderer is not timed, where it should have been.
    pub warning: Option<String>,
}

impl Clocks {
    /// Of the whole model, and of its renderer `when` that is wished for.
    ///
    /// # Errors
    /// When an adapter was wished for and there is none, or it fails, or a rule cannot be computed on the processor.
    pub fn new(whole: &Subject, point: &Point, when: GpuTiming) -> Result<Self, StudyError> {
        let (gpu, warning) = match when {
            GpuTiming::Never => (gpu::Clock::none(), None),
            GpuTiming::Auto | GpuTiming::Always => gpu::Clock::open(whole, point, when == GpuTiming::Always)?,
        };
        Ok(Self { whole: whole.live_pass(point)?, gpu, warning })
    }

    /// What the renderer is timed on.
    #[must_use]
    pub fn adapter(&self) -> Option<String> {
        self.gpu.adapter()
    }

    /// A pass of the CPU engine over all of a case's samples, and a frame of the renderer (of several scenes the first's):
    /// both beside the whole model's.
    ///
    /// # Errors
    /// When the adapter fails, or a rule cannot be computed on the processor.
    pub fn time(&self, case: &Subject, point: &Point) -> Result<(Timed, Option<Timed>), StudyError> {
        let own = case.live_pass(point)?;
        let mut whole_pass = || Ok::<f64, StudyError>(seconds_of(|| self.whole.run()));
        let mut own_pass = || Ok(seconds_of(|| own.run()));
        let cpu = interleaved(Rounds::default(), &mut [&mut whole_pass, &mut own_pass])?;
        Ok((cpu[1], self.gpu.time(case, point)?))
    }
}

mod gpu {
    use crate::StudyError;
    use crate::engine::Point;
    use crate::gpu::upload::Content;
    use crate::gpu::{Choice, Gpu, RenderOptions, Renderer};
    use crate::render::antialias::Antialias;
    use crate::render::shading::Shading;
    use crate::shader::Budget;
    use crate::subject::Subject;
    use crate::timing::{Rounds, Spread, Timed, interleaved};

    /// Frames between two turns.
    const FRAMES: usize = 5;

    /// The adapter, and the whole model on it.
    pub(super) struct Clock(Option<Open>);

    struct Open {
        gpu: Gpu,
        whole: Content,
    }

    impl Clock {
        pub(super) fn none() -> Self {
            Self(None)
        }

        /// Of the whole model, where there is an adapter of hardware, or of any kind if it is `wished` for; and
        /// why it is not timed all the same.
        pub(super) fn open(
            whole: &Subject,
            point: &Point,
            wished: bool,
        ) -> Result<(Self, Option<String>), StudyError> {
            let gpu = match Gpu::open(&Choice::default()) {
                Ok(gpu) if wished || !gpu.is_software() => gpu,
                Err(error) if wished => return Err(error.into()),
                _ => return Ok((Self(None), None)),
            };
            if let Some(what) = content(whole, point).and_then(|whole| whole.scene.cpu_alone()) {
                return Ok((Self(None), Some(format!("GPU time is not measured: {what}."))));
            }
            if !gpu.timestamps() {
                let warning = format!("GPU time is not measured: {} has no timestamps.", gpu.name());
                return Ok((Self(None), Some(warning)));
            }
            let open = content(whole, point).map(|whole| Open { gpu, whole });
            Ok((Self(open), None))
        }

        pub(super) fn adapter(&self) -> Option<String> {
            let gpu = &self.0.as_ref()?.gpu;
            let kind = if gpu.is_software() { " (software)" } else { "" };
            Some(format!("{}{kind}", gpu.name()))
        }

        /// A frame of the first view beside the whole model's.
        pub(super) fn time(&self, case: &Subject, point: &Point) -> Result<Option<Timed>, StudyError> {
            let Some(Open { gpu, whole }) = &self.0 else { return Ok(None) };
            let camera = whole.scene.views[0].camera;
            let mut whole = renderer(gpu, whole.clone())?;
            let Some(own) = content(case, point) else { return Ok(None) };
            let mut own = renderer(gpu, own)?;
            let frames = |renderer: &mut Renderer| -> Result<f64, StudyError> {
                let times = renderer.frame_times(&camera, FRAMES)?;
                Ok(1e-3 * Spread::of(&times).map_or(0.0, |spread| spread.median))
            };
            let mut jobs = [&mut whole, &mut own].map(|renderer| move || frames(renderer));
            let [whole, own] = &mut jobs;
            Ok(interleaved(Rounds::default(), &mut [whole, own])?.get(1).copied())
        }
    }

    /// The first scene that is fitted, at the constants of `point`.
    fn content(subject: &Subject, point: &Point) -> Option<Content> {
        let first = subject.scenes.fitted().next()?;
        let Point { params, .. } = subject.scenes.point_of(first, point);
        Some(Content { params, ..Content::of(&first.baked) })
    }

    fn renderer(gpu: &Gpu, content: Content) -> Result<Renderer, StudyError> {
        let antialias = Antialias::Grid(content.scene.quality.samples_per_axis);
        let options = RenderOptions {
            antialias,
            shading: Shading::default(),
            budget: Budget::Exact,
            timed: true,
            animated: false,
        };
        Ok(Renderer::new(gpu, content, options)?)
    }
}
