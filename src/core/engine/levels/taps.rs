//! Where the taps of a Gaussian fall, and what they find there.
//!
//! Tap k, and -k with it, lies k deviations from a texel and weighs exp(-k^2 / 2), shared linearly between the two texels
//! about its place. Where sixteen texels are far from their charts' borders all of these count, weights add up to the same number
//! and do not move; near them the ones that are not of the chart count nothing, and weights are added up one by one.

use super::Number;
use crate::model::real::Real;
use crate::samples::LANES;
use crate::samples::along::{Along, SixteenTexels};
use crate::simd::Simd;

/// What the taps of sixteen texels find, `REACH` to either side of each, tap by tap.
pub(super) struct Taps<R, const REACH: usize> {
    /// The two texels about the tap before, and those about the one after; the texel itself in the place of what is not there.
    pub(super) texels: [[[u32; LANES]; 4]; REACH],
    /// What the second of each two counts.
    pub(super) shares: [[[R; LANES]; 2]; REACH],
    /// One over the sum of the weights, 1 of the texel itself with them.
    pub(super) share: [R; LANES],
    /// How the sum of the weights moves as the deviation does.
    pub(super) slopes: [R; LANES],
}

/// Sixteen texels, and along what.
type Of<'a> = (Along<'a>, &'a SixteenTexels);

/// The first of each two texels, steps from the texel itself.
type Steps<const REACH: usize> = [[[i32; LANES]; 2]; REACH];

impl<R: Number, const REACH: usize> Taps<R, REACH> {
    /// Of sixteen texels with these deviations.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, of: Of<'_>, deviation: R::Sixteen<S>) -> Self {
        let nothing = [R::from(0.0); LANES];
        let (texels, shares) = ([[[0; LANES]; 4]; REACH], [[nothing; 2]; REACH]);
        let mut taps = Self { texels, shares, share: nothing, slopes: nothing };
        let mut steps = [[[0_i32; LANES]; 2]; REACH];
        for k in 0..REACH {
            let after = R::splat(simd, R::from(k as f32 + 1.0)) * deviation;
            let before = -after;
            let lows = [before.floor(), after.floor()];
            taps.shares[k] = [R::array::<S>(before - lows[0]), R::array::<S>(after - lows[1])];
            steps[k] = [R::whole::<S>(lows[0]), R::whole::<S>(lows[1])];
        }
        if of.0.have_room(of.1, &steps[REACH - 1][1]) {
            taps.find_all(of, &steps);
        } else {
            taps.find_some(of, &steps);
        }
        taps
    }

    /// Every tap finds something.
    #[inline(always)]
    fn find_all(&mut self, of: Of<'_>, steps: &Steps<REACH>) {
        let mut all = R::from(1.0);
        for k in 0..REACH {
            let [weight, _] = weight::<R>(k);
            all = all + (weight + weight);
            for i in 0..4 {
                self.texels[k][i] = of.0.within(of.1, &steps[k][i / 2], (i % 2) as i32);
            }
        }
        (self.share, self.slopes) = ([R::from(1.0) / all; LANES], [R::from(0.0); LANES]);
    }

    /// Some of them may find nothing.
    #[inline(always)]
    fn find_some(&mut self, of: Of<'_>, steps: &Steps<REACH>) {
        let (zero, one) = (R::from(0.0), R::from(1.0));
        let (mut weights, mut slopes) = ([one; LANES], [zero; LANES]);
        for k in 0..REACH {
            let [weight, slope] = weight::<R>(k);
            for i in 0..4 {
                let (side, second) = (i / 2, i % 2);
                let found;
                [self.texels[k][i], found] = of.0.near(of.1, &steps[k][side], second as i32);
                // The texel further off gains what the nearer one loses.
                let slope = if second == side { slope } else { -slope };
                for lane in 0..LANES {
                    let share = self.shares[k][side][lane];
                    let share = if second == 1 { share } else { one - share };
                    let there = found[lane] == 1;
                    weights[lane] = weights[lane] + if there { weight * share } else { zero };
                    slopes[lane] = slopes[lane] + if there { slope } else { zero };
                }
            }
        }
        for lane in 0..LANES {
            self.share[lane] = one / weights[lane];
        }
        self.slopes = slopes;
    }
}

/// What tap k + 1 weighs, and how much of that goes from one of its two texels to the other as the deviation grows.
#[inline(always)]
pub(super) fn weight<R: Number>(k: usize) -> [R; 2] {
    // exp(-1/2), exp(-2), exp(-9/2), exp(-8).
    const WEIGHTS: [f64; 4] = [
        0.606_530_659_712_633_4,
        0.135_335_283_236_612_7,
        0.011_108_996_538_242_306,
        0.000_335_462_627_902_511_84,
    ];
    let weight = R::from(0.0).lit(WEIGHTS[k]);
    [weight, weight * R::from(k as f32 + 1.0)]
}
