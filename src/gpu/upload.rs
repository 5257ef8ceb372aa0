//! A scene on the device: what plans read of it, each thing uploaded once and only when a plan names it.
//!
//! - `made`: buffers, textures and samplers
//! - `resource`: what plans read beside attributes
//! - `pose`: all in another pose

mod made;
mod pose;
mod resource;

use std::collections::HashMap;
use std::sync::Arc;

use wgpu::{BindingResource, Buffer, BufferUsages, CommandEncoder, Sampler, TextureView};

pub(crate) use self::made::{buffer, storage, texture};
use super::device::Gpu;
use super::error::GpuError;
use super::plain::{Corners, Materials};
use super::shadow::{self, Mapped};
use super::timing::Timer;
use super::triangles::Triangles;
use super::vertices;
use crate::bake::rays::RayMesh;
use crate::bake::stacks::Stack;
use crate::bake::{Illumination, PoseBake, SkyBake, VertexOcclusion, VertexThickness};
use crate::model::cube::Cube;
use crate::model::fields::{Field, Fields};
use crate::model::params::Params;
use crate::prepare::Baked;
use crate::samples::{PosedSurface, SurfaceBakes};
use crate::scene::Scene;
use crate::scene::mesh::Mesh;
use crate::scene::mip_maps::MipMaps;
use crate::shader::{Attribute, Facts, Resource};

/// What is rendered: a scene, its bakes, and the parameters. Whatever is large is shared: a clone copies none of it.
#[derive(Clone)]
pub struct Content {
    /// The scene, its mesh at rest.
    pub scene: Arc<Scene>,
    /// The cubes that its effects ask for.
    pub illumination: Arc<Illumination>,
    /// Ambient occlusion, when asked for.
    pub occlusion: Option<Arc<VertexOcclusion>>,
    /// The sky that each vertex sees, when asked for.
    pub sky: Option<Arc<SkyBake>>,
    /// How thick the mesh is below each vertex, when asked for.
    pub thickness: Option<Arc<VertexThickness>>,
    /// The constants of the model.
    pub params: Params,
}

impl Content {
    /// A scene and its bakes, at its own constants.
    #[must_use]
    pub fn of(baked: &Baked) -> Self {
        Self {
            scene: Arc::clone(&baked.scene),
            illumination: Arc::clone(&baked.illumination),
            occlusion: baked.occlusion.clone(),
            sky: baked.sky.clone(),
            thickness: baked.thickness.clone(),
            params: baked.scene.params.clone(),
        }
    }
}

/// The scene's part on the device.
pub(super) struct Uploads {
    content: Content,
    /// In the place of the scene's mesh and its occlusion: one whose triangles share no vertices.
    split: Option<(Mesh, Option<VertexOcclusion>)>,
    /// The morph targets that are summed, by their index in the mesh.
    targets: Vec<usize>,
    stacks: [Option<Cube<f32>>; Stack::ALL.len()],
    attributes: HashMap<Attribute, Buffer>,
    /// What was found of fields at the vertices.
    found: HashMap<Field, Vec<f32>>,
    resources: HashMap<Resource, Bound>,
    /// The coarser levels of the scene's maps, once a plan reads a map that is filtered by them.
    mip_maps: Option<MipMaps>,
    /// The lights that have shadow maps, and those, once a plan reads them.
    mapped: Vec<Mapped>,
    shadow_maps: Option<shadow::Maps>,
    /// What is not skin, and what it is drawn by, once something draws it.
    corners: Option<Corners>,
    materials: Option<Arc<Materials>>,
    indices: Buffer,
    /// What `indices` holds.
    triangles: Triangles,
    /// Bytes that were uploaded, but for the corners' own.
    bytes: u64,
    /// Texels that were cut at the end of their format's range.
    clipped: usize,
}

/// A resource as it is bound.
#[derive(Clone)]
pub(super) enum Bound {
    Texture(TextureView),
    Sampler(Sampler),
    Buffer(Buffer),
}

impl Bound {
    pub(super) fn binding(&self) -> BindingResource<'_> {
        match self {
            Self::Texture(view) => BindingResource::TextureView(view),
            Self::Sampler(sampler) => BindingResource::Sampler(sampler),
            Self::Buffer(buffer) => buffer.as_entire_binding(),
        }
    }
}

