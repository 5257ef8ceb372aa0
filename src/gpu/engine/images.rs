//! The forward pass: images, left on the device.

use std::sync::MutexGuard;

use web_time::Instant;

use wgpu::{BindGroup, Buffer, BufferUsages, ComputePassDescriptor, ComputePipeline};

use super::dispatch::PART_BYTES;
use super::fused::Fused;
use super::lights::Inputs;
use super::parts::Parts;
use super::pipeline::{Uniform, bind_part, buffer, encoder, part_layout, pipeline};
use super::{GpuEngine, OnDevice};
use crate::model::gain::Gain;
use crate::model::terms::TermName;
use crate::readback::read_floats;
use crate::timing::Timer;
use crate::{Gpu, GpuError};
use skinfit_core::engine::Point;
use skinfit_core::engine::view::ObservedView;

/// The forward pass and its images, a buffer a part.
pub(super) struct Images {
    pub(super) inputs: Inputs,
    pipeline: ComputePipeline,
    channels: usize,
    /// For each part its uniform block, its image and their bindings.
    parts: Vec<(Uniform, Buffer, BindGroup)>,
}

impl Images {
    pub(super) fn new(gpu: &Gpu, fused: &Fused, parts: &Parts) -> Result<Self, GpuError> {
        let (inputs, layout) = (Inputs::new(gpu, &fused.plan), part_layout(gpu, parts.have_levels()));
        let pipeline = pipeline(gpu, "forward pass", &fused.image_module(), &[&inputs.layout, &layout]);
        let channels = fused.channels();
        let images = parts.parts.iter().map(|part| {
            let block = Uniform::new(gpu, "part", PART_BYTES);
            let bytes = 4 * channels * Parts::slots(part);
            let image = buffer(gpu, "image", bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let bindings = bind_part(gpu, &layout, &block, &part.buffers, &image);
            (block, image, bindings)
        });
        let parts = images.collect();
        gpu.check()?;
        Ok(Self { inputs, pipeline, channels, parts })
    }

    /// Shade every part; nothing is waited for. A part's time goes to a timer of its own, where they are wanted.
    pub(super) fn run(
        &self,
        gpu: &Gpu,
        parts: &Parts,
        views: &[ObservedView],
        gains: &[Gain],
        mut timers: Option<&mut Vec<Timer>>,
    ) -> Result<(), GpuError> {
        let Some(lights) = self.inputs.bound() else { return gpu.check() };
        for (part, (block, _, bindings)) in parts.parts.iter().zip(&self.parts) {
            let gain = gains.get(part.view).copied().unwrap_or_default();
            if Parts::is_streamed(part) {
                gpu.wait()?;
                parts.stream(gpu, views, part)?;
            }
            block.write(gpu, &parts.block(views, part, gain, 0));
            let mut commands = encoder(gpu);
            let mut timer = timers.is_some().then(|| Timer::new(gpu));
            {
                let timestamp_writes = timer.as_mut().and_then(|timer| timer.around_compute("shade"));
                let mut pass =
                    commands.begin_compute_pass(&ComputePassDescriptor { label: None, timestamp_writes });
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, lights, &[]);
                pass.set_bind_group(1, bindings, &[]);
                pass.dispatch_workgroups(Parts::image_workgroups(part), 1, 1);
            }
            if let Some(timer) = &mut timer {
                timer.finish(&mut commands);
            }
            gpu.queue.submit([commands.finish()]);
            if let Some(timers) = &mut timers {
                timers.extend(timer);
            }
        }
        gpu.check()
    }

    /// The planes of a view's image.
    pub(super) fn read(&self, gpu: &Gpu, parts: &Parts, view: usize) -> Result<Vec<Vec<f32>>, GpuError> {
        let mut planes = vec![Vec::new(); self.channels];
        for (part, (_, image, _)) in parts.parts.iter().zip(&self.parts).filter(|(part, _)| part.view == view)
        {
            let numbers = read_floats(gpu, encoder(gpu), image)?;
            let slots = Parts::slots(part);
            for (plane, numbers) in planes.iter_mut().zip(numbers.chunks_exact(slots)) {
                plane.extend_from_slice(numbers);
            }
        }
        Ok(planes)
    }
}

