//! One direction of a Gaussian blur of several levels at once: which texels count, and what each weighs, is found once for
//! a level and for how it moves along every seed.
//!
//! `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have the same of one level. What is summed up are differences to the texel
//! itself: what is alike everywhere stays so to the bit.

use std::borrow::Cow;
use std::f64::consts::LOG2_E;

use super::records::{Made, Record, sixteen};
use super::taps::Taps;
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
        // How the level itself moves as the deviation does.
        let mut slopes = [[R::from(0.0); 3]; LANES];
        let of = (first, numbers[0]);
        match self.of.reach {
            Some(1) => self.by_taps::<S, 1>(simd, of, (leaves, stride), &mut slopes),
            Some(2) => self.by_taps::<S, 2>(simd, of, (leaves, stride), &mut slopes),
            Some(3) => self.by_taps::<S, 3>(simd, of, (leaves, stride), &mut slopes),
            Some(_) => self.by_taps::<S, 4>(simd, of, (leaves, stride), &mut slopes),
            None => {
                let deviations = R::array::<S>(numbers[0]);
                for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                    slopes[lane] = self.by_steps(first + lane, deviations[lane], leaves);
                }
            }
        }
        for (k, moved) in self.moved.iter().enumerate() {
            let Some(moved) = *moved else { continue };
            let moved = R::array::<S>(numbers[moved]);
            for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                for c in 0..3 {
                    leaves[3 * k + c] = leaves[3 * k + c] + moved[lane] * slopes[lane][c];
                }
            }
        }
    }

    /// Blur by `REACH` taps to either side that lie a deviation apart.
    #[inline(always)]
    fn by_taps<S: Simd, const REACH: usize>(
        &self,
        simd: S,
        (first, deviations): (usize, R::Sixteen<S>),
        (leaves, stride): (&mut [R], usize),
        slopes: &mut [Texel<R>; LANES],
    ) {
        let zero = R::splat(simd, R::from(0.0));
        let taps = Taps::<R, REACH>::new::<S>(simd, deviations);
        let Sources { stride: width, count, .. } = *self.sources;
        let record = &*self.sources.record;
        for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
            let here = first + lane;
            let near = taps.near(self.atlas, self.of.axis, here, lane);
            let share = R::splat(simd, near.share);
            for from in (0..3 * count).step_by(LANES) {
                let own = R::load(simd, sixteen(record, here * width + from));
                let (mut sum, mut change) = (zero, zero);
                for k in 0..REACH {
                    let [a, b, c, d] = near.texels[k];
                    let a = R::load(simd, sixteen(record, a as usize * width + from));
                    let b = R::load(simd, sixteen(record, b as usize * width + from));
                    let c = R::load(simd, sixteen(record, c as usize * width + from));
                    let d = R::load(simd, sixteen(record, d as usize * width + from));
                    let [weight, slope] = taps.weight(k);
                    let [before, after] = near.shares[k];
                    let (down, up) = (b - a, d - c);
                    let off = R::splat(simd, before).mul_add(down, (a - own) + (c - own));
                    let off = R::splat(simd, after).mul_add(up, off);
                    sum = R::splat(simd, weight).mul_add(off, sum);
                    change = R::splat(simd, slope).mul_add(up - down, change);
                }
                let off = sum * share;
                put(&R::array::<S>(own + off), &mut leaves[from..]);
                // The level itself stands first.
                if from == 0 {
                    let change = (change - R::splat(simd, near.slopes) * off) * share;
                    let change = R::array::<S>(change);
                    slopes[lane] = [change[0], change[1], change[2]];
                }
            }
            self.clear(leaves);
        }
    }

    /// Blur by all texels within six deviations; how the level itself moves as that does.
    #[inline(always)]
    fn by_steps(&self, here: usize, deviation: R, leaves: &mut [R]) -> Texel<R> {
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
            let slope = weight * deviations * deviations / narrow;
            slopes = slopes + slope;
            let change = change.iter_mut().zip(near.iter().zip(own));
            change.for_each(|(sum, (&value, &own))| *sum = *sum + slope * (value - own));
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
    if let Some(room) = room.first_chunk_mut() {
        *room = *numbers;
        return;
    }
    let (numbers, _) = numbers.as_chunks::<4>();
    let (room, _) = room.as_chunks_mut::<4>();
    for (room, numbers) in room.iter_mut().zip(numbers) {
        *room = *numbers;
    }
}
