//! Where the other starts of a multi-start fit begin.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::coordinates::{Coordinates, is_angle, is_log};
use crate::engine::Unknown;

/// Intervals whose ends have a greater ratio than this are no guide to where an answer may be.
const WIDEST_RATIO: f64 = 1e4;
/// How far from the given start positive unknowns without a guide are drawn.
const FACTOR: f64 = 4.0;

/// The coordinates of start `index`: 0 is the given one, the others are drawn from (`seed`,
/// `index`) alone, so that a start does not depend on how many there are.
#[must_use]
pub fn draw(coordinates: &Coordinates, seed: u64, index: u32) -> Vec<f64> {
    let given = coordinates.origin();
    if index == 0 {
        return given.to_vec();
    }
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..12].copy_from_slice(&index.to_le_bytes());
    let mut rng = StdRng::from_seed(key);
    let one = |((unknown, &bounds), &given): ((&Unknown, &(f64, f64)), &f64)| {
        draw_one(unknown, bounds, given, &mut rng)
    };
    let unknowns = coordinates.unknowns().iter().zip(coordinates.bounds());
    let drawn: Vec<f64> = unknowns.zip(given).map(one).collect();
    let bounds = coordinates.lower().iter().zip(coordinates.upper());
    let mut drawn: Vec<f64> =
        drawn.iter().zip(bounds).map(|(u, (lower, upper))| u.clamp(*lower, *upper)).collect();
    coordinates.share_out(&mut drawn);
    drawn
}

fn draw_one(unknown: &Unknown, (lower, upper): (f64, f64), given: f64, rng: &mut StdRng) -> f64 {
    if is_log(unknown) {
        rng.random_range(lower.ln()..upper.ln())
    } else if lower > 0.0 && upper / lower <= WIDEST_RATIO {
        // Exponents: any ratio is as likely.
        rng.random_range(lower.ln()..upper.ln()).exp()
    } else if lower.is_finite() && upper.is_finite() && lower <= 0.0 {
        rng.random_range(lower..upper)
    } else if is_angle(unknown) {
        given + rng.random_range(-180.0..180.0)
    } else if lower >= 0.0 {
        given.max(0.1) * rng.random_range(-FACTOR.ln()..FACTOR.ln()).exp()
    } else {
        given + given.abs().max(1.0) * rng.random_range(-1.0..1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Point;
    use crate::model::effects::Form;
    use crate::model::gain::Gain;
    use crate::model::params::{Channels, Column, Param, Params};

    #[test]
    fn shares_are_drawn_within_their_whole() {
        crate::shader::term::library::register_all();
        let weights = [1, 2, 3].map(|k| Param::from_name(&format!("diffusion_weight_{k}")).unwrap());
        let unknowns = weights.map(|weight| Unknown::Param(Column::tied(weight)));
        let mut origin = Point { params: Params::defaults(Form::Corrected), gains: vec![] };
        weights.into_iter().for_each(|weight| origin.params.set(weight, 0.2));
        let coordinates = Coordinates::new(&unknowns, &origin);
        let totals: Vec<f64> =
            (1..100).map(|index| draw(&coordinates, 3, index).iter().sum::<f64>()).collect();
        // Three of [0, 1] add up to 1.5 in the mean: most are drawn beyond the whole.
        assert!(totals.iter().all(|total| *total <= 1.0 + 1e-12), "{totals:?}");
        assert!(totals.iter().filter(|total| **total > 1.0 - 1e-12).count() > 50);
    }

    #[test]
    fn starts_are_within_bounds_differ_and_depend_on_seed_and_index_alone() {
        let mut unknowns: Vec<Unknown> = Param::all().map(|p| Unknown::Param(Column::tied(p))).collect();
        unknowns.push(Unknown::Gain(0, Channels::Tied));
        let origin = Point { params: Params::defaults(Form::Corrected), gains: vec![Gain::ONE] };
        let coordinates = Coordinates::new(&unknowns, &origin);
        assert_eq!(coordinates.point(&draw(&coordinates, 9, 0)), origin);
        for index in 1..100 {
            let at = draw(&coordinates, 9, index);
            assert_eq!(at, draw(&coordinates, 9, index));
            assert_ne!(at, draw(&coordinates, 10, index));
            assert_ne!(at, draw(&coordinates, 9, index + 1));
            let point = coordinates.point(&at);
            for unknown in &unknowns {
                let (lower, upper) = unknown.bounds();
                assert!((lower..=upper).contains(&unknown.get(&point)), "{}", unknown.name());
            }
        }
    }
}
