//! What finds numbers of samples that no vertex has.

use std::cell::OnceCell;

use super::LANES;
use super::rows::Row;
use super::trace::Hit;
use super::visibility::Places;
use crate::model::fields::{Field, MOST_NUMBERS};

/// Points of the mesh whose fields are found together: one of each of a group's pixels.
pub(super) struct Points {
    pub(super) hits: [Hit; LANES],
    /// The same as light may reach them, once something asks.
    pub(super) places: OnceCell<Places>,
}

impl From<[Hit; LANES]> for Points {
    fn from(hits: [Hit; LANES]) -> Self {
        Self { hits, places: OnceCell::new() }
    }
}

/// What finds a field of samples at any point of the mesh.
pub(super) trait Supply: Sync {
    /// The field's numbers there.
    fn find(&self, hit: Hit, numbers: &mut [f32]);

    /// The field's numbers at each of the points, a row each.
    fn find_each(&self, points: &Points, rows: &mut [Row]) {
        one_by_one(self, points, rows);
    }
}

/// A field's numbers at points that have nothing to do with one another.
pub(super) fn one_by_one<S: Supply + ?Sized>(supply: &S, points: &Points, rows: &mut [Row]) {
    put_each(points, rows, |hit, numbers| supply.find(hit, numbers));
}

/// What `find` gives at each of the points, a row for each number.
pub(super) fn put_each(points: &Points, rows: &mut [Row], find: impl Fn(Hit, &mut [f32])) {
    for (lane, &hit) in points.hits.iter().enumerate() {
        let mut numbers = [0.0; MOST_NUMBERS];
        let numbers = &mut numbers[..rows.len()];
        find(hit, numbers);
        rows.iter_mut().zip(&*numbers).for_each(|(row, number)| row[lane] = *number);
    }
}

/// Fields, and what finds each.
pub(super) type Supplies<'a> = Vec<(Field, Box<dyn Supply + 'a>)>;
