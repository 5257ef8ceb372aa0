//! How a fit is to be done.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::coordinates::Limits;
use super::fingerprint::Fingerprint;
use crate::model::bounds::Bounds;
use crate::model::effects::Effects;

/// The solvers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverKind {
    /// Variable projection: linear unknowns in closed form, the others by Levenberg-Marquardt.
    #[default]
    Varpro,
    /// Levenberg-Marquardt over all unknowns.
    Lm,
    /// L-BFGS with a line search by Moré and Thuente, bounds by transforms; for comparison.
    Lbfgs,
    /// The simplex of Nelder and Mead, bounds by transforms; for comparison.
    NelderMead,
    /// Adam's gradient steps, bounds by transforms; for comparison.
    Adam,
}

impl SolverKind {
    /// Every solver, in the order of documentation.
    pub const ALL: [Self; 5] = [Self::Varpro, Self::Lm, Self::Lbfgs, Self::NelderMead, Self::Adam];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Varpro => "varpro",
            Self::Lm => "lm",
            Self::Lbfgs => "lbfgs",
            Self::NelderMead => "nelder-mead",
            Self::Adam => "adam",
        }
    }

    /// The solver of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Iterations after which a fit that has not converged probably never will.
    #[must_use]
    pub const fn default_iterations(self) -> u64 {
        match self {
            // They converge in 5 to 30.
            Self::Varpro | Self::Lm => 200,
            Self::Lbfgs => 1000,
            // A simplex needs some hundreds for each unknown.
            Self::NelderMead => 20_000,
            // Its steps have shrunk to a fortieth by then.
            Self::Adam => 2_000,
        }
    }
}

/// When `varpro` and `lm` stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Stop when the undamped step changes no unknown by more than this share of its size. That
    /// step is still taken: near the answer it squares the error, so that 1e-5 leaves about 1e-10.
    pub step: f64,
    /// Stop when the model promises less than this share of the loss: less is rounding.
    pub gain: f64,
    /// The same for robust losses, whose reweighting closes in by a steady factor an iteration.
    pub robust_gain: f64,
    /// Stop when what the model promises moves the answer by less than this share of a standard
    /// error, that is when it is less than `error^2 / residuals` of the loss. The step is still taken.
    pub error: f64,
    /// Stop where the last passes gained less than this share of the loss, although steps were turned back among them
    /// that promised more: slopes are those of straight pieces there, or of what ends at once, and say no more of the
    /// loss. Of half a million residuals that is three quarters of a standard error of independent noise, and some
    /// hundredths of one of a model that does not fit.
    pub rough: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self { step: 1e-5, gain: 1e-10, robust_gain: 1e-8, error: 0.03, rough: 1e-6 }
    }
}

impl Tolerances {
    /// The share of the loss that is not worth another pass, of a fit of `count` residuals.
    #[must_use]
    pub fn gain(&self, quadratic: bool, count: u64) -> f64 {
        let rounding = if quadratic { self.gain } else { self.robust_gain };
        rounding.max(self.error * self.error / count.max(1) as f64)
    }
}

/// How a fit is to be done.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Which solver.
    pub solver: SolverKind,
    /// Most iterations for each start; `None`: [`SolverKind::default_iterations`].
    pub max_iterations: Option<u64>,
    /// When `varpro` and `lm` stop.
    pub tolerances: Tolerances,
    /// How many starts: the given point, and others drawn about it. At least 1.
    pub starts: u32,
    /// What the other starts are drawn from.
    pub seed: u64,
    /// What scenes bound their free parameters by: one for each, or none.
    pub bounds: Vec<Bounds>,
    /// The effects whose parameters count as shares of a whole; all where it is not said.
    pub effects: Option<Effects>,
    /// What identifies the objective: states of others are refused.
    pub fingerprint: Fingerprint,
    /// Where the state is kept, written about once a second and at the end.
    pub state: Option<PathBuf>,
    /// A state to go on from.
    pub resume: Option<PathBuf>,
    /// Set from outside (by Ctrl-C) to end the fit after the present iteration.
    pub interrupt: Option<Arc<AtomicBool>>,
    /// Pixels in a row of each view's image: with them standard errors know which residuals are neighbours. Empty: they
    /// assume independent residuals.
    pub widths: Vec<usize>,
    /// Whether the weakest unknown is held beside the answer, to see how far the loss lets it go.
    pub profile: bool,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            solver: SolverKind::default(),
            max_iterations: None,
            tolerances: Tolerances::default(),
            starts: 1,
            seed: 0,
            bounds: Vec::new(),
            effects: None,
            fingerprint: Fingerprint::default(),
            state: None,
            resume: None,
            interrupt: None,
            widths: Vec::new(),
            profile: false,
        }
    }
}

impl FitOptions {
    /// What bounds unknowns beside the table of parameters.
    #[must_use]
    pub fn limits(&self) -> Limits<'_> {
        Limits { bounds: &self.bounds, effects: self.effects }
    }
}
