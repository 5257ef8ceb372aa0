//! The transpose of a cube's lookups: what each sample's light gained, added to the texels that it was read from.

use wgpu::{Buffer, BufferUsages, CommandEncoder, ComputePipeline};

use super::buffer::TensorBuffer;
use super::pass;
use super::shaded::Scatter;
use crate::gpu::{Gpu, GpuError};

/// The passes of either way of adding.
#[derive(Debug)]
pub(super) struct Scattering {
    way: Scatter,
    largest: ComputePipeline,
    scatter: ComputePipeline,
    sums: ComputePipeline,
}

impl Scattering {
    pub(super) fn new(gpu: &Gpu, way: Scatter) -> Result<Self, GpuError> {
        let text = concat!(include_str!("scatter.wgsl"), include_str!("atomic_sums.wgsl"));
        let module = pass::module(gpu, "scatter", text)?;
        let pipeline = |entry| pass::pipeline(gpu, &module, entry);
        let (scatter, sums) = match way {
            Scatter::Exact => ("cs_exact", "cs_exact_sums"),
            Scatter::Fast => ("cs_fast", "cs_fast_sums"),
        };
        Ok(Self { way, largest: pipeline("cs_largest")?, scatter: pipeline(scatter)?, sums: pipeline(sums)? })
    }

    /// Add up the lookups of one cube of `size` texels a face. For each lookup, `lights` holds what each sample
    /// gained (four numbers) and where it looked (face, s, t).
    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        lights: &[[&Buffer; 2]],
        samples: usize,
        size: usize,
        result: &TensorBuffer,
    ) -> Result<(), GpuError> {
        let texels = 6 * (size + 2) * (size + 2);
        // A texel may be one of the four of every lookup.
        let headroom = (4 * samples * lights.len()).max(1).ilog2() + 1;
        let numbers = [size as u32, samples as u32, headroom, texels as u32];
        let uniform = gpu.buffer("size", bytemuck::cast_slice(&numbers), BufferUsages::UNIFORM);
        let largest = gpu.scratch("the largest adjoint", 4)?;
        let words = if self.way == Scatter::Exact { 2 } else { 1 };
        let sums = gpu.scratch("the sums of a cube's texels", (16 * words * texels) as u64)?;
        let size = || (0, uniform.as_entire_binding());
        let threads = samples as u64;
        if self.way == Scatter::Exact {
            for [adjoint, _] in lights {
                let resources =
                    vec![size(), (1, adjoint.as_entire_binding()), (3, largest.as_entire_binding())];
                pass::dispatch(gpu, encoder, &self.largest, &[resources], threads);
            }
        }
        for [adjoint, place] in lights {
            let mut resources = vec![
                size(),
                (1, adjoint.as_entire_binding()),
                (2, place.as_entire_binding()),
                (4, sums.as_entire_binding()),
            ];
            self.with_largest(&mut resources, &largest);
            pass::dispatch(gpu, encoder, &self.scatter, &[resources], threads);
        }
        let mut resources = vec![size(), (4, sums.as_entire_binding()), (5, result.binding())];
        self.with_largest(&mut resources, &largest);
        pass::dispatch(gpu, encoder, &self.sums, &[resources], 4 * texels as u64);
        Ok(())
    }

    fn with_largest<'a>(&self, resources: &mut Vec<(u32, wgpu::BindingResource<'a>)>, largest: &'a Buffer) {
        if self.way == Scatter::Exact {
            resources.push((3, largest.as_entire_binding()));
        }
    }
}
