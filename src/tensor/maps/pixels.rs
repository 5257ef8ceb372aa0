//! The pixels of a function of maps: views beside what was observed, cut into parts.

use std::ops::Range;

use super::parts::Cut;
use super::problem::{shown, weighed};
use crate::engine::residual::Residuals;
use crate::engine::view::ObservedView;
use crate::model::gain::Gain;
use crate::samples::{LANES, SurfaceRecords, ViewSamples};
use crate::{Inputs, Shade};

/// A view.
pub(super) struct View {
    /// What was observed; the surface of the samples is the parts'.
    observed: ObservedView,
    /// How many pixels its image has.
    pub(super) pixels: usize,
    /// Whether it counts in the loss.
    pub(super) counts: bool,
}

/// Some pixel slots of a view.
pub(super) struct Part {
    pub(super) view: usize,
    pub(super) slots: Range<usize>,
    pub(super) shade: Shade,
    /// What it takes at the start.
    pub(super) inputs: Inputs,
}

/// A pixel of an image.
pub(super) struct Seen {
    /// Its slot in the part.
    pub(super) slot: usize,
    /// Its number in the image, row by row.
    pub(super) pixel: usize,
    /// The share of it that the mesh covers.
    pub(super) coverage: f64,
}

impl View {
    pub(super) fn new(observed: ObservedView, pixels: usize, counts: bool) -> Self {
        let samples = ViewSamples { surface: SurfaceRecords::default(), ..observed.samples };
        Self { observed: ObservedView { samples, ..observed }, pixels, counts }
    }

    /// What it adds to the weight that the loss is a mean over.
    pub(super) fn weight(&self) -> f64 {
        let (weight, _) = self.observed.weight_and_count(0..self.observed.samples.groups());
        if self.counts { weight * self.observed.target.stride() as f64 } else { 0.0 }
    }

    /// The pixels that a part shows.
    pub(super) fn seen(&self, part: &Part) -> impl Iterator<Item = Seen> {
        let ViewSamples { pixel, coverage, .. } = &self.observed.samples;
        let seen = |(slot, place): (usize, usize)| {
            let padding = pixel[place] == u32::MAX;
            let (pixel, coverage) = (pixel[place] as usize, f64::from(coverage[place]));
            (!padding).then_some(Seen { slot, pixel, coverage })
        };
        part.slots.clone().enumerate().filter_map(seen)
    }

    /// The summed losses of a part's image, and their slopes by what each slot shows, gain included.
    pub(super) fn weigh(
        &self,
        part: &Part,
        residuals: Residuals,
        image: &[f32],
        gain: Gain,
    ) -> (f64, Vec<[f64; 4]>) {
        let channels = self.observed.target.stride();
        let mut loss = 0.0;
        let mut slopes = vec![[0.0; 4]; part.slots.len()];
        for (slot, place) in part.slots.clone().enumerate() {
            let counts = f64::from(self.observed.pixel_weight(place));
            if counts > 0.0 {
                let rows = weighed(residuals, &self.observed, (place, counts), shown(image, slot, gain));
                for (slope, row) in slopes[slot].iter_mut().zip(rows.each()).take(channels) {
                    loss += row.loss;
                    *slope = 2.0 * row.scale * row.residual;
                }
            }
        }
        (loss, slopes)
    }
}

impl Part {
    /// Of a part of one view.
    pub(super) fn new(cut: &Cut, (shade, inputs): (Shade, Inputs)) -> Option<Self> {
        let (view, groups) = cut.one_view()?;
        Some(Self { view, slots: groups.start * LANES..groups.end * LANES, shade, inputs })
    }
}
