//! Samples and targets as the kernel reads them: row by row, asked for some way ahead.

use super::view::ObservedView;
use crate::samples::rows::{Row, Rows};
use crate::samples::surface_records::Places;
use crate::scene::view::Clip;

/// How many records ahead rows are asked for: enough work to hide a read from memory.
pub(super) const AHEAD: usize = 4;

/// The samples and the targets of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Records<'a> {
    /// Where each group's records start, and the end of the last.
    pub group_start: &'a [u32],
    pub places: &'a Places,
    samples: &'a Rows,
    targets: &'a Rows,
    weights: &'a [Row],
    pub clip: Option<Clip>,
}

impl<'a> Records<'a> {
    pub(super) fn new(view: &'a ObservedView) -> Self {
        Self {
            group_start: &view.samples.group_start,
            places: view.samples.surface.places(),
            samples: view.samples.surface.rows(),
            targets: &view.target,
            weights: &view.weight,
            clip: view.clip,
        }
    }

    /// Ask for what the record some way behind this one will read.
    #[inline(always)]
    pub(super) fn prefetch_record(&self, index: usize) {
        self.samples.prefetch(index + AHEAD);
    }

    /// Ask for the target of the group some way behind this one.
    #[inline(always)]
    pub(super) fn prefetch_target(&self, group: usize) {
        self.targets.prefetch(group + AHEAD);
    }

    /// One record's rows.
    #[inline(always)]
    pub(super) fn record(&self, index: usize) -> &'a [Row] {
        self.samples.record(index)
    }

    /// A group's target, a row a compared channel.
    #[inline(always)]
    pub(super) fn target(&self, group: usize) -> &'a [Row] {
        self.targets.record(group)
    }

    /// What each of a group's pixels counts; `None` when each counts 1.
    #[inline(always)]
    pub(super) fn pixel_weight(&self, group: usize) -> Option<&'a Row> {
        self.weights.get(group)
    }
}
