//! Bounded Levenberg-Marquardt as an `argmin` solver, one pass over the samples an iteration; with
//! the linear unknowns eliminated it is variable projection.
//!
//! Each step solves `(H + damping D^2) d = -g` within the bounds, exactly. D is Marquardt's scaling
//! by the columns' norms (never shrinking: Moré, *The Levenberg-Marquardt algorithm: implementation
//! and theory*, 1978). A step that raises the loss is shortened by the parabola through what is
//! known of the loss along it (MINPACK's rule), raising the damping until the step is that short,
//! which costs no pass. The pass that judges a step is the next linearisation when it is taken.

use super::bounded;
use super::coordinates::Coordinates;
use super::linearisation::{Linearisation, Passes};
use super::memory::Memory;
use super::options::Tolerances;
use super::outcome::Ending;
use super::recent::Recent;
use super::varpro::Elimination;
use crate::engine::Unknown;
use argmin::core::{Error, IterState, KV, Problem, Solver, TerminationReason};

/// What `argmin` carries from iteration to iteration.
pub type LmState = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

/// Differences of the loss below this share of it may be rounding: the sums come from 32-bit
/// floats, whose errors of 6e-8 average to about 1e-9 over a few thousand residuals.
const LOSS_ROUNDING: f64 = 1e-8;
/// A promised gain below this share of the first loss that then does not come is rounding too.
const GAIN_ROUNDING: f64 = 1e-9;
/// After this number of steps in a row within rounding, there is nothing more to gain.
const MOST_IDLE: u32 = 3;
/// An undamped step that promises more than this share of the loss is not put down to a rough loss.
const ROUGH_OUTLOOK: f64 = 1e-3;
/// Damping at the start, beside the unit diagonal of the scaled H: nearly Gauss-Newton.
const FIRST_DAMPING: f64 = 1e-4;
/// Below this, damping changes no digit that matters.
const LEAST_DAMPING: f64 = 1e-10;
/// Where damping begins when a step must be shortened.
const SHORTENING_DAMPING: f64 = 1e-6;
/// By then the step is below rounding.
const MOST_DAMPING: f64 = 1e16;
/// Where the model cannot reach the image, and for robust losses, Gauss-Newton's quadratic is too
/// steep or too flat and closes in by a steady factor: steps are lengthened by what the parabola
/// through the last one showed, up to this, once a step lowers the loss to no less than [`NEAR`] of
/// it (a tenth of the passes where outliers are left in, half with the loss `smape`).
const MOST_STRETCH: f64 = 4.0;
const NEAR: f64 = 0.9;
/// Where elimination says that less than this share of a measured loss is left, that is a difference of sums
/// that agree in all their digits: what is left must be measured.
const LEFT: f64 = 1e-7;
/// That matters where the measured loss exceeded by this factor the mean square of the image that is the answer:
/// weights are then off by some 1e-6 of themselves, times the condition of the normal equations.
const EXTREME: f64 = 1e3;
/// Linear unknowns that moved by more than this leave the Jacobian stale.
const STALE: f64 = 0.01;
/// Once, a step from a stale Jacobian may raise the eliminated loss by this factor, though not above the
/// loss that was measured: where it led to the Jacobian is
/// fresh, which is worth more than a pass that renews it in place (over 100 random starts: 6.0
/// passes on average and 9 at most, against 6.1 and 12; with a factor of 4 some starts go astray).
const FORGIVEN: f64 = 2.0;

/// The solver.
pub struct LevenbergMarquardt<'a> {
    coordinates: &'a Coordinates,
    elimination: Option<Elimination>,
    quadratic: bool,
    tolerances: Tolerances,
    memory: Memory,
}