impl OnDevice {
    /// The images of the last forward pass, and the parts that they are of.
    fn shaded(&self, gpu: &Gpu) -> Result<(&Images, &Parts), GpuError> {
        match &self.images {
            Some((_, images)) => Ok((images, &self.parts)),
            None => gpu.check().and(Err(gpu.lost("no image"))),
        }
    }
}

impl GpuEngine {
    /// The image of view `index` at `point`, as the CPU engine's: for each pixel slot the mean over its
    /// samples, colour and (where the haze is compared) alpha, times the view's gain.
    ///
    /// # Errors
    /// When the device fails.
    pub fn image(&self, index: usize, point: &Point) -> Result<Vec<Vec<f32>>, GpuError> {
        self.read_image(index, point, None)
    }

    /// As [`Self::image`], of one term alone, without alpha.
    ///
    /// # Errors
    /// When the device fails.
    pub fn term_image(&self, index: usize, point: &Point, term: TermName) -> Result<Vec<Vec<f32>>, GpuError> {
        self.read_image(index, point, Some(term))
    }

    /// Shade every view and wait for it; the images stay on the device. To be timed.
    ///
    /// # Errors
    /// When the device fails.
    pub fn shade(&self, point: &Point) -> Result<(), GpuError> {
        let _images = self.run_images(point, None)?;
        self.gpu.wait()
    }

    /// Milliseconds of each of `passes` forward passes over all views with nothing read back. On the GPU's clock, one
    /// right after another; a program on the CPU stamps a compute pass before its threads have run it, so there it is
    /// the host's clock, around each. Empty where a card has no timestamps.
    ///
    /// # Errors
    /// When the device fails.
    pub fn shade_times(&self, point: &Point, passes: usize) -> Result<Vec<f64>, GpuError> {
        let (gpu, gains) = (&self.gpu, point.gains.as_slice());
        if !gpu.timestamps() && !gpu.is_software() {
            return Ok(Vec::new());
        }
        let device = self.run_images(point, None)?;
        let (images, parts) = device.shaded(gpu)?;
        if gpu.is_software() {
            gpu.wait()?;
            let timed = |_| {
                let start = Instant::now();
                images.run(gpu, parts, &self.views, gains, None)?;
                gpu.wait()?;
                Ok(1e3 * start.elapsed().as_secs_f64())
            };
            return (0..passes).map(timed).collect();
        }
        let timed = |_| {
            let mut timers = Vec::new();
            images.run(gpu, parts, &self.views, gains, Some(&mut timers))?;
            Ok(timers)
        };
        let timers = (0..passes).map(timed).collect::<Result<Vec<Vec<Timer>>, GpuError>>()?;
        let milliseconds = |mut timer: Timer| {
            timer.collect(gpu)?;
            Ok(timer.times.iter().map(|time| time.milliseconds).sum::<f64>())
        };
        timers.into_iter().map(|timers| timers.into_iter().map(milliseconds).sum()).collect()
    }

    fn read_image(
        &self,
        index: usize,
        point: &Point,
        term: Option<TermName>,
    ) -> Result<Vec<Vec<f32>>, GpuError> {
        let device = self.run_images(point, term)?;
        let (images, parts) = device.shaded(&self.gpu)?;
        images.read(&self.gpu, parts, index)
    }

    /// Run the forward pass; its images are on the device that comes back, as long as that is held.
    fn run_images(
        &self,
        point: &Point,
        term: Option<TermName>,
    ) -> Result<MutexGuard<'_, OnDevice>, GpuError> {
        let written = self.written(point);
        let mut device = self.lock();
        self.keep(point, &mut device)?;
        self.look_up(point, &mut device)?;
        let OnDevice { parts, lights, images, .. } = &mut *device;
        if images.as_ref().is_none_or(|(of, _)| *of != (written, term)) {
            let fused = self.fused(written, lights.face_sizes(), term)?;
            *images = Some(((written, term), Images::new(&self.gpu, &fused, parts)?));
        }
        if let Some((_, images)) = images {
            lights.set(&self.gpu, &point.params, &mut images.inputs)?;
            images.run(&self.gpu, parts, &self.views, &point.gains, None)?;
        }
        Ok(device)
    }
}
