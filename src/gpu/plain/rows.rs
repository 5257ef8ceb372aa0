//! The light on what is not skin, as shaders read it: rows of each vertex, the lights, and the environment.

use std::ops::Range;

use wgpu::{
    AddressMode, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, BufferUsages, FilterMode,
    MipmapFilterMode, SamplerBindingType, SamplerDescriptor, ShaderStages, TextureSampleType,
    TextureViewDimension,
};

use super::text::{OWN_ROWS, rows_of};
use crate::bake::lobe_sky::LobeSky;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::model::cube::Cube;
use crate::samples::plain_vertices::{PlainVertices, lights};
use crate::scene::Scene;
use crate::scene::light::LightKind;
use crate::texels::{self, Texels};
use crate::upload::{buffer, texture};

/// The light, bound.
pub(super) struct Light {
    layout: BindGroupLayout,
    bound: BindGroup,
    vertices: Buffer,
    /// The vertices that it has rows of.
    range: Range<usize>,
    /// What shaders are to know of them and of the targets: `Drawn` of `wgsl/plain.wgsl`.
    drawn: Buffer,
    /// What the sky's texels are to be multiplied by.
    brightness: f32,
    count: usize,
    bytes: u64,
}

impl Light {
    /// The scene's, with what reaches its vertices.
    ///
    /// # Errors
    /// When it is larger than the adapter takes.
    pub(super) fn new(gpu: &Gpu, scene: &Scene, found: &PlainVertices) -> Result<Self, GpuError> {
        let range = vertices_of(scene);
        let rows = vertex_rows(scene, found, range.clone());
        let storage =
            |what, rows: &[[f32; 4]]| buffer(gpu, what, bytemuck::cast_slice(rows), BufferUsages::STORAGE);
        let vertices = storage("vertices of what is not skin", &rows)?;
        let lamps = storage("lights", &light_rows(scene))?;
        let drawn = gpu.buffer("drawn", &[0; 16], BufferUsages::UNIFORM);
        let (sky, brightness) = sky(scene);
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
            drawn.as_entire_binding(),
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
        let count = lights(scene).len();
        Ok(Self { layout, bound, vertices, range, drawn, brightness, count, bytes })
    }

    /// Set what is drawn next: into so many samples along a pixel's side.
    pub(super) fn set(&self, gpu: &Gpu, axis: u32) {
        let drawn = [axis, self.range.start as u32, self.brightness.to_bits(), 0];
        gpu.queue.write_buffer(&self.drawn, 0, bytemuck::cast_slice(&drawn));
    }

    /// Put what reaches the vertices of another pose in place.
    pub(super) fn set_vertices(&self, gpu: &Gpu, scene: &Scene, found: &PlainVertices) {
        gpu.queue.write_buffer(
            &self.vertices,
            0,
            bytemuck::cast_slice(&vertex_rows(scene, found, self.range.clone())),
        );
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
}

/// From the first to the last vertex of what is not skin.
fn vertices_of(scene: &Scene) -> Range<usize> {
    let parts = scene.mesh.plain.iter().flat_map(|parts| &parts.of_triangle);
    let plain = scene.mesh.triangles.iter().zip(parts).filter(|(_, of)| of.is_some());
    let vertices = plain.flat_map(|(corners, _)| corners.map(|vertex| vertex as usize));
    let (first, end) =
        vertices.fold((usize::MAX, 0), |(first, end), vertex| (first.min(vertex), end.max(vertex + 1)));
    first.min(end)..end
}

/// The environment's levels, and what they are to be multiplied by: 16 bits hold numbers up to 65504, and a sun is brighter.
fn sky(scene: &Scene) -> (Texels, f32) {
    let sky = LobeSky::of_scene(scene);
    let levels = sky.as_ref().map_or(&[][..], LobeSky::levels);
    // No level is brighter than the finest.
    let finest = levels.first().map_or(&[][..], Cube::padded);
    let brightest = finest.iter().flatten().fold(0.0_f32, |most, x| most.max(*x));
    let brightness = (brightest / texels::LARGEST_HALF).max(1.0);
    let dimmed = |level: &Cube<f32>| level.map(|texel| texel.map(|x| x / brightness));
    match brightest > texels::LARGEST_HALF {
        true => (texels::cubes(&levels.iter().map(dimmed).collect::<Vec<_>>()), brightness),
        false => (texels::cubes(levels), 1.0),
    }
}

/// The rows of those vertices: the harmonics of what stands in the way in three, the factor on the base colour, then what
/// arrives of the lights.
fn vertex_rows(scene: &Scene, found: &PlainVertices, range: Range<usize>) -> Vec<[f32; 4]> {
    let lights = lights(scene).len();
    let tints = tints(scene, found.blocked.len());
    let mut rows = Vec::with_capacity(range.len() * (OWN_ROWS + rows_of(lights)));
    for vertex in range {
        let [a, b, c, d, e, f, g, h, last] = found.blocked[vertex];
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
    let drawn = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
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
        (ShaderStages::VERTEX_FRAGMENT, drawn),
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
