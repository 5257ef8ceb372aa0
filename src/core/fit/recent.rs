//! The last passes of a fit, which tell where the loss is rougher than what is left to gain of it.
//!
//! Taps of a blur fall between texels, so that levels are made of straight pieces along a radius, and gloss ends at once where
//! a bump turns a sample from the eye. Slopes then promise what no step finds: some lower the loss by next to nothing, and
//! those between are turned back, for as many passes as one likes.

use serde::{Deserialize, Serialize};

/// Passes that are looked back on.
const PASSES: usize = 8;
/// The fewest of their steps that were taken, and the fewest that were turned back.
const LEAST: usize = 3;

/// The least loss after each of the last passes, and whether its step was taken; before them, that at their start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Recent(Vec<(f64, bool)>);

impl Recent {
    /// One pass more.
    pub(super) fn note(&mut self, loss: f64, taken: bool) {
        if self.0.len() > PASSES {
            self.0.remove(0);
        }
        self.0.push((loss, taken));
    }

    /// What the last passes have gained, as a share of the loss, where steps were taken and turned back by turns; `None`
    /// where the loss is not seen to be rough.
    pub(super) fn gained(&self) -> Option<f64> {
        let [(before, _), passes @ .., (after, last)] = self.0.as_slice() else { return None };
        let taken = passes.iter().filter(|(_, taken)| *taken).count() + usize::from(*last);
        let turned_back = passes.len() + 1 - taken;
        (self.0.len() > PASSES && taken >= LEAST && turned_back >= LEAST).then(|| (before - after) / after)
    }

    /// Whether one that was read from a file can be gone on from.
    pub(super) fn is_sound(&self) -> bool {
        self.0.len() <= PASSES + 1 && self.0.iter().all(|(loss, _)| loss.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(passes: &[(f64, bool)]) -> Option<f64> {
        let mut recent = Recent::default();
        passes.iter().for_each(|&(loss, taken)| recent.note(loss, taken));
        assert!(recent.is_sound());
        recent.gained()
    }

    #[test]
    fn a_loss_is_rough_where_steps_are_taken_and_turned_back_by_turns() {
        let by_turns: Vec<(f64, bool)> =
            (0..9).map(|i| (1.25 - 0.0625 * f64::from(i / 2), i % 2 == 0)).collect();
        // Four of the eight after the first were taken, and they gained a quarter of what is left.
        assert_eq!(after(&by_turns), Some(0.25));
        assert_eq!(after(&by_turns[1..]), None, "eight have no loss before them");
        let older = [&[(9.0, true); 5], by_turns.as_slice()].concat();
        assert_eq!(after(&older), Some(0.25), "older ones do not count");
        let smooth: Vec<(f64, bool)> = by_turns.iter().map(|&(loss, _)| (loss, true)).collect();
        assert_eq!(after(&smooth), None);
        // A first step that is too long is turned back until it is short enough.
        let long: Vec<(f64, bool)> =
            by_turns.iter().enumerate().map(|(i, &(loss, _))| (loss, i > 6)).collect();
        assert_eq!(after(&long), None);
    }
}
