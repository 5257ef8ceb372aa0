//! The shaders of a wish as pipelines, and one run of them.

use wgpu::{BindGroup, Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor, ComputePipeline};

use super::dispatch::PART_BYTES;
use super::fused::{ColumnOf, Fused, PARTS, Slab, Sum, gather_module};
use super::lights::Inputs;
use super::part::Part;
use super::parts::Parts;
use super::pipeline::{
    READ, UNIFORM, Uniform, WRITE, bind, bind_part, buffer, encoder, layout, part_layout, pipeline,
};
use crate::model::gain::Gain;
use crate::readback::map;
use crate::{Gpu, GpuError};
use skinfit_core::engine::PassOutputs;
use skinfit_core::engine::view::ObservedView;

/// The shaders of a wish.
pub(super) struct Program {
    fused: Fused,
    slabs: Vec<(Slab, ComputePipeline)>,
    gather: ComputePipeline,
    pub(super) inputs: Inputs,
    /// For each slab and part: where its sums stand, and the bindings of both shaders.
    runs: Vec<Run>,
    results: Buffer,
    readback: Buffer,
}

/// One slab over one part.
struct Run {
    slab: usize,
    part: usize,
    first_sum: u32,
    first_result: usize,
    block: Uniform,
    bindings: BindGroup,
    gather: BindGroup,
    counts: Uniform,
}

impl Program {
    pub(super) fn new(gpu: &Gpu, fused: Fused, wish: PassOutputs, parts: &Parts) -> Result<Self, GpuError> {
        let inputs = Inputs::new(gpu, &fused.plan);
        let (of_part, of_gather) = (
            part_layout(gpu, parts.have_levels()),
            layout(gpu, "gather", &[(0, UNIFORM), (1, READ), (2, WRITE)]),
        );
        let slabs: Vec<(Slab, ComputePipeline)> = fused
            .slabs(wish)
            .into_iter()
            .map(|slab| {
                let made = pipeline(gpu, "fused pass", &slab.wgsl, &[&inputs.layout, &of_part]);
                (slab, made)
            })
            .collect();
        let gather = pipeline(gpu, "gather", &gather_module(), &[&of_gather]);
        gpu.check()?;
        let (mut sums, mut results) = (0, 0);
        let mut places = Vec::new();
        for (s, (slab, _)) in slabs.iter().enumerate() {
            for (p, part) in parts.parts.iter().enumerate() {
                places.push((s, p, sums, results));
                sums += slab.sums.len() * Parts::most_workgroups(part) as usize;
                results += slab.sums.len() * PARTS;
            }
        }
        let partial_sums = buffer(gpu, "partial sums", 4 * sums, BufferUsages::STORAGE);
        let results_buffer = buffer(gpu, "sums", 4 * results, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let readback = buffer(gpu, "sums read", 4 * results, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let runs = places.into_iter().map(|(slab, part, first_sum, first_result)| {
            let counts = Uniform::new(gpu, "counts", 16);
            let block = Uniform::new(gpu, "part", PART_BYTES);
            let bindings = bind_part(gpu, &of_part, &block, &parts.parts[part].buffers, &partial_sums);
            let gather = bind(gpu, &of_gather, &[counts.buffer(), &partial_sums, &results_buffer]);
            Run { slab, part, first_sum: first_sum as u32, first_result, block, bindings, gather, counts }
        });
        let runs = runs.collect();
        gpu.check()?;
        Ok(Self { fused, slabs, gather, inputs, runs, results: results_buffer, readback })
    }

    /// How many shaders a pass takes.
    pub(super) fn shaders(&self) -> u64 {
        self.slabs.len() as u64
    }

    pub(super) fn columns(&self) -> &[ColumnOf] {
        &self.fused.columns
    }

    /// One pass over all parts: for each, its sums.
    pub(super) fn run(
        &self,
        gpu: &Gpu,
        parts: &Parts,
        views: &[ObservedView],
        gains: &[Gain],
    ) -> Result<Vec<Vec<(Sum, f64)>>, GpuError> {
        let mut commands = encoder(gpu);
        for run in &self.runs {
            let part = &parts.parts[run.part];
            let gain = gains.get(part.view).copied().unwrap_or_default();
            if Parts::is_streamed(part) {
                // Its buffers may still be read by the part before it.
                gpu.queue.submit([std::mem::replace(&mut commands, encoder(gpu)).finish()]);
                gpu.wait()?;
                parts.stream(gpu, views, part)?;
            }
            run.block.write(gpu, &parts.block(views, part, gain, run.first_sum));
            self.encode(gpu, &mut commands, run, part);
        }
        commands.copy_buffer_to_buffer(&self.results, 0, &self.readback, 0, self.results.size());
        gpu.queue.submit([commands.finish()]);
        let slice = self.readback.slice(..);
        map(gpu, &slice)?;
        let sums = {
            let view = slice.get_mapped_range().map_err(|error| gpu.lost(&error.to_string()))?;
            self.collect(bytemuck::cast_slice(&view), parts.parts.len())
        };
        self.readback.unmap();
        Ok(sums)
    }

    fn encode(&self, gpu: &Gpu, encoder: &mut CommandEncoder, run: &Run, part: &Part) {
        let (slab, pipeline) = &self.slabs[run.slab];
        let workgroups = Parts::workgroups(part);
        let counts = [workgroups, run.first_sum, run.first_result as u32, 0];
        run.counts.write(gpu, bytemuck::cast_slice(&counts));
        let Some(lights) = self.inputs.bound() else { return };
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, lights, &[]);
        pass.set_bind_group(1, &run.bindings, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(0, &run.gather, &[]);
        pass.dispatch_workgroups(slab.sums.len() as u32, 1, 1);
    }

    /// The last additions, in f64.
    fn collect(&self, numbers: &[f32], parts: usize) -> Vec<Vec<(Sum, f64)>> {
        let mut sums = vec![Vec::new(); parts];
        for run in &self.runs {
            let (slab, _) = &self.slabs[run.slab];
            for (k, &sum) in slab.sums.iter().enumerate() {
                let parts = &numbers[run.first_result + k * PARTS..][..PARTS];
                sums[run.part].push((sum, parts.iter().map(|&x| f64::from(x)).sum()));
            }
        }
        sums
    }
}
