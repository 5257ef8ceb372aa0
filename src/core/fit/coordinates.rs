//! The coordinates that solvers step in: an unknown's value, or its logarithm where the parameter
//! table says that its ratio is what matters.

use super::room::{Room, Sum};
use crate::engine::{Point, Unknown};
use crate::model::bounds::Bounds;
use crate::model::effects::Effects;
use crate::model::params::{Param, Scale};
use crate::model::shares;

/// The map between points and vectors of solver coordinates.
#[derive(Clone, Debug)]
pub struct Coordinates {
    unknowns: Vec<Unknown>,
    origin: Point,
    at_origin: Vec<f64>,
    /// Least and greatest value of each.
    bounds: Vec<(f64, f64)>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Unknowns that are shares of one whole, and what they may add up to.
    shares: Vec<(Vec<usize>, f64)>,
}

/// What bounds unknowns beside the table of parameters.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits<'a> {
    /// What scenes set ([`Unknown::bounds_within`]).
    pub bounds: &'a [Bounds],
    /// The effects whose shares of a whole count; all where it is not said.
    pub effects: Option<Effects>,
}

impl Coordinates {
    /// The coordinates of `unknowns`, within the table's bounds; everything else stays as it is at `origin`.
    #[must_use]
    pub fn new(unknowns: &[Unknown], origin: &Point) -> Self {
        Self::within(unknowns, origin, Limits::default())
    }

    /// The same within what a fit sets.
    #[must_use]
    pub fn within(unknowns: &[Unknown], origin: &Point, limits: Limits<'_>) -> Self {
        let bounds: Vec<(f64, f64)> = unknowns.iter().map(|u| u.bounds_within(limits.bounds)).collect();
        let bounded = || unknowns.iter().zip(&bounds);
        Self {
            unknowns: unknowns.to_vec(),
            origin: origin.clone(),
            at_origin: unknowns.iter().map(|u| inward(u, u.get(origin))).collect(),
            lower: bounded().map(|(u, (lower, _))| inward(u, *lower)).collect(),
            upper: bounded().map(|(u, (_, upper))| inward(u, *upper)).collect(),
            shares: shares_of(unknowns, origin, limits.effects),
            bounds,
        }
    }

    /// Least and greatest value of each unknown.
    #[must_use]
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// The unknowns, in order.
    #[must_use]
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// The coordinates of the origin.
    #[must_use]
    pub fn origin(&self) -> &[f64] {
        &self.at_origin
    }

