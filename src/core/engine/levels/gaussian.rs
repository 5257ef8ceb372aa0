//! One direction of a Gaussian blur of several levels at once: which texels count, and what each weighs, is found once for
//! a level and for how it moves along every seed.
//!
//! `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have the same of one level. What is summed up are differences to the texel
//! itself: what is alike everywhere stays so to the bit.

use std::borrow::Cow;
use std::f64::consts::LOG2_E;

use super::records::{Made, Record, sixteen};
use super::taps::{Near, Taps};
use super::{Number, Texel};
use crate::model::real::Real;
use crate::program::levels::GaussianOf;
use crate::samples::{Atlas, LANES};
use crate::simd::Simd;

/// What is blurred: texels' numbers side by side, in the order of the leaves.
pub(super) struct Sources<'a, R: Number> {
    record: Cow<'a, [R]>,
    stride: usize,
    /// How many leaves have a source; those come first.
    count: usize,
}

/// The order of a pass' columns in which those with a source come first, as these stand in their record. The pass leaves
/// them in this order.
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
            return Self { record: vec![R::from(0.0); LANES].into(), stride: 0, count: 0 };
        };
        let record = made.record(first);
        let in_order = places.iter().enumerate().all(|(k, &place)| place == (first, 3 * k));
        // As they stand, where nothing stands between them.
        if in_order && atlas.margins().is_empty() {
            return Self { record: record.numbers.as_slice().into(), stride: record.stride, count };
        }
        let mut copied = Record::new(count, atlas.covered());
        let stride = copied.stride;
        for (texel, numbers) in copied.of_texels().chunks_mut(stride).enumerate() {
            for (k, &(record, offset)) in places.iter().enumerate() {
                numbers[3 * k..3 * k + 3].copy_from_slice(&made.record(record).at(texel, offset));
            }
        }
        copied.extend(atlas.margins().shares());
        Self { stride, record: copied.numbers.into(), count }
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, texel: usize, from: usize) -> R::Sixteen<S> {
        R::load(simd, sixteen(&self.record, texel * self.stride + from))
    }

    /// A texel's numbers.
    #[inline(always)]
    fn texel(&self, texel: usize) -> &[R] {
        &self.record[texel * self.stride..(texel + 1) * self.stride]
    }
}

/// A pass at work.
pub(super) struct Gaussian<'a, R: Number> {
    pub(super) of: &'a GaussianOf,
    pub(super) atlas: &'a Atlas,
    pub(super) sources: &'a Sources<'a, R>,
    /// For each leaf in the order in which they stand, which of the steps' numbers is how the deviation moves along its seed.
    pub(super) moved: Vec<Option<usize>>,
}

impl<'a, R: Number> Gaussian<'a, R> {
    pub(super) fn new(
        of: &'a GaussianOf,
        order: &[usize],
        atlas: &'a Atlas,
        sources: &'a Sources<'a, R>,
    ) -> Self {
        let moved = order.iter().map(|&column| of.columns[column].moved.map(|moved| 1 + moved)).collect();
        Self { of, atlas, sources, moved }
    }