impl<'a> LevenbergMarquardt<'a> {
    /// A solver that begins at the pass `first`; `elimination` makes it variable projection, and
    /// `quadratic` says that the loss is exactly so in the eliminated unknowns.
    #[must_use]
    pub fn new(
        coordinates: &'a Coordinates,
        elimination: Option<Elimination>,
        quadratic: bool,
        tolerances: Tolerances,
        first: Linearisation,
    ) -> Self {
        let memory = Memory {
            moved: 0.0,
            measured: first.loss,
            damping: FIRST_DAMPING,
            reach: None,
            scaling: vec![0.0; first.len()],
            stretch: 1.0,
            rejected: 0,
            forgiven: false,
            idle: 0,
            recent: Recent::default(),
            renewed: None,
            first_loss: first.loss,
            ending: None,
            base: first.clone(),
        };
        let mut solver = Self { coordinates, elimination, quadratic, tolerances, memory };
        solver.take(first);
        solver
    }

    /// The solver that had this memory.
    #[must_use]
    pub fn resumed(
        coordinates: &'a Coordinates,
        elimination: Option<Elimination>,
        quadratic: bool,
        tolerances: Tolerances,
        memory: Memory,
    ) -> Self {
        Self { coordinates, elimination, quadratic, tolerances, memory: Memory { ending: None, ..memory } }
    }

    /// What it remembers.
    #[must_use]
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Make `model` the base, its linear unknowns at their best where that is exact.
    fn take(&mut self, model: Linearisation) {
        self.memory.measured = model.loss;
        (self.memory.base, self.memory.moved) = self.reduced(model);
        for i in 0..self.memory.scaling.len() {
            self.memory.scaling[i] = self.memory.scaling[i].max(self.memory.base.curvature(i));
        }
    }

    /// For a robust loss the closed form is one step of reweighting, whose loss is not known before
    /// it is measured: the joint step then makes it, and its pass verifies it.
    fn reduced(&self, model: Linearisation) -> (Linearisation, f64) {
        match &self.elimination {
            Some(elimination) if self.quadratic => {
                let reduced = elimination.reduce(self.coordinates, &model);
                (reduced.model, reduced.moved)
            }
            _ => (model, 0.0),
        }
    }

    /// Whether damping holds unknown `i` back. The eliminated ones are free to follow, unless a
    /// robust loss twice rejected what the reweighted quadratic promised.
    fn is_damped(&self, i: usize) -> bool {
        let unknowns = self.coordinates.unknowns();
        let follows = self.elimination.is_some() && unknowns[i].linear();
        let robust = !self.quadratic && (self.memory.rejected > 1 || unknowns.iter().all(Unknown::linear));
        !follows || robust
    }

    fn step(&self, damping: f64) -> Vec<f64> {
        let base = &self.memory.base;
        let mut hessian = base.hessian.clone();
        for i in 0..base.len() {
            if damping > 0.0 && self.is_damped(i) {
                hessian[i * base.len() + i] += damping * self.memory.scaling[i];
            }
        }
        bounded::minimise(&hessian, &base.gradient, &self.coordinates.room(&base.at))
    }

    /// The damped unknowns' part of a step, in units of D.
    fn length(&self, step: &[f64]) -> f64 {
        let terms = (0..step.len()).filter(|&i| self.is_damped(i));
        terms.map(|i| step[i] * step[i] * self.memory.scaling[i]).sum::<f64>().sqrt()
    }

    /// The step at the present damping, raised until the step is within reach.
    fn damped_step(&mut self) -> Vec<f64> {
        let mut step = self.step(self.memory.damping);
        let Some(reach) = self.memory.reach else {
            step.iter_mut().for_each(|d| *d *= self.memory.stretch);
            return step;
        };
        while self.length(&step) > reach && self.memory.damping < MOST_DAMPING {
            self.memory.damping = (self.memory.damping * 3.0).max(SHORTENING_DAMPING);
            step = self.step(self.memory.damping);
        }
        step
    }

    /// Whether an extreme start left of the base's loss and of its linear unknowns nothing but rounding; not when
    /// measuring them anew did not change that.
    fn is_rounding(&self) -> bool {
        let Memory { base, measured, renewed, .. } = &self.memory;
        let unknowns = self.coordinates.unknowns().iter().zip(&base.at);
        let weights: Vec<f64> = unknowns.map(|(u, &at)| if u.linear() { at } else { 0.0 }).collect();
        let image = base.image_change(&weights) / base.weight;
        base.loss < LEFT * measured
            && *measured > EXTREME * image
            && renewed.is_none_or(|before| *measured < 0.1 * before)
    }

