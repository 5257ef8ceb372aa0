//! The cubes and the uniform block of a fit.

use wgpu::TextureView;

use super::program::Program;
use crate::engine::cpu::Illumination;
use crate::gpu::constants::model_block;
use crate::gpu::{Gpu, GpuError, texels, upload};
use crate::model::cube::Cube;
use crate::model::params::{Param, Params};
use crate::shader::Resource;

/// The cubes, each uploaded once, but for the specular one: again when its exponent has changed.
pub(super) struct DeviceLights {
    illumination: Illumination,
    irradiance: Option<TextureView>,
    hilite: Option<TextureView>,
    /// The exponent, E_s there, and how it moves.
    specular: Option<(f64, TextureView, TextureView)>,
    /// Counts changes, so that bindings can follow.
    version: u64,
}

impl DeviceLights {
    pub(super) const fn new(illumination: Illumination) -> Self {
        Self { illumination, irradiance: None, hilite: None, specular: None, version: 0 }
    }

    /// Have what a program reads ready for a pass at `params`.
    pub(super) fn set(&mut self, gpu: &Gpu, params: &Params, program: &mut Program) -> Result<(), GpuError> {
        let upload = |name: &str, cube: &Cube<f32>| upload::texture(gpu, name, &texels::faces(cube));
        for &resource in program.resources() {
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
        program.set_constants(gpu, &model_block(program.constants(), params));
        program.bind_lights(gpu, self)
    }

    pub(super) const fn version(&self) -> u64 {
        self.version
    }

    /// A resource of the plan.
    pub(super) fn view(&self, gpu: &Gpu, resource: Resource) -> Result<&TextureView, GpuError> {
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