    /// Least allowed coordinates.
    #[must_use]
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Greatest allowed coordinates.
    #[must_use]
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// The point at these coordinates. Bounds and the origin come back to the bit.
    #[must_use]
    pub fn point(&self, at: &[f64]) -> Point {
        let mut point = self.origin.clone();
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let (low, high) = self.bounds[i];
            if at[i] <= self.lower[i] {
                unknown.set(&mut point, low);
            } else if at[i] >= self.upper[i] {
                unknown.set(&mut point, high);
            } else if at[i] != self.at_origin[i] {
                unknown.set(&mut point, outward(unknown, at[i]).clamp(low, high));
            }
        }
        point
    }

    /// The shares of one whole that add up to all that they may at these coordinates: each whole's unknowns.
    pub fn full(&self, at: &[f64]) -> impl Iterator<Item = &[usize]> {
        let full = |(of, most): &&(Vec<usize>, f64)| total(of, at) >= most - FULL;
        self.shares.iter().filter(full).map(|(of, _)| of.as_slice())
    }

    /// Shares that add up to more than they may, what they are above their least values lowered alike; the others as they
    /// are.
    pub(super) fn share_out(&self, at: &mut [f64]) {
        for whole in &self.shares {
            self.lower_shares(whole, at);
        }
    }

    /// The derivative of a loss by coordinates before [`share_out`](Self::share_out), from that by those after it.
    pub(super) fn share_out_pulled_back(&self, at: &[f64], gradient: &mut [f64]) {
        let mut after = at.to_vec();
        let lowered: Vec<(Vec<f64>, f64)> = self
            .shares
            .iter()
            .map(|whole| {
                let above = whole.0.iter().map(|&i| after[i] - self.lower[i]).collect();
                (above, self.lower_shares(whole, &mut after))
            })
            .collect();
        for ((of, _), (above, share)) in
            self.shares.iter().zip(lowered).rev().filter(|(_, (_, share))| *share < 1.0)
        {
            let along: f64 = of.iter().zip(&above).map(|(&i, x)| gradient[i] * x).sum();
            let along = along / above.iter().sum::<f64>();
            of.iter().for_each(|&i| gradient[i] = share * (gradient[i] - along));
        }
    }

    /// Lower the shares of one whole where they are more than it; what is left of what is above their least values.
    fn lower_shares(&self, (of, most): &(Vec<usize>, f64), at: &mut [f64]) -> f64 {
        let (sum, least) = (total(of, at), total(of, &self.lower));
        if sum <= *most {
            return 1.0;
        }
        let share = (most - least) / (sum - least);
        of.iter().for_each(|&i| at[i] = self.lower[i] + share * (at[i] - self.lower[i]));
        share
    }

    /// `at + step`, within the bounds, and on a bound to the bit where the step reaches it.
    #[must_use]
    pub fn moved(&self, at: &[f64], step: &[f64]) -> Vec<f64> {
        let mut step = step.to_vec();
        if !self.shares.is_empty() {
            let room = self.room(at);
            step.iter_mut().enumerate().for_each(|(i, d)| *d = d.clamp(room.down[i], room.up[i]));
            room.cut(&mut step);
        }
        (0..at.len())
            .map(|i| match step[i] {
                d if d <= self.lower[i] - at[i] => self.lower[i],
                d if d >= self.upper[i] - at[i] => self.upper[i],
                d => at[i] + d,
            })
            .collect()
    }

    /// How far a step from `at` may go.
    #[must_use]
    pub fn room(&self, at: &[f64]) -> Room {
        let to = |bounds: &[f64]| bounds.iter().zip(at).map(|(b, u)| b - u).collect();
        let sum =
            |(of, most): &(Vec<usize>, f64)| Sum { of: of.clone(), room: (most - total(of, at)).max(0.0) };
        Room { down: to(&self.lower), up: to(&self.upper), sums: self.shares.iter().map(sum).collect() }
    }

    /// The derivative of unknown `i`'s value with respect to its coordinate.
    #[must_use]
    pub fn slope(&self, i: usize, at: f64) -> f64 {
        if is_log(&self.unknowns[i]) { outward(&self.unknowns[i], at) } else { 1.0 }
    }

    /// The size that a change of coordinate `i` is compared with: the coordinate's own, but no less
    /// than what is natural (a hundredth of a weight, one unit of a logarithm, one degree).
    #[must_use]
    pub fn size(&self, i: usize, at: f64) -> f64 {
        match self.unknowns[i] {
            u if is_log(&u) => 1.0,
            u if is_angle(&u) => at.abs().max(1.0),
            _ => at.abs().max(0.01),
        }
    }
}

/// Whether a solver steps through this unknown by its logarithm.
#[must_use]
pub fn is_log(unknown: &Unknown) -> bool {
    unknown.column().is_some_and(|column| column.param.info().scale == Scale::Log)
}

/// Whether it is an angle.
pub(super) fn is_angle(unknown: &Unknown) -> bool {
    unknown.column().is_some_and(|column| column.param.info().unit == "degrees")
}

/// Sums this near to what they may be are full: what solvers leave by rounding.
const FULL: f64 = 1e-9;

fn total(of: &[usize], at: &[f64]) -> f64 {
    of.iter().map(|&i| at[i]).sum()
}

