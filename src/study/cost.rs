//! What a setting costs, in counts: they are the same on every machine, and stand beside the times.

use serde::Serialize;

use super::StudyError;
use super::subject::Subject;
use crate::engine::{Engine, Point};
use crate::model::diffusion::{Method, Seams};
use crate::model::effects::Effect;
use crate::model::params::Params;
use crate::prepare::{Baked, JointScene, JointScenes};
use crate::shader::{Budget, plan};

/// A cube lookup reads 2 x 2 texels of four 32-bit channels.
const LOOKUP_BYTES: usize = 4 * 4 * size_of::<f32>();

/// What a setting costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counts {
    /// Surface samples over all views.
    pub samples: u64,
    /// Bytes that a pass reads for a sample: its attributes, and the texels of its lookups.
    pub bytes_a_sample: usize,
    /// Operations a fragment in the renderer, as its planner counts them.
    pub operations: f64,
    /// What a renderer needs baked, by name.
    pub bakes: Vec<String>,
    /// Bytes of it.
    pub baked_bytes: usize,
}

impl Counts {
    /// Of a subject at `point`; of several scenes samples and bakes are added up, and what a sample or a fragment costs is the
    /// mean over all samples.
    ///
    /// # Errors
    /// When the renderer has no shader for it.
    pub fn new(subject: &Subject, point: &Point) -> Result<Self, StudyError> {
        let of = |part| Self::of_scene(&subject.scenes, part, &subject.scenes.point_of(part, point).params);
        let all = subject.scenes.fitted().map(of).collect::<Result<Vec<_>, _>>()?;
        Ok(Self::of_all(all))
    }

    fn of_scene(scenes: &JointScenes, part: &JointScene, params: &Params) -> Result<Self, StudyError> {
        let scene = &part.baked.scene;
        let mut facts = scene.facts(params, Budget::Exact, false);
        // Told of what an adapter can draw, which the others are measured against.
        let diffusion = &mut facts.setup.choices.diffusion;
        (diffusion.method, diffusion.seams) = (Method::Separable, Seams::Cut);
        let planned = plan(&facts)?;
        let views = scenes.views(part);
        let attributes = views.first().map_or(0, |view| view.samples.surface.rows().stride());
        let needs = scene.needs();
        let lookups = [needs.irradiance, scene.effects.has(Effect::SideSpecular), needs.dapple, needs.hilite];
        let lookups = lookups.into_iter().filter(|&wanted| wanted).count();
        let (bakes, baked_bytes) = bakes(&part.baked);
        Ok(Self {
            samples: scenes.engine(part).map_or(0, Engine::samples),
            bytes_a_sample: attributes * size_of::<f32>() + lookups * LOOKUP_BYTES,
            operations: planned.cost,
            bakes,
            baked_bytes,
        })
    }

    fn of_all(mut scenes: Vec<Self>) -> Self {
        if scenes.len() == 1 {
            return scenes.remove(0);
        }
        let samples: u64 = scenes.iter().map(|scene| scene.samples).sum();
        let mean = |of: &dyn Fn(&Self) -> f64| {
            scenes.iter().map(|scene| scene.samples as f64 * of(scene)).sum::<f64>() / samples.max(1) as f64
        };
        let mut bakes: Vec<String> = Vec::new();
        for name in scenes.iter().flat_map(|scene| &scene.bakes) {
            if !bakes.contains(name) {
                bakes.push(name.clone());
            }
        }
        Self {
            samples,
            bytes_a_sample: mean(&|scene| scene.bytes_a_sample as f64).round() as usize,
            operations: mean(&|scene| scene.operations),
            bakes,
            baked_bytes: scenes.iter().map(|scene| scene.baked_bytes).sum(),
        }
    }

    /// What `other` need not have baked that this has.
    #[must_use]
    pub fn bakes_saved(&self, other: &Self) -> Vec<String> {
        self.bakes.iter().filter(|name| !other.bakes.contains(name)).cloned().collect()
    }
}

/// What was baked, and how many bytes it is.
fn bakes(baked: &Baked) -> (Vec<String>, usize) {
    let light = &baked.illumination;
    let (mut names, mut floats) = (Vec::new(), 0);
    let mut cube = |name: &str, texels: usize| {
        names.push(name.to_owned());
        floats += 4 * texels;
    };
    if let Some(irradiance) = &light.irradiance {
        cube("irradiance", irradiance.padded().len());
    }
    // A renderer needs one: the stack's, interpolated at the exponent.
    if let Some(lobe) = light.lobes.as_ref().and_then(|lobes| lobes.cubes.first()) {
        cube("specular", lobe.padded().len());
    }
    if let Some(hilite) = &light.hilite {
        cube("hilite", hilite.padded().len());
    }
    if let Some(occlusion) = &baked.occlusion {
        names.push("occlusion".to_owned());
        floats += occlusion.base.len() + occlusion.morphs.iter().map(Vec::len).sum::<usize>();
    }
    if let Some(sky) = &baked.sky {
        names.push("sky".to_owned());
        // A renderer's vertices have the ratio alone.
        floats += 3 * sky.transfer.occlusion().base.len();
    }
    if let Some(thickness) = &baked.thickness {
        names.push("thickness".to_owned());
        floats += thickness.base.len() + thickness.morphs.iter().map(Vec::len).sum::<usize>();
    }
    (names, floats * size_of::<f32>())
}
