//! Shadow maps: how deep each light sees, drawn once for a pose of the mesh and a place of the lights.
//!
//! - `views`: what each light sees; [`Maps`]: the texture, and the passes that draw it
//!
//! The mesh is placed by the plan's own vertex stage. Both sides of a triangle are drawn, as both are seen and stop rays: a
//! mesh may be open. Backs alone would need no bias on closed bodies, but light comes through where a body is thin: on a
//! scanned head they are off by half as much again. What has holes or blends is drawn after the rest, by its material
//! ([`Casters`]). How fragments read the maps stands in the rules (`rules/lib/shadow.wgsl` and
//! `rules/family/shadow.wgsl`).

mod views;

use glam::DMat4;
use wgpu::{
    AddressMode, BindGroup, Buffer, BufferUsages, CommandEncoder, CompareFunction, Extent3d, FilterMode,
    IndexFormat, LoadOp, Operations, RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline,
    SamplerDescriptor, StoreOp, Texture, TextureDescriptor, TextureDimension, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension,
};

pub(super) use self::views::{Mapped, mapped, with_layers};
use self::views::{ROWS, views};
use super::constants;
use super::device::Gpu;
use super::error::{GpuError, Oversized};
use super::geometry::outline;
use super::pipeline::{self, Outputs, Stages};
use super::plain::Casters;
use super::targets::DEPTH;
use super::timing::Timer;
use super::upload::{Bound, Uploads};
use crate::scene::ShadowMaps;
use crate::scene::mesh::Mesh;
use crate::shader::{Constant, Facts, Resource};

/// The shadow maps of a scene on the device.
pub(super) struct Maps {
    settings: ShadowMaps,
    lights: Vec<Mapped>,
    layers: Vec<Layer>,
    texture: Texture,
    /// The rows that shaders read of each layer.
    rows: Buffer,
    pipeline: RenderPipeline,
    constants: Vec<Constant>,
    attributes: Vec<Buffer>,
    /// The triangles that stop all light, and how many indices they have.
    indices: (Buffer, u32),
    /// Those that light passes in places.
    casters: Option<Casters>,
    /// Whether they do not show the present pose.
    stale: bool,
    drawn: u64,
}

/// One map.
struct Layer {
    target: TextureView,
    matrix: DMat4,
    constants: Buffer,
    bound: BindGroup,
}

impl Maps {
    /// Maps for these lights of a mesh that facts' plans draw; nothing is drawn yet.
    ///
    /// # Errors
    /// When they are more or larger than the adapter takes.
    pub(super) fn new(
        gpu: &Gpu,
        facts: &Facts,
        lights: Vec<Mapped>,
        settings: ShadowMaps,
        uploads: &mut Uploads,
    ) -> Result<Self, GpuError> {
        let count = lights.iter().map(Mapped::layers).sum::<usize>();
        let texture = texture(gpu, settings.size, count)?;
        let plan = outline(facts).map_err(|error| GpuError::Plan(error.to_string()))?;
        let attributes =
            plan.attributes.iter().map(|&a| uploads.attribute(gpu, a)).collect::<Result<Vec<_>, _>>()?;
        let resources =
            plan.resources.iter().map(|&r| uploads.resource(gpu, r)).collect::<Result<Vec<_>, _>>()?;
        let layout = pipeline::layout(gpu, &plan, Stages::Raster);
        let outputs = Outputs { formats: &[], multisamples: 1, depth: true };
        let pipeline = pipeline::pipeline(gpu, &plan, &layout, outputs);
        let block = vec![0; constants::block_bytes(&plan.constants, facts.morphs)];
        let layer = |i: usize| {
            let constants = gpu.buffer("shadow constants", &block, BufferUsages::UNIFORM);
            let bound = pipeline::bind(gpu, &layout, Some(&constants), &resources);
            Layer { target: layer_view(&texture, i), matrix: DMat4::IDENTITY, constants, bound }
        };
        let layers = (0..count).map(layer).collect();
        let rows = gpu.buffer("shadow views", &vec![0; 16 * ROWS * count.max(1)], BufferUsages::STORAGE);
        gpu.check()?;
        let indices = (uploads.indices().clone(), 3 * uploads.triangles().blocking);
        let casters = Casters::new(gpu, facts, uploads, count)?;
        let constants = plan.constants;
        let (stale, drawn) = (true, 0);
        Ok(Self {
            settings,
            lights,
            layers,
            texture,
            rows,
            pipeline,
            constants,
            attributes,
            indices,
            casters,
            stale,
            drawn,
        })
    }

