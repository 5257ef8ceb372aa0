//! The cubes and the uniform block of a fit.

use std::collections::BTreeMap;
use std::sync::Arc;

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, BindingType,
    TextureSampleType, TextureView, TextureViewDimension,
};

use super::pipeline::{UNIFORM, Uniform, layout};
use crate::bake::Illumination;
use crate::bake::stacks::{Content, Stack};
use crate::constants::model_block;
use crate::model::cube::Cube;
use crate::model::params::Params;
use crate::shader::facts::FaceSizes;
use crate::shader::{Plan, Resource};
use crate::{Gpu, GpuError, texels, upload};

/// The cubes, each uploaded once, but for those of stacks: again when they are looked up elsewhere.
pub(super) struct DeviceLights {
    illumination: Arc<Illumination>,
    irradiance: Option<TextureView>,
    hilite: Option<TextureView>,
    /// Of a stack the place where it was looked up last, the cube there, and how it moves.
    stacks: BTreeMap<Stack, (f64, TextureView, TextureView)>,
    /// Counts changes, so that bindings can follow.
    version: u64,
}

impl DeviceLights {
    pub(super) const fn new(illumination: Arc<Illumination>) -> Self {
        Self { illumination, irradiance: None, hilite: None, stacks: BTreeMap::new(), version: 0 }
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
                of_stack => {
                    let Some((stack, _)) = Stack::named(of_stack.name()) else { continue };
                    let place = stack.place(params);
                    if self.stacks.get(&stack).is_none_or(|(at, ..)| *at != place)
                        && let Some((cube, slope)) = stack.at(&self.illumination, place)
                    {
                        let views = (place, upload("faces", &cube)?, upload("slope faces", &slope)?);
                        self.stacks.insert(stack, views);
                        self.version += 1;
                    }
                }
            }
        }
        inputs.bind(gpu, self, &model_block(&inputs.plan.constants, params))
    }

    /// A resource of the plan.
    fn view(&self, gpu: &Gpu, resource: Resource) -> Result<&TextureView, GpuError> {
        let found = match resource {
            Resource::IrradianceFaces => self.irradiance.as_ref(),
            Resource::HiliteFaces => self.hilite.as_ref(),
            of_stack => Stack::named(of_stack.name()).and_then(|(stack, content)| {
                let (_, cube, slope) = self.stacks.get(&stack)?;
                Some(if content == Content::Light { cube } else { slope })
            }),
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
