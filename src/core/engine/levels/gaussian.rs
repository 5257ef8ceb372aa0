//! One direction of a Gaussian blur of several levels at once: which texels count, and what each weighs, is found once for
//! a level and for how it moves along every seed.
//!
//! `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have the same of one level.

use std::borrow::Cow;
use std::f64::consts::LOG2_E;

use super::records::{Made, Record};
use super::{Number, Texel};
use crate::program::levels::GaussianOf;
use crate::samples::Atlas;
use crate::shader::atlas::Axis;

/// Numbers that are weighed at once.
const WIDE: usize = 16;

/// What is blurred: texels' numbers side by side, in the order of the leaves.
pub(super) struct Sources<'a, R: Number> {
    record: Cow<'a, [R]>,
    stride: usize,
    /// How many leaves have a source; those come first.
    count: usize,
}

/// The order of a pass' columns in which those with a source come first, as these stand in their record.
pub(super) fn ordered(of: &GaussianOf, place: impl Fn(&str) -> Option<(usize, usize)>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..of.columns.len()).collect();
    let key = |&column: &usize| {
        let at = of.columns[column].source.as_deref().and_then(&place);
        // The level itself stays first.
        (column > 0, at.is_none(), at)
    };
    order.sort_by_key(key);
    order
}

impl<'a, R: Number> Sources<'a, R> {
    /// Of the columns in their order.
    pub(super) fn new(of: &GaussianOf, order: &[usize], made: &'a Made<R>, atlas: &Atlas) -> Self {
        let places: Vec<(usize, usize)> =
            order.iter().map_while(|&column| made.place(of.columns[column].source.as_deref()?)).collect();
        let count = places.len();
        let Some(&(first, _)) = places.first() else {
            return Self { record: Vec::new().into(), stride: 0, count: 0 };
        };
        let record = made.record(first);
        let in_order = places.iter().enumerate().all(|(k, &place)| place == (first, 3 * k));
        // As they stand, where nothing stands between them.
        if in_order && atlas.margins().is_empty() {
            return Self { record: record.numbers.as_slice().into(), stride: record.stride, count };
        }
        let mut copied = Record::new(count, atlas.covered());
        for (texel, numbers) in copied.numbers.chunks_mut(copied.stride).enumerate() {
            for (k, &(record, offset)) in places.iter().enumerate() {
                numbers[3 * k..3 * k + 3].copy_from_slice(&made.record(record).at(texel, offset));
            }
        }
        copied.extend(atlas.margins().shares());
        Self { stride: copied.stride, record: copied.numbers.into(), count }
    }

    #[inline(always)]
    fn at(&self, texel: usize) -> &[R] {
        &self.record[texel * self.stride..(texel + 1) * self.stride]
    }
}

/// A texel that counts: its place among those that are covered, what it weighs, and how that moves as the deviation does.
#[derive(Clone, Copy)]
pub(super) struct Weighed<R> {
    place: u32,
    weight: R,
    slope: R,
}

/// A pass at work.
pub(super) struct Gaussian<'a, R: Number> {
    pub(super) of: &'a GaussianOf,
    pub(super) atlas: &'a Atlas,
    pub(super) sources: &'a Sources<'a, R>,
    /// The pass' columns, in the order in which the sources stand.
    pub(super) order: &'a [usize],
}

