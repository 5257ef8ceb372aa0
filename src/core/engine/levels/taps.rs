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

/// Taps to either side that there may be ([`crate::model::diffusion::Taps`]).
const MOST: usize = 4;

/// Where taps fall of sixteen texels: those before and those after each.
pub(super) struct Taps<R> {
    reach: usize,
    /// The first of the two texels, steps from the texel itself.
    steps: [[[i32; LANES]; 2]; MOST],
    /// What the second counts.
    shares: [[[R; LANES]; 2]; MOST],
    weights: [R; MOST],
}

/// Tap k and tap -k of a texel.
#[derive(Clone, Copy)]
pub(super) struct Tap<R> {
    /// The two texels about the tap before, and those about the one after; the texel itself in the place of what is not there.
    pub(super) texels: [u32; 4],
    /// What the second of each two counts.
    pub(super) shares: [R; 2],
    pub(super) weight: R,
    /// How that of the second moves as the deviation does, after the texel; before it by as much the other way.
    pub(super) slope: R,
}

/// What a texel's taps find.
pub(super) struct Near<R> {
    taps: [Tap<R>; MOST],
    reach: usize,
    /// One over the sum of the weights, 1 of the texel itself with them.
    pub(super) share: R,
    /// How the sum of the weights moves as the deviation does.
    pub(super) slopes: R,
}

impl<R> Near<R> {
    #[inline(always)]
    pub(super) fn taps(&self) -> &[Tap<R>] {
        &self.taps[..self.reach]
    }
}

impl<R: Number> Taps<R> {
    /// Of texels with these deviations.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, reach: usize, deviation: R::Sixteen<S>) -> Self {
        let reach = reach.min(MOST);
        let mut taps = Self {
            reach,
            steps: [[[0; LANES]; 2]; MOST],
            shares: [[[R::from(0.0); LANES]; 2]; MOST],
            weights: std::array::from_fn(weight),
        };
        for k in 0..reach {
            let tap = R::splat(simd, R::from(k as f32 + 1.0));
            for (side, at) in [-(tap * deviation), tap * deviation].into_iter().enumerate() {
                let low = at.floor();
                taps.shares[k][side] = R::array::<S>(at - low);
                taps.steps[k][side] = R::array::<S>(low).map(|step| {
                    let step: f64 = step.into();
                    step as i32
                });
            }
        }
        taps
    }

    /// What the taps of a texel find, `lane` of the sixteen.
    #[inline(always)]
    pub(super) fn near(&self, atlas: &Atlas, axis: Axis, here: usize, lane: usize) -> Near<R> {
        let one = R::from(1.0);
        let none =
            Tap { texels: [here as u32; 4], shares: [one; 2], weight: R::from(0.0), slope: R::from(0.0) };
        let mut near = Near { taps: [none; MOST], reach: self.reach, share: one, slopes: R::from(0.0) };
        let room = atlas.room(axis, here);
        let widest = self.reach.checked_sub(1).map_or(0, |last| self.steps[last][1][lane]);
        let within = widest < room;
        let mut weights = one;
        for k in 0..self.reach {
            let weight = self.weights[k];
            let tap = &mut near.taps[k];
            tap.weight = weight;
            tap.slope = weight * R::from(k as f32 + 1.0);
            let [before, after] = self.steps[k].map(|steps| steps[lane]);
            tap.shares = self.shares[k].map(|shares| shares[lane]);
            let steps = [before, before.saturating_add(1), after, after.saturating_add(1)];
            if within {
                tap.texels = steps.map(|step| atlas.place_within(axis, here, step));
                weights = weights + (weight + weight);
                continue;
            }
            let [b, d] = tap.shares;
            let counted = [one - b, b, one - d, d];
            let slopes = [tap.slope, -tap.slope, -tap.slope, tap.slope];
            for i in 0..4 {
                if let Some(texel) = atlas.place_along(axis, here, i64::from(steps[i])) {
                    tap.texels[i] = texel as u32;
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
fn weight<R: Number>(k: usize) -> R {
    let tap = k as f64 + 1.0;
    R::from(0.0).lit((-0.5 * tap * tap).exp())
}
