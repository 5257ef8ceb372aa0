//! Where the taps of a Gaussian fall, and what they find there.
//!
//! Tap k, and -k with it, lies k deviations from a texel and weighs exp(-k^2 / 2), shared linearly between the two texels
//! about its place. Far from a chart's border all of these count, weights add up to the same number and do not move; near it
//! the ones that are not of the chart count nothing.

use super::Number;
use crate::model::real::Real;
use crate::samples::{Atlas, LANES};
use crate::shader::atlas::Axis;
use crate::simd::Simd;

/// Where taps fall of sixteen texels, `REACH` to either side: those before each, and those after.
pub(super) struct Taps<R, const REACH: usize> {
    /// The first of the two texels, steps from the texel itself.
    steps: [[[i32; LANES]; 2]; REACH],
    /// What the second counts.
    shares: [[[R; LANES]; 2]; REACH],
    weights: [R; REACH],
}

/// What a texel's taps find, tap by tap.
pub(super) struct Near<R, const REACH: usize> {
    /// The two texels about the tap before, and those about the one after; the texel itself in the place of what is not there.
    pub(super) texels: [[u32; 4]; REACH],
    /// What the second of each two counts.
    pub(super) shares: [[R; 2]; REACH],
    /// One over the sum of the weights, 1 of the texel itself with them.
    pub(super) share: R,
    /// How the sum of the weights moves as the deviation does.
    pub(super) slopes: R,
}

impl<R: Number, const REACH: usize> Taps<R, REACH> {
    /// Of texels with these deviations.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, deviation: R::Sixteen<S>) -> Self {
        let mut taps = Self {
            steps: [[[0; LANES]; 2]; REACH],
            shares: [[[R::from(0.0); LANES]; 2]; REACH],
            weights: [R::from(0.0); REACH],
        };
        for k in 0..REACH {
            taps.weights[k] = weight(k);
            let after = R::splat(simd, R::from(k as f32 + 1.0)) * deviation;
            let before = -after;
            let lows = [before.floor(), after.floor()];
            for (side, off) in [before - lows[0], after - lows[1]].into_iter().enumerate() {
                taps.shares[k][side] = R::array::<S>(off);
                taps.steps[k][side] = R::whole::<S>(lows[side]);
            }
        }
        taps
    }

    /// What tap k + 1 weighs, and how much of that goes from one of its two texels to the other as the deviation grows.
    #[inline(always)]
    pub(super) fn weight(&self, k: usize) -> [R; 2] {
        [self.weights[k], self.weights[k] * R::from(k as f32 + 1.0)]
    }

    /// What the taps of a texel find, `lane` of the sixteen.
    #[inline(always)]
    pub(super) fn near(&self, atlas: &Atlas, axis: Axis, here: usize, lane: usize) -> Near<R, REACH> {
        let one = R::from(1.0);
        let mut near = Near {
            texels: [[here as u32; 4]; REACH],
            shares: [[one; 2]; REACH],
            share: one,
            slopes: R::from(0.0),
        };
        let within = self.steps[REACH - 1][1][lane] < atlas.room(axis, here);
        let mut weights = one;
        for k in 0..REACH {
            let [weight, slope] = self.weight(k);
            let [before, after] = [self.steps[k][0][lane], self.steps[k][1][lane]];
            let [b, d] = [self.shares[k][0][lane], self.shares[k][1][lane]];
            near.shares[k] = [b, d];
            if within {
                near.texels[k] = [
                    atlas.place_within(axis, here, before),
                    atlas.place_within(axis, here, before + 1),
                    atlas.place_within(axis, here, after),
                    atlas.place_within(axis, here, after + 1),
                ];
                weights = weights + (weight + weight);
                continue;
            }
            let steps = [before, before.saturating_add(1), after, after.saturating_add(1)];
            let counted = [one - b, b, one - d, d];
            let slopes = [slope, -slope, -slope, slope];
            for i in 0..4 {
                if let Some(texel) = atlas.place_along(axis, here, i64::from(steps[i])) {
                    near.texels[k][i] = texel as u32;
                    weights = weights + weight * counted[i];
                    near.slopes = near.slopes + slopes[i];
                }
            }
        }
        near.share = one / weights;
        near
    }
}

/// What tap k + 1 weighs.
#[inline(always)]
fn weight<R: Number>(k: usize) -> R {
    // exp(-1/2), exp(-2), exp(-9/2), exp(-8).
    const WEIGHTS: [f64; 4] = [
        0.606_530_659_712_633_4,
        0.135_335_283_236_612_7,
        0.011_108_996_538_242_306,
        0.000_335_462_627_902_511_84,
    ];
    R::from(0.0).lit(WEIGHTS[k])
}
