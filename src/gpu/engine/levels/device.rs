//! Levels that the adapter makes, in one buffer: a pass is run again where a number has changed that it is made with, or a
//! level that it reads.

use std::collections::BTreeSet;
use std::sync::Arc;

use wgpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor, ComputePipeline,
};

use super::stored::StoredAtlas;
use crate::bake::stacks::Stack;
use crate::compute::groups;
use crate::constants::model_block;
use crate::engine::fused::{Fused, Looked};
use crate::engine::lights::{DeviceLights, Inputs};
use crate::engine::pipeline::{READ, WRITE, bind, buffer, encoder, layout, pipeline};
use crate::model::diffusion::Seams;
use crate::model::params::Params;
use crate::samples::Atlas;
use crate::shader::atlas::buffers::{LevelShader, LevelShaders, StoredTexels};
use crate::{Gpu, GpuError};
use skinfit_core::engine::view::ObservedView;
use skinfit_core::program::graph::Input;

/// Levels and what makes them.
pub(in crate::engine) struct MadeLevels {
    size: u32,
    dilated: bool,
    /// For an environment that is not turned, and for one that is.
    shaders: [LevelShaders; 2],
    /// The passes of the one that was used last.
    passes: Option<(bool, Vec<Pass>)>,
    levels: Buffer,
    stored: StoredAtlas,
    count: u64,
}

/// A pass.
struct Pass {
    inputs: Inputs,
    pipeline: ComputePipeline,
    bound: BindGroup,
    workgroups: u32,
    /// What it was run with last.
    with: Option<Vec<f64>>,
}

impl MadeLevels {
    /// Of a fit's plans, the environment not turned and turned; `None` where the processor has to make levels: sums over the
    /// surface, blurs across seams, views with atlases of their own, or more levels than a binding holds.
    ///
    /// # Errors
    /// When the device has no room for them.
    pub(super) fn new(
        gpu: &Gpu,
        fused: &[Vec<Fused>; 2],
        views: &[ObservedView],
    ) -> Result<Option<Self>, GpuError> {
        let joined = |fused: &Fused| fused.plan.facts.setup.choices.diffusion.seams == Seams::Joined;
        let Some(atlas) = shared_atlas(views).filter(|_| !fused.iter().flatten().any(joined)) else {
            return Ok(None);
        };
        let row = |name: &str, component: usize| atlas.row(&Input { name: name.to_owned(), component });
        let texels = StoredTexels { size: atlas.size(), rows: atlas.rows().stride(), row: &row };
        let shaders = |fused: &[Fused]| {
            let plans: Vec<_> = fused.iter().map(|fused| (&fused.plan, fused.chain())).collect();
            LevelShaders::new(&plans, &texels)
        };
        let [Some(plain), Some(turned)] = [shaders(&fused[0]), shaders(&fused[1])] else { return Ok(None) };
        let count = plain.layers.count.max(turned.layers.count);
        let bytes = 16 * u64::from(atlas.size()).pow(2) * count as u64;
        if gpu.check_binding("levels", bytes).is_err() {
            return Ok(None);
        }
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let levels = buffer(gpu, "levels", bytes as usize, usage);
        let dilated = dilates(fused);
        let stored = StoredAtlas::new(gpu, &atlas, dilated);
        gpu.check()?;
        let (size, shaders) = (atlas.size(), [plain, turned]);
        Ok(Some(Self { size, dilated, shaders, passes: None, levels, stored, count: 0 }))
    }

    pub(super) const fn buffer(&self) -> &Buffer {
        &self.levels
    }

    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn looked(&self, turned: bool) -> Looked {
        let layers = self.shaders[usize::from(turned)].layers.clone();
        Looked::Levels { layers, size: self.size, dilated: self.dilated }
    }

    /// Run the passes that are to be run for `params`.
    pub(super) fn set(
        &mut self,
        gpu: &Gpu,
        (turned, params): (bool, &Params),
        lights: &mut DeviceLights,
    ) -> Result<(), GpuError> {
        let Self { shaders, passes, levels, stored, count, .. } = self;
        let shaders = &shaders[usize::from(turned)].shaders;
        if passes.as_ref().is_none_or(|(of, _)| *of != turned) {
            let own = layout(gpu, "levels", &[(0, WRITE), (1, READ), (2, READ), (3, READ)]);
            let made = shaders.iter().map(|shader| Pass::new(gpu, shader, &own, (levels, stored)));
            *passes = Some((turned, made.collect()));
            gpu.check()?;
        }
        let Some((_, passes)) = passes else { return Ok(()) };
        let mut changed: BTreeSet<&str> = BTreeSet::new();
        let mut commands = encoder(gpu);
        for (pass, shader) in passes.iter_mut().zip(shaders) {
            let with = made_with(shader, params);
            let same = pass.with.as_ref() == Some(&with);
            if same && !shader.reads.iter().any(|level| changed.contains(level.as_str())) {
                continue;
            }
            lights.set(gpu, params, &mut pass.inputs)?;
            pass.run(&mut commands);
            pass.with = Some(with);
            changed.extend(shader.leaves.iter().map(String::as_str));
        }
        if !changed.is_empty() {
            *count += 1;
            gpu.queue.submit([commands.finish()]);
        }
        Ok(())
    }
}

/// The atlas of all views, where they have one together.
fn shared_atlas(views: &[ObservedView]) -> Option<Arc<Atlas>> {
    let first =
        views.iter().find_map(|view| view.samples.atlas.clone()).filter(|atlas| atlas.covered() > 0)?;
    let own =
        |view: &ObservedView| view.samples.atlas.as_ref().is_some_and(|atlas| Arc::ptr_eq(atlas, &first));
    views.iter().all(own).then_some(first)
}

fn dilates(fused: &[Vec<Fused>; 2]) -> bool {
    let lookup = |fused: &Fused| fused.plan.facts.setup.choices.diffusion.lookup;
    fused.iter().flatten().any(|fused| lookup(fused) == crate::model::diffusion::Lookup::Dilated)
}

/// The numbers that a pass is made with.
fn made_with(shader: &LevelShader, params: &Params) -> Vec<f64> {
    let block = model_block(&shader.plan.constants, params).into_iter().map(f64::from);
    let stacks = shader.plan.resources.iter().filter_map(|resource| Stack::named(resource.name()));
    block.chain(stacks.map(|(stack, _)| stack.place(params))).collect()
}

impl Pass {
    fn new(
        gpu: &Gpu,
        shader: &LevelShader,
        own: &BindGroupLayout,
        (levels, stored): (&Buffer, &StoredAtlas),
    ) -> Self {
        let inputs = Inputs::new(gpu, &shader.plan);
        let pipeline = pipeline(gpu, "levels", &shader.wgsl, &[&inputs.layout, own]);
        let (list, workgroups) = stored.list(shader.over);
        let bound = bind(gpu, own, &[levels, &stored.texels, &stored.records, list]);
        Self { inputs, pipeline, bound, workgroups, with: None }
    }

    fn run(&self, commands: &mut CommandEncoder) {
        let Some(lights) = self.inputs.bound().filter(|_| self.workgroups > 0) else { return };
        let mut pass = commands.begin_compute_pass(&ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, lights, &[]);
        pass.set_bind_group(1, &self.bound, &[]);
        let [across, down] = groups(self.workgroups);
        pass.dispatch_workgroups(across, down, 1);
    }
}
