//! How fast an adapter's memory is: what no pass can beat that moves its bytes once.

use wgpu::{BufferUsages, CommandEncoderDescriptor, ShaderStages};

use super::compute::{bind, compute_pass, groups, layout, module, pipeline, storage};
use super::device::Gpu;
use super::error::GpuError;
use super::timing::Timer;

/// Bytes of what is copied: more than caches hold.
const BYTES: u64 = 1 << 28;
/// Copies of which the median counts.
const COPIES: usize = 21;
/// Threads of a workgroup.
const THREADS: u32 = 256;

const COPY: &str = "\
@group(0) @binding(0) var<storage, read> source: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> copied: array<vec4f>;

@compute @workgroup_size(256)
fn cs_main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let i = id.x + 256u * workgroups.x * id.y;
    if (i < arrayLength(&copied)) {
        copied[i] = source[i];
    }
}
";

/// Bytes that are read and written in a second where a shader copies a buffer to another; `None` where the adapter has no
/// timestamps, or no room.
///
/// # Errors
/// When the device fails.
pub fn copied_bytes_a_second(gpu: &Gpu) -> Result<Option<f64>, GpuError> {
    if !gpu.timestamps() || gpu.is_software() || gpu.check_binding("bandwidth", BYTES).is_err() {
        return Ok(None);
    }
    let numbers: Vec<u32> = (0..BYTES as u32 / 4).map(|i| i.wrapping_mul(2_654_435_761) >> 9).collect();
    let source = gpu.buffer("source", bytemuck::cast_slice(&numbers), BufferUsages::STORAGE);
    let copied = gpu.scratch("copied", BYTES)?;
    let compute = ShaderStages::COMPUTE;
    let own = layout(gpu, "copy", &[(compute, storage(true)), (compute, storage(false))]);
    let bound = bind(gpu, &own, vec![source.as_entire_binding(), copied.as_entire_binding()]);
    let made = pipeline(gpu, "cs_main", &module(gpu, "copy", COPY), &[&own]);
    let [across, down] = groups((BYTES / 16) as u32 / THREADS);
    let mut times = Vec::with_capacity(COPIES);
    for _ in 0..COPIES {
        let mut timer = Timer::new(gpu);
        let mut encoder = gpu.device.create_command_encoder(&CommandEncoderDescriptor::default());
        {
            let mut pass = compute_pass(&mut encoder, "copy", Some(&mut timer));
            pass.set_pipeline(&made);
            pass.set_bind_group(0, &bound, &[]);
            pass.dispatch_workgroups(across, down, 1);
        }
        timer.finish(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        timer.collect(gpu)?;
        times.extend(timer.times.iter().map(|time| time.milliseconds));
    }
    times.sort_by(f64::total_cmp);
    Ok(times.get(times.len() / 2).map(|milliseconds| 2.0 * BYTES as f64 / (1e-3 * milliseconds)))
}
