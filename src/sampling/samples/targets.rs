//! What each pixel of a target asks of the model: its colour, and how much it counts.

use std::collections::BTreeSet;

use super::rows::{Row, Rows};
use super::{LANES, SampleError, ViewSamples};
use crate::scene::view::{Clip, View};

/// A pixel of which less than this is covered, in the target or by the samples, is left out: what
/// remains after division by its coverage is noise.
const LEAST_COVERAGE: f32 = 0.05;

/// A target in the order of a [`ViewSamples`]' pixel slots.
#[derive(Clone, Debug, Default)]
pub struct TargetRows {
    /// For each group three rows: linear radiance of the surface, no longer premultiplied; 0 where the
    /// weight is 0. Where the target has a haze, that is a fourth.
    pub channels: Rows,
    /// For each group what its pixels count: mask times coverage; 0 for padding.
    pub weight: Vec<Row>,
    /// The values at and beyond which residuals are one-sided.
    pub clip: Option<Clip>,
}

impl TargetRows {
    /// The target of `view` for `samples`; `None` when the view has no target.
    ///
    /// The colour is the target's over its alpha, so that a silhouette pixel is compared with the
    /// samples that cover it; it counts by the smaller of the two coverages. A target without
    /// alpha is compared where the samples cover the whole pixel. Pixels that show something else than skin do not count.
    ///
    /// # Errors
    /// When the target has not as many pixels as the view, or none of them counts.
    pub fn new(view: &View, samples: &ViewSamples) -> Result<Option<Self>, SampleError> {
        let Some(target) = &view.target else { return Ok(None) };
        let pixels = view.camera.width as usize * view.camera.height as usize;
        let planes = [&target.alpha, &target.mask, &target.haze].map(|plane| plane.as_ref().map(Vec::len));
        let lengths = planes.into_iter().chain([Some(target.rgb.len())]);
        if let Some(found) = lengths.flatten().find(|&length| length != pixels) {
            return Err(SampleError::TargetSize { view: view.name.clone(), found, pixels });
        }
        let groups = samples.groups();
        let count = if target.haze.is_some() { 4 } else { 3 };
        // What a target shows there is of both.
        let mixed: BTreeSet<u32> = samples.plain.iter().map(|plain| plain.pixel).collect();
        let (mut channels, mut weights) = (Rows::new(count, groups), vec![Row::ZERO; groups]);
        for (slot, (&pixel, &coverage)) in samples.pixel.iter().zip(&samples.coverage).enumerate() {
            let (asked, weight) = if pixel == u32::MAX || mixed.contains(&pixel) {
                ([0.0; 4], 0.0)
            } else {
                let i = pixel as usize;
                let mask = target.mask.as_ref().map_or(1.0, |mask| mask[i]);
                let (alpha, shared) = match &target.alpha {
                    Some(alpha) => (alpha[i], coverage.min(alpha[i])),
                    None => (1.0, if coverage >= 1.0 { 1.0 } else { 0.0 }),
                };
                // The readers refuse what is not finite; should it get here, it does not count.
                let [r, g, b] = target.rgb[i];
                let asked = [r, g, b, target.haze.as_ref().map_or(0.0, |haze| haze[i])];
                let sound = asked.iter().all(|x| x.is_finite());
                if alpha >= LEAST_COVERAGE && shared >= LEAST_COVERAGE && mask > 0.0 && sound {
                    (asked.map(|x| x / alpha), mask * shared.min(1.0))
                } else {
                    ([0.0; 4], 0.0)
                }
            };
            let (group, lane) = (slot / LANES, slot % LANES);
            channels.record_mut(group).iter_mut().zip(asked).for_each(|(row, x)| row[lane] = x);
            weights[group][lane] = weight;
        }
        if weights.iter().all(|row| *row == Row::ZERO) {
            return Err(SampleError::EmptyMask { view: view.name.clone() });
        }
        Ok(Some(Self { channels, weight: weights, clip: target.clipped_at }))
    }
}
