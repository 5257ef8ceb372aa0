//! A fit, step by step: the command line's own, on a thread of its own. It waits after each step until the next one is
//! asked for, so that whoever watches it may stop it there.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, PyErr, PyRef, PyResult, Python, pyclass, pymethods};
use skinfit_core::engine::Point;
use skinfit_core::fit::outcome::Iteration;
use skinfit_core::model::params::Param;
use skinfit_core::prepare::scene_names;
use skinfit_host::cli::CommandLine;
use skinfit_host::contained::{Heard, contained};
use skinfit_view::FitRequest;
use skinfit_view::host::FitScene;

use crate::errors::Refused;
use crate::scene::Scene;
use crate::waiting::{guarded, locked, next};

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
    Refused(PyErr),
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
    /// Begin a fit of these scenes as one skin into the folder `run`, by further words of the command line; or go on with
    /// the one that was stopped there.
    #[new]
    #[pyo3(signature = (scenes, run, words, resume = false))]
    fn new(scenes: Vec<PyRef<'_, Scene>>, run: PathBuf, words: Vec<String>, resume: bool) -> PyResult<Self> {
        let paths: Vec<PathBuf> = scenes.iter().map(|scene| scene.0.path.clone()).collect();
        let names = scene_names(&paths).map_err(Refused::from)?;
        let asked = |(name, scene): (String, &PyRef<'_, Scene>)| FitScene {
            name,
            path: scene.0.path.clone(),
            values: scene.0.values(),
        };
        let asked: Vec<FitScene> = names.into_iter().zip(&scenes).map(asked).collect();
        let shown = asked.iter().map(|scene| scene.values.rows()).collect();
        let cache = scenes.first().and_then(|scene| scene.0.cache.clone());
        let kept = match &cache {
            Some(cache) => vec!["--cache".to_owned(), cache.display().to_string()],
            None => vec!["--no-cache".to_owned()],
        };
        let line = CommandLine { words: [kept, words].concat(), cache };
        let request = FitRequest { scenes: asked, start: String::new(), run, resume };
        begin(line, request, shown)
    }

    /// Whether it ended.
    #[getter]
    fn is_over(&self) -> bool {
        locked(&self.end).is_some()
    }

    /// The next step; `None` when the fit is over. What a signal raises leaves it under way.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<PyStep<'py>>> {
        if self.is_over() {
            return Ok(None);
        }
        if self.waits.swap(false, Ordering::SeqCst)
            && let Some(go_on) = &*locked(&self.go_on)
        {
            // It may have ended meanwhile.
            let _ = go_on.send(());
        }
        match next(py, &self.messages)? {
            Message::Step(step) => {
                self.waits.store(true, Ordering::SeqCst);
                Ok(Some(self.told(py, &step)?))
            }
            Message::Over(end) => {
                *locked(&self.end) = Some(match *end {
                    Ok(heard) => End::Done(heard),
                    Err(refused) => End::Refused(refused.into()),
                });
                Ok(None)
            }
        }
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
        match &*locked(&self.end) {
            Some(End::Done(heard)) => Ok((heard.said.clone(), heard.told.clone())),
            Some(End::Refused(error)) => Err(error.clone_ref(py)),
            None => Ok((Vec::new(), Vec::new())),
        }
    }
}

impl Fitting {
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
fn begin(line: CommandLine, request: FitRequest, shown: Vec<Vec<Param>>) -> PyResult<Fitting> {
    let ((send, messages), (go_on, goes)) = (channel(), channel());
    let interrupt = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&interrupt);
    let work = move || {
        let mut watch = |iteration: &Iteration, points: &[Point]| {
            let _ = send.send(Message::Step(Step { iteration: *iteration, points: points.to_vec() }));
            // Until it is to go on, or nobody is left to say so.
            let _ = goes.recv();
        };
        let done = guarded(|| contained(|| line.fit(&request, &mut watch, &stop)));
        let done = done.and_then(|(fitted, heard)| match fitted {
            Ok(_) => Ok(heard),
            Err(refusal) => Err(Refused::Fit(refusal.words().to_owned())),
        });
        let _ = send.send(Message::Over(Box::new(done)));
    };
    std::thread::Builder::new().name("skinfit fit".to_owned()).spawn(work)?;
    Ok(Fitting {
        interrupt,
        messages: Mutex::new(messages),
        go_on: Mutex::new(Some(go_on)),
        waits: AtomicBool::new(false),
        end: Mutex::new(None),
        shown,
    })
}
