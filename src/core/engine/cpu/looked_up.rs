//! Looked-up rows: what samples find of the UV atlas.

use std::sync::{Arc, PoisonError};

use super::CpuEngine;
use super::pass::Pass;
use crate::engine::Point;
use crate::engine::cubes_at::CubesAt;
use crate::samples::rows::Row;

/// What samples look up of the UV atlas, and what that was made with.
#[derive(Debug)]
pub(super) struct LookedUp {
    turned: bool,
    made_with: Vec<f64>,
    /// For each view, rows of each record.
    pub(super) views: Vec<Vec<Row>>,
}

impl CpuEngine {
    /// What samples look up of the UV atlas, made again where a number differs that it is made with; `None` where nothing
    /// is computed there.
    pub(super) fn looked_up(&self, pass: &Pass, turned: bool, point: &Point) -> Option<Arc<LookedUp>> {
        if pass.levels.rows() == 0 {
            return None;
        }
        let made_with = pass.levels.made_with(&point.params);
        let lock = || self.looked_up.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |found: &&Arc<LookedUp>| found.turned == turned && found.made_with == made_with;
        if let Some(found) = lock().as_ref().filter(same) {
            return Some(Arc::clone(found));
        }
        let params = &point.params;
        let cubes = || CubesAt::new(&self.illumination, params, |x| x);
        let views = self.views.iter().map(|view| pass.levels.look_up(&view.samples, params, cubes, Row::of));
        let found = Arc::new(LookedUp { turned, views: views.collect(), made_with });
        *lock() = Some(Arc::clone(&found));
        Some(found)
    }

    /// How often levels of the UV atlas were made: once for as long as nothing changes that moves them.
    #[must_use]
    pub fn levels_made(&self) -> u64 {
        let passes = self.passes.lock().unwrap_or_else(PoisonError::into_inner);
        passes.values().map(|pass| pass.levels.count()).sum()
    }
}
