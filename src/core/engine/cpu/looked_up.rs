//! What samples find of the UV atlas: rows of each record where that stays from pass to pass, levels where it moves.

use std::sync::{Arc, PoisonError};

use super::CpuEngine;
use super::pass::Pass;
use super::view_pass::Lookup;
use crate::engine::Point;
use crate::engine::cubes_at::CubesAt;
use crate::engine::levels::{Corners, Finder, corners_of};
use crate::samples::rows::Row;

/// What samples look up of the UV atlas, and what that was made with.
#[derive(Debug)]
pub(super) struct LookedUp {
    turned: bool,
    made_with: Vec<f64>,
    views: Vec<Found>,
}

/// What a view's samples find.
#[derive(Debug)]
enum Found {
    /// Rows of each record.
    Rows(Vec<Row>),
    /// Levels, which every pass looks up anew: to write rows down and read them again takes longer.
    Levels(Finder<f32>, Arc<Vec<Vec<Corners<f32>>>>),
}

impl LookedUp {
    /// What a view's passes read: rows, or what they look up by.
    pub(super) fn of(&self, view: usize) -> (&[Row], Option<Lookup<'_>>) {
        match &self.views[view] {
            Found::Rows(rows) => (rows, None),
            Found::Levels(finder, corners) => (&[], Some(Lookup { finder, corners: &corners[view] })),
        }
    }
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
        // Levels are made in the memory of the last ones, where nobody has these any more.
        drop(lock().take());
        let params = &point.params;
        let cubes = || CubesAt::new(&self.illumination, params, |x| x);
        // Of an engine for images, every pass is another's.
        let anew = pass.levels.moves() || self.fitted.unknowns.is_empty();
        let views = self.views.iter().map(|view| match &view.samples.atlas {
            Some(atlas) if anew && view.samples.records() > 0 => {
                let made = pass.levels.levels(atlas, params, cubes);
                Found::Levels(Finder::new(&pass.levels, made), self.corners(pass.levels.program().dilated))
            }
            _ => Found::Rows(pass.levels.look_up(&view.samples, params, cubes, Row::of)),
        });
        let found = Arc::new(LookedUp { turned, views: views.collect(), made_with });
        *lock() = Some(Arc::clone(&found));
        Some(found)
    }

    /// The texels that each view's samples look up.
    fn corners(&self, dilated: bool) -> Arc<Vec<Vec<Corners<f32>>>> {
        let made = || Arc::new(self.views.iter().map(|view| corners_of(&view.samples, dilated)).collect());
        Arc::clone(self.corners.get_or_init(made))
    }

    /// How often levels of the UV atlas were made: once for as long as nothing changes that moves them.
    #[must_use]
    pub fn levels_made(&self) -> u64 {
        let passes = self.passes.lock().unwrap_or_else(PoisonError::into_inner);
        passes.values().map(|pass| pass.levels.count()).sum()
    }
}
