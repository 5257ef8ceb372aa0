//! One direction of a blur at a texel, as `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have it.

use std::f64::consts::LOG2_E;

use super::{Number, Texel};
use crate::program::levels::{BlurOf, Taps};
use crate::samples::Atlas;
use crate::shader::atlas::Axis;

/// A level that is blurred; where the kernel moves, how the level does, or that it stays.
type Source<'a, R> = (&'a [Texel<R>], Option<Option<&'a [Texel<R>]>>);

/// The blurred value of the texel at a place, or how it moves where the kernel does. `number` gives what the kernel
/// yields, tap by tap: where it lies and what it weighs, then (where it moves) how both do.
pub(super) fn blurred<R: Number>(
    blur: &BlurOf,
    atlas: &Atlas,
    here: usize,
    (source, moving): Source<'_, R>,
    number: impl Fn(usize) -> R,
) -> Texel<R> {
    let (zero, one) = (R::from(0.0), R::from(1.0));
    let [column, row] = atlas.texel(here).map(i64::from);
    let (mut sum, mut weights) = ([zero; 3], zero);
    // How both move.
    let (mut change, mut change_of_weights) = ([zero; 3], zero);
    let chart = atlas.chart(here);
    let kernel = Kernel::new(blur.kernel, moving.is_some(), atlas.size(), number);
    for tap in -kernel.reach..=kernel.reach {
        let Tap { at, weighs, slope, slope_of_weight } = kernel.tap(tap);
        let low = at.floor();
        let f = at - low;
        let first: f64 = low.into();
        for (side, share) in [(0, one - f), (1, f)] {
            let step = (first as i64).saturating_add(side);
            let near = match blur.axis {
                Axis::U => atlas.place(column.saturating_add(step), row),
                Axis::V => atlas.place(column, row.saturating_add(step)),
            };
            let Some(near) = near.filter(|&near| atlas.chart(near) == chart) else { continue };
            let weight = weighs * share;
            add(&mut sum, weight, &source[near], &source[here]);
            weights = weights + weight;
            if let Some(moved) = moving {
                let along = if side == 1 { slope } else { -slope };
                let moves = slope_of_weight * share + weighs * along;
                add(&mut change, moves, &source[near], &source[here]);
                change_of_weights = change_of_weights + moves;
                if let Some(moved) = moved {
                    add(&mut change, weight, &moved[near], &moved[here]);
                }
            }
        }
    }
    let weighs = zero.lt(weights);
    let own = match moving {
        None => source[here],
        Some(moved) => moved.map_or([zero; 3], |moved| moved[here]),
    };
    if !weighs {
        return own;
    }
    let off = |c: usize| match moving {
        None => sum[c] / weights,
        Some(_) => (change[c] - change_of_weights * sum[c] / weights) / weights,
    };
    std::array::from_fn(|c| own[c] + off(c))
}

/// One place that counts: how many texels away, and its weight; and how both move.
struct Tap<R> {
    at: R,
    weighs: R,
    slope: R,
    slope_of_weight: R,
}

/// A kernel at a texel.
struct Kernel<F> {
    taps: Taps,
    moves: bool,
    /// Taps to either side.
    reach: i64,
    number: F,
}

impl<R: Number, F: Fn(usize) -> R> Kernel<F> {
    fn new(taps: Taps, moves: bool, size: u32, number: F) -> Self {
        let reach = match taps {
            Taps::Given(reach) | Taps::Gaussian(reach) => reach as i64,
            Taps::WholeGaussian => {
                let deviation: f64 = number(0).into();
                (6.0 * deviation).ceil().min(f64::from(size)) as i64
            }
        };
        Self { taps, moves, reach, number }
    }

    fn tap(&self, tap: i64) -> Tap<R> {
        let (zero, one) = (R::from(0.0), R::from(1.0));
        let number = |k: usize| if self.moves || k < 2 { (self.number)(k) } else { zero };
        let step = one.lit(tap as f64);
        // exp(-d^2 / 2).
        let weight = |deviations: R| (one.lit(-0.5 * LOG2_E) * deviations * deviations).exp2();
        match self.taps {
            Taps::Given(reach) => {
                let first = if self.moves { 4 } else { 2 } * (tap + reach as i64) as usize;
                let [at, weighs] = [0, 1].map(|k| (self.number)(first + k));
                let [slope, slope_of_weight] =
                    [2, 3].map(|k| if self.moves { (self.number)(first + k) } else { zero });
                Tap { at, weighs, slope, slope_of_weight }
            }
            Taps::Gaussian(_) => {
                let slope = if self.moves { step * number(1) } else { zero };
                Tap { at: step * number(0), weighs: weight(step), slope, slope_of_weight: zero }
            }
            Taps::WholeGaussian => {
                let deviation = number(0);
                let narrow = one.lit(1e-10);
                let narrow = if narrow.lt(deviation) { deviation } else { narrow };
                let deviations = step / narrow;
                let weighs = weight(deviations);
                let moved = if self.moves { number(1) } else { zero };
                let slope_of_weight = weighs * deviations * deviations * moved / narrow;
                Tap { at: step, weighs, slope: zero, slope_of_weight }
            }
        }
    }
}

/// Add how a texel differs from the one that is blurred: what is alike everywhere stays so to the bit.
fn add<R: Number>(sum: &mut Texel<R>, weight: R, texel: &Texel<R>, own: &Texel<R>) {
    (0..3).for_each(|c| sum[c] = sum[c] + weight * (texel[c] - own[c]));
}
