//! What is not skin, drawn plainly: by its own glTF material (metallic-roughness) under the scene's light.
//!
//! - [`Plain`]: the parts on the device, and the passes' draws
//! - `text`: the text of their shaders
//! - [`Corners`]: their corners, and `placed`: what places these
//! - `light`: what reaches them; the lights and the sky
//! - `materials`: what each part is drawn by
//! - [`Casters`]: those that have holes or blend, in shadow maps
//!
//! No constant of the skin moves them. Where lights move or the environment turns, the renderer makes them anew.

mod casters;
mod corners;
mod light;
mod materials;
mod placed;
mod text;

use std::ops::Range;
use std::sync::Arc;

use wgpu::{
    BindGroupLayout, ColorTargetState, ColorWrites, FragmentState, MultisampleState,
    PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState, RenderPass, RenderPipeline,
    RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, VertexState,
};

pub(super) use self::casters::Casters;
pub(super) use self::corners::Corners;
use self::light::Light;
pub(super) use self::materials::Materials;
use self::placed::{Placed, layouts};
use self::text::{module, placing};
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::pipeline::nearest;
use super::targets::Key;
use super::upload::Uploads;
use crate::scene::mesh::Mesh;
use crate::shader::Facts;

/// The parts of a scene's mesh that are not skin, on a device.
pub(super) struct Plain {
    placed: Placed,
    light: Light,
    materials: Arc<Materials>,
    /// Corners of each material, by its place.
    runs: Vec<(u16, Range<u32>)>,
    layouts: [BindGroupLayout; 3],
}

/// How the parts are drawn into an image.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Show {
    /// As they look.
    Lit,
    /// As nothing, which hides what is behind it: in the image of a term.
    Hidden,
}

impl Plain {
    /// Of a scene; `None` where all of its mesh is skin.
    ///
    /// # Errors
    /// When the adapter does not take what they read.
    pub(super) fn new(gpu: &Gpu, facts: &Facts, uploads: &mut Uploads) -> Result<Option<Self>, GpuError> {
        let scene = Arc::clone(&uploads.content().scene);
        let ordered = uploads.triangles();
        if ordered.plain.is_empty() {
            return Ok(None);
        }
        let (runs, order) = (ordered.runs().collect(), ordered.order[ordered.skin as usize..].to_vec());
        let light = Light::new(gpu, &scene, &uploads.content().params, order)?;
        let plan = placing(facts).map_err(|error| GpuError::Plan(error.to_string()))?;
        let placed = Placed::new(gpu, plan, uploads.corners(gpu)?)?;
        let materials = uploads.materials(gpu)?;
        let layouts = [placed.inputs.layout.clone(), materials.layout().clone(), light.layout().clone()];
        uploads.add_bytes(light.bytes());
        gpu.check()?;
        Ok(Some(Self { placed, light, materials, runs, layouts }))
    }

    /// What draws them into targets of `key`.
    pub(super) fn pipeline(&self, gpu: &Gpu, key: &Key, show: Show) -> RenderPipeline {
        let device = &gpu.device;
        let (multisamples, formats) = (key.antialias.multisamples(), key.formats());
        let plan = &self.placed.inputs.plan;
        let wgsl = module(plan, self.light.shining(), show, key.hazy, multisamples > 1);
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("plain"),
            source: ShaderSource::Wgsl(wgsl.into()),
        });
        let groups: Vec<_> = self.layouts.iter().map(Some).collect();
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("plain"),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let attributes = self.placed.attributes();
        let target = |&format| Some(ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL });
        let targets: Vec<_> = formats.iter().map(target).collect();
        let constants = [("multisamples", f64::from(multisamples))];
        device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("plain"),
            layout: Some(&layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some("plain_vertex"),
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &layouts(&attributes),
            },
            // Both sides of a triangle are seen, as on the CPU.
            primitive: PrimitiveState { cull_mode: None, ..PrimitiveState::default() },
            depth_stencil: Some(nearest()),
            multisample: MultisampleState { count: multisamples, ..MultisampleState::default() },
            fragment: Some(FragmentState {
                module: &module,
                entry_point: Some("plain_fragment"),
                compilation_options: PipelineCompilationOptions {
                    constants: &constants,
                    ..Default::default()
                },
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Set the constants of what is drawn next, into `axis` samples along a pixel's side.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>, axis: u32) {
        self.placed.set(gpu, values);
        self.light.set(gpu, axis);
    }

    /// Put what reaches another pose of the mesh, whose corners `uploads` have, in the place of what is on the device.
    pub(super) fn set_mesh(&self, gpu: &Gpu, uploads: &Uploads, mesh: &Mesh) {
        self.light.set_mesh(gpu, &uploads.content().scene, mesh);
    }

    /// Draw them into what skin was drawn into.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.placed.inputs.bound, &[]);
        pass.set_bind_group(2, self.light.bound(), &[]);
        self.placed.set_buffers(pass);
        self.materials.draw(pass, &self.runs);
    }
}
