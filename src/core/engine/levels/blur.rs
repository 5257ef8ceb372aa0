//! One direction of a blur at a texel, as `shader/atlas/blur.wgsl` and `blur_tangent.wgsl` have it.

use super::{Number, Texel};
use crate::program::levels::BlurOf;
use crate::samples::Atlas;
use crate::shader::atlas::Axis;

/// A level that is blurred; where the kernel moves, how the level does, or that it stays.
type Source<'a, R> = (&'a [Texel<R>], Option<Option<&'a [Texel<R>]>>);

/// The blurred value of the texel at a place, or how it moves where the kernel does. `number` gives what the kernel
/// yields, tap by tap: where it lies and what it weighs, then (where it moves) how both do. Levels go on beyond the covered
/// texels with the atlas' [margins](Atlas::margins).
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
    let (chart, own_value) = (atlas.chart(here), source[here]);
    let width = if moving.is_some() { 4 } else { 2 };
    for tap in 0..=2 * blur.reach {
        let [at, weighs] = [0, 1].map(|k| number(width * tap + k));
        let [slope, slope_of_weight] =
            [2, 3].map(|k| if moving.is_some() { number(width * tap + k) } else { zero });
        let low = at.floor();
        let f = at - low;
        let first: f64 = low.into();
        for (side, share) in [(0, one - f), (1, f)] {
            let step = (first as i64).saturating_add(side);
            let near = match blur.axis {
                Axis::U => atlas.place_of_chart(chart, column.saturating_add(step), row),
                Axis::V => atlas.place_of_chart(chart, column, row.saturating_add(step)),
            };
            let Some(near) = near else { continue };
            let weight = weighs * share;
            add(&mut sum, weight, source[near], own_value);
            weights = weights + weight;
            if let Some(moved) = moving {
                let along = if side == 1 { slope } else { -slope };
                let moves = slope_of_weight * share + weighs * along;
                add(&mut change, moves, source[near], own_value);
                change_of_weights = change_of_weights + moves;
                if let Some(moved) = moved {
                    add(&mut change, weight, moved[near], moved[here]);
                }
            }
        }
    }
    let weighs = zero.lt(weights);
    let own = match moving {
        None => own_value,
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

/// Add how a texel differs from the one that is blurred: what is alike everywhere stays so to the bit.
fn add<R: Number>(sum: &mut Texel<R>, weight: R, texel: Texel<R>, own: Texel<R>) {
    (0..3).for_each(|c| sum[c] = sum[c] + weight * (texel[c] - own[c]));
}
