//! What holds an answer: bounds of unknowns, and wholes that their shares fill.

use nalgebra::DMatrix;

use super::bounded::{NULL_EIGENVALUE, projection};
use super::coordinates::Coordinates;

/// Solvers that step through transforms never quite reach a bound.
const AT_BOUND: f64 = 1e-6;

/// Which unknowns cannot move both ways: a bound holds them, or wholes that are full leave them no step at all.
pub(super) fn at_bounds(coordinates: &Coordinates, at: &[f64]) -> Vec<bool> {
    let mut held: Vec<bool> = (0..at.len()).map(|i| is_at_bound(coordinates, i, at[i])).collect();
    let full: Vec<&[usize]> = coordinates.full(at).collect();
    if !full.is_empty() {
        let counts = |s: usize, i: usize| f64::from(full[s].contains(&i) && !held[i]);
        let left = projection(&DMatrix::from_fn(full.len(), at.len(), counts)).diagonal();
        held.iter_mut().zip(&left).for_each(|(held, &left)| *held |= left < NULL_EIGENVALUE);
    }
    held
}

/// The wholes that are full, by the names of their shares that no bound holds; none whose shares another one has, too.
pub(super) fn full_shares(coordinates: &Coordinates, at: &[f64], at_bound: &[bool]) -> Vec<Vec<String>> {
    let free = |of: &[usize]| of.iter().copied().filter(|&i| !at_bound[i]).collect::<Vec<_>>();
    let all: Vec<Vec<usize>> = coordinates.full(at).map(free).filter(|of| of.len() > 1).collect();
    let within =
        |of: &[usize], other: &[usize]| of.len() < other.len() && of.iter().all(|i| other.contains(i));
    let mut widest: Vec<&Vec<usize>> =
        all.iter().filter(|of| !all.iter().any(|other| within(of, other))).collect();
    widest.dedup();
    widest.iter().map(|of| of.iter().map(|&i| coordinates.unknowns()[i].name()).collect()).collect()
}

fn is_at_bound(coordinates: &Coordinates, i: usize, at: f64) -> bool {
    let near = AT_BOUND * coordinates.size(i, at);
    at - coordinates.lower()[i] <= near || coordinates.upper()[i] - at <= near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{Point, Unknown};
    use crate::model::effects::Form;
    use crate::model::params::{Channels, Column, Param, Params};
    use crate::shader::term::library;

    #[test]
    fn shares_are_held_where_full_wholes_leave_them_no_step() {
        library::register_all();
        let weight = |k: usize| Param::from_name(&format!("diffusion_weight_{k}")).unwrap();
        let column = |k, channels| Unknown::Param(Column { param: weight(k), channels });
        // Two that are tied over the channels, and a third of red alone.
        let unknowns = [column(1, Channels::Tied), column(2, Channels::Tied), column(3, Channels::One(0))];
        let mut params = Params::defaults(Form::Corrected);
        [1, 2].into_iter().for_each(|k| params.set(weight(k), 0.2));
        params.set_rgb(weight(3), [0.1, 0.1, 0.3]);
        let coordinates = Coordinates::new(&unknowns, &Point { params, gains: vec![] });
        let told = |at: [f64; 3]| {
            let held = at_bounds(&coordinates, &at);
            (held.clone(), full_shares(&coordinates, &at, &held))
        };
        assert_eq!(told([0.2, 0.2, 0.1]), (vec![false; 3], vec![]));
        // Blue, which holds 0.3 already, is full; red is not.
        let pair = vec!["diffusion_weight_1".to_owned(), "diffusion_weight_2".to_owned()];
        assert_eq!(told([0.3, 0.4, 0.1]), (vec![false; 3], vec![pair.clone()]));
        // Both are: what one of the tied takes the other gives, and the third can only fall.
        assert_eq!(told([0.3, 0.4, 0.3]), (vec![false, false, true], vec![pair]));
        // One of the tied at its bound holds the other.
        assert_eq!(told([0.0, 0.7, 0.1]), (vec![true, true, false], vec![]));
    }
}
