//! `argmin`'s executor runs every solver, watched: progress, state and interruption in one place.
//!
//! `argmin`'s own observers and checkpoints must live for ever (`'static`), and so can see neither a
//! caller's callback nor the state that several starts share. [`Watched`] wraps a solver instead: it
//! is a solver itself.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use argmin::core::{
    Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus,
};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::quasinewton::LBFGS;
use web_time::Instant;

use super::adam::{Adam, AdamState};
use super::bounded;
use super::error::FitError;
use super::linearisation::{EngineFault, Linearisation, Passes};
use super::lm::{LevenbergMarquardt, LmState};
use super::memory::Memory;
use super::options::{FitOptions, SolverKind};
use super::outcome::{Ending, Iteration};
use super::state::{Run, Saved, StateError};
use super::transform::Transform;
use super::unbounded::Unbounded;
use super::varpro::Elimination;
use crate::engine::Point;

/// How often the state is written.
const WRITE_EVERY: Duration = Duration::from_secs(1);
/// Curvature pairs that L-BFGS keeps: the usual 10, as many as there are unknowns or more.
const LBFGS_PAIRS: usize = 10;
/// The comparison solvers stop when the loss changes by less than this share of the first loss.
const COST_TOLERANCE: f64 = 1e-12;
/// They are run again while that gains more than this share of the first loss.
const RESTART_GAIN: f64 = 1e-6;
/// They have converged when the normal equations promise less than this share of the loss, or less
/// than [`RESTART_GAIN`]: their crude stops leave a simplex 1e-4 above the others'
/// answer, whereas one that is stuck is above it by percents.
const LEFT_TO_GAIN: f64 = 1e-3;
/// L-BFGS stops when the variables, scaled so that a step of 1 changes the image by 1, have this
/// share of the first residual to go.
const GRADIENT_TOLERANCE: f64 = 1e-7;

/// Is told of each iteration, and where it has led.
pub(super) type Watch<'a> = dyn FnMut(&Iteration, &Point) + 'a;

/// What is written down as solvers run.
pub(super) struct Log<'a> {
    pub(super) saved: Saved,
    passes: &'a Passes<'a>,
    options: &'a FitOptions,
    progress: &'a mut Watch<'a>,
    clock: Instant,
    seconds_before: f64,
    written: Option<Instant>,
}

impl<'a> Log<'a> {
    pub(super) fn new(
        saved: Saved,
        passes: &'a Passes<'a>,
        options: &'a FitOptions,
        progress: &'a mut Watch<'a>,
        clock: Instant,
    ) -> Self {
        let seconds_before = saved.seconds;
        Self { saved, passes, options, progress, clock, seconds_before, written: None }
    }

    /// The run that is going on: the last.
    fn run(&mut self) -> &mut Run {
        let last = self.saved.runs.len() - 1;
        &mut self.saved.runs[last]
    }

    fn record(&mut self, at: Vec<f64>, loss: f64, memory: Option<&Memory>) -> Result<(), Error> {
        // What a lost engine yields must not stand in the state that a later process resumes.
        self.passes.check()?;
        let run = self.run();
        // Our own solvers' point is the one to go on from; the others' best is kept.
        if memory.is_some() || loss < run.loss {
            (run.at, run.loss) = (at, loss);
        }
        run.memory = memory.cloned();
        let (iteration, loss) = (run.iterations, run.loss);
        self.stamp();
        let (evaluations, seconds) = (self.saved.evaluations, self.saved.seconds);
        let entry = Iteration { iteration, evaluations, loss, seconds };
        self.run().history.push(entry);
        let point = self.passes.coordinates().point(&self.run().at);
        (self.progress)(&entry, &point);
        match self.written {
            Some(then) if then.elapsed() < WRITE_EVERY => Ok(()),
            _ => Ok(self.write()?),
        }
    }

    fn stamp(&mut self) {
        self.saved.evaluations = self.passes.count();
        self.saved.seconds = self.seconds_before + self.clock.elapsed().as_secs_f64();
    }

    /// Write the state, if it is to be kept.
    pub(super) fn write(&mut self) -> Result<(), StateError> {
        self.stamp();
        self.written = Some(Instant::now());
        self.options.state.as_deref().map_or(Ok(()), |path: &Path| self.saved.write(path))
    }

    pub(super) fn interrupted(&self) -> bool {
        self.options.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::SeqCst))
    }

    fn iterations_left(&self) -> u64 {
        let most = self.options.max_iterations.unwrap_or(self.options.solver.default_iterations());
        most.saturating_sub(self.saved.runs.last().map_or(0, |run| run.iterations))
    }
}

