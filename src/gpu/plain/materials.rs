//! The materials of what is not skin: their numbers and pictures, bound one by one.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use wgpu::{
    AddressMode, BindGroup, BindGroupLayout, BindingResource, BindingType, BufferBindingType, BufferUsages,
    FilterMode, RenderPass, Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages, TextureSampleType,
    TextureView, TextureViewDimension,
};

use crate::compute;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::scene::maps::Map;
use crate::scene::plain::{Alpha, PlainMap, PlainMaterial, Wrap};
use crate::texels;
use crate::upload::texture;

/// The materials, each bound.
pub(crate) struct Materials {
    layout: BindGroupLayout,
    bound: Vec<BindGroup>,
    bytes: u64,
}

/// Pictures on the device, by where they lie in memory: parts of a mesh share them.
#[derive(Default)]
struct Pictures {
    known: HashMap<*const Map<4>, TextureView>,
    bytes: u64,
}

impl Materials {
    /// Upload what they are drawn by.
    ///
    /// # Errors
    /// When a picture is larger than the adapter takes.
    pub(crate) fn new(gpu: &Gpu, materials: &[PlainMaterial]) -> Result<Self, GpuError> {
        let layout = layout(gpu);
        // In the place of pictures that a material has not.
        let white = PlainMap {
            map: Arc::new(Map { width: 1, height: 1, texels: vec![[1.0; 4]] }),
            wrap: [Wrap::Repeat; 2],
            nearest: false,
        };
        let mut pictures = Pictures::default();
        let mut bound = Vec::with_capacity(materials.len());
        for material in materials {
            let numbers = gpu.buffer(
                "material",
                bytemuck::cast_slice(numbers(material).as_flattened()),
                BufferUsages::UNIFORM,
            );
            let maps = [&material.color_map, &material.roughness_map, &material.emission_map];
            let mut read = Vec::new();
            for map in maps.map(|map| map.as_ref().unwrap_or(&white)) {
                read.push((pictures.view(gpu, &map.map)?, sampler(gpu, map)));
            }
            let maps = read.iter().flat_map(|(view, sampler)| {
                [BindingResource::TextureView(view), BindingResource::Sampler(sampler)]
            });
            let resources = std::iter::once(numbers.as_entire_binding()).chain(maps);
            bound.push(compute::bind(gpu, &layout, resources.collect()));
        }
        Ok(Self { layout, bound, bytes: pictures.bytes })
    }

    pub(super) const fn layout(&self) -> &BindGroupLayout {
        &self.layout
    }

    /// Draw corners, those of each material by its place.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, runs: &[(u16, Range<u32>)]) {
        for (material, corners) in runs {
            if let Some(bound) = self.bound.get(usize::from(*material)) {
                pass.set_bind_group(1, bound, &[]);
                pass.draw(corners.clone(), 0..1);
            }
        }
    }

    pub(crate) const fn bytes(&self) -> u64 {
        self.bytes
    }
}

impl Pictures {
    fn view(&mut self, gpu: &Gpu, map: &Arc<Map<4>>) -> Result<TextureView, GpuError> {
        if let Some(view) = self.known.get(&Arc::as_ptr(map)) {
            return Ok(view.clone());
        }
        let texels = texels::picture(map);
        let view = texture(gpu, "picture of a material", &texels)?;
        self.bytes += texels.bytes.len() as u64;
        self.known.insert(Arc::as_ptr(map), view.clone());
        Ok(view)
    }
}

/// As the shader's `Material` has them.
fn numbers(material: &PlainMaterial) -> [[f32; 4]; 3] {
    let [r, g, b] = material.emission;
    let (mode, cutoff) = match material.alpha {
        Alpha::Opaque => (0.0, 0.0),
        Alpha::Mask(cutoff) => (1.0, cutoff),
        Alpha::Blend => (2.0, 0.0),
    };
    [material.base_color, [r, g, b, cutoff], [material.metallic, material.roughness, mode, 0.0]]
}

fn sampler(gpu: &Gpu, map: &PlainMap) -> Sampler {
    let mode = |wrap: Wrap| match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::Mirror => AddressMode::MirrorRepeat,
        Wrap::Clamp => AddressMode::ClampToEdge,
    };
    let filter = if map.nearest { FilterMode::Nearest } else { FilterMode::Linear };
    gpu.device.create_sampler(&SamplerDescriptor {
        label: Some("picture of a material"),
        address_mode_u: mode(map.wrap[0]),
        address_mode_v: mode(map.wrap[1]),
        mag_filter: filter,
        min_filter: filter,
        ..SamplerDescriptor::default()
    })
}

fn layout(gpu: &Gpu) -> BindGroupLayout {
    let numbers = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let picture = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = BindingType::Sampler(SamplerBindingType::Filtering);
    let kinds = [numbers, picture, sampler, picture, sampler, picture, sampler];
    compute::layout(gpu, "material", &kinds.map(|kind| (ShaderStages::FRAGMENT, kind)))
}
