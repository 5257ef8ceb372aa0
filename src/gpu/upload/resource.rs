//! What plans read beside attributes: maps, cubes, samplers, and what moves vertices.

use std::sync::Arc;

use wgpu::AddressMode;

use super::made::{sampler, storage, texture};
use super::{Bound, Uploads};
use crate::bake::stacks::Stack;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::model::cube::Cube;
use crate::model::texture_filter::TextureFilter;
use crate::scene::Scene;
use crate::scene::maps::Maps;
use crate::scene::mip_maps::MipMaps;
use crate::shader::Resource;
use crate::texels::{self, Texels};
use crate::vertices;

impl Uploads {
    /// A resource, ready to be bound.
    pub(crate) fn resource(&mut self, gpu: &Gpu, resource: Resource) -> Result<Bound, GpuError> {
        if let Some(bound) = self.resources.get(&resource) {
            return Ok(bound.clone());
        }
        let bound = self.make(gpu, resource)?;
        self.resources.insert(resource, bound.clone());
        Ok(bound)
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
}
