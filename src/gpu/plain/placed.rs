//! What places the parts that are not skin: the planned vertex stage over triangles that share no vertices, so that each
//! fragment knows its triangle and where in it it lies.

use std::collections::HashMap;
use std::ops::Range;

use wgpu::{
    BindGroup, Buffer, BufferUsages, RenderPass, VertexAttribute, VertexBufferLayout, VertexFormat,
    VertexStepMode,
};

use crate::constants::{Values, block_bytes};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::formats::vertex_format;
use crate::pipeline::{self, Inputs, Stages};
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::shader::{Attribute, Plan, Resource};
use crate::upload::{Bound, Uploads, buffer, storage};
use crate::vertices;

/// The parts' corners on the device.
pub(super) struct Placed {
    pub(super) inputs: Inputs,
    /// Factors on the base colour, a corner each.
    tints: Buffer,
    /// What the plan reads beside attributes, in its order.
    resources: Vec<(Resource, Buffer)>,
    /// Their triangles.
    triangles: Vec<[u32; 3]>,
    /// The morph targets that are summed.
    targets: Vec<usize>,
}

impl Placed {
    /// Those of the scene that `uploads` are of, in that range of its triangles, placed by a plan.
    ///
    /// # Errors
    /// When they are more than the adapter takes.
    pub(super) fn new(
        gpu: &Gpu,
        plan: Plan,
        triangles: Range<u32>,
        uploads: &Uploads,
    ) -> Result<Self, GpuError> {
        let scene = &*uploads.content().scene;
        let (ordered, range) = (uploads.triangles(), triangles.start as usize..triangles.end as usize);
        let (triangles, order) = (ordered.corners[range.clone()].to_vec(), &ordered.order[range]);
        let targets = uploads.targets().to_vec();
        let split = corners(&scene.mesh, &triangles);
        let attributes = plan.attributes.iter().map(|&attribute| {
            let bytes = vertices::attribute(attribute, &split, None, &HashMap::new());
            buffer(gpu, attribute.name(), &bytes, BufferUsages::VERTEX)
        });
        let attributes = attributes.collect::<Result<Vec<_>, _>>()?;
        let resources = plan.resources.iter().map(|&resource| {
            let rows = rows(resource, &split, &targets);
            Ok((resource, storage(gpu, resource.name(), bytemuck::cast_slice(&rows))?))
        });
        let resources = resources.collect::<Result<Vec<_>, GpuError>>()?;
        let bound = bound(&resources);
        let tints = tints(scene, order);
        let tints = buffer(gpu, "tints", bytemuck::cast_slice(&tints), BufferUsages::VERTEX)?;
        let inputs = Inputs::of(gpu, plan, attributes, &bound, Stages::Raster);
        Ok(Self { inputs, tints, resources, triangles, targets })
    }

    /// Set the constants of what is drawn next.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) {
        self.inputs.set(gpu, values);
    }

    /// Put another pose of the mesh in the place of the one that is on the device.
    pub(super) fn set_mesh(&self, gpu: &Gpu, mesh: &Mesh) {
        let split = corners(mesh, &self.triangles);
        for (&attribute, buffer) in self.inputs.plan.attributes.iter().zip(&self.inputs.attributes) {
            if matches!(attribute, Attribute::Position | Attribute::Normal) {
                let bytes = vertices::attribute(attribute, &split, None, &HashMap::new());
                gpu.queue.write_buffer(buffer, 0, &bytes);
            }
        }
        for (resource, buffer) in &self.resources {
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rows(*resource, &split, &self.targets)));
        }
    }

    /// A uniform block for the plan's constants beside its own, bound with what else it reads.
    pub(super) fn constants(&self, gpu: &Gpu) -> (Buffer, BindGroup) {
        let plan = &self.inputs.plan;
        let block = vec![0; block_bytes(&plan.constants, plan.facts.morphs)];
        let buffer = gpu.buffer("constants", &block, BufferUsages::UNIFORM);
        let bound = pipeline::bind(gpu, &self.inputs.layout, Some(&buffer), &bound(&self.resources));
        (buffer, bound)
    }

    /// How each buffer is read, and the bytes of a corner in it.
    pub(super) fn attributes(&self) -> Vec<([VertexAttribute; 1], u64)> {
        let read = self.inputs.plan.attributes.iter().map(|&a| (vertex_format(a), a.bytes()));
        let tint = (VertexFormat::Float32x4, 16);
        let attribute = |(shader_location, (format, bytes))| {
            ([VertexAttribute { format, offset: 0, shader_location }], bytes)
        };
        (0_u32..).zip(read.chain([tint])).map(attribute).collect()
    }

    /// Have a pass read them.
    pub(super) fn set_buffers(&self, pass: &mut RenderPass<'_>) {
        for (slot, buffer) in (0_u32..).zip(self.buffers()) {
            pass.set_vertex_buffer(slot, buffer.slice(..));
        }
    }

    /// What is read of each corner, in the order of the shader's locations.
    fn buffers(&self) -> impl Iterator<Item = &Buffer> {
        self.inputs.attributes.iter().chain([&self.tints])
    }

    pub(super) fn bytes(&self) -> u64 {
        let resources = self.resources.iter().map(|(_, buffer)| buffer);
        self.buffers().chain(resources).map(Buffer::size).sum()
    }
}

/// The layouts of such buffers.
pub(super) fn layouts(attributes: &[([VertexAttribute; 1], u64)]) -> Vec<Option<VertexBufferLayout<'_>>> {
    let step_mode = VertexStepMode::Vertex;
    let each = attributes.iter();
    each.map(|(attributes, bytes)| Some(VertexBufferLayout { array_stride: *bytes, step_mode, attributes }))
        .collect()
}

fn bound(resources: &[(Resource, Buffer)]) -> Vec<Bound> {
    resources.iter().map(|(_, buffer)| Bound::Buffer(buffer.clone())).collect()
}

/// A mesh of those triangles alone, which share no vertices.
fn corners(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let (split, _) = vertices::by_corner(mesh, triangles, None);
    Mesh { plain: None, ..split }
}

/// The rows of what a vertex stage reads beside attributes.
fn rows(resource: Resource, mesh: &Mesh, targets: &[usize]) -> Vec<[f32; 4]> {
    match resource {
        Resource::MorphDeltas => vertices::morph_deltas(mesh, targets, None),
        Resource::Bones => vertices::bones(&mesh.bones),
        // Nothing else places a mesh.
        _ => vec![[0.0; 4]],
    }
}

/// The factor on the base colour at each corner of those triangles.
fn tints(scene: &Scene, triangles: &[u32]) -> Vec<[f32; 4]> {
    let colors = scene.mesh.plain.as_ref().map_or(&[][..], |parts| &parts.corner_colors);
    let of = |&triangle: &u32| colors.get(triangle as usize).copied().unwrap_or([[1.0; 4]; 3]);
    triangles.iter().flat_map(of).collect()
}
