//! Buffers, textures and samplers of what is uploaded, within the adapter's limits.

use wgpu::util::{DeviceExt as _, TextureDataOrder};
use wgpu::{
    AddressMode, Buffer, BufferUsages, Extent3d, FilterMode, MipmapFilterMode, Sampler, SamplerDescriptor,
    TextureDescriptor, TextureDimension, TextureUsages, TextureView, TextureViewDescriptor,
};

use crate::device::Gpu;
use crate::error::{GpuError, Oversized};
use crate::model::texture_filter::TextureFilter;
use crate::texels::Texels;

fn check_size(gpu: &Gpu, what: &str, bytes: u64, limit: u64) -> Result<(), GpuError> {
    if bytes <= limit {
        return Ok(());
    }
    let (adapter, what) = (gpu.name().to_owned(), what.to_owned());
    Err(GpuError::BufferSize { adapter, what, bytes, limit, of: Oversized::Mesh })
}

pub(crate) fn buffer(
    gpu: &Gpu,
    label: &str,
    contents: &[u8],
    usage: BufferUsages,
) -> Result<Buffer, GpuError> {
    check_size(gpu, label, contents.len() as u64, gpu.device.limits().max_buffer_size)?;
    let made = gpu.buffer(label, contents, usage);
    gpu.check()?;
    Ok(made)
}

/// A buffer that shaders read.
pub(crate) fn storage(gpu: &Gpu, what: &str, bytes: &[u8]) -> Result<Buffer, GpuError> {
    check_size(gpu, what, bytes.len() as u64, gpu.device.limits().max_storage_buffer_binding_size)?;
    buffer(gpu, what, bytes, BufferUsages::STORAGE)
}

pub(crate) fn texture(gpu: &Gpu, name: &str, texels: &Texels) -> Result<TextureView, GpuError> {
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if texels.width.max(texels.height) > limit {
        return Err(GpuError::TextureSize {
            adapter: gpu.name().to_owned(),
            what: name.replace('_', " "),
            width: texels.width as usize,
            height: texels.height as usize,
            limit,
            of: Oversized::Map,
        });
    }
    let descriptor = TextureDescriptor {
        label: Some(name),
        size: Extent3d { width: texels.width, height: texels.height, depth_or_array_layers: texels.layers },
        mip_level_count: texels.levels,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: texels.format,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = TextureDataOrder::LayerMajor;
    let made = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, &texels.bytes);
    gpu.check()?;
    Ok(made.create_view(&TextureViewDescriptor {
        dimension: Some(texels.dimension),
        ..TextureViewDescriptor::default()
    }))
}

/// Bilinear within a level, and as `filter` says between levels, where a texture has several. An adapter that cannot
/// filter anisotropically looks up once.
pub(super) fn sampler(gpu: &Gpu, mode: AddressMode, filter: TextureFilter) -> Sampler {
    let between = if filter.reads_levels() { MipmapFilterMode::Linear } else { MipmapFilterMode::Nearest };
    gpu.device.create_sampler(&SamplerDescriptor {
        address_mode_u: mode,
        address_mode_v: mode,
        address_mode_w: mode,
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        mipmap_filter: between,
        anisotropy_clamp: filter.most_taps(),
        ..SamplerDescriptor::default()
    })
}
