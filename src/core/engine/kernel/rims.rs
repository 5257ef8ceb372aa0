//! Rims of records whose silhouettes no free parameter moves, a run of records at once.
//!
//! A power is a chain of some forty steps that wait for each other; side by side, chains hide one another.

use std::ops::Range;

use super::Kernel;
use crate::engine::lanes::Lanes;
use crate::model::rim::{Rim, rim};
use crate::samples::rows::Row;
use crate::simd::Simd;

/// The rims of a run of records.
#[derive(Default)]
pub(in crate::engine) struct Rims {
    first: usize,
    /// Of each record the value, and how it moves with the exponent and with the silhouette.
    rows: Vec<[Row; 3]>,
}

impl Rims {
    /// A record's rim.
    #[inline(always)]
    pub(super) fn of<S: Simd>(&self, simd: S, record: usize) -> Rim<Lanes<S>> {
        let [value, by_exponent, by_silhouette] = &self.rows[record - self.first];
        Rim {
            value: Lanes::of_row(simd, value),
            by_exponent: Lanes::of_row(simd, by_exponent),
            by_silhouette: Lanes::of_row(simd, by_silhouette),
        }
    }
}

impl<S: Simd> Kernel<'_, S> {
    /// Before the groups of a run: their records' rims, where these do not wait for a lookup.
    #[inline(always)]
    pub(in crate::engine) fn begin(&self, groups: Range<usize>, rims: &mut Rims) {
        if self.plan.any_live {
            return;
        }
        let starts = &self.view.group_start;
        let (first, end) = (starts[groups.start] as usize, starts[groups.end] as usize);
        rims.first = first;
        rims.rows.resize(end - first, [Row::ZERO; 3]);
        for (record, rows) in (first..end).zip(&mut rims.rows) {
            let silhouette = match self.plan.kept.silhouette {
                Some(at) => Lanes::of_row(self.simd, &self.kept_rows(record)[at]),
                None => self.no_terms(record).silhouette,
            };
            let rim = rim(silhouette, self.weights.rim_exponent);
            rim.value.store(&mut rows[0]);
            rim.by_exponent.store(&mut rows[1]);
            rim.by_silhouette.store(&mut rows[2]);
        }
    }
}
