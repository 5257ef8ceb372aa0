//! A scene on the device: what plans read of it, each thing uploaded once and only when a plan names it.

use glam::Mat4;
use std::collections::HashMap;
use std::sync::Arc;

use wgpu::util::{DeviceExt as _, TextureDataOrder};
use wgpu::{
    AddressMode, BindingResource, Buffer, BufferUsages, CommandEncoder, Extent3d, FilterMode,
    MipmapFilterMode, Sampler, SamplerDescriptor, TextureDescriptor, TextureDimension, TextureUsages,
    TextureView, TextureViewDescriptor,
};

use super::device::Gpu;
use super::error::{GpuError, Oversized};
use super::plain::Materials;
use super::shadow::{self, Mapped};
use super::texels::{self, Texels};
use super::timing::Timer;
use super::triangles::Triangles;
use super::vertices;
use crate::bake::rays::RayMesh;
use crate::bake::stacks::Stack;
use crate::bake::{Illumination, PoseBake, SkyBake, VertexOcclusion, VertexThickness};
use crate::model::cube::Cube;
use crate::model::fields::{Field, Fields};
use crate::model::params::Params;
use crate::model::texture_filter::TextureFilter;
use crate::prepare::Baked;
use crate::samples::{PosedSurface, SurfaceBakes};
use crate::scene::Scene;
use crate::scene::maps::Maps;
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
    /// What is not skin is drawn by, once something draws it.
    materials: Option<Arc<Materials>>,
    indices: Buffer,
    /// What `indices` holds.
    triangles: Triangles,
    /// Bytes that were uploaded.
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

    /// The morph targets that are summed, by their index in the mesh.
    pub(super) fn targets(&self) -> &[usize] {
        &self.targets
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
        self.bytes
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

    /// A resource, ready to be bound.
    pub(super) fn resource(&mut self, gpu: &Gpu, resource: Resource) -> Result<Bound, GpuError> {
        if let Some(bound) = self.resources.get(&resource) {
            return Ok(bound.clone());
        }
        let bound = self.make(gpu, resource)?;
        self.resources.insert(resource, bound.clone());
        Ok(bound)
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

    fn make(&mut self, gpu: &Gpu, resource: Resource) -> Result<Bound, GpuError> {
        let (scene, illumination) = (Arc::clone(&self.content.scene), Arc::clone(&self.content.illumination));
        let cube = |cube: &Option<Cube<f32>>, form: fn(&Cube<f32>) -> Texels| cube.as_ref().map(form);
        let stacked = |stack: Stack| &self.stacks[stack as usize];
        let texels = match resource {
            Resource::MapSampler => {
                let filter = scene.quality.texture_filter;
                return Ok(Bound::Sampler(sampler(gpu, AddressMode::Repeat, filter)));
            }
            Resource::CubeSampler => {
                let filter = TextureFilter::Bilinear;
                return Ok(Bound::Sampler(sampler(gpu, AddressMode::ClampToEdge, filter)));
            }
            Resource::MorphDeltas => {
                let (mesh, occlusion) = self.mesh();
                let deltas = vertices::morph_deltas(mesh, &self.targets, occlusion);
                return self.storage(gpu, "morph targets", &deltas);
            }
            Resource::Bones => return self.storage(gpu, "bones", &vertices::bones(&scene.mesh.bones)),
            Resource::IrradianceFaces => cube(&illumination.irradiance, texels::faces),
            Resource::SpecularFaces => cube(stacked(Stack::Specular), texels::faces),
            Resource::ReflectedFaces => cube(stacked(Stack::Reflected), texels::faces),
            Resource::GlossyFaces => cube(stacked(Stack::Glossy), texels::faces),
            // A fit's: no renderer's plan reads them. Shadow maps are there before they are asked for.
            Resource::SpecularSlopeFaces
            | Resource::ReflectedSlopeFaces
            | Resource::GlossySlopeFaces
            | Resource::ShadowMaps
            | Resource::ShadowSampler
            | Resource::ShadowViews => None,
            Resource::HiliteFaces => cube(&illumination.hilite, texels::faces),
            Resource::IrradianceCube => cube(&illumination.irradiance, texels::cube),
            Resource::SpecularCube => cube(stacked(Stack::Specular), texels::cube),
            Resource::ReflectedCube => cube(stacked(Stack::Reflected), texels::cube),
            Resource::GlossyCube => cube(stacked(Stack::Glossy), texels::cube),
            Resource::HiliteCube => cube(&illumination.hilite, texels::cube),
            map => texels::map(map, &scene.maps, self.coarser_maps(&scene)),
        };
        let texels = texels.ok_or_else(|| GpuError::Refused {
            adapter: gpu.name().to_owned(),
            reason: format!("the shader reads {}, which the scene does not have", resource.name()),
        })?;
        self.bytes += texels.bytes.len() as u64;
        self.clipped += texels.clipped;
        Ok(Bound::Texture(texture(gpu, resource.name(), &texels)?))
    }

    /// The levels of the scene's maps below the finest; none where its filter reads none.
    fn coarser_maps(&mut self, scene: &Scene) -> &[Maps] {
        if self.mip_maps.is_none() {
            self.mip_maps = MipMaps::new(&scene.maps, scene.quality.texture_filter);
        }
        self.mip_maps.as_ref().map_or(&[], MipMaps::levels)
    }

    fn storage(&mut self, gpu: &Gpu, what: &str, rows: &[[f32; 4]]) -> Result<Bound, GpuError> {
        let made = storage(gpu, what, bytemuck::cast_slice(rows))?;
        self.bytes += made.size();
        Ok(Bound::Buffer(made))
    }

    /// The whole mesh in a pose of those bones and weights, where what is on the device goes by more than these: shadows,
    /// what is found at vertices and what reaches parts that are not skin are of the posed surface, which the processor knows of the whole mesh.
    pub(super) fn posed_whole(&self, bones: &[Mat4], weights: &[f32]) -> Option<Mesh> {
        let mesh = &self.content.scene.mesh;
        let finds = self.attributes.keys().any(|attribute| matches!(attribute, Attribute::Field(_)));
        if self.shadow_maps.is_none() && !finds && mesh.plain.is_none() {
            return None;
        }
        let mut mesh = Mesh { bones: self.posed(bones), ..mesh.clone() };
        mesh.morphs.iter_mut().zip(weights).for_each(|(morph, weight)| morph.weight = *weight);
        Some(mesh)
    }

    /// Put other bones in place of those that are on the device.
    pub(super) fn set_pose(&self, gpu: &Gpu, bones: &[Mat4]) {
        if let Some(Bound::Buffer(buffer)) = self.resources.get(&Resource::Bones) {
            let rows = vertices::bones(&self.posed(bones));
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rows));
        }
    }

    /// The mesh's bones, those that are given in the place of its own.
    fn posed(&self, bones: &[Mat4]) -> Vec<Mat4> {
        let mut posed = self.content.scene.mesh.bones.clone();
        posed.iter_mut().zip(bones).for_each(|(old, new)| *old = *new);
        posed
    }

    /// Put another pose of the mesh (the same vertices at another time) in place of the one that is on the
    /// device; and what is baked of that pose, where it has bakes of its own, in place of the scene's.
    pub(super) fn set_mesh(
        &mut self,
        gpu: &Gpu,
        mesh: &Mesh,
        own: Option<&PoseBake>,
    ) -> Result<(), GpuError> {
        if let Some(maps) = &mut self.shadow_maps {
            maps.set_mesh(gpu, mesh);
        }
        let occlusion = own.and_then(|own| own.occlusion.as_ref());
        let occluded = occlusion.is_some();
        let occlusion = occlusion.or(self.content.occlusion.as_deref());
        // What is found at vertices is found anew in this pose.
        let finds = self.attributes.keys().filter_map(|attribute| match attribute {
            Attribute::Field(field) => Some(*field),
            _ => None,
        });
        let fields = self.fields(gpu, mesh, own, Fields::of(finds))?;
        for (&attribute, buffer) in &self.attributes {
            let moves = matches!(
                attribute,
                Attribute::Position | Attribute::Normal | Attribute::Tangent | Attribute::Field(_)
            );
            if moves || occluded && attribute == Attribute::Occlusion {
                let bytes = vertices::attribute(attribute, mesh, occlusion, &fields);
                gpu.queue.write_buffer(buffer, 0, &bytes);
            }
        }
        for (&resource, bound) in &self.resources {
            let rows = match resource {
                Resource::Bones => vertices::bones(&mesh.bones),
                Resource::MorphDeltas => vertices::morph_deltas(mesh, &self.targets, occlusion),
                _ => continue,
            };
            if let Bound::Buffer(buffer) = bound {
                gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&rows));
            }
        }
        Ok(())
    }
}

fn check_size(gpu: &Gpu, what: &str, bytes: u64, limit: u64) -> Result<(), GpuError> {
    if bytes <= limit {
        return Ok(());
    }
    let (adapter, what) = (gpu.name().to_owned(), what.to_owned());
    Err(GpuError::BufferSize { adapter, what, bytes, limit, of: Oversized::Mesh })
}

pub(super) fn buffer(
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
pub(super) fn storage(gpu: &Gpu, what: &str, bytes: &[u8]) -> Result<Buffer, GpuError> {
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
fn sampler(gpu: &Gpu, mode: AddressMode, filter: TextureFilter) -> Sampler {
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