    /// Whether the base is the answer; if so, the last undamped step is taken on trust.
    fn settle(&mut self) -> bool {
        let memory = &self.memory;
        let nonlinear = self.coordinates.unknowns().iter().any(|u| !u.linear());
        if (nonlinear && memory.moved > STALE) || self.is_rounding() {
            return false;
        }
        let step = self.step(0.0);
        let largest = (0..step.len())
            .map(|i| step[i].abs() / self.coordinates.size(i, memory.base.at[i]))
            .fold(0.0, f64::max);
        let promised = -memory.base.change(&step);
        let settled = largest <= self.tolerances.step
            || promised <= self.tolerances.gain(self.quadratic, memory.base.count) * memory.base.loss
            || memory.idle >= MOST_IDLE
            || (memory.recent.gained().is_some_and(|gained| gained <= self.tolerances.rough)
                && promised <= ROUGH_OUTLOOK * memory.base.loss);
        // A long step along a direction that hardly matters is not taken unseen.
        if settled && largest <= 100.0 * self.tolerances.step {
            let stretched: Vec<f64> = step.iter().map(|d| d * memory.stretch).collect();
            let at = self.coordinates.moved(&memory.base.at, &stretched);
            let step: Vec<f64> = at.iter().zip(&memory.base.at).map(|(to, from)| to - from).collect();
            self.memory.base = memory.base.moved(&step, at);
        }
        settled
    }

    /// The gain that the model promises of a step.
    fn promised(&self, step: &[f64]) -> f64 {
        let base = &self.memory.base;
        // A stretched step overshoots the quadratic; half the slope is what the quadratic promises
        // of a step to its minimum.
        if self.memory.stretch == 1.0 { -base.change(step) } else { -0.5 * slope(base, step) }
    }

    /// Take or reject the trial that `step` led to; whether it was taken.
    fn judge(&mut self, step: &[f64], trial: Linearisation) -> bool {
        let base = &self.memory.base;
        let (promised, old, length) = (self.promised(step), base.loss, self.length(step));
        if !trial.is_finite() {
            return self.reject(0.1 * length);
        }
        let new = self.reduced(trial.clone()).0.loss;
        // Where along the step the parabola with the loss and slope at the base and the loss at the
        // trial has its minimum.
        let slope = slope(base, step);
        let parabola = -0.5 * slope / (new - old - slope).max(f64::MIN_POSITIVE);
        // With noise in the loss, gain and promise are both padded by it (Conn, Gould and Toint,
        // *Trust-Region Methods*, section 17.4.2).
        let rounding = LOSS_ROUNDING * old + f64::MIN_POSITIVE;
        let ratio = (old - new + rounding) / (promised + rounding);
        let forgiven = !self.memory.forgiven
            && self.memory.moved > STALE
            && new < self.memory.measured.min(FORGIVEN * old);
        // Where no loss can tell, the slope still does.
        let nearer = promised <= rounding && self.nears(&trial);
        if ratio < 1e-4 && !forgiven && !nearer {
            self.memory.stretch = 1.0;
            return self.reject(parabola.clamp(0.1, 0.5) * length);
        }
        self.memory.forgiven |= ratio < 1e-4 && !nearer;
        self.memory.idle = if (old - new).abs() <= rounding && !nearer { self.memory.idle + 1 } else { 0 };
        let damping = match ratio {
            _ if nearer => self.memory.damping,
            r if r > 0.75 => self.memory.damping * 0.1 * (new / old).clamp(0.01, 1.0),
            r if r > 0.25 || forgiven => self.memory.damping,
            _ => (self.memory.damping * 4.0).max(1e-3),
        };
        self.memory.damping = if damping < LEAST_DAMPING { 0.0 } else { damping };
        // Far from the answer the parabola says little of the next step.
        let near = new > NEAR * old;
        let stretch = if near { self.memory.stretch * parabola.clamp(0.5, 1.5) } else { 1.0 };
        self.memory.stretch = stretch.clamp(1.0, MOST_STRETCH);
        self.renew(trial)
    }