    /// What the pass leaves of up to sixteen texels from `first` on, `stride` numbers each. `numbers` are their deviations,
    /// and then how these move.
    #[inline(always)]
    pub(super) fn blur<S: Simd>(
        &self,
        simd: S,
        first: usize,
        numbers: &[R::Sixteen<S>],
        (leaves, stride): (&mut [R], usize),
    ) {
        let moves = self.moved.iter().any(Option::is_some);
        let deviations = R::array::<S>(numbers[0]);
        let taps = self.of.reach.map(|reach| Taps::new::<S>(simd, reach, numbers[0]));
        let mut by_deviation = [[R::from(0.0); 3]; LANES];
        for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
            let here = first + lane;
            by_deviation[lane] = match &taps {
                Some(taps) => {
                    let near = taps.near(self.atlas, self.of.axis, here, lane);
                    self.by_taps(simd, here, &near, moves, leaves)
                }
                None => self.by_steps(here, deviations[lane], moves, leaves),
            };
        }
        for (k, moved) in self.moved.iter().enumerate() {
            let Some(moved) = *moved else { continue };
            let moved = R::array::<S>(numbers[moved]);
            for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                let leaf = &mut leaves[3 * k..3 * k + 3];
                (0..3).for_each(|c| leaf[c] = leaf[c] + moved[lane] * by_deviation[lane][c]);
            }
        }
    }

    /// Blur by taps that lie a deviation apart; how the level itself moves as that does.
    #[inline(always)]
    fn by_taps<S: Simd>(
        &self,
        simd: S,
        here: usize,
        near: &Near<R>,
        moves: bool,
        leaves: &mut [R],
    ) -> Texel<R> {
        let numbers = 3 * self.sources.count;
        let mut by_deviation = [R::from(0.0); 3];
        let share = R::splat(simd, near.share);
        for from in (0..numbers).step_by(LANES) {
            let own = self.sources.load(simd, here, from);
            let (mut sum, mut change) = (R::splat(simd, R::from(0.0)), R::splat(simd, R::from(0.0)));
            for tap in near.taps() {
                let [a, b, c, d] = tap.texels.map(|texel| self.sources.load(simd, texel as usize, from));
                let [before, after] = tap.shares.map(|share| R::splat(simd, share));
                let weight = R::splat(simd, tap.weight);
                let (down, up) = (b - a, d - c);
                let off = after.mul_add(up, before.mul_add(down, (a - own) + (c - own)));
                sum = weight.mul_add(off, sum);
                if moves && from == 0 {
                    change = R::splat(simd, tap.slope).mul_add(up - down, change);
                }
            }
            let off = sum * share;
            if moves && from == 0 {
                let change = (change - R::splat(simd, near.slopes) * off) * share;
                let [x, y, z, ..] = R::array(change);
                by_deviation = [x, y, z];
            }
            put(&R::array(own + off), &mut leaves[from..]);
        }
        self.clear(leaves);
        by_deviation
    }

    /// Blur by all texels within six deviations; how the level itself moves as that does.
    #[inline(always)]
    fn by_steps(&self, here: usize, deviation: R, moves: bool, leaves: &mut [R]) -> Texel<R> {
        let (zero, one) = (R::from(0.0), R::from(1.0));
        let own = self.sources.texel(here);
        let wide: f64 = deviation.into();
        let reach = (6.0 * wide).ceil().min(f64::from(self.atlas.size())) as i64;
        let narrow = if one.lit(1e-10).lt(deviation) { deviation } else { one.lit(1e-10) };
        let (mut weights, mut slopes, mut change) = (zero, zero, [zero; 3]);
        let numbers = 3 * self.sources.count;
        leaves.fill(zero);
        for step in -reach..=reach {
            let Some(place) = self.atlas.place_along(self.of.axis, here, step) else { continue };
            let deviations = one.lit(step as f64) / narrow;
            // exp(-d^2 / 2).
            let weight = (one.lit(-0.5 * LOG2_E) * deviations * deviations).exp2();
            let near = self.sources.texel(place);
            weights = weights + weight;
            for k in 0..numbers {
                leaves[k] = leaves[k] + weight * (near[k] - own[k]);
            }
            if moves {
                let slope = weight * deviations * deviations / narrow;
                slopes = slopes + slope;
                let change = change.iter_mut().zip(near.iter().zip(own));
                change.for_each(|(sum, (&value, &own))| *sum = *sum + slope * (value - own));
            }
        }
        let weighs = zero.lt(weights);
        let share = one / if weighs { weights } else { one };
        let off = [0, 1, 2].map(|c| if c < numbers { leaves[c] * share } else { zero });
        for k in 0..numbers {
            leaves[k] = own[k] + leaves[k] * share;
        }
        std::array::from_fn(|c| if weighs { (change[c] - slopes * off[c]) * share } else { zero })
    }

    /// Clear the leaves without a source.
    #[inline(always)]
    fn clear(&self, leaves: &mut [R]) {
        if self.sources.count < self.moved.len() {
            leaves[3 * self.sources.count..].fill(R::from(0.0));
        }
    }
}

/// The first of sixteen numbers, as many as there is room for: a multiple of four.
#[inline(always)]
pub(super) fn put<R: Copy>(numbers: &[R; LANES], room: &mut [R]) {
    match room.len() {
        4 => room.copy_from_slice(&numbers[..4]),
        8 => room.copy_from_slice(&numbers[..8]),
        12 => room.copy_from_slice(&numbers[..12]),
        _ => room[..LANES].copy_from_slice(numbers),
    }
}
