//! Samples as the kernel reads them: each record's numbers side by side.
//!
//! Sixteen pixels' worth of a number is a row, and a row is a cache line. Twenty planes read in step
//! would be twenty streams, which no prefetcher follows and which compete for the same cache sets,
//! as planes of equal length do; a record is read from one stream.

use std::ops::{Deref, DerefMut};

use prefetch_index::prefetch_index;
use rayon::prelude::*;

use super::view::ObservedView;
use crate::samples::LANES;
use crate::scene::view::Clip;

/// One vector's worth of numbers, on a cache line of its own.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row([f32; LANES]);

impl Row {
    pub(super) const ZERO: Self = Self([0.0; LANES]);

    #[cfg(test)]
    pub(super) const fn of(numbers: [f32; LANES]) -> Self {
        Self(numbers)
    }
}

impl Deref for Row {
    type Target = [f32; LANES];
    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Row {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// Where a record's numbers stand; `None` where no enabled effect asked for them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub base: Option<usize>,
    pub bump: Option<usize>,
    pub view: Option<usize>,
    pub normal: Option<usize>,
    pub albedo: Option<usize>,
    pub occlusion: Option<usize>,
    pub silhouette: Option<usize>,
    pub dapple: Option<usize>,
    pub specular: Option<usize>,
    pub attenuator: Option<usize>,
    /// The samples' share of their pixels.
    pub weight: Option<usize>,
}

/// How many records ahead rows are asked for: enough work to hide a read from memory.
pub(super) const AHEAD: usize = 4;

/// Planes of equal length, interleaved row by row.
#[derive(Clone, Debug)]
struct Interleaved {
    stride: usize,
    rows: Vec<Row>,
}

impl Interleaved {
    fn new(planes: &[&[f32]]) -> Self {
        let stride = planes.len();
        let planes: Vec<&[[f32; LANES]]> = planes.iter().map(|plane| plane.as_chunks().0).collect();
        let count = planes.first().map_or(0, |plane| plane.len());
        let rows = (0..count).into_par_iter().flat_map_iter(|at| planes.iter().map(move |p| Row(p[at])));
        Self { stride, rows: rows.collect() }
    }

    /// Ask for a row of planes that will be read soon: pages are small, and the processor's prefetcher
    /// ends at each.
    #[inline(always)]
    fn prefetch(&self, index: usize) {
        prefetch_rows(&self.rows, index * self.stride, self.stride);
    }

    #[inline(always)]
    fn get(&self, index: usize) -> &[Row] {
        &self.rows[index * self.stride..][..self.stride]
    }
}

/// The samples and the targets of a view.
#[derive(Clone, Debug)]
pub(super) struct Records {
    /// Where each group's records start, and the end of the last.
    pub group_start: Vec<u32>,
    pub places: Places,
    samples: Interleaved,
    targets: Interleaved,
    weights: Interleaved,
    pub clip: Option<Clip>,
}

impl Records {
    pub(super) fn new(view: &ObservedView) -> Self {
        let s = &view.samples.surface;
        let mut planes: Vec<&[f32]> = Vec::new();
        let places = Places {
            base: place(&mut planes, &s.base),
            bump: place(&mut planes, &s.bump),
            view: place(&mut planes, &s.view),
            normal: place(&mut planes, &s.normal),
            albedo: place(&mut planes, &s.albedo),
            occlusion: place(&mut planes, std::slice::from_ref(&s.occlusion)),
            silhouette: place(&mut planes, std::slice::from_ref(&s.silhouette)),
            dapple: place(&mut planes, std::slice::from_ref(&s.dapple)),
            specular: place(&mut planes, std::slice::from_ref(&s.specular)),
            attenuator: place(&mut planes, std::slice::from_ref(&s.attenuator)),
            weight: place(&mut planes, std::slice::from_ref(&view.samples.weight)),
        };
        let targets: Vec<&[f32]> = view.target.iter().map(Vec::as_slice).filter(|t| !t.is_empty()).collect();
        let weights: Vec<&[f32]> = [view.weight.as_slice()].into_iter().filter(|w| !w.is_empty()).collect();
        Self {
            group_start: view.samples.group_start.clone(),
            places,
            samples: Interleaved::new(&planes),
            targets: Interleaved::new(&targets),
            weights: Interleaved::new(&weights),
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
    pub(super) fn record(&self, index: usize) -> &[Row] {
        self.samples.get(index)
    }

    /// A group's target, a row a compared channel.
    #[inline(always)]
    pub(super) fn target(&self, group: usize) -> &[Row] {
        self.targets.get(group)
    }

    /// What each of a group's pixels counts; `None` when each counts 1.
    #[inline(always)]
    pub(super) fn pixel_weight(&self, group: usize) -> Option<&Row> {
        self.weights.get(group).first()
    }
}

/// Ask for `count` rows from `first` on; they may lie beyond the end.
#[inline(always)]
pub(super) fn prefetch_rows(rows: &[Row], first: usize, count: usize) {
    for row in first..first + count {
        prefetch_index(rows, row);
    }
}

/// Where the planes will stand once they are added to the list.
fn place<'a>(planes: &mut Vec<&'a [f32]>, parts: &'a [Vec<f32>]) -> Option<usize> {
    let at = planes.len();
    (!parts[0].is_empty()).then(|| {
        planes.extend(parts.iter().map(Vec::as_slice));
        at
    })
}
