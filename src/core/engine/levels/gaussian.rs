//! One direction of a Gaussian blur of several levels at once: which texels count, and what each weighs, is found once for
//! a level and for how it moves along every seed.
//!
//! `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have the same of one level. What is summed up are differences to the texel
//! itself: what is alike everywhere stays so to the bit.

use std::borrow::Cow;
use std::f64::consts::LOG2_E;

use super::records::{Made, Record};
use super::run::Yielded;
use super::taps::{Taps, weight};
use super::wide::Wide;
use super::{Number, Texel};
use crate::program::levels::GaussianOf;
use crate::samples::along::Along;
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
    along: Along<'a>,
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
        Self { of, along: atlas.along(of.axis), sources, moved }
    }

    /// What the pass leaves of up to sixteen texels from `first` on, `stride` numbers each. `yielded` are their deviations,
    /// and then how these move.
    #[inline(always)]
    pub(super) fn blur<S: Simd>(
        &self,
        simd: S,
        first: usize,
        yielded: &Yielded<'_, R, S>,
        (leaves, stride): (&mut [R], usize),
    ) {
        // How the level itself moves as the deviation does.
        let mut slopes = [[R::from(0.0); 3]; LANES];
        let of = (first, yielded.number(0));
        match self.of.reach {
            Some(1) => self.by_taps::<S, 1>(simd, of, (leaves, stride), &mut slopes),
            Some(2) => self.by_taps::<S, 2>(simd, of, (leaves, stride), &mut slopes),
            Some(3) => self.by_taps::<S, 3>(simd, of, (leaves, stride), &mut slopes),
            Some(_) => self.by_taps::<S, 4>(simd, of, (leaves, stride), &mut slopes),
            None => {
                let deviations = R::array::<S>(yielded.number(0));
                for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                    slopes[lane] = self.by_steps(first + lane, deviations[lane], leaves);
                }
            }
        }
        for (k, moved) in self.moved.iter().enumerate() {
            let Some(moved) = *moved else { continue };
            let moved = R::array::<S>(yielded.number(moved));
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
        let of = self.along.sixteen(first);
        let taps = Taps::<R, REACH>::new::<S>(simd, (self.along, of), deviations);
        let numbers = 3 * self.sources.count;
        let moves = self.moved.iter().any(Option::is_some);
        // What is written beyond a texel's own numbers is written over: texels are in their order.
        if numbers <= R::Four::<S>::COUNT {
            for (lane, slope) in slopes.iter_mut().enumerate().take(leaves.len() / stride) {
                let slope = moves.then_some(slope);
                let at = (of.places[lane] as usize, lane, 0);
                self.weighed::<S, R::Four<S>, REACH>(simd, &taps, at, &mut leaves[lane * stride..], slope);
                self.clear(&mut leaves[lane * stride..(lane + 1) * stride]);
            }
            return;
        }
        for (lane, slope) in slopes.iter_mut().enumerate().take(leaves.len() / stride) {
            let at = |from| (of.places[lane] as usize, lane, from);
            let first = &mut leaves[lane * stride..];
            // The level itself stands first.
            self.weighed::<S, R::Sixteen<S>, REACH>(simd, &taps, at(0), first, moves.then_some(slope));
            for from in (LANES..numbers).step_by(LANES) {
                let next = &mut leaves[lane * stride + from..];
                if numbers - from <= R::Four::<S>::COUNT {
                    self.weighed::<S, R::Four<S>, REACH>(simd, &taps, at(from), next, None);
                } else {
                    self.weighed::<S, R::Sixteen<S>, REACH>(simd, &taps, at(from), next, None);
                }
            }
            self.clear(&mut leaves[lane * stride..(lane + 1) * stride]);
        }
    }

    /// Several numbers of a texel, weighed by its taps, and in `slopes` how the first three move as the deviation does.
    #[inline(always)]
    fn weighed<S: Simd, W: Wide<R, S>, const REACH: usize>(
        &self,
        simd: S,
        taps: &Taps<R, REACH>,
        (here, lane, from): (usize, usize, usize),
        leaves: &mut [R],
        slopes: Option<&mut Texel<R>>,
    ) {
        let record = &self.sources.record[from..];
        let stride = self.sources.stride;
        let own = W::load(simd, record, here * stride);
        let (mut sum, mut change) = (W::splat(simd, R::from(0.0)), W::splat(simd, R::from(0.0)));
        for k in 0..REACH {
            let near = |i: usize| W::load(simd, record, taps.texels[k][i][lane] as usize * stride);
            let share = |side: usize| W::splat(simd, taps.shares[k][side][lane]);
            let [a, b, c, d] = [near(0), near(1), near(2), near(3)];
            let [weight, slope] = weight(k);
            let (down, up) = (b - a, d - c);
            let off = share(0).times_plus(down, (a - own) + (c - own));
            let off = share(1).times_plus(up, off);
            sum = W::splat(simd, weight).times_plus(off, sum);
            change = W::splat(simd, slope).times_plus(up - down, change);
        }
        let share = W::splat(simd, taps.share[lane]);
        let off = sum * share;
        (own + off).store(leaves);
        if let Some(slopes) = slopes {
            *slopes = ((change - W::splat(simd, taps.slopes[lane]) * off) * share).three();
        }
    }

    /// Blur by all texels within six deviations; how the level itself moves as that does.
    #[inline(always)]
    fn by_steps(&self, here: usize, deviation: R, leaves: &mut [R]) -> Texel<R> {
        let (zero, one) = (R::from(0.0), R::from(1.0));
        let own = self.sources.texel(here);
        let wide: f64 = deviation.into();
        let reach = (6.0 * wide).ceil().min(f64::from(self.along.size())) as i32;
        let narrow = if one.lit(1e-10).lt(deviation) { deviation } else { one.lit(1e-10) };
        let (mut weights, mut slopes, mut change) = (zero, zero, [zero; 3]);
        let numbers = 3 * self.sources.count;
        leaves.fill(zero);
        for step in -reach..=reach {
            let Some(place) = self.along.place(here as u32, step) else { continue };
            let deviations = one.lit(f64::from(step)) / narrow;
            // exp(-d^2 / 2).
            let weight = (one.lit(-0.5 * LOG2_E) * deviations * deviations).exp2();
            let near = self.sources.texel(place as usize);
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
