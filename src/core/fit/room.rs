//! Where a step may go: each variable within an interval, and some together up by only so much.

/// What bounds leave to a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Room {
    /// The least step of each variable: 0 or less.
    pub down: Vec<f64>,
    /// The greatest: 0 or more.
    pub up: Vec<f64>,
    /// What some may go up by together.
    pub sums: Vec<Sum>,
}

/// Variables whose steps add up to no more than `room`.
#[derive(Clone, Debug, PartialEq)]
pub struct Sum {
    /// Their places.
    pub of: Vec<usize>,
    /// 0 or more.
    pub room: f64,
}

impl Room {
    /// Intervals alone.
    #[must_use]
    pub fn within(down: &[f64], up: &[f64]) -> Self {
        Self { down: down.to_vec(), up: up.to_vec(), sums: Vec::new() }
    }

    /// The room of some of the variables, in this order, while the others stay.
    #[must_use]
    pub fn of(&self, places: &[usize]) -> Self {
        let pick = |all: &[f64]| places.iter().map(|&i| all[i]).collect();
        let sum = |sum: &Sum| {
            let of: Vec<usize> = (0..places.len()).filter(|&to| sum.of.contains(&places[to])).collect();
            (!of.is_empty()).then_some(Sum { of, room: sum.room })
        };
        Self { down: pick(&self.down), up: pick(&self.up), sums: self.sums.iter().filter_map(sum).collect() }
    }

    /// Leave variable `i` where it is.
    pub fn hold(&mut self, i: usize) {
        (self.down[i], self.up[i]) = (0.0, 0.0);
    }

    /// Shorten a step so that no sum overflows: what goes up goes up by less, all of a sum alike.
    pub(super) fn cut(&self, step: &mut [f64]) {
        for sum in &self.sums {
            let over = sum.of.iter().map(|&i| step[i]).sum::<f64>() - sum.room.max(0.0);
            if over > 0.0 {
                let up: f64 = sum.of.iter().map(|&i| step[i].max(0.0)).sum();
                let share = (1.0 - over / up).max(0.0);
                for &i in &sum.of {
                    step[i] *= if step[i] > 0.0 { share } else { 1.0 };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_of_the_variables_keep_what_their_sums_leave() {
        let sums = vec![Sum { of: vec![0, 2], room: 0.5 }, Sum { of: vec![1], room: 0.25 }];
        let room = Room { down: vec![-1.0, -2.0, -3.0], up: vec![1.0, 2.0, 3.0], sums };
        let some = room.of(&[2, 1]);
        assert_eq!((some.down, some.up), (vec![-3.0, -2.0], vec![3.0, 2.0]));
        let wanted = [Sum { of: vec![0], room: 0.5 }, Sum { of: vec![1], room: 0.25 }];
        assert_eq!(some.sums, wanted);
        assert!(room.of(&[]).sums.is_empty());
    }

    #[test]
    fn a_step_is_cut_where_its_sum_overflows() {
        let room = Room { sums: vec![Sum { of: vec![0, 1], room: 0.5 }], ..Room::default() };
        let cut = |mut step: [f64; 3]| {
            room.cut(&mut step);
            step
        };
        assert_eq!(cut([0.25, 0.25, 9.0]), [0.25, 0.25, 9.0]);
        assert_eq!(cut([1.0, 1.0, 9.0]), [0.25, 0.25, 9.0]);
        // What one gives, another may take; and along a full sum no more than a rounding is taken off.
        assert_eq!(cut([2.0, -1.75, 9.0]), [2.0, -1.75, 9.0]);
        let full = Room { sums: vec![Sum { of: vec![0, 1], room: 0.0 }], ..Room::default() };
        let mut along = [0.3, -0.3 + 1e-16];
        full.cut(&mut along);
        assert!((along[0] - 0.3).abs() < 1e-15 && along[1] == -0.3 + 1e-16, "{along:?}");
    }
}
