//! Adam (Kingma and Ba 2015) as an `argmin` solver: gradient steps, each variable by the size of its recent
//! gradients. For comparison with what fits of images in other frameworks use.

use argmin::core::CostFunction;
use argmin::core::{
    Error, Gradient, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};

/// The step at first, in variables scaled so that a step of 1 changes the image by 1 (over its first error).
const RATE: f64 = 0.05;
/// The decays of the means of gradients and of their squares: the authors'.
const DECAY: [f64; 2] = [0.9, 0.999];
/// Keeps the division finite: the authors'.
const EPSILON: f64 = 1e-8;
/// The step falls as 1 / (1 + iteration / this), so that it settles at all.
const COOLING: f64 = 60.0;

/// Steps in a row without a lower loss that end it: far more than the means of gradients remember, and enough for
/// cooling to shorten the first steps to a quarter.
const IDLE: u32 = 200;

/// The state of Adam's steps.
pub(super) type AdamState = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

/// Adam.
pub(super) struct Adam {
    rate: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
    /// Converged once the gradient is below this.
    tolerance: f64,
    length: f64,
    /// What a loss must be lower by to count.
    gain: f64,
    lowest: f64,
    /// Steps since it was.
    idle: u32,
}

impl Adam {
    /// With steps of a share of `scale`, the variables' natural size. A gradient below `tolerance` ends it, or losses that
    /// fall by less than `gain` for long: of sums in f32 a gradient is never quite 0.
    pub(super) fn new(scale: f64, tolerance: f64, gain: f64) -> Self {
        Self {
            rate: RATE * scale,
            mean: Vec::new(),
            square: Vec::new(),
            tolerance,
            length: f64::INFINITY,
            gain,
            lowest: f64::INFINITY,
            idle: 0,
        }
    }

    /// Take note of a step's loss.
    fn note(&mut self, cost: f64) {
        if cost < self.lowest - self.gain {
            (self.lowest, self.idle) = (cost, 0);
        } else {
            self.idle += 1;
        }
    }
}

impl<O> Solver<O, AdamState> for Adam
where
    O: CostFunction<Param = Vec<f64>, Output = f64> + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
{
    fn name(&self) -> &str {
        "adam"
    }

    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: AdamState,
    ) -> Result<(AdamState, Option<KV>), Error> {
        let at = state.take_param().unwrap_or_default();
        (self.mean, self.square) = (vec![0.0; at.len()], vec![0.0; at.len()]);
        let cost = problem.cost(&at)?;
        self.note(cost);
        let gradient = problem.gradient(&at)?;
        Ok((state.param(at).cost(cost).gradient(gradient), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: AdamState,
    ) -> Result<(AdamState, Option<KV>), Error> {
        let (Some(at), Some(gradient)) = (state.take_param(), state.take_gradient()) else {
            return Err(Error::msg("there is no point to go on from"));
        };
        let step = state.get_iter() as f64 + 1.0;
        let rate = self.rate / (1.0 + step / COOLING);
        let unbiased = DECAY.map(|decay| 1.0 - decay.powf(step));
        let mut moved = at.clone();
        for (i, g) in gradient.iter().enumerate() {
            self.mean[i] += (1.0 - DECAY[0]) * (g - self.mean[i]);
            self.square[i] += (1.0 - DECAY[1]) * (g * g - self.square[i]);
            moved[i] -= rate * self.mean[i] / unbiased[0] / ((self.square[i] / unbiased[1]).sqrt() + EPSILON);
        }
        let Ok(cost) = problem.cost(&moved) else {
            // Where the loss is not finite it turns back, slower and without its momentum.
            self.rate *= 0.5;
            self.mean.fill(0.0);
            let cost = state.get_cost();
            return Ok((state.param(at).cost(cost).gradient(gradient), None));
        };
        self.note(cost);
        let gradient = problem.gradient(&moved)?;
        self.length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        Ok((state.param(moved).cost(cost).gradient(gradient), None))
    }

    fn terminate(&mut self, _: &AdamState) -> TerminationStatus {
        if self.length <= self.tolerance || self.idle >= IDLE {
            return TerminationStatus::Terminated(TerminationReason::SolverConverged);
        }
        TerminationStatus::NotTerminated
    }
}
