//! Levels as they stand in memory: what a pass leaves of a texel side by side.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Number, Texel};
use crate::samples::{Dilation, LANES};

/// Numbers that a record is a multiple of: what one instruction loads.
const WIDE: usize = 4;

/// What one pass leaves: for each covered texel its leaves one after another, three numbers each.
///
/// Behind the last texel stand [`LANES`] numbers or more that mean nothing: sixteen are read at once from wherever a texel's
/// begin.
#[derive(Clone, Debug)]
pub struct Record<R> {
    /// Numbers a texel, [`WIDE`] at a time.
    pub(super) stride: usize,
    texels: usize,
    pub(super) numbers: Vec<R>,
}

impl<R> Default for Record<R> {
    /// Of no texels.
    fn default() -> Self {
        Self { stride: 0, texels: 0, numbers: Vec::new() }
    }
}

impl<R: Number> Record<R> {
    /// `leaves` leaves of each of `texels` texels, in memory that others have left. What stands there is theirs.
    pub(super) fn within(mut memory: Vec<R>, leaves: usize, texels: usize) -> Self {
        let (stride, count) = (Self::stride(leaves), Self::room(leaves, texels));
        if memory.len() < count {
            // Not a copy of what nobody reads.
            memory = vec![R::from(0.0); count];
        }
        Self { stride, texels, numbers: memory }
    }

    /// Numbers of a texel with `leaves` leaves.
    fn stride(leaves: usize) -> usize {
        (3 * leaves).next_multiple_of(WIDE)
    }

    /// Numbers that a record of `leaves` leaves of each of `texels` texels takes.
    pub(super) fn room(leaves: usize, texels: usize) -> usize {
        Self::stride(leaves) * texels + LANES
    }

    /// `leaves` leaves of each of `texels` texels, all 0.
    pub(super) fn new(leaves: usize, texels: usize) -> Self {
        Self::within(Vec::new(), leaves, texels)
    }

    /// Numbers of all texels.
    pub(super) fn of_texels(&mut self) -> &mut [R] {
        &mut self.numbers[..self.stride * self.texels]
    }

    /// Sixteen numbers from `offset` on of a texel, those after its own with them.
    #[inline(always)]
    pub(super) fn sixteen(&self, texel: usize, offset: usize) -> &[R; LANES] {
        sixteen(&self.numbers, texel * self.stride + offset)
    }

    /// Add texels, each by a function of those before.
    fn add<T>(&mut self, texels: impl ExactSizeIterator<Item = T>, number: impl Fn(&[R], &T, usize) -> R) {
        let mut end = self.stride * self.texels;
        self.texels += texels.len();
        let count = self.stride * self.texels + LANES;
        self.numbers.resize(count.max(self.numbers.len()), R::from(0.0));
        for texel in texels {
            let (before, own) = self.numbers.split_at_mut(end);
            for (k, x) in own[..self.stride].iter_mut().enumerate() {
                *x = number(before, &texel, k);
            }
            end += self.stride;
        }
    }

    /// Add texels that are made of others, each of its four by shares. Of differences to one of them: what is alike everywhere
    /// stays so to the bit.
    pub(super) fn extend(&mut self, made_of: &[[(u32, f32); 4]]) {
        let stride = self.stride;
        self.add(made_of.iter(), |numbers, shares, k| {
            let number = |texel: u32| numbers[texel as usize * stride + k];
            let first = number(shares[0].0);
            shares.iter().fold(first, |sum, &(at, share)| sum + R::from(share) * (number(at) - first))
        });
    }

    /// Add the texels that a dilation fills beyond the covered ones.
    pub(super) fn fill(&mut self, dilation: &Dilation) {
        let stride = self.stride;
        self.add(dilation.filled(), |numbers, near, k| {
            let number = |texel: u32| numbers[texel as usize * stride + k];
            let first = number(near[0]);
            let count = first.lit(near.len() as f64);
            first + near.iter().fold(R::from(0.0), |sum, &at| sum + (number(at) - first)) / count
        });
    }

    /// What stands from `offset` on of a texel.
    #[inline(always)]
    pub(super) fn at(&self, texel: usize, offset: usize) -> Texel<R> {
        let first = texel * self.stride + offset;
        [self.numbers[first], self.numbers[first + 1], self.numbers[first + 2]]
    }
}

/// Sixteen numbers from a place on.
#[inline(always)]
fn sixteen<R>(numbers: &[R], first: usize) -> &[R; LANES] {
    match numbers[first..].first_chunk() {
        Some(sixteen) => sixteen,
        None => unreachable!("sixteen numbers stand behind the last texel"),
    }
}

/// What passes have left.
#[derive(Clone, Debug)]
pub struct Made<R> {
    /// For each pass; of one whose memory others have taken, nothing.
    records: Vec<Arc<Record<R>>>,
    /// For each pass the numbers that it was made with, beside what other passes left.
    with: Vec<Vec<f64>>,
    /// The record of each level, and where it stands in it.
    places: BTreeMap<String, (usize, usize)>,
    texels: usize,
}

impl<R: Number> Made<R> {
    pub(super) const fn new(texels: usize) -> Self {
        Self { records: Vec::new(), with: Vec::new(), places: BTreeMap::new(), texels }
    }

    /// Add what a pass has left, in the order of its leaves.
    pub(super) fn push(
        &mut self,
        leaves: impl Iterator<Item = String>,
        record: Arc<Record<R>>,
        with: Vec<f64>,
    ) {
        let places = leaves.enumerate().map(|(k, name)| (name, (self.records.len(), 3 * k)));
        self.places.extend(places);
        self.records.push(record);
        self.with.push(with);
    }

    /// Where a level stands.
    pub(super) fn place(&self, name: &str) -> Option<(usize, usize)> {
        self.places.get(name).copied()
    }

    pub(super) fn record(&self, at: usize) -> &Record<R> {
        &self.records[at]
    }

    /// What a pass has left, if that is there and was made with these numbers.
    pub(super) fn made_with(&self, pass: usize, with: &[f64]) -> Option<&Arc<Record<R>>> {
        let record = self.records.get(pass).filter(|record| !record.numbers.is_empty());
        record.filter(|_| self.with[pass] == with)
    }

    /// Whether a pass was made with these numbers, whatever became of what it left.
    pub(super) fn was_made_with(&self, pass: usize, with: &[f64]) -> bool {
        self.with.get(pass).is_some_and(|known| known == with)
    }

    /// The memory of a pass' record, where nobody else reads it.
    pub(super) fn take(&mut self, pass: usize) -> Option<Vec<R>> {
        let record = self.records.get_mut(pass)?;
        Some(std::mem::take(&mut Arc::get_mut(record)?.numbers)).filter(|memory| memory.capacity() > 0)
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
