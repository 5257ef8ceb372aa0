//! What is not skin, drawn plainly: by its own glTF material (metallic-roughness) under the scene's light.
//!
//! - [`Plain`]: the parts on the device, and the passes' draws
//! - `text`: the text of their shaders, after what places the mesh
//! - `rows`: what reaches their vertices; the lights and the sky
//! - `materials`: what each part is drawn by
//!
//! No constant of the skin moves them. Where lights move or the environment turns, the renderer makes them anew.

mod materials;
mod rows;
mod text;

use std::ops::Range;

use wgpu::{
    BindGroupLayout, ColorTargetState, ColorWrites, FragmentState, IndexFormat, MultisampleState,
    PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState, RenderPass, RenderPipeline,
    RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, VertexAttribute, VertexBufferLayout,
    VertexState, VertexStepMode,
};

use self::materials::Materials;
use self::rows::Light;
use self::text::{Varyings, module, placing};
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::formats::vertex_format;
use super::pipeline::{Inputs, Stages, nearest};
use super::targets::Key;
use super::upload::Uploads;
use crate::bake::rays::RayMesh;
use crate::samples::plain_vertices::PlainVertices;
use crate::scene::mesh::Mesh;
use crate::shader::Facts;

/// The parts of a scene's mesh that are not skin, on a device.
pub(super) struct Plain {
    /// What places them.
    inputs: Inputs,
    light: Light,
    materials: Materials,
    /// Triangles of each material, by its place.
    runs: Vec<(u16, Range<u32>)>,
    layouts: [BindGroupLayout; 3],
    varyings: Varyings,
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
        let scene = std::sync::Arc::clone(&uploads.content().scene);
        let Some(parts) = &scene.mesh.plain else { return Ok(None) };
        let plan = placing(facts).map_err(|error| GpuError::Plan(error.to_string()))?;
        let inputs = Inputs::new(gpu, plan, uploads, Vec::new(), Stages::Raster)?;
        let light = Light::new(gpu, &scene, &found(&scene, &scene.mesh))?;
        let varyings = Varyings::new(gpu, light.count())?;
        let materials = Materials::new(gpu, &parts.materials)?;
        let layouts = [inputs.layout.clone(), light.layout().clone(), materials.layout().clone()];
        uploads.add_bytes(light.bytes() + materials.bytes());
        let runs = uploads.triangles().plain.clone();
        gpu.check()?;
        Ok(Some(Self { inputs, light, materials, runs, layouts, varyings }))
    }

    /// What draws them into targets of `key`.
    pub(super) fn pipeline(&self, gpu: &Gpu, key: &Key, show: Show) -> RenderPipeline {
        let device = &gpu.device;
        let (multisamples, formats) = (key.antialias.multisamples(), key.formats());
        let wgsl = module(&self.inputs.plan, &self.varyings, show, key.hazy, multisamples > 1);
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("plain"),
            source: ShaderSource::Wgsl(wgsl.into()),
        });
        let layouts: Vec<_> = self.layouts.iter().map(Some).collect();
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("plain"),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let read = &self.inputs.plan.attributes;
        let attributes: Vec<[VertexAttribute; 1]> = (0_u32..)
            .zip(read)
            .map(|(shader_location, &a)| {
                [VertexAttribute { format: vertex_format(a), offset: 0, shader_location }]
            })
            .collect();
        let step_mode = VertexStepMode::Vertex;
        let buffers: Vec<_> = attributes
            .iter()
            .zip(read)
            .map(|(attributes, a)| {
                Some(VertexBufferLayout { array_stride: a.bytes(), step_mode, attributes })
            })
            .collect();
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
                buffers: &buffers,
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

    /// Set the constants of what is drawn next, into so many samples along a pixel's side.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>, axis: u32) {
        self.inputs.set(gpu, values);
        self.light.set(gpu, axis);
    }

    /// Put what reaches the vertices of another pose in the place of what reached them.
    pub(super) fn set_mesh(&self, gpu: &Gpu, uploads: &Uploads, mesh: &Mesh) {
        let scene = &uploads.content().scene;
        self.light.set_vertices(gpu, scene, &found(scene, mesh));
    }

    /// Draw them into what skin was drawn into.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, pipeline: &RenderPipeline, uploads: &Uploads) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.inputs.bound, &[]);
        pass.set_bind_group(1, self.light.bound(), &[]);
        for (slot, buffer) in self.inputs.attributes.iter().enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
        pass.set_index_buffer(uploads.indices().slice(..), IndexFormat::Uint32);
        for (material, triangles) in &self.runs {
            if let Some(bound) = self.materials.bound(*material) {
                pass.set_bind_group(2, bound, &[]);
                pass.draw_indexed(3 * triangles.start..3 * triangles.end, 0, 0..1);
            }
        }
    }
}

/// What reaches the vertices of a mesh of the scene in its pose.
fn found(scene: &crate::scene::Scene, mesh: &Mesh) -> PlainVertices {
    let posed = mesh.pose();
    PlainVertices::new(scene, &posed, &RayMesh::of(&posed))
}
