//! One view as the engine sees it: its samples beside what was observed there.

use super::residual::weighted_residual;
use crate::samples::{LANES, ViewSamples};
use crate::scene::Loss;
use crate::scene::view::Clip;

/// Samples of a view, and the target at its pixel slots.
#[derive(Clone, Debug, Default)]
pub struct ObservedView {
    /// The visible surface.
    pub samples: ViewSamples,
    /// For each pixel slot: the target's colour, not premultiplied, and where the haze is compared
    /// too its alpha; otherwise the fourth plane is empty.
    pub target: [Vec<f32>; 4],
    /// For each pixel slot: what it counts; 0 for padding. Empty: every slot counts 1.
    pub weight: Vec<f32>,
    /// Where an 8-bit target is clipped.
    pub clip: Option<Clip>,
}

impl ObservedView {
    /// Sum of the squared target, weighted as the residuals of a perfect fit are.
    pub(super) fn power(&self, groups: impl Iterator<Item = usize>, loss: Loss) -> f64 {
        let slots = groups.flat_map(|group| group * LANES..(group + 1) * LANES);
        let planes = || self.target.iter().filter(|plane| !plane.is_empty());
        let of = |slot: usize| {
            let weight = f64::from(self.weight.get(slot).copied().unwrap_or(1.0));
            let square = |plane: &Vec<f32>| {
                let target = f64::from(plane[slot]);
                (weighted_residual(loss, self.clip, target, target, weight).scale * target).powi(2)
            };
            planes().map(square).sum::<f64>()
        };
        slots.map(of).sum()
    }

    /// Sum of the pixels' weights, and how many count at all.
    pub(super) fn weight_and_count(&self, groups: impl Iterator<Item = usize>) -> (f64, u64) {
        let (mut sum, mut count) = (0.0, 0);
        for group in groups {
            if self.weight.is_empty() {
                sum += LANES as f64;
                count += LANES as u64;
            } else {
                for &w in &self.weight[group * LANES..(group + 1) * LANES] {
                    sum += f64::from(w);
                    count += u64::from(w > 0.0);
                }
            }
        }
        (sum, count)
    }
}
