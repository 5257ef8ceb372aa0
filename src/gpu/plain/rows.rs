//! The light on what is not skin, as shaders read it: rows of each vertex, the lights, and the environment.

use wgpu::{
    AddressMode, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, FilterMode,
    MipmapFilterMode, SamplerBindingType, SamplerDescriptor, ShaderStages, TextureSampleType,
    TextureViewDimension,
};

use super::text::{OWN_ROWS, rows_of};
use crate::bake::lobe_sky::LobeSky;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::samples::plain_vertices::{PlainVertices, lights};
use crate::scene::Scene;
use crate::scene::light::LightKind;
use crate::texels;
use crate::upload::texture;

/// The light, bound.
pub(super) struct Light {
    layout: BindGroupLayout,
    bound: BindGroup,
    vertices: Buffer,
    count: usize,
    bytes: u64,
    clipped: usize,
}

impl Light {
    /// The scene's, with what reaches its vertices.
    ///
    /// # Errors
    /// When it is larger than the adapter takes.
    pub(super) fn new(gpu: &Gpu, scene: &Scene, found: &PlainVertices) -> Result<Self, GpuError> {
        let rows = vertex_rows(scene, found);
        let vertices = gpu.storage("vertices of what is not skin", bytemuck::cast_slice(&rows))?;
        let lamps = light_rows(scene);
        let lamps = gpu.storage("lights", bytemuck::cast_slice(&lamps))?;
        let sky = texels::cubes(LobeSky::of_scene(scene).as_ref().map_or(&[], LobeSky::levels));
        let view = texture(gpu, "sky", &sky)?;
        let sampler = gpu.device.create_sampler(&SamplerDescriptor {
            label: Some("sky"),
            address_mode_u: AddressMode::ClampToEdge,
            address_mode_v: AddressMode::ClampToEdge,
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..SamplerDescriptor::default()
        });
        let layout = layout(gpu);
        let resources = [
            vertices.as_entire_binding(),
            lamps.as_entire_binding(),
            BindingResource::TextureView(&view),
            BindingResource::Sampler(&sampler),
        ];
        let entries: Vec<_> = (0_u32..)
            .zip(resources)
            .map(|(binding, resource)| BindGroupEntry { binding, resource })
            .collect();
        let bound = gpu.device.create_bind_group(&BindGroupDescriptor {
            label: Some("light on what is not skin"),
            layout: &layout,
            entries: &entries,
        });
        let bytes = vertices.size() + lamps.size() + sky.bytes.len() as u64;
        let (count, clipped) = (lights(scene).len(), sky.clipped);
        Ok(Self { layout, bound, vertices, count, bytes, clipped })
    }

    /// Put what reaches the vertices of another pose in place.
    pub(super) fn set_vertices(&self, gpu: &Gpu, scene: &Scene, found: &PlainVertices) {
        gpu.queue.write_buffer(&self.vertices, 0, bytemuck::cast_slice(&vertex_rows(scene, found)));
    }

    pub(super) const fn layout(&self) -> &BindGroupLayout {
        &self.layout
    }

    pub(super) const fn bound(&self) -> &BindGroup {
        &self.bound
    }

    /// How many lights there are.
    pub(super) const fn count(&self) -> usize {
        self.count
    }

    pub(super) const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Texels of the environment that were cut.
    pub(super) const fn clipped(&self) -> usize {
        self.clipped
    }
}

/// The rows of each vertex: the harmonics of what stands in the way in three, the factor on the base colour, then what
/// arrives of the lights.
fn vertex_rows(scene: &Scene, found: &PlainVertices) -> Vec<[f32; 4]> {
    let lights = lights(scene).len();
    let tints = tints(scene, found.blocked.len());
    let mut rows = Vec::with_capacity(found.blocked.len() * (OWN_ROWS + rows_of(lights)));
    for (vertex, blocked) in found.blocked.iter().enumerate() {
        let [a, b, c, d, e, f, g, h, last] = *blocked;
        rows.extend([[a, b, c, d], [e, f, g, h], [last, 0.0, 0.0, 0.0], tints[vertex]]);
        let arriving = &found.arriving[vertex * lights..][..lights];
        let row = |four: &[f32]| std::array::from_fn(|i| four.get(i).copied().unwrap_or(0.0));
        rows.extend(arriving.chunks(4).map(row));
    }
    rows
}

/// The factor on the base colour at each vertex.
fn tints(scene: &Scene, count: usize) -> Vec<[f32; 4]> {
    let mut tints = vec![[1.0; 4]; count];
    let colors = scene.mesh.plain.as_ref().map_or(&[][..], |parts| &parts.corner_colors);
    for (corners, colors) in scene.mesh.triangles.iter().zip(colors) {
        corners.iter().zip(colors).for_each(|(&corner, color)| tints[corner as usize] = *color);
    }
    tints
}

/// Two rows of each light: where its light comes from, and its strength. One of nothing where there is none: a binding
/// cannot be empty.
fn light_rows(scene: &Scene) -> Vec<[f32; 4]> {
    let mut rows = Vec::new();
    for light in lights(scene) {
        let from = match &light.kind {
            LightKind::Directional(_) => light.towards(glam::DVec3::ZERO).as_vec3().extend(0.0),
            LightKind::Point(lamp) | LightKind::Spot(lamp, _) => lamp.position.as_vec3().extend(1.0),
        };
        let [r, g, b] = light.strength().map(|x| x as f32);
        rows.extend([from.to_array(), [r, g, b, 0.0]]);
    }
    if rows.is_empty() {
        rows.extend([[0.0; 4]; 2]);
    }
    rows
}

fn layout(gpu: &Gpu) -> BindGroupLayout {
    let storage = BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sky = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::Cube,
        multisampled: false,
    };
    let entries = [
        (ShaderStages::VERTEX, storage),
        (ShaderStages::FRAGMENT, storage),
        (ShaderStages::FRAGMENT, sky),
        (ShaderStages::FRAGMENT, BindingType::Sampler(SamplerBindingType::Filtering)),
    ];
    let entries: Vec<_> = (0_u32..)
        .zip(entries)
        .map(|(binding, (visibility, ty))| BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("light on what is not skin"),
        entries: &entries,
    })
}
