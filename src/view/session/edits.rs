//! What one does to the values: each is a step of the history, or part of one that goes on until it is settled. While a
//! fit moves them nothing else does.

use std::ops::RangeInclusive;

use super::Session;
use crate::engine::Unknown;
use crate::history::History;
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::params::{Channels, Column, Param};
use crate::skin::Skin;
use crate::values::Values;

/// What the slider of a gain spans.
pub const GAINS: RangeInclusive<f64> = 0.1..=10.0;

impl Session {
    /// The values and their past, while no fit moves them.
    pub(super) fn editable(&mut self) -> Option<&mut History<Skin>> {
        if self.fitting.is_some() { None } else { self.values.as_mut() }
    }

    /// Change the values of the scene that is looked at by a whole step: what is the skin's changes in all scenes.
    pub fn edit(&mut self, change: impl FnOnce(&mut Values)) {
        self.drag(change);
        self.settle();
    }

    /// Change them as part of a step.
    pub fn drag(&mut self, change: impl FnOnce(&mut Values)) {
        let scene = self.at.0;
        if let Some(history) = self.editable() {
            history.drag(|values| values.change(scene, change));
        }
    }

    /// The step is over.
    pub fn settle(&mut self) {
        if let Some(history) = self.editable() {
            history.settle();
        }
    }

    /// Back by a step, if there is one.
    pub fn undo(&mut self) {
        if let Some(history) = self.editable() {
            history.undo();
        }
    }

    /// Forward again.
    pub fn redo(&mut self) {
        if let Some(history) = self.editable() {
            history.redo();
        }
    }

    /// Whether there is a step back, and one forward.
    #[must_use]
    pub fn steps(&self) -> (bool, bool) {
        let idle = self.values.as_ref().filter(|_| self.fitting.is_none());
        idle.map_or((false, false), |history| (history.can_undo(), history.can_redo()))
    }

    /// Move a slider, as part of a drag; it stays within its bounds.
    pub fn slide(&mut self, column: Column, value: f64) {
        if value.is_finite() {
            self.drag(|values| {
                let own = values.bounds.own(column.param);
                let (lower, upper) = own.unwrap_or_else(|| column.param.info().range());
                column.set(&mut values.params, value.clamp(lower, upper));
            });
        }
    }

    /// Move the slider of a view's gain, or of a channel of it, as part of a drag.
    pub fn slide_gain(&mut self, view: usize, channels: Channels, value: f64) {
        let (least, greatest) = Unknown::Gain(view, channels).bounds();
        if value.is_finite() {
            self.drag(|values| {
                if let Some(gain) = values.gains.get_mut(view) {
                    *gain = Gain(channels.with(gain.0, value.clamp(least, greatest)));
                }
            });
        }
    }

    /// Turn the environment's light by `degrees`, as part of a drag.
    pub fn turn_light(&mut self, degrees: f64) {
        self.drag(|values| {
            let at = values.params.scalar(Param::EnvironmentRotation) + degrees;
            values.params.set(Param::EnvironmentRotation, (at + 540.0).rem_euclid(360.0) - 180.0);
        });
    }

    /// Set a parameter to what is called so, of its [`resets`](Self::resets).
    pub fn reset(&mut self, param: Param, to: &str) {
        if let Some((_, rgb)) = self.resets(param).into_iter().find(|(name, _)| *name == to) {
            self.edit(|values| values.params.set_rgb(param, rgb));
        }
    }

    /// Turn an effect on or off. What that changes is told once its image is there.
    pub fn set_effect(&mut self, effect: Effect, on: bool) {
        self.weigh_from(effect);
        self.edit(|values| values.set_effect(effect, on));
    }

    /// Leave a view out of fits, or take it in again: by its number among the [`places`](Self::places).
    pub fn set_fitted(&mut self, place: usize, fitted: bool) {
        let Some(place) = self.places().into_iter().nth(place) else { return };
        let name = self.scenes[place.scene].views()[place.view].name.clone();
        if let Some(history) = self.editable() {
            history.edit(|values| {
                values.change(place.scene, |values| values.set_held_out(&name, !fitted));
            });
        }
    }
}