/// What a solver lets others see of itself.
trait Remembers {
    fn memory(&self) -> Option<&Memory> {
        None
    }
}

impl Remembers for LevenbergMarquardt<'_> {
    fn memory(&self) -> Option<&Memory> {
        Some(self.memory())
    }
}
impl<L, P, G, F> Remembers for LBFGS<L, P, G, F> {}
impl<P, F> Remembers for NelderMead<P, F> {}
impl Remembers for Adam {}

/// A solver whose iterations are written down, and that ends when it is told to.
struct Watched<'w, 'a, S, M> {
    solver: S,
    log: &'w mut Log<'a>,
    /// From the solver's variables to coordinates.
    coordinates: M,
}

impl<S: Remembers, M: Fn(&[f64]) -> Vec<f64>> Watched<'_, '_, S, M> {
    fn record<I: State<Param = Vec<f64>, Float = f64>>(&mut self, state: &I) -> Result<(), Error> {
        // A solver that gives up may leave no point behind.
        if let Some(at) = state.get_param() {
            let at = (self.coordinates)(at);
            self.log.record(at, state.get_cost(), self.solver.memory())?;
        }
        Ok(())
    }
}

impl<O, I, S, M> Solver<O, I> for Watched<'_, '_, S, M>
where
    I: State<Param = Vec<f64>, Float = f64>,
    S: Solver<O, I> + Remembers,
    M: Fn(&[f64]) -> Vec<f64>,
{
    fn name(&self) -> &str {
        self.solver.name()
    }

    fn init(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        let (state, kv) = self.solver.init(problem, state)?;
        if self.log.run().history.is_empty() {
            self.record(&state)?;
        }
        Ok((state, kv))
    }

    fn next_iter(&mut self, problem: &mut Problem<O>, state: I) -> Result<(I, Option<KV>), Error> {
        let (state, kv) = self.solver.next_iter(problem, state)?;
        self.log.run().iterations += 1;
        self.record(&state)?;
        Ok((state, kv))
    }

    fn terminate(&mut self, state: &I) -> TerminationStatus {
        if self.log.interrupted() {
            return TerminationStatus::Terminated(TerminationReason::Interrupt);
        }
        self.solver.terminate(state)
    }
}

/// Run the last run of `log` until it ends.
pub(super) fn run(kind: SolverKind, log: &mut Log<'_>) -> Result<(), FitError> {
    match kind {
        SolverKind::Varpro | SolverKind::Lm => run_lm(kind, log),
        SolverKind::Lbfgs | SolverKind::NelderMead | SolverKind::Adam => run_unbounded(kind, log),
    }
}

fn run_lm(kind: SolverKind, log: &mut Log<'_>) -> Result<(), FitError> {
    let passes = log.passes;
    let coordinates = passes.coordinates();
    let elimination = (kind == SolverKind::Varpro).then(|| Elimination::new(coordinates));
    let (quadratic, tolerances) = (passes.is_quadratic(), log.options.tolerances);
    let run = log.run();
    let solver = match (run.memory.take(), run.model.take()) {
        (Some(memory), _) => {
            LevenbergMarquardt::resumed(coordinates, elimination, quadratic, tolerances, memory)
        }
        (None, first) => {
            let first = first.unwrap_or_else(|| passes.linearise(&run.at));
            LevenbergMarquardt::new(coordinates, elimination, quadratic, tolerances, first)
        }
    };
    let left = log.iterations_left();
    let watched = Watched { solver, log, coordinates: <[f64]>::to_vec };
    let ending = execute(Executor::new(passes, watched).configure(|s: LmState| s.max_iters(left)), kind)?;
    log.run().ending = Some(ending);
    Ok(())
}

