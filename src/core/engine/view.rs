//! One view as the engine sees it: its samples beside what was observed there.

use super::residual::Residuals;
use crate::model::batch::Batch;
use crate::samples::rows::{Row, Rows};
use crate::samples::{LANES, ViewSamples};
use crate::scene::view::Clip;

/// Samples of a view, and the target at its pixel slots.
#[derive(Clone, Debug, Default)]
pub struct ObservedView {
    /// The visible surface.
    pub samples: ViewSamples,
    /// For each group: three rows of the target's colour, not premultiplied, and where the haze is
    /// compared too a fourth of its alpha.
    pub target: Rows,
    /// For each group what its pixels count; 0 for padding. Empty: every pixel counts 1.
    pub weight: Vec<Row>,
    /// Where an 8-bit target is clipped.
    pub clip: Option<Clip>,
}

impl ObservedView {
    /// Whether the target has an alpha that the haze is compared with.
    #[must_use]
    pub const fn compares_alpha(&self) -> bool {
        self.target.stride() == 4
    }

    /// What the pixel at `slot` counts.
    #[must_use]
    pub fn pixel_weight(&self, slot: usize) -> f32 {
        self.weight.get(slot / LANES).map_or(1.0, |row| row[slot % LANES])
    }

    /// Sum of the squared target, weighted as the residuals of a perfect fit are.
    pub(super) fn power(&self, groups: impl Iterator<Item = usize>, residuals: &Residuals) -> f64 {
        let of = |group: usize| {
            // A row at a time: fits of some hundred pixels are over in the time that asking slot by slot takes.
            let slots = |row: &Row| Batch::<f64, LANES>(std::array::from_fn(|lane| row[lane].into()));
            let weight = self.weight.get(group).map_or(Batch([1.0; LANES]), slots);
            let square = |target: &Row| {
                let target = slots(target);
                let scaled = residuals.weigh(self.clip, target, target, weight).scale * target;
                scaled.0.iter().map(|x| x * x).sum::<f64>()
            };
            self.target.record(group).iter().map(square).sum::<f64>()
        };
        groups.map(of).sum()
    }

    /// Sum of the pixels' weights, and how many count at all.
    pub fn weight_and_count(&self, groups: impl Iterator<Item = usize>) -> (f64, u64) {
        let of = |group: usize| match self.weight.get(group) {
            None => (LANES as f64, LANES as u64),
            Some(row) => {
                let sum = row.iter().map(|&weight| f64::from(weight)).sum();
                (sum, row.iter().map(|&weight| u64::from(weight > 0.0)).sum())
            }
        };
        groups.map(of).fold((0.0, 0), |(sum, count), (own, counted)| (sum + own, count + counted))
    }
}
