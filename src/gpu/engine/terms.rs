//! Samples replaced by their terms, where no free parameter needs a lookup: then they are all that a pass reads.

use wgpu::{Buffer, BufferUsages, ComputePassDescriptor};

use super::fused::{Fitted, Layout, WORKGROUP, terms_module};
use super::lights::{DeviceLights, Inputs};
use super::parts::Parts;
use super::pipeline::{READ, UNIFORM, Uniform, WRITE, bind, buffer, encoder, layout, pipeline};
use crate::model::params::Params;
use crate::{Gpu, GpuError, MOST_OF_A_DISPATCH};
use skinfit_core::engine::view::ObservedView;

/// Put terms in the place of every part's samples.
pub(super) fn replace_samples(
    gpu: &Gpu,
    fitted: &Fitted,
    terms: &Layout,
    params: &Params,
    lights: &mut DeviceLights,
    parts: &mut Parts,
    views: &[ObservedView],
) -> Result<(), GpuError> {
    let (plan, wgsl) = terms_module(fitted, terms).map_err(GpuError::Plan)?;
    let mut inputs = Inputs::new(gpu, &plan);
    let in_place = terms.in_place_of(&fitted.layout);
    let of_part = if in_place {
        layout(gpu, "samples to terms", &[(0, UNIFORM), (1, WRITE)])
    } else {
        layout(gpu, "samples to terms", &[(0, UNIFORM), (1, READ), (2, WRITE)])
    };
    let made = pipeline(gpu, "samples to terms", &wgsl, &[&inputs.layout, &of_part]);
    lights.set(gpu, params, &mut inputs)?;
    let Some(bound) = inputs.bound() else { return gpu.check() };
    for part in &mut parts.parts {
        let samples = Parts::samples(part, views);
        let count = Uniform::new(gpu, "count", 16);
        count.write(gpu, bytemuck::cast_slice(&[samples as u32, 0, 0, 0]));
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let longer = (!in_place).then(|| buffer(gpu, "terms", 4 * samples * terms.rows, usage));
        let buffers: Vec<&Buffer> =
            [count.buffer(), &part.buffers.samples].into_iter().chain(&longer).collect();
        let bindings = bind(gpu, &of_part, &buffers);
        let mut commands = encoder(gpu);
        {
            let mut pass = commands.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(&made);
            pass.set_bind_group(0, bound, &[]);
            pass.set_bind_group(1, &bindings, &[]);
            let workgroups = samples.div_ceil(WORKGROUP as usize).clamp(1, MOST_OF_A_DISPATCH as usize);
            pass.dispatch_workgroups(workgroups as u32, 1, 1);
        }
        gpu.queue.submit([commands.finish()]);
        // The samples' memory is given back before the next part takes more.
        if let Some(longer) = longer {
            part.buffers.samples = longer;
        }
        gpu.wait()?;
    }
    gpu.check()
}