impl Uploads {
    /// The scene's triangles; everything else follows as it is asked for. `targets` are summed.
    pub(super) fn new(gpu: &Gpu, content: Content, targets: Vec<usize>) -> Result<Self, GpuError> {
        Self::of_mesh(gpu, content, targets, None)
    }

    /// As [`new`](Self::new), of a mesh whose triangles share no vertices: each knows which corner it is. Its pose is
    /// the scene's for good.
    pub(super) fn by_corner(gpu: &Gpu, content: Content, targets: Vec<usize>) -> Result<Self, GpuError> {
        let mesh = &content.scene.mesh;
        let split = vertices::by_corner(mesh, &mesh.triangles, content.occlusion.as_deref());
        Self::of_mesh(gpu, content, targets, Some(split))
    }

    fn of_mesh(
        gpu: &Gpu,
        mut content: Content,
        targets: Vec<usize>,
        split: Option<(Mesh, Option<VertexOcclusion>)>,
    ) -> Result<Self, GpuError> {
        let mapped = shadow::mapped(&content.scene, &content.params);
        content.params = shadow::with_layers(content.params, &mapped);
        let mesh = split.as_ref().map_or(&content.scene.mesh, |(mesh, _)| mesh);
        let triangles = Triangles::of(mesh);
        let corners = bytemuck::cast_slice(&triangles.corners);
        let indices = buffer(gpu, "triangles", corners, BufferUsages::INDEX | BufferUsages::STORAGE)?;
        let bytes = corners.len() as u64;
        let looked_up = |stack: Stack| stack.at(&content.illumination, stack.place(&content.params));
        let stacks = Stack::ALL.map(|stack| looked_up(stack).map(|(cube, _)| cube));
        Ok(Self {
            content,
            split,
            targets,
            stacks,
            attributes: HashMap::new(),
            found: HashMap::new(),
            resources: HashMap::new(),
            mip_maps: None,
            mapped,
            shadow_maps: None,
            corners: None,
            materials: None,
            indices,
            triangles,
            bytes,
            clipped: 0,
        })
    }

    /// What attributes are of.
    fn mesh(&self) -> (&Mesh, Option<&VertexOcclusion>) {
        match &self.split {
            Some((mesh, occlusion)) => (mesh, occlusion.as_ref()),
            None => (&self.content.scene.mesh, self.content.occlusion.as_deref()),
        }
    }

    pub(super) const fn content(&self) -> &Content {
        &self.content
    }

    /// Take other constants, where what was uploaded holds for them, too: whether it does.
    pub(super) fn set_params(&mut self, params: &Params) -> bool {
        let Content { scene, params: before, .. } = &self.content;
        let mapped = shadow::mapped(scene, params);
        let params = shadow::with_layers(params.clone(), &mapped);
        // What rays have found of vertices may go by anything that is no weight: where a light is, how the sky is
        // turned, how rough the skin is.
        let found = self.found.is_empty() || params.differ_in_weights_alone(before);
        let same = found
            && mapped == self.mapped
            && scene.lights_at(&params) == scene.lights_at(before)
            && Stack::ALL.into_iter().all(|stack| stack.place(&params) == stack.place(before));
        if same {
            self.content.params = params;
        }
        same
    }

    pub(super) const fn indices(&self) -> &Buffer {
        &self.indices
    }

    pub(super) fn vertex_count(&self) -> u64 {
        self.mesh().0.positions.len() as u64
    }

    /// What they are the vertices of.
    pub(super) const fn triangles(&self) -> &Triangles {
        &self.triangles
    }

    /// Three for each triangle of skin, which come first.
    pub(super) const fn index_count(&self) -> u32 {
        3 * self.triangles.skin
    }

    /// Count bytes that were uploaded beside.
    pub(super) const fn add_bytes(&mut self, bytes: u64) {
        self.bytes += bytes;
    }

    pub(super) const fn bytes(&self) -> u64 {
        let corners = match &self.corners {
            Some(corners) => corners.bytes(),
            None => 0,
        };
        self.bytes + corners
    }

    pub(super) const fn clipped(&self) -> usize {
        self.clipped
    }

    /// Have the fields that a plan reads of vertices found together: what rays find of one they may find of others.
    pub(super) fn find_fields(&mut self, gpu: &Gpu, attributes: &[Attribute]) -> Result<(), GpuError> {
        let unfound = attributes.iter().filter_map(|attribute| match attribute {
            Attribute::Field(field) if !self.found.contains_key(field) => Some(*field),
            _ => None,
        });
        let found = self.fields(gpu, self.mesh().0, None, Fields::of(unfound))?;
        self.found.extend(found);
        Ok(())
    }

