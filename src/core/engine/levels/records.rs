//! Levels as they stand in memory: what a pass leaves of a texel side by side.

use std::collections::BTreeMap;

use super::{Number, Texel};

/// Numbers that a record is a multiple of: what one instruction loads.
const WIDE: usize = 4;

/// What one pass leaves: for each covered texel its leaves one after another, three numbers each.
#[derive(Clone, Debug)]
pub(super) struct Record<R> {
    /// Numbers a texel, [`WIDE`] at a time.
    pub(super) stride: usize,
    pub(super) numbers: Vec<R>,
}

impl<R: Number> Record<R> {
    /// So many leaves of so many texels, all 0.
    pub(super) fn new(leaves: usize, texels: usize) -> Self {
        let stride = (3 * leaves).next_multiple_of(WIDE);
        Self { stride, numbers: vec![R::from(0.0); stride * texels] }
    }

    /// What stands from `offset` on of a texel.
    #[inline(always)]
    pub(super) fn at(&self, texel: usize, offset: usize) -> Texel<R> {
        let first = texel * self.stride + offset;
        [self.numbers[first], self.numbers[first + 1], self.numbers[first + 2]]
    }
}

/// Every level that passes have left.
#[derive(Clone, Debug)]
pub struct Made<R> {
    records: Vec<Record<R>>,
    /// The record of each level, and where it stands in it.
    places: BTreeMap<String, (usize, usize)>,
    texels: usize,
}

impl<R: Number> Made<R> {
    pub(super) fn new(texels: usize) -> Self {
        Self { records: Vec::new(), places: BTreeMap::new(), texels }
    }

    /// Add what a pass has left.
    pub(super) fn push(&mut self, leaves: impl Iterator<Item = String>, record: Record<R>) {
        let places = leaves.enumerate().map(|(k, name)| (name, (self.records.len(), 3 * k)));
        self.places.extend(places);
        self.records.push(record);
    }

    /// Where a level stands.
    pub(super) fn place(&self, name: &str) -> Option<(usize, usize)> {
        self.places.get(name).copied()
    }

    pub(super) fn record(&self, at: usize) -> &Record<R> {
        &self.records[at]
    }

    /// Forget what no lookup reads.
    pub(super) fn retain(&mut self, read: impl Fn(&str) -> bool) {
        self.places.retain(|name, _| read(name));
        for (at, record) in self.records.iter_mut().enumerate() {
            if !self.places.values().any(|place| place.0 == at) {
                record.numbers = Vec::new();
            }
        }
    }

    /// A level's value in each covered texel, in the atlas' order; of fewer than three components, 0 after. `None` where
    /// no pass leaves it.
    #[must_use]
    pub fn texels(&self, name: &str) -> Option<Vec<[R; 3]>> {
        let (record, offset) = self.place(name)?;
        Some((0..self.texels).map(|texel| self.records[record].at(texel, offset)).collect())
    }

    /// All of them, by their names.
    #[must_use]
    pub fn all(&self) -> BTreeMap<String, Vec<[R; 3]>> {
        let texels = |name: &String| Some((name.clone(), self.texels(name)?));
        self.places.keys().filter_map(texels).collect()
    }
}
