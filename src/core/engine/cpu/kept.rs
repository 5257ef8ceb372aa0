//! Kept rows: numbers of each sample that no free parameter changes.

use std::sync::{Arc, PoisonError};

use rayon::prelude::*;

use super::file::File;
use super::lobe::Lobes;
use super::pass::Pass;
use super::streams::BATCH;
use super::sums::CHUNK;
use super::view_pass::{Beside, streams};
use super::{CpuEngine, machine};
use crate::engine::{BLOCK, Point};
use crate::samples::rows::{Row, zeros};
use crate::with_simd;

/// Kept numbers, and what they were made with.
#[derive(Debug)]
pub(super) struct Kept {
    turned: bool,
    /// The numbers that all samples shared, and where stacks of cubes were looked up.
    made_with: (Vec<f64>, Vec<f64>),
    /// For each view, rows of each record.
    pub(super) views: Vec<Vec<Row>>,
}

impl CpuEngine {
    /// What no free parameter changes, made on the first pass, and again should a held parameter differ.
    pub(super) fn kept(&self, pass: &Pass, turned: bool, point: &Point, lobes: &Lobes) -> Arc<Kept> {
        let places = pass.kept_of.iter().map(|stack| stack.place(&point.params)).collect();
        let made_with = (pass.keep.uniforms(&point.params), places);
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |kept: &&Arc<Kept>| kept.turned == turned && kept.made_with == made_with;
        if let Some(kept) = lock().as_ref().filter(same) {
            return Arc::clone(kept);
        }
        // Memory that nothing reads any more goes first; all cores work while no lock is held.
        drop(lock().take());
        let views = (0..self.views.len()).map(|view| self.make_kept(pass, point, view, lobes)).collect();
        let kept = Arc::new(Kept { turned, made_with, views });
        *lock() = Some(Arc::clone(&kept));
        kept
    }

    fn make_kept(&self, pass: &Pass, point: &Point, view: usize, lobes: &Lobes) -> Vec<Row> {
        let (stride, observed) = (pass.kept, &self.views[view]);
        let records = observed.samples.records();
        let mut kept = zeros(records * stride);
        if stride == 0 {
            return kept;
        }
        let bound = self.bound(&pass.keep, point, lobes);
        let streams = streams(observed, Beside::default(), &self.neutral);
        let size = BLOCK * CHUNK;
        kept.par_chunks_mut(stride * size).enumerate().for_each_init(File::default, |file, (chunk, rows)| {
            file.prepare(&bound);
            with_simd!(self.level, simd => {
                for (k, rows) in rows.chunks_mut(stride * BATCH).enumerate() {
                    let count = rows.len() / stride;
                    machine::run(simd, &bound, file, &streams, chunk * size + k * BATCH, count);
                    for (output, column) in file.columns().iter().enumerate() {
                        for i in 0..count {
                            rows[i * stride + output] = Row::of(column[i].get());
                        }
                    }
                }
            });
        });
        kept
    }
}
