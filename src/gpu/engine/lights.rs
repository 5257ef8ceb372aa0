//! The cubes and the uniform block of a fit.

use std::sync::Arc;

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, BindingType,
    TextureSampleType, TextureView, TextureViewDimension,
};

use super::pipeline::{UNIFORM, Uniform, layout};
use crate::bake::Illumination;
use crate::constants::model_block;
use crate::model::cube::Cube;
use crate::model::params::{Param, Params};
use crate::shader::facts::FaceSizes;
use crate::shader::{Plan, Resource};
use crate::{Gpu, GpuError, texels, upload};

/// The cubes, each uploaded once, but for the specular one: again when its exponent has changed.
pub(super) struct DeviceLights {
    illumination: Arc<Illumination>,
    irradiance: Option<TextureView>,
    hilite: Option<TextureView>,
    /// The exponent, E_s there, and how it moves.
    specular: Option<(f64, TextureView, TextureView)>,
    /// Counts changes, so that bindings can follow.
    version: u64,
}

impl DeviceLights {
    pub(super) const fn new(illumination: Arc<Illumination>) -> Self {
        Self { illumination, irradiance: None, hilite: None, specular: None, version: 0 }
    }

    /// The cubes' sizes.
    pub(super) fn face_sizes(&self) -> FaceSizes {
        skinfit_core::engine::face_sizes(&self.illumination)
    }

    /// Have what a program reads ready for a pass at `params`.
    pub(super) fn set(&mut self, gpu: &Gpu, params: &Params, inputs: &mut Inputs) -> Result<(), GpuError> {
        let upload = |name: &str, cube: &Cube<f32>| upload::texture(gpu, name, &texels::faces(cube));
        for &resource in &inputs.plan.resources {
            match resource {
                Resource::IrradianceFaces if self.irradiance.is_none() => {
                    let cube = self.illumination.irradiance.as_ref();
                    self.irradiance = cube.map(|cube| upload("irradiance faces", cube)).transpose()?;
                    self.version += 1;
                }
                Resource::HiliteFaces if self.hilite.is_none() => {
                    let cube = self.illumination.hilite.as_ref();
                    self.hilite = cube.map(|cube| upload("hilite faces", cube)).transpose()?;
                    self.version += 1;
                }
                Resource::SpecularFaces | Resource::SpecularSlopeFaces => {
                    let exponent = params.scalar(Param::SpecularLobe);
                    if self.specular.as_ref().is_none_or(|(at, ..)| *at != exponent)
                        && let Some(stack) = &self.illumination.lobes
                    {
                        let (cube, slope) = stack.at(exponent);
                        let (cube, slope) =
                            (upload("specular faces", &cube)?, upload("specular slope faces", &slope)?);
                        self.specular = Some((exponent, cube, slope));
                        self.version += 1;
                    }
                }
                _ => {}
            }
        }
        inputs.bind(gpu, self, &model_block(&inputs.plan.constants, params))
    }

    /// A resource of the plan.
    fn view(&self, gpu: &Gpu, resource: Resource) -> Result<&TextureView, GpuError> {
        let found = match resource {
            Resource::IrradianceFaces => self.irradiance.as_ref(),
            Resource::HiliteFaces => self.hilite.as_ref(),
            Resource::SpecularFaces => self.specular.as_ref().map(|(_, cube, _)| cube),
            Resource::SpecularSlopeFaces => self.specular.as_ref().map(|(.., slope)| slope),
            _ => None,
        };
        found.ok_or_else(|| GpuError::Refused {
            adapter: gpu.name().to_owned(),
            reason: format!("the shader reads {}, which the scene does not have", resource.name()),
        })
    }
}

/// Group 0 of a shader: its plan's constants and cubes.
pub(super) struct Inputs {
    plan: Plan,
    pub(super) layout: BindGroupLayout,
    constants: Uniform,
    /// The cubes' version that is bound.
    bound: Option<(u64, BindGroup)>,
}

impl Inputs {
    pub(super) fn new(gpu: &Gpu, plan: &Plan) -> Self {
        let faces = BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: false },
            view_dimension: TextureViewDimension::D2Array,
            multisampled: false,
        };
        let cubes = (1..=plan.resources.len() as u32).map(|binding| (binding, faces));
        // Always there, so that no group is empty.
        let kinds: Vec<_> = std::iter::once((0, UNIFORM)).chain(cubes).collect();
        let constants = Uniform::new(gpu, "constants", 16 * plan.constants.len());
        Self { plan: plan.clone(), layout: layout(gpu, "lights", &kinds), constants, bound: None }
    }

    /// What is bound, once a pass has set it.
    pub(super) fn bound(&self) -> Option<&BindGroup> {
        self.bound.as_ref().map(|(_, group)| group)
    }

    fn bind(&mut self, gpu: &Gpu, lights: &DeviceLights, block: &[f32]) -> Result<(), GpuError> {
        self.constants.write(gpu, bytemuck::cast_slice(block));
        if self.bound.as_ref().is_some_and(|(version, _)| *version == lights.version) {
            return Ok(());
        }
        let mut entries =
            vec![BindGroupEntry { binding: 0, resource: self.constants.buffer().as_entire_binding() }];
        for (binding, &resource) in (1..).zip(&self.plan.resources) {
            let resource = BindingResource::TextureView(lights.view(gpu, resource)?);
            entries.push(BindGroupEntry { binding, resource });
        }
        let descriptor =
            BindGroupDescriptor { label: Some("lights"), layout: &self.layout, entries: &entries };
        self.bound = Some((lights.version, gpu.device.create_bind_group(&descriptor)));
        gpu.check()
    }
}
