//! What stays from pass to pass: the specular cube of the last exponent, and the terms that no free
//! parameter moves.

use std::sync::{Arc, PoisonError};

use rayon::prelude::*;

use super::lobe::Lobe;
use super::{BLOCK, CHUNK, CpuEngine};
use crate::engine::Unknown;
use crate::model::params::{Param, Params};
use crate::samples::rows::Row;
use crate::with_simd;

#[derive(Debug)]
pub(super) struct Kept {
    key: [f64; 5],
    /// For each view, the plan's kept rows of each record.
    pub(super) views: Vec<Vec<Row>>,
}

impl CpuEngine {
    pub(super) fn lobe(&self, exponent: f64) -> Option<Arc<Lobe>> {
        let mut slot = self.lobe.lock().unwrap_or_else(PoisonError::into_inner);
        Lobe::at(self.illumination.lobes.as_ref()?, exponent, &mut slot)
    }

    /// Terms that no free parameter changes, made on the first pass (and again should one of the
    /// held parameters differ).
    pub(super) fn kept(&self, params: &Params, lobe: Option<&Lobe>) -> Arc<Kept> {
        let key = [
            Param::NormalStrength,
            Param::SpecularLobe,
            Param::EnvironmentRotation,
            Param::KeyAzimuth,
            Param::KeyElevation,
        ]
        .map(|p| {
            let free = self.unknowns.iter().any(|u| matches!(u, Unknown::Param(c) if c.param == p));
            if free { 0.0 } else { params.scalar(p) }
        });
        let mut slot = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = slot.as_ref().filter(|kept| kept.key == key) {
            return Arc::clone(kept);
        }
        let views = (0..self.views.len()).map(|index| self.make_kept(index, params, lobe)).collect();
        let kept = Arc::new(Kept { key, views });
        *slot = Some(Arc::clone(&kept));
        kept
    }

    fn make_kept(&self, index: usize, params: &Params, lobe: Option<&Lobe>) -> Vec<Row> {
        let stride = self.plan.kept.rows;
        let mut kept = vec![Row::ZERO; self.views[index].samples.records() * stride];
        if stride > 0 {
            let size = BLOCK * CHUNK;
            kept.par_chunks_mut(stride * size).enumerate().for_each(|(chunk, rows)| {
                with_simd!(self.level, simd => {
                    let kernel = self.kernel(simd, &self.views[index], &[], params, lobe, 1.0);
                    for (k, rows) in rows.chunks_exact_mut(stride).enumerate() {
                        kernel.keep(chunk * size + k, rows);
                    }
                });
            });
        }
        kept
    }
}
