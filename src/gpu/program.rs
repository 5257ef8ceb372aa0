//! A plan on the device: what evaluates it, and the passes over the UV atlas that go before.

use wgpu::{CommandEncoder, RenderPass, TextureFormat};

use super::atlas::{Atlas, AtlasTraffic};
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::pipeline::{Inputs, Outputs, Pipeline};
use super::targets::Key;
use super::timing::Timer;
use super::upload::{Bound, Uploads};
use super::visibility_buffer::VisibilityBuffer;
use crate::shader::Plan;
use crate::shader::visibility_buffer::VisibilityBuffer as Modules;

/// A plan on the device, in pipelines of some kind.
pub(super) struct Program<P = Pipeline> {
    pub(super) pipelines: P,
    /// Passes that go before.
    atlas: Option<Atlas>,
}

/// The pipelines of an image.
pub(super) enum Shaded {
    Forward(Pipeline),
    Computed(VisibilityBuffer),
}

impl AsRef<Inputs> for Pipeline {
    fn as_ref(&self) -> &Inputs {
        &self.inputs
    }
}

impl AsRef<Inputs> for Shaded {
    fn as_ref(&self) -> &Inputs {
        match self {
            Self::Forward(pipeline) => &pipeline.inputs,
            Self::Computed(buffer) => &buffer.inputs,
        }
    }
}

impl Program {
    /// The plan's pipeline for targets of those formats; without any, for depth alone: the plan has no fragment
    /// stage.
    pub(super) fn new(
        gpu: &Gpu,
        plan: Plan,
        uploads: &mut Uploads,
        formats: &[TextureFormat],
        multisamples: u32,
    ) -> Result<Self, GpuError> {
        let (atlas, levels) = atlas(gpu, &plan, uploads)?;
        let outputs = Outputs { formats, multisamples, depth: true };
        Ok(Self { pipelines: Pipeline::new(gpu, plan, uploads, levels, outputs)?, atlas })
    }

    /// Targets that it draws into, depth aside.
    pub(super) const fn targets(&self) -> usize {
        self.pipelines.targets()
    }

    /// Draw the mesh, or over the whole target.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        self.pipelines.draw(pass);
    }
}

impl Program<Shaded> {
    /// The plan's pipelines for targets of `key`: compute shaders, where there are `modules` of it, or the rasteriser's
    /// stages.
    pub(super) fn shaded(
        gpu: &Gpu,
        plan: Plan,
        modules: Option<&Modules>,
        uploads: &mut Uploads,
        key: &Key,
    ) -> Result<Self, GpuError> {
        let Some(modules) = modules else {
            let multisamples = key.antialias.multisamples();
            let Program { pipelines, atlas } =
                Program::new(gpu, plan, uploads, &key.formats(), multisamples)?;
            return Ok(Self { pipelines: Shaded::Forward(pipelines), atlas });
        };
        let (atlas, levels) = atlas(gpu, &plan, uploads)?;
        let computed = VisibilityBuffer::new(gpu, plan, modules, uploads, levels, key)?;
        Ok(Self { pipelines: Shaded::Computed(computed), atlas })
    }

    /// Whether compute shaders evaluate it.
    pub(super) const fn is_computed(&self) -> bool {
        matches!(self.pipelines, Shaded::Computed(_))
    }
}

impl<P: AsRef<Inputs>> Program<P> {
    /// What is drawn.
    pub(super) fn plan(&self) -> &Plan {
        &self.pipelines.as_ref().plan
    }

    /// Set the constants of what is drawn next; they hold for all that is submitted at once.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) {
        self.pipelines.as_ref().set(gpu, values);
        if let Some(atlas) = &self.atlas {
            atlas.set(gpu, values);
        }
    }

    /// Have the passes that go before run again: what they show has moved.
    pub(super) fn forget(&self) {
        self.atlas.iter().for_each(Atlas::forget);
    }

    /// What these take.
    pub(super) fn atlas_traffic(&self) -> AtlasTraffic {
        self.atlas.as_ref().map(Atlas::traffic).unwrap_or_default()
    }

    /// How often these ran.
    pub(super) fn atlas_made(&self) -> u64 {
        self.atlas.as_ref().map_or(0, Atlas::made)
    }

    /// Run the passes that go before, where what they leave is not there yet.
    pub(super) fn prepare(&self, encoder: &mut CommandEncoder, timer: Option<&mut Timer>) {
        if let Some(atlas) = &self.atlas {
            atlas.draw(encoder, timer);
        }
    }
}

/// A plan's passes over the atlas, and the levels that it reads of them.
fn atlas(gpu: &Gpu, plan: &Plan, uploads: &mut Uploads) -> Result<(Option<Atlas>, Vec<Bound>), GpuError> {
    let atlas = Atlas::new(gpu, plan, uploads)?;
    let levels = atlas.as_ref().map_or(Ok(Vec::new()), |atlas| atlas.bound(&plan.levels))?;
    Ok((atlas, levels))
}