    /// Bytes of the maps.
    pub(super) fn bytes(&self) -> u64 {
        4 * u64::from(self.settings.size).pow(2) * self.layers.len() as u64
    }

    /// How often a layer was drawn.
    pub(super) const fn drawn(&self) -> u64 {
        self.drawn
    }

    /// What shaders read of them.
    pub(super) fn bound(&self, gpu: &Gpu) -> [(Resource, Bound); 3] {
        let all = self.texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            ..TextureViewDescriptor::default()
        });
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("shadow_sampler"),
            address_mode_u: AddressMode::ClampToEdge,
            address_mode_v: AddressMode::ClampToEdge,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            // A greater depth is nearer.
            compare: Some(CompareFunction::GreaterEqual),
            ..SamplerDescriptor::default()
        });
        [
            (Resource::ShadowMaps, Bound::Texture(all)),
            (Resource::ShadowSampler, Bound::Sampler(sampler)),
            (Resource::ShadowViews, Bound::Buffer(self.rows.clone())),
        ]
    }

    /// Fit the maps to a pose of the mesh. They are drawn with the next frame.
    pub(super) fn set_mesh(&mut self, gpu: &Gpu, mesh: &Mesh) {
        let places = mesh.pose().positions;
        let mut rows = Vec::with_capacity(ROWS * self.layers.len());
        let views = self.lights.iter().flat_map(|light| views(light, &self.settings, &places));
        for (layer, view) in self.layers.iter_mut().zip(views) {
            layer.matrix = view.matrix;
            rows.extend(view.rows);
        }
        gpu.queue.write_buffer(&self.rows, 0, bytemuck::cast_slice(&rows));
        self.stale = true;
    }

    /// Draw them, where they do not show the present pose.
    pub(super) fn draw(
        &mut self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        morph_weights: &[f32],
        mut timer: Option<&mut Timer>,
    ) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        for (i, layer) in self.layers.iter().enumerate() {
            let block = constants::outline_block(&self.constants, &layer.matrix, morph_weights);
            gpu.queue.write_buffer(&layer.constants, 0, bytemuck::cast_slice(&block));
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("shadow map"),
                depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                    view: &layer.target,
                    depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
                    stencil_ops: None,
                }),
                timestamp_writes: timer.as_mut().and_then(|timer| timer.around("shadow maps")),
                ..RenderPassDescriptor::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &layer.bound, &[]);
            for (slot, buffer) in self.attributes.iter().enumerate() {
                pass.set_vertex_buffer(slot as u32, buffer.slice(..));
            }
            let (indices, count) = &self.indices;
            pass.set_index_buffer(indices.slice(..), IndexFormat::Uint32);
            pass.draw_indexed(0..*count, 0, 0..1);
            if let Some(casters) = &self.casters {
                casters.draw(gpu, &mut pass, i, (&layer.matrix, morph_weights));
            }
        }
        self.drawn += self.layers.len() as u64;
    }
}

/// A texture of `layers` maps; of one texel, where no light has one.
fn texture(gpu: &Gpu, size: u32, layers: usize) -> Result<Texture, GpuError> {
    let limits = gpu.device.limits();
    let (adapter, limit) = (gpu.name().to_owned(), limits.max_texture_dimension_2d);
    if size > limit {
        let (what, side, of) = ("shadow map".to_owned(), size as usize, Oversized::ShadowMap);
        return Err(GpuError::TextureSize { adapter, what, width: side, height: side, limit, of });
    }
    let limit = limits.max_texture_array_layers;
    if layers > limit as usize {
        return Err(GpuError::ShadowMaps { adapter, layers, limit });
    }
    let side = if layers == 0 { 1 } else { size };
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some("shadow maps"),
        size: Extent3d { width: side, height: side, depth_or_array_layers: layers.max(1) as u32 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: DEPTH,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    gpu.check()?;
    Ok(texture)
}

/// One layer, to be drawn into.
fn layer_view(texture: &Texture, layer: usize) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_array_layer: layer as u32,
        array_layer_count: Some(1),
        ..TextureViewDescriptor::default()
    })
}