impl<R: Number> Gaussian<'_, R> {
    /// What the pass leaves of a texel, into its record. `number` gives the deviation, and then how it moves; `near` is
    /// memory to work in.
    #[inline(always)]
    pub(super) fn blur(
        &self,
        here: usize,
        number: impl Fn(usize) -> R,
        near: &mut Vec<Weighed<R>>,
        leaves: &mut [R],
    ) {
        let zero = R::from(0.0);
        let moves = self.of.columns.iter().any(|column| column.moved.is_some());
        self.weigh(here, number(0), moves, near);
        let own = self.sources.at(here);
        let (mut weights, mut slopes) = (zero, zero);
        // Of the level itself, by how the weights move.
        let mut change: Texel<R> = [zero; 3];
        for texel in near.iter() {
            weights = weights + texel.weight;
            if moves {
                let value = self.sources.at(texel.place as usize);
                slopes = slopes + texel.slope;
                (0..3).for_each(|c| change[c] = change[c] + texel.slope * (value[c] - own[c]));
            }
        }
        let weighs = zero.lt(weights);
        let share = R::from(1.0) / if weighs { weights } else { R::from(1.0) };
        let mut means = [zero; WIDE];
        for first in (0..3 * self.sources.count).step_by(WIDE) {
            let width = WIDE.min(self.sources.stride - first);
            if width == WIDE {
                self.mean::<WIDE>(first, near, own, share, &mut means);
            } else {
                for four in (0..width).step_by(4) {
                    let mut mean = [zero; 4];
                    self.mean::<4>(first + four, near, own, share, &mut mean);
                    means[four..four + 4].copy_from_slice(&mean);
                }
            }
            let width = width.min(3 * self.sources.count - first);
            for (k, mean) in means[..width].iter().enumerate() {
                let (column, c) = ((first + k) / 3, (first + k) % 3);
                leaves[3 * self.order[column] + c] = *mean;
            }
        }
        if !moves || !weighs {
            return;
        }
        let value = [0, 1, 2].map(|c| leaves[c] - own[c]);
        let by_deviation: Texel<R> = std::array::from_fn(|c| (change[c] - slopes * value[c]) * share);
        for (column, leaf) in self.of.columns.iter().zip(leaves.chunks_mut(3)) {
            let Some(moved) = column.moved else { continue };
            let moved = number(1 + moved);
            (0..3).for_each(|c| leaf[c] = leaf[c] + moved * by_deviation[c]);
        }
    }

    /// Weighted means of `N` numbers from `first` on, of differences to the texel itself: what is alike everywhere stays so
    /// to the bit.
    #[inline(always)]
    fn mean<const N: usize>(
        &self,
        first: usize,
        near: &[Weighed<R>],
        own: &[R],
        share: R,
        means: &mut [R; N],
    ) {
        let own: [R; N] = std::array::from_fn(|k| own[first + k]);
        let mut sum = [R::from(0.0); N];
        for texel in near {
            let numbers = &self.sources.at(texel.place as usize)[first..first + N];
            for k in 0..N {
                sum[k] = sum[k] + texel.weight * (numbers[k] - own[k]);
            }
        }
        for k in 0..N {
            means[k] = own[k] + sum[k] * share;
        }
    }

    /// The texels that count at one.
    #[inline(always)]
    fn weigh(&self, here: usize, deviation: R, moves: bool, near: &mut Vec<Weighed<R>>) {
        near.clear();
        let (zero, one) = (R::from(0.0), R::from(1.0));
        let [column, row] = self.atlas.texel(here).map(i64::from);
        let chart = self.atlas.chart(here);
        let mut add = |step: i64, weight: R, slope: R| {
            let place = match self.of.axis {
                Axis::U => self.atlas.place_of_chart(chart, column.saturating_add(step), row),
                Axis::V => self.atlas.place_of_chart(chart, column, row.saturating_add(step)),
            };
            if let Some(place) = place {
                near.push(Weighed { place: place as u32, weight, slope });
            }
        };
        // exp(-d^2 / 2).
        let weight = |deviations: R| (one.lit(-0.5 * LOG2_E) * deviations * deviations).exp2();
        if let Some(reach) = self.of.reach {
            for tap in -(reach as i64)..=reach as i64 {
                let step = one.lit(tap as f64);
                let (at, weighs) = (step * deviation, weight(step));
                let low = at.floor();
                let f = at - low;
                let first: f64 = low.into();
                let first = first as i64;
                add(first, weighs * (one - f), -(weighs * step));
                add(first.saturating_add(1), weighs * f, weighs * step);
            }
            return;
        }
        let wide: f64 = deviation.into();
        let reach = (6.0 * wide).ceil().min(f64::from(self.atlas.size())) as i64;
        let narrow = if one.lit(1e-10).lt(deviation) { deviation } else { one.lit(1e-10) };
        for step in -reach..=reach {
            let deviations = one.lit(step as f64) / narrow;
            let weighs = weight(deviations);
            let slope = if moves { weighs * deviations * deviations / narrow } else { zero };
            add(step, weighs, slope);
        }
    }
}
