//! The evidence: each view's target, fit and terms.

use crate::cli::Refusal;
use crate::cli::fit_engine::surfaced_views;
use crate::engine::view::ObservedView;
use crate::engine::{Engine, Point};
use crate::prepare::{Baked, HeldOut};
use crate::progress;
use crate::render::image::Image;
use crate::render::places::places;
use crate::render::shade::Shader;
use crate::report::ViewEvidence;
use crate::scene::view::View;

/// For each view the target, the fit and its terms; those of views that were held out come last.
pub(super) fn evidence(
    (baked, held): (&Baked, &HeldOut),
    engine: &dyn Engine,
    end: &Point,
) -> Result<Vec<ViewEvidence>, Refusal> {
    let observed = surfaced_views(engine)?;
    let shader = Shader::new(baked.setup(), &baked.illumination, &end.params)?;
    let fitted = baked.scene.views.iter().zip(observed.iter()).zip(&end.gains).map(|view| (view, false));
    let others = held.views.iter().zip(&held.observed).zip(&held.gains).map(|view| (view, true));
    let bar = progress::bar("pictures", (baked.scene.views.len() + held.views.len()) as u64);
    let evidence = fitted
        .chain(others)
        .map(|(((view, observed), &gain), held_out)| {
            let shaded = shader.shade(&observed.samples, &view.camera, gain);
            let (target, coverage) = compared(view, observed, &shaded.image);
            bar.inc(1);
            ViewEvidence {
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
                    &end.params,
                    [view.camera.width, view.camera.height].map(|side| side as usize),
                ),
                clip: observed.clip,
                held_out,
            }
        })
        .collect();
    bar.finish_and_clear();
    Ok(evidence)
}

/// The target as an image, and how much of each pixel is compared.
pub(in crate::cli) fn compared(view: &View, observed: &ObservedView, fit: &Image) -> (Image, Vec<f32>) {
    let mut target = Image::new(fit.width, fit.height);
    let Some(source) = &view.target else { return (target, fit.alpha.clone()) };
    target.rgb.clone_from(&source.rgb);
    // Without an alpha of its own, the target is opaque.
    target.alpha = source.alpha.clone().unwrap_or_else(|| vec![1.0; source.rgb.len()]);
    let mut coverage = vec![0.0; fit.alpha.len()];
    for (slot, &pixel) in observed.samples.pixel.iter().enumerate() {
        if pixel != u32::MAX && observed.pixel_weight(slot) > 0.0 {
            let at = pixel as usize;
            coverage[at] = observed.samples.coverage[slot].min(target.alpha[at]);
        }
    }
    (target, coverage)
}
