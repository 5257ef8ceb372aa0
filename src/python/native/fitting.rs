//! A fit, step by step: the command line's own, on a thread of its own. It waits after each step until the next one is
//! requested, so that whoever watches it may stop it there.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, PyRef, PyResult, Python, pyclass, pymethods};
use skinfit_core::engine::Point;
use skinfit_core::fit::outcome::Iteration;
use skinfit_core::model::params::Param;
use skinfit_host::contained::{Heard, contained};

use crate::asked::Asked;
use crate::errors::Refused;
use crate::fault::provoked;
use crate::scene::Scene;
use crate::waiting::{SLICE, begin, guarded, here, locked, not_forked};

/// An iteration, and where it has led in each scene.
struct Step {
    iteration: Iteration,
    points: Vec<Point>,
}

/// What the fit's thread says.
enum Message {
    Step(Step),
    Over(Box<Result<Heard, Refused>>),
}

/// How a fit ended.
enum End {
    /// What the command line would have said.
    Done(Heard),
    Refused(Refused),
}

/// What is heard of a fit within a slice.
enum Next {
    Step(Step),
    Nothing,
    Over,
}

/// A fit under way. Dropped, it stops soon.
#[pyclass(frozen, module = "skinfit._native")]
pub(crate) struct Fitting {
    interrupt: Arc<AtomicBool>,
    messages: Mutex<Receiver<Message>>,
    /// Gone once the fit is not to wait any more.
    go_on: Mutex<Option<Sender<()>>>,
    /// Whether it waits after a step.
    waits: AtomicBool,
    end: Mutex<Option<End>>,
    /// The constants that are told of each scene.
    shown: Vec<Vec<Param>>,
}

/// A step as Python has it: iteration, evaluations, loss, seconds, constants of each scene.
type PyStep<'py> = (u64, u64, f64, f64, Vec<Bound<'py, PyDict>>);

#[pymethods]
impl Fitting {
    /// Begin a fit of these scenes as one skin into the folder `run`, without the views that are held out, by further words
    /// of the command line; or go on with the one that was stopped there.
    #[new]
    #[pyo3(signature = (scenes, run, words, hold_out, resume = false))]
    fn new(
        scenes: Vec<PyRef<'_, Scene>>,
        run: PathBuf,
        words: Vec<String>,
        hold_out: Vec<String>,
        resume: bool,
    ) -> PyResult<Self> {
        let reads = scenes.iter().map(|scene| Arc::clone(&scene.0)).collect();
        fitting(here(|| Asked::new(reads, run, words, hold_out, resume))?)
    }

    /// Whether it ended.
    #[getter]
    fn is_over(&self) -> bool {
        locked(&self.end).is_some()
    }

    /// The next step; `None` when the fit is over. What a signal raises leaves it under way.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<PyStep<'py>>> {
        not_forked()?;
        loop {
            match py.detach(|| self.hear()) {
                Next::Step(step) => return self.told(py, &step).map(Some),
                Next::Over => return self.ended().map(|_| None),
                Next::Nothing => py.check_signals()?,
            }
        }
    }

    /// Wait until one that was stopped is over, but no longer than `seconds`: whether it is.
    fn see_off(&self, py: Python<'_>, seconds: f64) -> PyResult<bool> {
        not_forked()?;
        let (begun, most) = (Instant::now(), Duration::try_from_secs_f64(seconds).unwrap_or_default());
        while !matches!(py.detach(|| self.hear()), Next::Over) {
            py.check_signals()?;
            if begun.elapsed() > most {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Have it end after the iteration that it is at, with what it has found.
    fn stop(&self) {
        self.interrupt.store(true, Ordering::SeqCst);
        // Nobody lets it go on any more: it does so by itself.
        locked(&self.go_on).take();
    }

    /// Go on to its end: what the command line would print, on standard output and on standard error.
    fn finish(&self, py: Python<'_>) -> PyResult<(Vec<String>, Vec<String>)> {
        while self.next(py)?.is_some() {}
        self.ended()
    }
}

impl Fitting {
    /// Have it go on where it waits, and hear of it. One thread at a time does: the one that takes the last word has kept
    /// it before another can find that nobody is left to send.
    fn hear(&self) -> Next {
        let messages = locked(&self.messages);
        if self.is_over() {
            return Next::Over;
        }
        if self.waits.swap(false, Ordering::SeqCst)
            && let Some(go_on) = &*locked(&self.go_on)
        {
            // It may have ended meanwhile.
            let _ = go_on.send(());
        }
        let end = match messages.recv_timeout(SLICE) {
            Ok(Message::Step(step)) => {
                self.waits.store(true, Ordering::SeqCst);
                return Next::Step(step);
            }
            Err(RecvTimeoutError::Timeout) => return Next::Nothing,
            Ok(Message::Over(end)) => match *end {
                Ok(heard) => End::Done(heard),
                Err(refused) => End::Refused(refused),
            },
            Err(RecvTimeoutError::Disconnected) => {
                End::Refused(Refused::Fault("the fit ended without a word".to_owned()))
            }
        };
        *locked(&self.end) = Some(end);
        Next::Over
    }

    /// What it said, on standard output and on standard error, or why it was refused.
    fn ended(&self) -> PyResult<(Vec<String>, Vec<String>)> {
        match &*locked(&self.end) {
            Some(End::Done(heard)) => Ok((heard.said.clone(), heard.told.clone())),
            Some(End::Refused(refused)) => Err(refused.raised()),
            None => Ok((Vec::new(), Vec::new())),
        }
    }

    fn told<'py>(&self, py: Python<'py>, step: &Step) -> PyResult<PyStep<'py>> {
        let Iteration { iteration, evaluations, loss, seconds } = step.iteration;
        let constants = |(point, shown): (&Point, &Vec<Param>)| {
            let all = PyDict::new(py);
            shown.iter().try_for_each(|&param| all.set_item(param.name(), point.params.rgb(param)))?;
            Ok(all)
        };
        let constants: PyResult<Vec<_>> = step.points.iter().zip(&self.shown).map(constants).collect();
        Ok((iteration, evaluations, loss, seconds, constants?))
    }
}

impl Drop for Fitting {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Begin a fit on a thread.
fn fitting(asked: Asked) -> PyResult<Fitting> {
    let ((send, messages), (go_on, goes)) = (channel(), channel());
    let interrupt = Arc::new(AtomicBool::new(false));
    let (stop, shown) = (Arc::clone(&interrupt), asked.shown());
    let work = move || {
        let mut watch = |iteration: &Iteration, points: &[Point]| {
            provoked();
            let _ = send.send(Message::Step(Step { iteration: *iteration, points: points.to_vec() }));
            // Until it is to go on, or nobody is left to say so.
            let _ = goes.recv();
        };
        let done = guarded(|| contained(|| asked.fit(&mut watch, &stop)));
        let done = done.and_then(|(fitted, heard)| fitted.map(|()| heard));
        let _ = send.send(Message::Over(Box::new(done)));
    };
    begin("skinfit fit", work)?;
    Ok(Fitting {
        interrupt,
        messages: Mutex::new(messages),
        go_on: Mutex::new(Some(go_on)),
        waits: AtomicBool::new(false),
        end: Mutex::new(None),
        shown,
    })
}
