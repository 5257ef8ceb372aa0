//! The forward pass: images, left on the device.

use wgpu::{BindGroup, Buffer, BufferUsages, ComputePassDescriptor, ComputePipeline};

use super::fused::Fused;
use super::lights::Inputs;
use super::parts::{PART_BYTES, Parts};
use super::pipeline::{Uniform, bind, buffer, encoder, part_layout, pipeline};
use crate::engine::view::ObservedView;
use crate::gpu::readback::read_floats;
use crate::gpu::timing::Timer;
use crate::gpu::{Gpu, GpuError};

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
        let (inputs, layout) = (Inputs::new(gpu, &fused.plan), part_layout(gpu));
        let pipeline = pipeline(gpu, "forward pass", &fused.image_module(), &[&inputs.layout, &layout]);
        let channels = fused.channels();
        let images = parts.parts.iter().map(|part| {
            let block = Uniform::new(gpu, "part", PART_BYTES);
            let bytes = 4 * channels * Parts::slots(part);
            let image = buffer(gpu, "image", bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let of = &part.buffers;
            let bindings =
                bind(gpu, &layout, &[block.buffer(), &of.samples, &of.group_start, &of.targets, &image]);
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
        gains: &[f64],
        mut timers: Option<&mut Vec<Timer>>,
    ) -> Result<(), GpuError> {
        let Some(lights) = self.inputs.bound() else { return gpu.check() };
        for (part, (block, _, bindings)) in parts.parts.iter().zip(&self.parts) {
            let gain = gains.get(part.view).copied().unwrap_or(1.0);
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
                pass.dispatch_workgroups(Parts::most_workgroups(part), 1, 1);
            }
            if let Some(timer) = &timer {
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
