//! Steps held against their conditions of optimality, and against points beside them.

use proptest::prelude::*;

use super::super::room::Sum;
use super::*;

/// H = J'J and g = J'r of random J, r with `rows` rows (fewer than K: singular), whose columns
/// have very different units.
fn problem() -> impl Strategy<Value = (usize, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>)> {
    (1_usize..9, 1_usize..14).prop_flat_map(|(k, rows)| {
        let jacobian = proptest::collection::vec(-1.0..1.0_f64, rows * k);
        let residual = proptest::collection::vec(-1.0..1.0_f64, rows);
        let units = proptest::collection::vec(-3..4_i32, k);
        let bound = || prop_oneof![Just(0.0), Just(f64::INFINITY), 0.0..1.0_f64];
        let lower = proptest::collection::vec(bound(), k);
        let upper = proptest::collection::vec(bound(), k);
        (jacobian, residual, units, lower, upper).prop_map(move |(j, r, units, lower, upper)| {
            let unit: Vec<f64> = units.iter().map(|&u| 10_f64.powi(u)).collect();
            let j = DMatrix::from_fn(rows, k, |row, col| j[row * k + col] * unit[col]);
            let h = j.tr_mul(&j);
            let g = j.tr_mul(&DVector::from_vec(r));
            let lower = lower.iter().zip(&unit).map(|(b, u)| -b / u).collect();
            let upper = upper.iter().zip(&unit).map(|(b, u)| b / u).collect();
            (k, h.as_slice().to_vec(), g.as_slice().to_vec(), lower, upper)
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]
    #[test]
    fn the_step_meets_the_kkt_conditions((k, h, g, lower, upper) in problem()) {
        let d = minimise(&h, &g, &Room::within(&lower, &upper));
        let unit = |i: usize| 1.0 / h[i * k + i].sqrt();
        let scaled = DMatrix::from_fn(k, k, |i, j| h[i * k + j] * unit(i) * unit(j));
        let least = SymmetricEigen::new(scaled).eigenvalues.min();
        for i in 0..k {
            prop_assert!((lower[i]..=upper[i]).contains(&d[i]));
            let terms: Vec<f64> = (0..k).map(|j| h[i * k + j] * d[j]).collect();
            let slope = g[i] + terms.iter().sum::<f64>();
            let size = h[i * k + i].sqrt() + terms.iter().map(|t| t.abs()).sum::<f64>();
            // Rounding of a well-conditioned system; else directions below 1e-8 of the largest
            // eigenvalue are left out, and with them a slope of up to sqrt(1e-8) |J| |r|.
            let tolerance = size * if least > 1e-5 { 1e-10 } else { 2e-4 * (k as f64) };
            if d[i] > lower[i] {
                prop_assert!(slope <= tolerance, "{i}: {slope} at {}", d[i]);
            }
            if d[i] < upper[i] {
                prop_assert!(slope >= -tolerance, "{i}: {slope} at {}", d[i]);
            }
        }
    }

    #[test]
    fn no_feasible_point_is_lower((k, h, g, lower, upper) in problem(), seed in any::<u64>()) {
        use rand::{RngExt, SeedableRng};
        let value = |d: &[f64]| {
            let hd = |i: usize| (0..k).map(|j| h[i * k + j] * d[j]).sum::<f64>();
            (0..k).map(|i| d[i] * (g[i] + 0.5 * hd(i))).sum::<f64>()
        };
        let best = minimise(&h, &g, &Room::within(&lower, &upper));
        let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
        for _ in 0..50 {
            let unit = |i: usize| 1.0 / h[i * k + i].sqrt().max(1e-9);
            let other: Vec<f64> = (0..k)
                .map(|i| (best[i] + unit(i) * rng.random_range(-0.1..0.1_f64)).clamp(lower[i], upper[i]))
                .collect();
            // Left-out directions cost at most sqrt(1e-8) |r| each over a move of 0.1 units.
            prop_assert!(value(&best) <= value(&other) + 1e-4, "{} > {}", value(&best), value(&other));
        }
    }
}

/// The same in one unit, each variable in none of two sums, in one or, of four `kinds`, in both (as one for all channels is).
fn summed(kinds: usize) -> impl Strategy<Value = (Vec<f64>, Vec<f64>, Room)> {
    (problem(), proptest::collection::vec(0..kinds, 9), proptest::array::uniform2(0.0..1.0_f64)).prop_map(
        move |((k, h, g, lower, upper), group, left)| {
            let unit: Vec<f64> = (0..k).map(|i| h[i * k + i].sqrt().max(1e-9)).collect();
            let room = Room {
                down: (0..k).map(|i| lower[i] * unit[i]).collect(),
                up: (0..k).map(|i| upper[i] * unit[i]).collect(),
                sums: (1..3)
                    .map(|s| Sum {
                        of: (0..k).filter(|&i| group[i] == s || group[i] == 3).collect(),
                        // Of those that share no variable, a third have no room at all. (Where sums that share some have
                        // none, more meet in a corner than it needs, and a search may end there: no higher, not the lowest.)
                        room: if kinds == 3 { (1.5 * left[s - 1] - 0.5).max(0.0) } else { 0.1 + left[s - 1] },
                    })
                    .collect(),
            };
            let g = (0..k).map(|i| g[i] / unit[i]).collect();
            let h = (0..k * k).map(|ij| h[ij] / unit[ij / k] / unit[ij % k]).collect();
            (h, g, room)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]
    #[test]
    fn a_step_within_sums_meets_the_kkt_conditions((h, g, room) in summed(3)) {
        let k = g.len();
        let d = minimise(&h, &g, &room);
        let least = SymmetricEigen::new(DMatrix::from_row_slice(k, k, &h)).eigenvalues.min();
        let tolerance = if least > 1e-5 { 1e-9 } else { 2e-4 * (k as f64) };
        let mut push = vec![(0.0_f64, 0.0_f64); k];
        for sum in &room.sums {
            let total: f64 = sum.of.iter().map(|&i| d[i]).sum();
            // Rounding of nine numbers, of which none is above some thousands.
            prop_assert!(total <= sum.room + 1e-9, "{total} > {}", sum.room);
            let full = total >= sum.room - 1e-9;
            sum.of.iter().for_each(|&i| push[i] = (0.0, if full { f64::INFINITY } else { 0.0 }));
        }
        // What each variable allows a sum that holds it to push by: all of a sum must agree.
        let mut allowed = push.clone();
        for i in 0..k {
            prop_assert!((room.down[i]..=room.up[i]).contains(&d[i]));
            let terms: Vec<f64> = (0..k).map(|j| h[i * k + j] * d[j]).collect();
            let slope = g[i] + terms.iter().sum::<f64>();
            let within = tolerance * (1.0 + terms.iter().map(|t| t.abs()).sum::<f64>());
            if d[i] > room.down[i] {
                allowed[i].1 = allowed[i].1.min(-slope + within);
            }
            if d[i] < room.up[i] {
                allowed[i].0 = allowed[i].0.max(-slope - within);
            }
        }
        let alone = |i: &usize| !room.sums.iter().any(|sum| sum.of.contains(i));
        for i in (0..k).filter(alone) {
            prop_assert!(allowed[i].0 <= allowed[i].1 + 2.0 * tolerance, "{i}: {:?}", allowed[i]);
        }
        for sum in &room.sums {
            let least = sum.of.iter().map(|&i| allowed[i].0).fold(0.0, f64::max);
            let most = sum.of.iter().map(|&i| allowed[i].1).fold(f64::INFINITY, f64::min);
            prop_assert!(least <= most + 2.0 * tolerance, "{:?}: {least} > {most}", sum.of);
        }
    }

    #[test]
    fn no_point_within_sums_is_lower((h, g, room) in summed(4), seed in any::<u64>()) {
        use rand::{RngExt, SeedableRng};
        let k = g.len();
        let value = |d: &[f64]| {
            let hd = |i: usize| (0..k).map(|j| h[i * k + j] * d[j]).sum::<f64>();
            (0..k).map(|i| d[i] * (g[i] + 0.5 * hd(i))).sum::<f64>()
        };
        let best = minimise(&h, &g, &room);
        for sum in &room.sums {
            let total: f64 = sum.of.iter().map(|&i| best[i]).sum();
            // Rounding, as above.
            prop_assert!(total <= sum.room + 1e-9, "{total} > {}", sum.room);
        }
        let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
        for _ in 0..50 {
            let near = |i: usize| best[i] + rng.random_range(-0.1..0.1_f64);
            let mut other: Vec<f64> =
                (0..k).map(near).zip(room.down.iter().zip(&room.up)).map(|(d, (a, b))| d.clamp(*a, *b)).collect();
            room.cut(&mut other);
            // Left-out directions cost at most sqrt(1e-8) |r| each over a move of 0.1 units.
            prop_assert!(value(&best) <= value(&other) + 1e-4, "{} > {}", value(&best), value(&other));
        }
    }
}

#[test]
fn a_full_sum_shares_what_it_has_and_gives_way_where_it_does_not_pay() {
    let h = [1.0, 0.0, 0.0, 1.0];
    let far = [f64::INFINITY; 2];
    let held = |g: [f64; 2], room: f64| {
        let sums = vec![Sum { of: vec![0, 1], room }];
        minimise(&h, &g, &Room { sums, ..Room::within(&far.map(|b: f64| -b), &far) })
    };
    // The nearest of x + y = 1 to (2, 1): both lose 1. And to (2, -3) nothing is lost, as it has room.
    let near = |d: Vec<f64>, wanted: [f64; 2]| (0..2).all(|i| (d[i] - wanted[i]).abs() < 1e-12);
    assert!(near(held([-2.0, -1.0], 1.0), [1.0, 0.0]));
    assert!(near(held([-2.0, 3.0], 1.0), [2.0, -3.0]));
    assert!(near(held([-2.0, -1.0], 0.0), [0.5, -0.5]));
    // Two sums that say the same, and one of which no variable is free.
    let twice = vec![Sum { of: vec![0, 1], room: 1.0 }; 2];
    let room = Room { sums: twice, ..Room::within(&[0.0; 2], &far) };
    assert!(near(minimise(&h, &[-2.0, -1.0], &room), [1.0, 0.0]));
    let room = Room { up: vec![0.0; 2], ..room };
    assert_eq!(minimise(&h, &[-2.0, -1.0], &room), [0.0; 2]);
}

#[test]
fn an_unbounded_regular_step_is_the_newton_step() {
    let h = [4.0, 1.0, 1.0, 3.0];
    let d = minimise(&h, &[-1.0, -2.0], &Room::within(&[f64::NEG_INFINITY; 2], &[f64::INFINITY; 2]));
    // By Cramer's rule: (1*3 - 2*1)/11, (4*2 - 1*1)/11; two roundings.
    assert!((d[0] - 1.0 / 11.0).abs() < 1e-15 && (d[1] - 7.0 / 11.0).abs() < 1e-15, "{d:?}");
}

#[test]
fn what_nothing_depends_on_does_not_move_and_twins_share_the_step() {
    // Columns 0 and 1 are equal, column 2 is zero.
    let h = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let free = [f64::INFINITY; 3];
    let d = minimise(&h, &[-2.0, -2.0, 0.0], &Room::within(&free.map(|b: f64| -b), &free));
    assert!((d[0] - 1.0).abs() < 1e-14 && (d[1] - 1.0).abs() < 1e-14, "{d:?}");
    assert_eq!(d[2], 0.0);
    // With the first held back, the second does all of it.
    let d = minimise(&h, &[-2.0, -2.0, 0.0], &Room::within(&[0.0; 3], &[0.25, f64::INFINITY, 1.0]));
    assert_eq!(d[0], 0.25);
    assert!((d[1] - 1.75).abs() < 1e-14, "{d:?}");
}

#[test]
fn sixty_four_unknowns_on_random_bounds_end_on_a_kkt_point() {
    use rand::{RngExt, SeedableRng};
    let k = 64;
    let mut rng = rand::rngs::StdRng::seed_from_u64(5);
    let j = DMatrix::from_fn(200, k, |_, _| rng.random_range(-1.0..1.0_f64));
    let h = j.tr_mul(&j);
    let g = j.tr_mul(&DVector::from_fn(200, |_, _| rng.random_range(-1.0..1.0_f64)));
    let upper: Vec<f64> = (0..k).map(|_| rng.random_range(0.0..0.05)).collect();
    let lower: Vec<f64> = upper.iter().map(|u| -u).collect();
    let d = DVector::from_vec(minimise(h.as_slice(), g.as_slice(), &Room::within(&lower, &upper)));
    let slope = &g + &h * &d;
    let on_bound = (0..k).filter(|&i| d[i] == lower[i] || d[i] == upper[i]).count();
    assert!((5..60).contains(&on_bound), "the test should mix free and bound: {on_bound}");
    for i in 0..k {
        // Well-conditioned: rounding of 64 terms of size ~10.
        assert!(d[i] == lower[i] || slope[i] < 1e-11, "{i}");
        assert!(d[i] == upper[i] || slope[i] > -1e-11, "{i}");
    }
}
