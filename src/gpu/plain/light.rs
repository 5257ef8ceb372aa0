//! The light on what is not skin, as shaders read it: what reaches the places that are spread over it, the lights, and the
//! environment.

use wgpu::{
    AddressMode, BindGroup, BindGroupLayout, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferUsages, FilterMode, MipmapFilterMode, SamplerBindingType, SamplerDescriptor, ShaderStages,
    TextureSampleType, TextureViewDimension,
};

use super::text::{OWN_ROWS, Shining, rows_of};
use crate::bake::harmonics::CONSTANT;
use crate::bake::lobe_sky::LobeSky;
use crate::bake::rays::RayMesh;
use crate::compute;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::model::cube::Cube;
use crate::model::params::Params;
use crate::samples::plain_spread::{HARMONICS, Reaching, Spread, lights};
use crate::scene::Scene;
use crate::scene::light::{Light as SceneLight, LightKind};
use crate::scene::mesh::Mesh;
use crate::texels::{self, Texels};
use crate::upload::{storage, texture};

/// The light, bound.
pub(super) struct Light {
    layout: BindGroupLayout,
    bound: BindGroup,
    /// The triangles that it falls on, by their places in the scene's mesh.
    triangles: Vec<u32>,
    spread: Spread,
    lights: Vec<SceneLight>,
    has_sky: bool,
    /// Rows of each place.
    reaching: Buffer,
    /// What shaders are to know of the targets and the sky: `Frame` of `wgsl/plain.wgsl`.
    frame: Buffer,
    /// What the sky's texels are to be multiplied by.
    brightness: f32,
    bytes: u64,
}

impl Light {
    /// The scene's on those triangles of its mesh.
    ///
    /// # Errors
    /// When it is larger than the adapter takes.
    pub(super) fn new(
        gpu: &Gpu,
        scene: &Scene,
        params: &Params,
        triangles: Vec<u32>,
    ) -> Result<Self, GpuError> {
        let posed = scene.mesh.pose();
        let (spread, lights) = (Spread::new(&posed, &triangles), lights(scene, params));
        let found = Reaching::new((scene, &lights), (&posed, &RayMesh::of(&posed)), &triangles, &spread);
        let reaching =
            storage(gpu, "light on what is not skin", bytemuck::cast_slice(&rows(&found, lights.len())))?;
        let places = storage(gpu, "places on what is not skin", bytemuck::cast_slice(&spread.triangles))?;
        let lamps = storage(gpu, "lights", bytemuck::cast_slice(&light_rows(&lights)))?;
        let frame = gpu.buffer("frame", &[0; 16], BufferUsages::UNIFORM);
        let (sky, brightness) = sky(scene, params);
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
        let resources = vec![
            reaching.as_entire_binding(),
            places.as_entire_binding(),
            lamps.as_entire_binding(),
            BindingResource::TextureView(&view),
            BindingResource::Sampler(&sampler),
            frame.as_entire_binding(),
        ];
        let bound = compute::bind(gpu, &layout, resources);
        let bytes = reaching.size() + places.size() + lamps.size() + sky.bytes.len() as u64;
        let has_sky = scene.environment.is_some();
        Ok(Self { layout, bound, triangles, spread, lights, has_sky, reaching, frame, brightness, bytes })
    }

    /// Set what is drawn next: into `axis` samples along a pixel's side.
    pub(super) fn set(&self, gpu: &Gpu, axis: u32) {
        let frame = [axis, self.brightness.to_bits(), 0, 0];
        gpu.queue.write_buffer(&self.frame, 0, bytemuck::cast_slice(&frame));
    }

    /// Put what reaches the places in another pose of the mesh in the place of what reached them.
    pub(super) fn set_mesh(&self, gpu: &Gpu, scene: &Scene, mesh: &Mesh) {
        let posed = mesh.pose();
        let found = Reaching::new(
            (scene, &self.lights),
            (&posed, &RayMesh::of(&posed)),
            &self.triangles,
            &self.spread,
        );
        gpu.queue.write_buffer(&self.reaching, 0, bytemuck::cast_slice(&rows(&found, self.lights.len())));
    }

    pub(super) const fn layout(&self) -> &BindGroupLayout {
        &self.layout
    }

    pub(super) const fn bound(&self) -> &BindGroup {
        &self.bound
    }

    /// What shines.
    pub(super) fn shining(&self) -> Shining {
        Shining { sky: self.has_sky, lights: self.lights.len() }
    }

    pub(super) const fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// 1, or 0 of a side of a place from which every way is blocked: no eye sees it, and what is seen beside it is not to be
/// dark for its sake.
fn seen(blocked: &[f32; HARMONICS]) -> f32 {
    // The constant function's integral is its inverse; of the rays one alone is 1/128.
    let share = f64::from(blocked[0]) * CONSTANT;
    if share < 1.0 - 1.0 / 256.0 { 1.0 } else { 0.0 }
}

/// The rows of each place: two of the first eight harmonics of each side; one of both last ones, and of which sides are
/// seen; then those of the lights.
fn rows(found: &Reaching, lights: usize) -> Vec<[f32; 4]> {
    let mut rows = Vec::with_capacity(found.blocked.len() * (OWN_ROWS + rows_of(lights)));
    for (place, sides) in found.blocked.iter().enumerate() {
        for [a, b, c, d, e, f, g, h, _] in *sides {
            rows.extend([[a, b, c, d], [e, f, g, h]]);
        }
        let [front, back] = *sides;
        rows.push([front[8], back[8], seen(&front), seen(&back)]);
        let arriving = &found.arriving[place * lights..][..lights];
        let row = |four: &[f32]| std::array::from_fn(|i| four.get(i).copied().unwrap_or(0.0));
        rows.extend(arriving.chunks(4).map(row));
    }
    rows
}

/// The environment's levels, and what they are to be multiplied by: 16 bits hold numbers up to 65504, and a sun is brighter.
fn sky(scene: &Scene, params: &Params) -> (Texels, f32) {
    let sky = LobeSky::at(scene, params);
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

/// Two rows of each light: where its light comes from, and its strength. One of nothing where there is none: a binding
/// cannot be empty.
fn light_rows(lights: &[SceneLight]) -> Vec<[f32; 4]> {
    let mut rows = Vec::new();
    for light in lights {
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
    let storage = compute::storage(true);
    let frame = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sky = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::Cube,
        multisampled: false,
    };
    let sampler = BindingType::Sampler(SamplerBindingType::Filtering);
    let kinds = [storage, storage, storage, sky, sampler, frame];
    compute::layout(gpu, "light on what is not skin", &kinds.map(|kind| (ShaderStages::FRAGMENT, kind)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_one_ray_leaves_is_seen_and_one_that_none_leaves_is_not() {
        let blocked = |rays: f64| [(rays / 128.0 / CONSTANT) as f32, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0];
        assert_eq!([0.0, 127.0, 128.0].map(|rays| seen(&blocked(rays))), [1.0, 1.0, 0.0]);
    }
}
