//! A group's values to residuals: targets, weights, gain, loss.

use super::Kernel;
use crate::engine::lanes::Lanes;
use crate::engine::residual::weighted_residual;
use crate::engine::window::{self, Window, row_mut};
use crate::model::real::Real;
use crate::scene::Loss;
use crate::simd::Simd;

impl<S: Simd> Kernel<'_, S> {
    /// Values to residuals, and columns to their weights. Returns the group's loss, lane by lane.
    #[inline(always)]
    pub(in crate::engine) fn weigh<const COLUMNS: bool>(
        &self,
        group: usize,
        window: &mut Window,
    ) -> Lanes<S> {
        let view = &self.view;
        let plain = self.loss == Loss::L2 && view.pixel_weight(group).is_none() && view.clip.is_none();
        let compared = view.target(group).len() == self.plan.channels.len();
        if plain && compared && self.gain == 1.0 && !self.plan.gains {
            return self.subtract_target(group, window);
        }
        self.weigh_channels::<COLUMNS>(group, window)
    }

    /// With unit weights and the plain loss the columns stay as they are.
    #[inline(always)]
    fn subtract_target(&self, group: usize, window: &mut Window) -> Lanes<S> {
        let targets = self.view.target(group);
        let mut loss = self.lit(0.0);
        // A loop, not a closure: in one that is not inlined, vectors would be cut into halves and quarters.
        for c in 0..self.plan.channels.len().min(targets.len()) {
            let row = row_mut(window, window::residual(c));
            let r = Lanes::of_row(self.simd, row) - Lanes::of_row(self.simd, &targets[c]);
            loss = r.mul_add(r, loss);
            r.store(row);
        }
        loss
    }

    #[inline(always)]
    fn weigh_channels<const COLUMNS: bool>(&self, group: usize, window: &mut Window) -> Lanes<S> {
        let weight = match self.view.pixel_weight(group) {
            Some(row) => Lanes::of_row(self.simd, row),
            None => self.lit(1.0),
        };
        let targets = self.view.target(group);
        let gain = self.lit(self.gain);
        let mut loss = self.lit(0.0);
        for (c, channel) in self.plan.channels.iter().enumerate() {
            let value = Lanes::of_row(self.simd, window::row(window, window::residual(c)));
            let target = self.load(targets, (c < targets.len()).then_some(c), 0.0);
            let weighted = weighted_residual(self.loss, self.view.clip, gain * value, target, weight);
            loss = loss + weighted.loss;
            if COLUMNS {
                let factor = weighted.scale * gain;
                for &place in &channel.rows[..channel.columns] {
                    let column = row_mut(window, place);
                    (factor * Lanes::of_row(self.simd, column)).store(column);
                }
                if self.plan.gains {
                    (weighted.scale * value).store(row_mut(window, window::gain(c)));
                }
            }
            weighted.residual.store(row_mut(window, window::residual(c)));
        }
        loss
    }
}
