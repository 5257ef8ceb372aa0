//! A plan on the device: its pipeline, and the passes over the atlas that go before.

use wgpu::{CommandEncoder, RenderPass, TextureFormat};

use super::atlas::Atlas;
use super::constants::Values;
use super::device::Gpu;
use super::error::GpuError;
use super::pipeline::{Outputs, Pipeline};
use super::timing::Timer;
use super::upload::Uploads;
use crate::shader::Plan;

/// A plan on the device.
pub(super) struct Program {
    pipeline: Pipeline,
    /// Passes that go before.
    atlas: Option<Atlas>,
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
        let atlas = Atlas::new(gpu, &plan, uploads)?;
        let levels = match &atlas {
            Some(atlas) => atlas.bound(&plan.levels)?,
            None => Vec::new(),
        };
        let outputs = Outputs { formats, multisamples, depth: true };
        let pipeline = Pipeline::new(gpu, plan, uploads, levels, outputs)?;
        Ok(Self { pipeline, atlas })
    }

    /// What is drawn.
    pub(super) const fn plan(&self) -> &Plan {
        &self.pipeline.plan
    }

    /// Targets that it draws into, depth aside.
    pub(super) const fn targets(&self) -> usize {
        self.pipeline.targets()
    }

    /// Set the constants of what is drawn next; they hold for all that is submitted at once.
    pub(super) fn set(&self, gpu: &Gpu, values: &Values<'_>) {
        self.pipeline.set(gpu, values);
        if let Some(atlas) = &self.atlas {
            atlas.set(gpu, values);
        }
    }

    /// Draw the passes that go before.
    pub(super) fn prepare(&self, encoder: &mut CommandEncoder, timer: Option<&mut Timer>) {
        if let Some(atlas) = &self.atlas {
            atlas.draw(encoder, timer);
        }
    }

    /// Draw the mesh, or over the whole target.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>) {
        self.pipeline.draw(pass);
    }
}
