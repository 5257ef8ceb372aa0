//! Kept rows: numbers of each sample that no free parameter changes.

use std::sync::{Arc, PoisonError};

use rayon::prelude::*;

use super::file::File;
use super::lobe::Lobe;
use super::pass::Pass;
use super::streams::{BATCH, Stream};
use super::sums::CHUNK;
use super::view_pass::{Beside, streams};
use super::{CpuEngine, machine};
use crate::engine::{BLOCK, Point};
use crate::model::params::Param;
use crate::samples::rows::Row;
use crate::with_simd;

/// Kept numbers, and what they were made with.
#[derive(Debug)]
pub(super) struct Kept {
    turned: bool,
    /// The numbers that all samples shared, and the specular cube's exponent.
    made_with: (Vec<f64>, f64),
    /// For each view, rows of each record.
    pub(super) views: Vec<Vec<Row>>,
}

impl CpuEngine {
    /// What no free parameter changes, made on the first pass, and again should a held parameter differ.
    pub(super) fn kept(&self, pass: &Pass, turned: bool, point: &Point, lobe: Option<&Lobe>) -> Arc<Kept> {
        let exponent = pass.keep.program.tape.resources.iter().any(|name| name.starts_with("specular"));
        let exponent = if exponent { point.params.scalar(Param::SpecularLobe) } else { 0.0 };
        let made_with = (pass.keep.uniforms(&point.params), exponent);
        let mut slot = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = slot.as_ref().filter(|kept| kept.turned == turned && kept.made_with == made_with)
        {
            return Arc::clone(kept);
        }
        let views = (0..self.views.len()).map(|view| self.make_kept(pass, point, view, lobe)).collect();
        let kept = Arc::new(Kept { turned, made_with, views });
        *slot = Some(Arc::clone(&kept));
        kept
    }

    fn make_kept(&self, pass: &Pass, point: &Point, view: usize, lobe: Option<&Lobe>) -> Vec<Row> {
        let (stride, observed) = (pass.kept, &self.views[view]);
        let records = observed.samples.records();
        let mut kept = vec![Row::ZERO; records * stride];
        if stride == 0 {
            return kept;
        }
        let bound = self.bound(&pass.keep, point, lobe);
        let none = Stream { rows: &[], stride: 0 };
        let streams = streams(observed, Beside { kept: none, levels: none }, &self.neutral);
        let size = BLOCK * CHUNK;
        kept.par_chunks_mut(stride * size).enumerate().for_each_init(File::default, |file, (chunk, rows)| {
            file.prepare(&bound);
            with_simd!(self.level, simd => {
                for (k, rows) in rows.chunks_mut(stride * BATCH).enumerate() {
                    let count = rows.len() / stride;
                    machine::run(simd, &bound, file, &streams, chunk * size + k * BATCH, count);
                    for (output, column) in file.columns().iter().enumerate() {
                        for i in 0..count {
                            rows[i * stride + output] = column[i].get();
                        }
                    }
                }
            });
        });
        kept
    }
}
