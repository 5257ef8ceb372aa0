//! A scene's own samples through every evaluator: parameters at each bound, effects one by one.

use std::path::Path;

use super::case::{Batch, FragmentInputs, Setting};
use super::declared::{Declared, declares};
use super::lights::{LightBox, LightKind};
use crate::model::effects::{Effect, Effects, Form};
use crate::model::evaluate::Setup;
use crate::model::fragment::Fragment;
use crate::model::params::Param;
use crate::model::terms::TermName;
use crate::prepare::{Baked, PrepareError, PrepareOptions, Sampled};
use crate::samples::{LANES, ViewSamples};
use crate::scene::{LoadOptions, Scene};

/// Fragments that are taken of a view.
const OF_A_VIEW: usize = 128;
/// Where a parameter has no bound.
const FAR: f64 = 1e3;

/// A scene whose samples are tried.
#[derive(Debug)]
pub struct SweptScene {
    /// What it is called among several.
    pub name: String,
    /// The lights, with its own.
    pub lights: LightBox,
    /// Its samples in every setting.
    pub batches: Vec<Batch>,
    /// Its own effects, where files declare parameters of them.
    pub declared: Option<Declared>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl SweptScene {
    /// Read, bake and sample the scene at `path`, called `name`; bakes are kept in `cache`.
    ///
    /// # Errors
    /// When a stage refuses its input.
    pub fn read(name: String, path: &Path, cache: Option<&Path>) -> Result<Self, PrepareError> {
        let load = LoadOptions { targets: false, ..LoadOptions::default() };
        let (scene, _) = Scene::load(path, &load)?;
        let effects = sweepable(scene.effects, scene.environment.is_some());
        let declared = declares(scene.effects).then(|| Declared::read(path, cache)).transpose()?;
        drop(scene);
        let cache = cache.map(Path::to_owned);
        let options = PrepareOptions { effects: Some(effects), cache, ..PrepareOptions::default() };
        let sampled = Sampled::new(path, &options)?;
        let batches = batches(&sampled, effects);
        let Sampled { baked: Baked { illumination, warnings, .. }, .. } = sampled;
        Ok(Self { name, batches, declared, lights: LightBox::new(Some(illumination)), warnings })
    }
}

/// Every setting that a scene is swept through, on a share of its samples.
#[must_use]
pub fn batches(sampled: &Sampled, effects: Effects) -> Vec<Batch> {
    let fragments: Vec<FragmentInputs> =
        sampled.samples.iter().flat_map(|view| fragments(view, sampled.scene.form)).collect();
    // Of fragments alone: nothing is interpolated, and S.w is given.
    let setup = Setup::new(sampled.scene.form, sampled.scene.silhouette, effects);
    let loss = sampled.scene.fit.loss;
    let own = Setting { setup, params: sampled.scene.params.clone(), lights: LightKind::Scene, loss };
    let mut settings = vec![own.clone()];
    for end in [0, 1] {
        // One parameter at its bound, and then all of them.
        let mut all = own.clone();
        for param in Param::built_in().filter(|&param| param != Param::SpecularLobe) {
            let info = param.info();
            let bound = [info.lower.max(-FAR), info.upper.min(FAR)][end];
            all.params.set(param, bound);
            let mut one = own.clone();
            one.params.set(param, bound);
            settings.push(one);
        }
        settings.push(all);
    }
    for effect in effects.iter() {
        for effects in [Effects::of(&[effect]), effects.without(effect)] {
            // What shows nothing alone (the rim, occlusion) is refused where shaders are planned.
            let shows = !TermName::of(effects).is_empty() || Setup { effects, ..setup }.needs().haze;
            if shows {
                settings.push(Setting { setup: Setup { effects, ..setup }, ..own.clone() });
            }
        }
    }
    settings.into_iter().map(|setting| Batch { setting, fragments: fragments.clone() }).collect()
}

/// Samples of a view, evenly drawn: their slots.
pub(super) fn spread(view: &ViewSamples) -> impl Iterator<Item = usize> {
    let slots = 0..view.records() * LANES;
    let samples: Vec<usize> = slots.filter(|&slot| view.surface.weight(slot) > 0.0).collect();
    let step = samples.len().div_ceil(OF_A_VIEW).max(1);
    samples.into_iter().step_by(step)
}

fn fragments(view: &ViewSamples, form: Form) -> Vec<FragmentInputs> {
    spread(view).map(|slot| fragment(&view.surface.fragment(slot), form)).collect()
}

/// A stored sample as a rasteriser would give it: base for N and bump for T, under a texel that takes both as
/// they are.
pub(super) fn fragment(f: &Fragment<f32>, form: Form) -> FragmentInputs {
    let wide = |v: [f32; 3]| v.map(f64::from);
    FragmentInputs {
        texel: match form {
            Form::Corrected => [1.0, 0.5, 1.0],
            Form::Listing => [1.0, 0.0, 1.0],
        },
        tangent: wide(f.bump),
        bitangent: [0.0; 3],
        normal: wide(f.base),
        view: wide(f.view),
        occlusion: f64::from(f.occlusion),
        silhouette: f64::from(f.silhouette),
        dapple: f64::from(f.dapple),
        albedo: wide(f.albedo),
        specular: f64::from(f.specular),
        attenuator: f64::from(f.attenuator),
    }
}

/// The effects that a scene can be swept with: all that shade where it has an environment, else its own.
#[must_use]
pub fn sweepable(own: Effects, environment: bool) -> Effects {
    let shading =
        Effect::BUILT_IN.into_iter().filter(|e| !matches!(*e, Effect::Bloom | Effect::Morph | Effect::Skin));
    let deforming = [Effect::Morph, Effect::Skin].into_iter().filter(|&effect| own.has(effect));
    let built_in = own.iter().filter(|effect| effect.is_built_in());
    if environment { shading.chain(deforming).collect() } else { built_in.collect() }
}
