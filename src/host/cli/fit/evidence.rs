//! The evidence: each view's target, fit and terms.

use crate::cli::Refusal;
use crate::cli::compared::compared;
use crate::cli::fit_engine::surfaced_views;
use crate::engine::Engine;
use crate::fit::outcome::Outcome;
use crate::prepare::Baked;
use crate::progress;
use crate::render::places::places;
use crate::render::shade::Shader;
use crate::report::ViewEvidence;

/// For each view the target, the fit and its terms.
pub(super) fn evidence(
    baked: &Baked,
    engine: &dyn Engine,
    outcome: &Outcome,
) -> Result<Vec<ViewEvidence>, Refusal> {
    let observed = surfaced_views(engine)?;
    let shader = Shader::new(baked.setup(), &baked.illumination, &outcome.end.params)?;
    let bar = progress::bar("pictures", baked.scene.views.len() as u64);
    let views = baked.scene.views.iter().zip(observed.iter()).enumerate();
    let evidence = views
        .map(|(index, (view, observed))| {
            let shaded = shader.shade(&observed.samples, &view.camera, outcome.end.gains[index]);
            let (target, coverage) = compared(view, observed, &shaded.image);
            bar.inc(1);
            Ok(ViewEvidence {
                name: view.name.clone(),
                target,
                fit: shaded.image,
                coverage,
                terms: shaded
                    .terms
                    .into_iter()
                    .map(|(name, image)| (name.name().to_owned(), image))
                    .collect(),
                haze: shaded.haze,
                places: places(
                    &observed.samples,
                    baked.setup(),
                    &baked.illumination,
                    &outcome.end.params,
                    [view.camera.width, view.camera.height].map(|side| side as usize),
                ),
                clip: observed.clip,
            })
        })
        .collect();
    bar.finish_and_clear();
    evidence
}