/// Run one of `argmin`'s own solvers, and again from where it stopped for as long as that helps: its
/// line search may give up on curvature pairs that a fresh start forgets, a simplex that has
/// collapsed short of the answer finds on from a fresh one, and a variable whose transform has
/// flattened out near a bound is taken off it. Whether it has converged is not its own word but what
/// the normal equations say of where it stopped.
fn run_unbounded(kind: SolverKind, log: &mut Log<'_>) -> Result<(), FitError> {
    loop {
        let before = log.run().loss;
        let ending = run_once(kind, log)?;
        // What is known of the answer needs its normal equations; their loss is the exact one.
        let model = log.passes.linearise(&log.run().at.clone());
        log.passes.check()?;
        let ending = match ending {
            Ending::Converged | Ending::Stalled if is_settled(log, &model) => Ending::Converged,
            Ending::Converged | Ending::Stalled => Ending::Stalled,
            ended_by_others => ended_by_others,
        };
        let run = log.run();
        (run.loss, run.model, run.ending) = (model.loss, Some(model), Some(ending));
        let gave_up = match kind {
            SolverKind::NelderMead => matches!(ending, Ending::Converged | Ending::Stalled),
            _ => ending == Ending::Stalled,
        };
        if !gave_up || before - run.loss <= RESTART_GAIN * run.loss_start || log.iterations_left() == 0 {
            return Ok(());
        }
    }
}

/// Whether the gradient, projected onto the bounds and scaled by the curvatures, has nothing left to
/// say: the undamped step within the bounds, g'(J'J)^-1 g long, promises next to nothing.
fn is_settled(log: &mut Log<'_>, model: &Linearisation) -> bool {
    let step = bounded::minimise(&model.hessian, &model.gradient, &log.passes.coordinates().room(&model.at));
    -model.change(&step) <= (LEFT_TO_GAIN * model.loss).max(RESTART_GAIN * log.run().loss_start)
}

fn run_once(kind: SolverKind, log: &mut Log<'_>) -> Result<Ending, FitError> {
    let passes = log.passes;
    let at = log.run().at.clone();
    let first = log.run().model.take().filter(|model| model.at == at);
    let first = first.unwrap_or_else(|| passes.linearise(&at));
    let transform = Transform::new(passes.coordinates(), &first);
    let (left, scale) = (log.iterations_left(), log.run().loss_start);
    let problem = Unbounded::new(passes, &transform, kind != SolverKind::NelderMead);
    let coordinates = |y: &[f64]| transform.coordinates(y);
    let failed = |e: Error| FitError::Solver { solver: kind.name(), reason: e.to_string() };
    if kind == SolverKind::Lbfgs {
        let search = MoreThuenteLineSearch::new().with_bounds(1e-12, 1e6).map_err(failed)?;
        let solver: LBFGS<_, Vec<f64>, Vec<f64>, f64> = LBFGS::new(search, LBFGS_PAIRS)
            .with_tolerance_grad(GRADIENT_TOLERANCE * scale.sqrt())
            .and_then(|solver| solver.with_tolerance_cost(COST_TOLERANCE * scale))
            .map_err(failed)?;
        let start = transform.start().to_vec();
        let configure = |s: LmState| s.param(start).max_iters(left);
        let watched = Watched { solver, log, coordinates };
        execute(Executor::new(problem, watched).configure(configure), kind)
    } else if kind == SolverKind::Adam {
        let solver = Adam::new(scale.sqrt(), GRADIENT_TOLERANCE * scale.sqrt(), COST_TOLERANCE * scale);
        let start = transform.start().to_vec();
        let configure = |s: AdamState| s.param(start).max_iters(left);
        let watched = Watched { solver, log, coordinates };
        execute(Executor::new(problem, watched).configure(configure), kind)
    } else {
        let solver = NelderMead::new(transform.simplex(first.loss.sqrt()))
            .with_sd_tolerance(COST_TOLERANCE * scale)
            .map_err(failed)?;
        let configure = |s: IterState<Vec<f64>, (), (), (), (), f64>| s.max_iters(left);
        let watched = Watched { solver, log, coordinates };
        execute(Executor::new(problem, watched).configure(configure), kind)
    }
}

fn execute<O, I, S>(executor: Executor<O, S, I>, kind: SolverKind) -> Result<Ending, FitError>
where
    I: State<Param = Vec<f64>, Float = f64>,
    S: Solver<O, I>,
{
    match executor.ctrlc(false).timer(false).run() {
        Ok(result) => Ok(match result.state().get_termination_reason() {
            Some(TerminationReason::SolverConverged | TerminationReason::TargetCostReached) => {
                Ending::Converged
            }
            Some(TerminationReason::Interrupt) => Ending::Interrupted,
            Some(TerminationReason::SolverExit(_)) => Ending::Stalled,
            _ => Ending::RanOut,
        }),
        Err(error) => Err(match error.downcast::<StateError>() {
            Ok(error) => FitError::State(error),
            Err(error) => match error.downcast::<EngineFault>() {
                Ok(fault) => FitError::Engine(fault),
                Err(error) => FitError::Solver { solver: kind.name(), reason: error.to_string() },
            },
        }),
    }
}