    /// An attribute's vertex buffer; a field's once it is found.
    pub(super) fn attribute(&mut self, gpu: &Gpu, attribute: Attribute) -> Result<Buffer, GpuError> {
        if let Some(buffer) = self.attributes.get(&attribute) {
            return Ok(buffer.clone());
        }
        self.find_fields(gpu, &[attribute])?;
        let (mesh, occlusion) = self.mesh();
        let bytes = vertices::attribute(attribute, mesh, occlusion, &self.found);
        let made = buffer(gpu, attribute.name(), &bytes, BufferUsages::VERTEX | BufferUsages::COPY_SRC)?;
        self.bytes += bytes.len() as u64;
        self.attributes.insert(attribute, made.clone());
        Ok(made)
    }

    /// What is found of fields at each vertex of the mesh in its pose, of which `own` is baked.
    fn fields(
        &self,
        gpu: &Gpu,
        mesh: &Mesh,
        own: Option<&PoseBake>,
        fields: Fields,
    ) -> Result<HashMap<Field, Vec<f32>>, GpuError> {
        if fields.is_empty() {
            return Ok(HashMap::new());
        }
        let posed = mesh.pose();
        let rays = RayMesh::of(&posed);
        // Where triangles share no vertices, the fields are the mesh file's own.
        let whole = self.split.is_none();
        let sky = own.and_then(|own| own.sky.as_ref()).or(self.content.sky.as_deref());
        let thickness = own.and_then(|own| own.thickness.as_ref()).or(self.content.thickness.as_deref());
        let (sky, thickness) = (sky.filter(|_| whole), thickness.filter(|_| whole));
        let bakes = SurfaceBakes { sky, thickness, ..SurfaceBakes::default() };
        let surface =
            PosedSurface::with_fields(&self.content.scene, &posed, &rays, &mesh.morphs, bakes, fields)
                .map_err(|error| GpuError::Refused {
                    adapter: gpu.name().to_owned(),
                    reason: error.to_string(),
                })?;
        Ok(fields.iter().map(|field| (field, surface.field_of_vertices(field))).collect())
    }

    /// Have the shadow maps that plans of these facts read.
    pub(super) fn make_shadow_maps(&mut self, gpu: &Gpu, facts: &Facts) -> Result<(), GpuError> {
        if self.shadow_maps.is_some() {
            return Ok(());
        }
        let scene = Arc::clone(&self.content.scene);
        let lights = self.mapped.clone();
        let mut maps = shadow::Maps::new(gpu, facts, lights, scene.shadow_maps, self)?;
        maps.set_mesh(gpu, &scene.mesh);
        self.bytes += maps.bytes();
        self.resources.extend(maps.bound(gpu));
        self.shadow_maps = Some(maps);
        Ok(())
    }

    /// The corners of what is not skin.
    pub(super) fn corners(&mut self, gpu: &Gpu) -> Result<&mut Corners, GpuError> {
        let corners = match self.corners.take() {
            Some(corners) => corners,
            None => Corners::new(gpu, &self.content.scene, &self.triangles, &self.targets)?,
        };
        Ok(self.corners.insert(corners))
    }

    /// The materials of what is not skin.
    pub(super) fn materials(&mut self, gpu: &Gpu) -> Result<Arc<Materials>, GpuError> {
        if let Some(materials) = &self.materials {
            return Ok(Arc::clone(materials));
        }
        let parts = self.content.scene.mesh.plain.as_ref();
        let made = Materials::new(gpu, parts.map_or(&[], |parts| &parts.materials))?;
        self.bytes += made.bytes();
        Ok(Arc::clone(self.materials.insert(Arc::new(made))))
    }

    /// Draw the shadow maps, where a plan reads them and what they show has changed.
    pub(super) fn draw_shadow_maps(
        &mut self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        morph_weights: &[f32],
        timer: Option<&mut Timer>,
    ) {
        if let Some(maps) = &mut self.shadow_maps {
            maps.draw(gpu, encoder, morph_weights, timer);
        }
    }

    /// How often shadow maps were drawn, layer by layer.
    pub(super) fn shadow_maps_drawn(&self) -> u64 {
        self.shadow_maps.as_ref().map_or(0, shadow::Maps::drawn)
    }
}