/// The unknowns of each whole's channels, and what those that are held leave them: no less than they have at the start.
fn shares_of(unknowns: &[Unknown], origin: &Point, effects: Option<Effects>) -> Vec<(Vec<usize>, f64)> {
    let mut found: Vec<(Vec<usize>, f64)> = Vec::new();
    for (_, shares) in shares::wholes(effects) {
        for channel in 0..3 {
            let moves = |param: Param, unknown: &Unknown| {
                let column = unknown.column();
                column.is_some_and(|column| column.param == param && column.channels.includes(channel))
            };
            let of = |param: Param| (0..unknowns.len()).filter(move |&i| moves(param, &unknowns[i]));
            let free: Vec<usize> = shares.iter().flat_map(|&share| of(share)).collect();
            let is_held = |share: &&Param| of(**share).next().is_none();
            let held: f64 =
                shares.iter().filter(is_held).map(|&share| origin.params.rgb(share)[channel]).sum();
            let start: f64 = free.iter().map(|&i| unknowns[i].get(origin)).sum();
            // Channels that are tied make one sum.
            let most = (1.0 - held).max(start);
            match found.iter_mut().find(|(other, _)| *other == free) {
                Some((_, least)) => *least = least.min(most).max(start),
                None if !free.is_empty() => found.push((free, most)),
                None => {}
            }
        }
    }
    found
}

fn inward(unknown: &Unknown, value: f64) -> f64 {
    if is_log(unknown) { value.ln() } else { value }
}

fn outward(unknown: &Unknown, at: f64) -> f64 {
    if is_log(unknown) { at.exp() } else { at }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::Form;
    use crate::model::params::{Channels, Column, Params};
    use crate::shader::term::library;

    /// Two weights that are tied over the channels and a third of red alone: two wholes that overlap; one weight is never
    /// below a tenth.
    fn overlapping() -> Coordinates {
        library::register_all();
        let weight = |k: usize| Param::from_name(&format!("diffusion_weight_{k}")).unwrap();
        let column = |k, channels| Unknown::Param(Column { param: weight(k), channels });
        let unknowns = [column(1, Channels::Tied), column(2, Channels::Tied), column(3, Channels::One(0))];
        let mut params = Params::defaults(Form::Corrected);
        (1..4).for_each(|k| params.set(weight(k), 0.2));
        let mut bounds = Bounds::default();
        bounds.set(weight(1), [0.1, 1.0]);
        let limits = Limits { bounds: &[bounds], effects: None };
        Coordinates::within(&unknowns, &Point { params, gains: vec![] }, limits)
    }

    #[test]
    fn shares_keep_to_every_whole_and_to_their_bounds() {
        let coordinates = overlapping();
        for at in [[0.2, 0.3, 0.4], [0.9, 0.1, 0.8], [0.1, 1.0, 1.0], [1.0, 1.0, 0.0]] {
            let mut shared = at;
            coordinates.share_out(&mut shared);
            let [a, b, c] = shared;
            // Green and blue hold 0.2; a few roundings.
            assert!(a + b <= 0.8 + 1e-15 && a + b + c <= 1.0 + 1e-15 && a >= 0.1, "{at:?}: {shared:?}");
            assert_eq!(shared == at, at == [0.2, 0.3, 0.4], "{at:?}");
        }
    }

    #[test]
    fn the_slope_through_shares_is_that_of_differences() {
        let coordinates = overlapping();
        let loss = |at: [f64; 3]| {
            let mut shared = at;
            coordinates.share_out(&mut shared);
            shared[0] * shared[0] + 2.0 * shared[1] - shared[1] * shared[2]
        };
        // None is full, the first whole, the second, both.
        for at in [[0.2, 0.3, 0.4], [0.3, 0.3, 0.9], [0.6, 0.5, 0.05], [0.7, 0.9, 0.8]] {
            let mut shared = at;
            coordinates.share_out(&mut shared);
            let mut slope = [2.0 * shared[0], 2.0 - shared[2], -shared[1]];
            coordinates.share_out_pulled_back(&at, &mut slope);
            for i in 0..3 {
                let moved = |h: f64| {
                    let mut moved = at;
                    moved[i] += h;
                    loss(moved)
                };
                // Central differences: h^2 of truncation, and 1e-16 / h of rounding.
                let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slope[i] - difference).abs() < 1e-8, "{at:?}, {i}: {} {difference}", slope[i]);
            }
        }
    }
}
