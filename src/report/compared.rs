//! What of a view is compared: its target, and which pixels.

use crate::engine::view::ObservedView;
use crate::render::image::Image;
use crate::scene::view::View;

/// The target as an image, and how much of each pixel is compared.
#[must_use]
pub fn compared(view: &View, observed: &ObservedView, fit: &Image) -> (Image, Vec<f32>) {
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
