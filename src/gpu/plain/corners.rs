//! The corners of the parts that are not skin: triangles that share no vertices, so that each fragment knows its triangle and
//! where in it it lies.

use std::collections::HashMap;

use wgpu::{Buffer, BufferUsages};

use crate::device::Gpu;
use crate::error::GpuError;
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::shader::{Attribute, Resource};
use crate::triangles::Triangles;
use crate::upload::{buffer, storage};
use crate::vertices;

/// The corners on a device, each thing uploaded once and only when a plan names it: images and shadow maps are drawn of the
/// same.
pub(crate) struct Corners {
    /// The parts alone, in the pose that is on the device.
    split: Mesh,
    /// Their triangles in the whole mesh.
    triangles: Vec<[u32; 3]>,
    /// The morph targets that are summed.
    targets: Vec<usize>,
    attributes: HashMap<Attribute, Buffer>,
    resources: HashMap<Resource, Buffer>,
    /// Factors on the base colour, a corner each.
    tints: Buffer,
    bytes: u64,
}

impl Corners {
    /// Those of a scene whose triangles stand in that order, `targets` of its mesh being summed.
    ///
    /// # Errors
    /// When they are more than the adapter takes.
    pub(crate) fn new(
        gpu: &Gpu,
        scene: &Scene,
        ordered: &Triangles,
        targets: &[usize],
    ) -> Result<Self, GpuError> {
        let first = ordered.skin as usize;
        let triangles = ordered.corners[first..].to_vec();
        let tints = tints(scene, &ordered.order[first..]);
        let tints = buffer(gpu, "tints", bytemuck::cast_slice(&tints), BufferUsages::VERTEX)?;
        Ok(Self {
            split: split(&scene.mesh, &triangles),
            triangles,
            targets: targets.to_vec(),
            attributes: HashMap::new(),
            resources: HashMap::new(),
            bytes: tints.size(),
            tints,
        })
    }

    /// An attribute of each corner.
    pub(super) fn attribute(&mut self, gpu: &Gpu, attribute: Attribute) -> Result<Buffer, GpuError> {
        if let Some(buffer) = self.attributes.get(&attribute) {
            return Ok(buffer.clone());
        }
        let made = buffer(gpu, attribute.name(), &self.numbers(attribute), BufferUsages::VERTEX)?;
        self.bytes += made.size();
        self.attributes.insert(attribute, made.clone());
        Ok(made)
    }

    /// What a vertex stage reads beside attributes.
    pub(super) fn resource(&mut self, gpu: &Gpu, resource: Resource) -> Result<Buffer, GpuError> {
        if let Some(buffer) = self.resources.get(&resource) {
            return Ok(buffer.clone());
        }
        let made = storage(gpu, resource.name(), bytemuck::cast_slice(&self.rows(resource)))?;
        self.bytes += made.size();
        self.resources.insert(resource, made.clone());
        Ok(made)
    }

    pub(super) const fn tints(&self) -> &Buffer {
        &self.tints
    }

    /// Put another pose of the mesh in the place of the one that is on the device.
    pub(crate) fn set_mesh(&mut self, gpu: &Gpu, mesh: &Mesh) {
        self.split = split(mesh, &self.triangles);
        for (&attribute, buffer) in &self.attributes {
            if matches!(attribute, Attribute::Position | Attribute::Normal) {
                gpu.queue.write_buffer(buffer, 0, &self.numbers(attribute));
            }
        }
        for (&resource, buffer) in &self.resources {
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&self.rows(resource)));
        }
    }

    /// Bytes that were uploaded.
    pub(crate) const fn bytes(&self) -> u64 {
        self.bytes
    }

    fn numbers(&self, attribute: Attribute) -> Vec<u8> {
        vertices::attribute(attribute, &self.split, None, &HashMap::new())
    }

    fn rows(&self, resource: Resource) -> Vec<[f32; 4]> {
        match resource {
            Resource::MorphDeltas => vertices::morph_deltas(&self.split, &self.targets, None),
            Resource::Bones => vertices::bones(&self.split.bones),
            // Nothing else places a mesh.
            _ => vec![[0.0; 4]],
        }
    }
}

/// A mesh of those triangles alone, which share no vertices.
fn split(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let (split, _) = vertices::by_corner(mesh, triangles, None);
    Mesh { plain: None, ..split }
}

/// The factor on the base colour at each corner of those triangles.
fn tints(scene: &Scene, triangles: &[u32]) -> Vec<[f32; 4]> {
    let colors = scene.mesh.plain.as_ref().map_or(&[][..], |parts| &parts.corner_colors);
    let of = |&triangle: &u32| colors.get(triangle as usize).copied().unwrap_or([[1.0; 4]; 3]);
    triangles.iter().flat_map(of).collect()
}
