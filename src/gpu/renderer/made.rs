//! What a renderer makes when it is first asked for: programs and targets.

use super::{Drawer, Layer, Renderer};
use crate::GpuError;
use crate::bloom::Finish;
use crate::geometry::outline;
use crate::model::effects::Effect;
use crate::program::{Program, Shaded};
use crate::render::shading::Shading;
use crate::resolve::Resolve;
use crate::scene::view::Camera;
use crate::shader::{Budget, Facts, Plan, PlanError, plan};
use crate::stage::Stage;
use crate::targets::{Key, Precision, Targets};
use crate::visibility_buffer::fits;

/// A budget that is at least this is drawn into 16-bit targets, which round to 2^-11.
const HALF_ERROR: f64 = 1e-3;

impl Renderer {
    /// The place of what draws a layer; made if it is not there yet.
    pub(super) fn program(&mut self, layer: Layer) -> Result<usize, GpuError> {
        if let Some(i) = self.programs.iter().position(|drawer| drawer.layer == layer) {
            return Ok(i);
        }
        let planned = match layer {
            Layer::Whole => plan(&Facts { output: None, ..self.facts }),
            Layer::Term(term) => plan(&Facts { output: Some(term), ..self.facts }),
            Layer::Plain => hidden(&self.facts),
        };
        let planned = planned.map_err(|error| GpuError::Plan(error.to_string()))?;
        let program = self.compiled(layer, planned)?;
        let key = self.key(1, 1, layer.is_hazy(program.plan()), program.is_computed());
        let plain = self.plain.as_ref().map(|plain| plain.pipeline(&self.gpu, &key, layer.shows_plain()));
        self.gpu.check()?;
        self.programs.push(Drawer { layer, program, plain });
        Ok(self.programs.len() - 1)
    }

    /// A plan on the device, where it is to be evaluated and can be. Beside what is not skin the rasteriser's stages
    /// shade: one depth for both.
    pub(super) fn compiled(&mut self, layer: Layer, plan: Plan) -> Result<Program<Shaded>, GpuError> {
        let wanted = self.options.shading == Shading::VisibilityBuffer
            && self.options.antialias.multisamples() == 1
            && self.plain.is_none();
        let hazy = layer.is_hazy(&plan);
        let format = self.key(1, 1, hazy, true).precision.wgsl();
        let modules = wanted.then(|| plan.visibility_buffer(format)).flatten();
        let modules = modules.filter(|modules| fits(&self.gpu, &plan, modules, &self.uploads));
        let key = self.key(1, 1, hazy, modules.is_some());
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
        let Drawer { layer, program, .. } = &self.programs[program];
        let hazy = layer.is_hazy(program.plan());
        let key = self.key(camera.width, camera.height, hazy, program.is_computed());
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

/// Skin that hides what is behind it and shows as nothing.
fn hidden(facts: &Facts) -> Result<Plan, PlanError> {
    let plan = outline(facts)?;
    let nothing = "\n@fragment\nfn fs_main() -> @location(0) vec4f {\n    return vec4f(0.0);\n}\n";
    Ok(Plan { wgsl: plan.wgsl + nothing, ..plan })
}
