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

/// For each view the target, the fit and its terms: those that were fitted, scene by scene, then those that were held
/// out.
pub(super) fn evidence(scenes: &Scenes, end: &Point) -> Result<Vec<ViewEvidence>, Refusal> {
    let count = |part: &JointScene| part.baked.scene.views.len() + part.held.views.len();
    let bar = progress::bar("pictures", scenes.parts.iter().map(count).sum::<usize>() as u64);
    let (mut fitted, mut others) = (Vec::new(), Vec::new());
    for part in &scenes.parts {
        let own = scenes.point_of(part, end);
        let shader = Shader::new(part.baked.setup(), &part.baked.illumination, &own.params)?;
        let shown = |(view, observed, gain, held_out): (&View, &ObservedView, Gain, bool)| {
            bar.inc(1);
            let name = scenes.view_name(part, &view.name);
            ViewEvidence { name, held_out, ..shown(part, (&shader, &own.params), (view, observed, gain)) }
        };
        if let Some(engine) = scenes.engine(part) {
            let observed = surfaced_views(engine)?;
            let views = part.baked.scene.views.iter().zip(observed.iter()).zip(&own.gains);
            fitted.extend(views.map(|((view, observed), &gain)| shown((view, observed, gain, false))));
        }
        let held = part.held.views.iter().zip(&part.held.observed).zip(&part.held.gains);
        others.extend(held.map(|((view, observed), &gain)| shown((view, observed, gain, true))));
    }
    bar.finish_and_clear();
    fitted.extend(others);
    Ok(fitted)
}

/// What diffusion has made in texels of each scene that has it, at the end of the fit. The texels are those of the
/// samples, whose fields are found already: one more pass over them is all that it takes.
pub(super) fn diffused(scenes: &Scenes, end: &Point) -> Result<Vec<DiffusedScene>, Refusal> {
    let mut diffused = Vec::new();
    for part in scenes.parts.iter().filter(|part| library::scatters(part.baked.scene.effects)) {
        let fitted = scenes.engine(part).map(surfaced_views).transpose()?;
        let mut views = fitted.iter().flat_map(|views| views.iter()).chain(&part.held.observed);
        let Some(atlas) = views.find_map(|view| view.samples.atlas.as_deref()) else { continue };
        let params = scenes.point_of(part, end).params;
        let name = if scenes.several() { part.name.clone() } else { String::new() };
        diffused.push(Stages::new(&part.baked, atlas, &params, &[])?.shown(name, &params));
    }
    Ok(diffused)
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
