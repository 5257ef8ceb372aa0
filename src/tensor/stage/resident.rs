//! What stays on the device from pass to pass: constants, cubes, and what is no tensor of each sample.

use wgpu::{
    BindingResource, Buffer, BufferUsages, CommandEncoder, ComputePipeline, Extent3d, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
};

use crate::adjoint::{Adjoint, module_of};
use crate::buffer::TensorBuffer;
use crate::gpu::{Gpu, GpuError};
use crate::model::params::{Column, Param, Params};
use crate::pass;
use crate::samples::ViewSamples;
use crate::samples::surface_records::neutral;
use crate::shader::quantity::Constant;

/// The block of constants, and the pass that fills it.
#[derive(Debug)]
pub(crate) struct Constants {
    pipeline: ComputePipeline,
    values: Buffer,
    filled: Buffer,
    pub(crate) block: Buffer,
}

/// A cube that shaders read.
#[derive(Clone, Debug)]
pub(crate) struct Faces {
    pub(crate) size: usize,
    pub(crate) view: TextureView,
    /// Of the same texels, to be written.
    storage: TextureView,
}

impl Constants {
    /// Of a plan's constants; `None` where it has none.
    pub(crate) fn new(
        gpu: &Gpu,
        constants: &[Constant],
        params: &Params,
        columns: &[Column],
    ) -> Result<Option<Self>, GpuError> {
        if constants.is_empty() {
            return Ok(None);
        }
        let module = pass::module(gpu, "constants", &module_of(constants, columns))?;
        let values: Vec<f32> = Param::all()
            .flat_map(|param| params.rgb(param).into_iter().chain([0.0]))
            .map(|value| value as f32)
            .collect();
        let bytes = 16 * constants.len();
        let block = |usage| gpu.buffer("constants", &vec![0; bytes], usage);
        Ok(Some(Self {
            pipeline: pass::pipeline(gpu, &module, "cs_main")?,
            values: gpu.storage("parameters", bytemuck::cast_slice(&values))?,
            filled: block(BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            block: block(BufferUsages::UNIFORM),
        }))
    }

    /// Take the free columns from their tensor, and all else from the parameters, to the block.
    pub(crate) fn fill(&self, gpu: &Gpu, encoder: &mut CommandEncoder, columns: Option<&TensorBuffer>) {
        let mut resources = vec![(1, self.values.as_entire_binding()), (2, self.filled.as_entire_binding())];
        resources.extend(columns.map(|columns| (0, columns.binding())));
        pass::dispatch(gpu, encoder, &self.pipeline, &[resources], 1);
        encoder.copy_buffer_to_buffer(&self.filled, 0, &self.block, 0, self.block.size());
    }
}

impl Faces {
    pub(crate) fn new(gpu: &Gpu, size: usize) -> Result<Self, GpuError> {
        let side = size as u32 + 2;
        let texture = gpu.device.create_texture(&TextureDescriptor {
            label: Some("faces"),
            size: Extent3d { width: side, height: side, depth_or_array_layers: 6 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba32Float,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING,
            view_formats: &[],
        });
        gpu.check()?;
        let view = |usage| {
            texture.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2Array),
                usage: Some(usage),
                ..TextureViewDescriptor::default()
            })
        };
        Ok(Self {
            size,
            view: view(TextureUsages::TEXTURE_BINDING),
            storage: view(TextureUsages::STORAGE_BINDING),
        })
    }

    /// The pass that [`fill`](Self::fill) encodes.
    pub(crate) fn filler(gpu: &Gpu) -> Result<ComputePipeline, GpuError> {
        pass::pipeline(gpu, &pass::module(gpu, "faces", include_str!("../faces.wgsl"))?, "cs_main")
    }

    /// Take the texels from their tensor to where shaders read them.
    pub(crate) fn fill(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        pipeline: &ComputePipeline,
        texels: &TensorBuffer,
    ) {
        let resources = vec![(0, texels.binding()), (1, BindingResource::TextureView(&self.storage))];
        pass::dispatch(gpu, encoder, pipeline, &[resources], self.texels() as u64);
    }

    pub(crate) fn texels(&self) -> usize {
        6 * (self.size + 2) * (self.size + 2)
    }
}

/// What is no tensor of each sample, plane by plane; the share last. What records lack is neutral, but for the normal, which
/// is then their base.
pub(crate) fn fixed_planes(adjoint: &Adjoint, views: &[&ViewSamples]) -> Vec<f32> {
    let mut numbers = Vec::new();
    for (name, width) in adjoint.fixed() {
        for c in 0..width {
            for ViewSamples { surface, .. } in views {
                let row = |name: &str| surface.places().fields().find(|(held, ..)| *held == name);
                let held = row(name).or_else(|| if name == "normal" { row("base") } else { None });
                match held {
                    Some((_, row, _)) => {
                        numbers.extend((0..surface.slots()).map(|slot| surface.rows().number(row + c, slot)));
                    }
                    None => numbers.extend((0..surface.slots()).map(|_| neutral(name).unwrap_or(0.0))),
                }
            }
        }
    }
    for ViewSamples { surface, .. } in views {
        numbers.extend((0..surface.slots()).map(|slot| surface.weight(slot)));
    }
    numbers
}

/// Where each group's records start, the views one after the other.
pub(crate) fn group_starts(views: &[&ViewSamples]) -> Vec<u32> {
    let mut starts = vec![0];
    for view in views {
        let base = starts.last().copied().unwrap_or(0);
        starts.extend(view.group_start.iter().skip(1).map(|end| base + end));
    }
    starts
}
