//! Levels as they stand in memory: what a pass leaves of a texel side by side.

use std::collections::BTreeMap;

use super::{Number, Texel};
use crate::samples::Dilation;

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

    /// Add texels that are made of others, each of its four by shares. Of differences to one of them: what is alike everywhere
    /// stays so to the bit.
    pub(super) fn extend(&mut self, made_of: &[[(u32, f32); 4]]) {
        for shares in made_of {
            let number = |texel: u32, k: usize| self.numbers[texel as usize * self.stride + k];
            let mixed = |k: usize| {
                let first = number(shares[0].0, k);
                shares.iter().fold(first, |sum, &(at, share)| sum + R::from(share) * (number(at, k) - first))
            };
            let mixed: Vec<R> = (0..self.stride).map(mixed).collect();
            self.numbers.extend(mixed);
        }
    }

    /// Add the texels that a dilation fills beyond the covered ones.
    fn fill(&mut self, dilation: &Dilation) {
        for near in dilation.filled() {
            let number = |texel: u32, k: usize| self.numbers[texel as usize * self.stride + k];
            let mean = |k: usize| {
                let first = number(near[0], k);
                let count = first.lit(near.len() as f64);
                let zero = R::from(0.0);
                first + near.iter().fold(zero, |sum, &at| sum + (number(at, k) - first)) / count
            };
            let mean: Vec<R> = (0..self.stride).map(mean).collect();
            self.numbers.extend(mean);
        }
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

    /// Add the texels that a dilation fills to all that lookups read.
    pub(super) fn fill(&mut self, dilation: &Dilation) {
        self.records
            .iter_mut()
            .filter(|record| !record.numbers.is_empty())
            .for_each(|record| record.fill(dilation));
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
