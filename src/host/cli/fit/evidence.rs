//! The evidence: each view's target, fit and terms.

use super::scenes::Scenes;
use crate::cli::Refusal;
use crate::cli::fit_engine::surfaced_views;
use crate::cli::stages::Stages;
use crate::engine::Point;
use crate::engine::view::ObservedView;
use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::prepare::{Baked, JointScene};
use crate::progress;
use crate::render::places::places;
use crate::render::shade::{PLAIN_LAYER, Shader};
use crate::report::ViewEvidence;
use crate::report::compared::compared;
use crate::report::diffusion::DiffusedScene;
use crate::scene::view::View;
use crate::shader::term::library;

/// What a fit's report shows of its end.
pub(super) struct Evidence {
    /// The views that were fitted, scene by scene, then those that were held out.
    pub(super) views: Vec<ViewEvidence>,
    /// The scenes that have diffusion.
    pub(super) diffused: Vec<DiffusedScene>,
}

/// For each view the target, the fit and its terms; of each scene what diffusion has made, where it has any.
pub(super) fn evidence(scenes: &Scenes, end: &Point) -> Result<Evidence, Refusal> {
    let count = |part: &JointScene| part.baked.scene.views.len() + part.held.views.len();
    let bar = progress::bar("pictures", scenes.parts.iter().map(count).sum::<usize>() as u64);
    let (mut fitted, mut others, mut diffused) = (Vec::new(), Vec::new(), Vec::new());
    for part in &scenes.parts {
        let own = scenes.point_of(part, end);
        let shader = Shader::new(part.baked.setup(), &part.baked.illumination, &own.params)?;
        let shown = |(view, observed, gain, held_out): (&View, &ObservedView, Gain, bool)| {
            bar.inc(1);
            let name = scenes.view_name(part, &view.name);
            ViewEvidence { name, held_out, ..shown(part, (&shader, &own.params), (view, observed, gain)) }
        };
        let observed = scenes.engine(part).map(surfaced_views).transpose()?;
        let observed = observed.as_deref().unwrap_or_default();
        let views = part.baked.scene.views.iter().zip(observed).zip(&own.gains);
        fitted.extend(views.map(|((view, observed), &gain)| shown((view, observed, gain, false))));
        let held = part.held.views.iter().zip(&part.held.observed).zip(&part.held.gains);
        others.extend(held.map(|((view, observed), &gain)| shown((view, observed, gain, true))));
        let name = if scenes.several() { part.name.as_str() } else { "" };
        diffused.extend(diffused_in(part, name, &own.params, observed)?);
    }
    bar.finish_and_clear();
    fitted.extend(others);
    Ok(Evidence { views: fitted, diffused })
}

/// What diffusion makes at `params` in texels of a scene's views, whose fields are found already: one more pass over them is
/// all that it takes. `None` where the scene has no diffusion.
fn diffused_in(
    part: &JointScene,
    name: &str,
    params: &Params,
    observed: &[ObservedView],
) -> Result<Option<DiffusedScene>, Refusal> {
    if !library::scatters(part.baked.scene.effects) {
        return Ok(None);
    }
    // All views of a scene show the same texels.
    let atlas = observed.iter().chain(&part.held.observed).find_map(|view| view.samples.atlas.as_deref());
    let stages = atlas.map(|atlas| Stages::new(&part.baked, atlas, params, &[])).transpose()?;
    Ok(stages.map(|stages| stages.shown(name.to_owned(), params)))
}

/// The images of a view of a scene, at the scene's constants.
fn shown(
    part: &JointScene,
    (shader, params): (&Shader, &Params),
    (view, observed, gain): (&View, &ObservedView, Gain),
) -> ViewEvidence {
    let Baked { scene, illumination, .. } = &part.baked;
    let shaded = shader.shade(&observed.samples, &view.camera, gain);
    let (target, coverage) = compared(view, observed, &shaded.image);
    let size = [view.camera.width, view.camera.height].map(|side| side as usize);
    let terms = shaded.terms.into_iter().map(|(name, image)| (name.name().to_owned(), image));
    let terms = terms.chain(shaded.plain.map(|image| (PLAIN_LAYER.to_owned(), image)));
    ViewEvidence {
        name: view.name.clone(),
        target,
        fit: shaded.image,
        coverage,
        terms: terms.collect(),
        haze: shaded.haze,
        places: places(&observed.samples, scene.setup(), illumination, params, size),
        clip: observed.clip,
        held_out: false,
    }
}
