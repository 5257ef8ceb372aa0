//! What Levenberg-Marquardt remembers between iterations.

use serde::{Deserialize, Serialize};

use super::linearisation::Linearisation;
use super::outcome::Ending;
use super::recent::Recent;

/// All that the solver remembers between iterations; a fit resumed from it goes on to the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// The model at the best point so far.
    pub base: Linearisation,
    /// How far the linear unknowns were moved after the model's pass.
    pub(super) moved: f64,
    /// The loss that the model's pass measured, before they were.
    pub(super) measured: f64,
    /// The damping factor.
    pub(super) damping: f64,
    /// The greatest scaled length that the next step may have, after a rejection.
    pub(super) reach: Option<f64>,
    /// D^2, the largest curvature seen along each unknown.
    pub(super) scaling: Vec<f64>,
    /// By how much steps are lengthened.
    pub(super) stretch: f64,
    /// Steps rejected in a row.
    pub(super) rejected: u32,
    /// Whether a step was taken once although it raised the eliminated loss.
    pub(super) forgiven: bool,
    /// Steps taken in a row whose gain was within rounding.
    pub(super) idle: u32,
    /// The last passes.
    #[serde(default)]
    pub(super) recent: Recent,
    /// The loss that was measured when the model was last made anew because elimination left nothing of it but
    /// rounding.
    pub(super) renewed: Option<f64>,
    /// The loss at the start; of a start that was nothing but an extreme number, after it.
    pub(super) first_loss: f64,
    /// How it ended, when it did.
    pub ending: Option<Ending>,
}

impl Memory {
    /// Whether a memory that was read from a file can be gone on from.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let numbers = [
            self.moved,
            self.stretch,
            self.measured,
            self.damping,
            self.reach.unwrap_or(0.0),
            self.first_loss,
        ];
        self.scaling.len() == self.base.len()
            && self.base.is_finite()
            && self.recent.is_sound()
            && numbers.iter().chain(&self.scaling).all(|&x| x.is_finite() && x >= 0.0)
    }
}
