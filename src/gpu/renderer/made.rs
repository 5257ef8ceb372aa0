//! What a renderer makes when it is first asked for: programs and targets.

use super::{Renderer, hazy};
use crate::GpuError;
use crate::bloom::Finish;
use crate::model::effects::Effect;
use crate::model::terms::TermName;
use crate::program::{Program, Shaded};
use crate::render::shading::Shading;
use crate::resolve::Resolve;
use crate::scene::view::Camera;
use crate::shader::{Budget, Facts, Plan, plan};
use crate::stage::Stage;
use crate::targets::{Key, Precision, Targets};
use crate::visibility_buffer::fits;

/// A budget that is at least this is drawn into 16-bit targets, which round to 2^-11.
const HALF_ERROR: f64 = 1e-3;

impl Renderer {
    /// The place of the program that draws the whole, or a term; made if it is not there yet.
    pub(super) fn program(&mut self, output: Option<TermName>) -> Result<usize, GpuError> {
        if let Some(i) = self.programs.iter().position(|program| program.plan().facts.output == output) {
            return Ok(i);
        }
        let plan =
            plan(&Facts { output, ..self.facts }).map_err(|error| GpuError::Plan(error.to_string()))?;
        let program = self.compiled(plan)?;
        self.programs.push(program);
        Ok(self.programs.len() - 1)
    }

    /// A plan on the device, where it is to be evaluated and can be.
    pub(super) fn compiled(&mut self, plan: Plan) -> Result<Program<Shaded>, GpuError> {
        let wanted =
            self.options.shading == Shading::VisibilityBuffer && self.options.antialias.multisamples() == 1;
        let format = self.key(1, 1, hazy(&plan), true).precision.wgsl();
        let modules = wanted.then(|| plan.visibility_buffer(format)).flatten();
        let modules = modules.filter(|modules| fits(&self.gpu, &plan, modules, &self.uploads));
        let key = self.key(1, 1, hazy(&plan), modules.is_some());
        Program::shaded(&self.gpu, plan, modules.as_ref(), &mut self.uploads, &key)
    }

    fn key(&self, width: u32, height: u32, hazy: bool, computed: bool) -> Key {
        let antialias = self.options.antialias;
        // WebGPU multisamples no 32-bit targets.
        let half = antialias.multisamples() > 1
            || match self.options.budget {
                Budget::Exact => false,
                Budget::Paper => true,
                Budget::Within(error) => error >= HALF_ERROR,
            };
        let precision = if half { Precision::Half } else { Precision::Full };
        let blooms = hazy && self.facts.setup.effects.has(Effect::Bloom);
        Key { width, height, antialias, precision, hazy, blooms, computed }
    }

    /// The place of the targets for such images; those of another size give way to them.
    pub(super) fn stage(&mut self, camera: &Camera, program: usize) -> Result<usize, GpuError> {
        let program = &self.programs[program];
        let key = self.key(camera.width, camera.height, hazy(program.plan()), program.is_computed());
        self.stages
            .retain(|stage| (stage.targets.key.width, stage.targets.key.height) == (key.width, key.height));
        if let Some(i) = self.stages.iter().position(|stage| stage.targets.key == key) {
            return Ok(i);
        }
        let targets = Targets::new(&self.gpu, key)?;
        let resolve = targets.samples.as_ref().map(|samples| Resolve::new(&self.gpu, &targets, samples));
        let sigma = self.uploads.content().scene.bloom.sigma;
        let backdrop = self.backdrop.as_ref().map(|(_, backdrop)| backdrop);
        let finish = Finish::new(&self.gpu, &targets, sigma, backdrop);
        self.gpu.check()?;
        self.stages.push(Stage { targets, resolve, finish });
        Ok(self.stages.len() - 1)
    }
}