    /// Whether an undamped step promises less than half as much at `trial` as at the base.
    fn nears(&self, trial: &Linearisation) -> bool {
        let outlook = |model: &Linearisation| {
            let room = self.coordinates.room(&model.at);
            -model.change(&bounded::minimise(&model.hessian, &model.gradient, &room))
        };
        outlook(&self.reduced(trial.clone()).0) < 0.5 * outlook(&self.memory.base)
    }

    /// Go on from `trial`.
    fn renew(&mut self, trial: Linearisation) -> bool {
        self.take(trial);
        (self.memory.reach, self.memory.rejected) = (None, 0);
        true
    }

    fn reject(&mut self, reach: f64) -> bool {
        self.memory.reach = Some(reach);
        self.memory.rejected += 1;
        false
    }

    /// After a rejection: whether to go on.
    fn exhausted(&self, promised: f64) -> Option<Ending> {
        if promised <= GAIN_ROUNDING * self.memory.first_loss {
            Some(Ending::Converged)
        } else if self.memory.damping >= MOST_DAMPING || self.memory.rejected > 30 {
            Some(Ending::Stalled)
        } else {
            None
        }
    }

    fn report(&mut self, state: LmState, ending: Option<Ending>) -> LmState {
        let state = state.param(self.memory.base.at.clone()).cost(self.memory.base.loss);
        self.memory.ending = ending;
        match ending {
            None => state,
            Some(Ending::Converged) => {
                argmin::core::State::terminate_with(state, TerminationReason::SolverConverged)
            }
            Some(_) => {
                let reason = TerminationReason::SolverExit("no step lowers the loss".to_owned());
                argmin::core::State::terminate_with(state, reason)
            }
        }
    }
}

/// The derivative of the loss along `step`.
fn slope(base: &Linearisation, step: &[f64]) -> f64 {
    2.0 * base.gradient.iter().zip(step).map(|(g, d)| g * d).sum::<f64>() / base.weight
}

impl Solver<&Passes<'_>, LmState> for LevenbergMarquardt<'_> {
    fn name(&self) -> &str {
        if self.elimination.is_some() { "varpro" } else { "lm" }
    }

    fn init(
        &mut self,
        _problem: &mut Problem<&Passes<'_>>,
        state: LmState,
    ) -> Result<(LmState, Option<KV>), Error> {
        let ending = self.settle().then_some(Ending::Converged);
        Ok((self.report(state, ending), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<&Passes<'_>>,
        state: LmState,
    ) -> Result<(LmState, Option<KV>), Error> {
        // What elimination left is measured where it is rounding. And before a step rejected twice is blamed on its
        // length once more, a stale Jacobian is renewed in place.
        let rounding = self.is_rounding();
        if rounding {
            self.memory.renewed = Some(self.memory.measured);
        }
        let stale = rounding || (self.memory.rejected > 1 && self.memory.moved > STALE);
        let step = if stale { vec![0.0; self.memory.base.len()] } else { self.damped_step() };
        let at = self.coordinates.moved(&self.memory.base.at, &step);
        let trial = problem.problem("passes", |passes| Ok(passes.linearise(&at)))?;
        let promised = self.promised(&step);
        if rounding && trial.is_finite() {
            // An extreme start says nothing of what gains are worth, nor of the unknowns' scales.
            self.memory.first_loss = self.memory.first_loss.min(trial.loss);
            self.memory.scaling.fill(0.0);
        }
        let renewed = stale && trial.is_finite();
        let taken = if renewed { self.renew(trial) } else { self.judge(&step, trial) };
        if !renewed {
            self.memory.recent.note(self.memory.base.loss, taken);
        }
        let ending =
            if taken { self.settle().then_some(Ending::Converged) } else { self.exhausted(promised) };
        Ok((self.report(state, ending), None))
    }
}
