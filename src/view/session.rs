//! All that the window holds, without a widget: the scene, the values that one edits, the images that are asked for, the
//! fit that runs.
//!
//! - `images`: which are asked for, and what effects change in them; `camera`: where they are seen from
//! - `known`: what is known of a parameter beside its value
//! - `fits`: the fit beside the window; `files`: constants and scenes as files

mod camera;
mod files;
mod fits;
mod images;
mod known;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

pub use camera::Orbit;
use images::Before;
pub use images::Change;

use crate::engine::Point;
use crate::fit::params_file::ParamsFile;
use crate::fitting::{Fitting, Step};
use crate::history::History;
use crate::host::{Fitted, Found, Host, ViewScore};
use crate::model::effects::Effect;
use crate::model::params::{Param, Params};
use crate::opened::{Opened, Reading};
use crate::paint::{Job, PaintWorker, Painted, Slot, Wake};
use crate::reported::reported;
use crate::scene::view::Camera;
use crate::start::{Run, Start};
use crate::values::Values;

/// The window's state.
pub struct Session {
    host: Arc<dyn Host>,
    start: Start,
    wake: Wake,
    opening: Option<Receiver<Result<Opened, String>>>,
    opened: Option<Arc<Opened>>,
    values: Option<History<Values>>,
    first: Option<Values>,
    fitted: Option<Params>,
    other: Option<Params>,
    other_fit: Option<Fitted>,
    found: Option<Found>,
    scores: Vec<ViewScore>,
    painter: PaintWorker,
    images: BTreeMap<Slot, Painted>,
    asked: BTreeMap<Slot, Arc<Job>>,
    engine: String,
    switched: Option<Before>,
    changes: BTreeMap<&'static str, Change>,
    fitting: Option<Fitting>,
    path: Vec<Step>,
    /// Which of the views is looked at.
    pub view: usize,
    /// How the camera is turned away from the view's.
    pub orbit: Orbit,
    /// Whether terms are wanted of the image of the sliders.
    pub terms: bool,
    told: Vec<String>,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("start", &self.start).finish_non_exhaustive()
    }
}

impl Session {
    /// Begin to open a scene; `wake` is called when there is something to [`poll`](Self::poll).
    #[must_use]
    pub fn new(host: Arc<dyn Host>, start: Start, wake: Wake) -> Self {
        let painter = PaintWorker::new(start.engine.clone(), Arc::clone(&wake));
        let mut session = Self {
            host,
            start,
            wake,
            opening: None,
            opened: None,
            values: None,
            first: None,
            fitted: None,
            other: None,
            other_fit: None,
            found: None,
            scores: Vec::new(),
            painter,
            images: BTreeMap::new(),
            asked: BTreeMap::new(),
            engine: String::new(),
            switched: None,
            changes: BTreeMap::new(),
            fitting: None,
            path: Vec::new(),
            view: 0,
            orbit: Orbit::default(),
            terms: false,
            told: Vec::new(),
        };
        session.read(session.start.reading.clone());
        session
    }

    fn read(&mut self, reading: Reading) {
        let (send, opening) = channel();
        let wake = Arc::clone(&self.wake);
        let work = move || {
            // The window may be gone.
            let _ = send.send(Opened::read(&reading));
            wake();
        };
        if let Err(error) = aside(work) {
            self.told.push(format!("no thread can be had: {error}"));
        }
        self.opening = Some(opening);
    }

    /// Look at another scene or run in the place of this one; not while a fit runs.
    pub fn open(&mut self, path: &Path) {
        if self.fitting.is_some() {
            self.told.push("a fit is under way: stop it first.".to_owned());
            return;
        }
        match self.host.start(path) {
            Ok(start) => {
                let start = Start { engine: self.start.engine.clone(), ..start };
                *self = Self::new(Arc::clone(&self.host), start, Arc::clone(&self.wake));
            }
            Err(error) => self.told.push(error),
        }
    }

    /// Compare another run, or the constants of a file.
    pub fn compare(&mut self, path: &Path) {
        let Some(opened) = self.opened.clone() else { return };
        match self.host.run(path) {
            Ok(run) => {
                let (other, other_fit) = self.left_by(&opened, Some(&run));
                (self.other, self.other_fit) = (other.map(|other| other.params), other_fit);
            }
            Err(error) => self.told.push(error),
        }
    }

    /// Take in what was answered, and ask for what is to be shown.
    pub fn poll(&mut self) {
        self.follow_opening();
        for answer in self.painter.answers().collect::<Vec<_>>() {
            self.painted(answer);
        }
        self.follow_fit();
        self.ask();
    }

    fn follow_opening(&mut self) {
        let Some(opening) = &self.opening else { return };
        let opened = match opening.try_recv() {
            Ok(opened) => opened,
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => {
                Err("the scene could not be read by a fault of skinfit's, told on standard error. Please report it."
                    .to_owned())
            }
        };
        self.opening = None;
        match opened {
            Ok(opened) => self.take(opened),
            Err(error) => {
                self.told.push(error);
                // What is shown stays, with its effects: the step to others is taken back.
                if let (Some(history), Some(opened)) = (&mut self.values, &self.opened) {
                    let effects = opened.baked.scene.effects;
                    history.refuse(|values| values.effects == effects);
                }
            }
        }
    }

    fn take(&mut self, opened: Opened) {
        let opened = Arc::new(opened);
        for words in &opened.baked.warnings {
            if !self.told.contains(words) {
                self.told.push(words.clone());
            }
        }
        let scene = Values::of(&opened.baked);
        let first = self.values.is_none().then(|| scene.clone());
        if let Some(scene) = first {
            let (fitted, known) = self.left_by(&opened, self.start.fitted.clone().as_ref());
            let (found, views) = known.map(|Fitted { found, views }| (found, views)).unzip();
            (self.found, self.scores) = (found, views.unwrap_or_default());
            let (other, other_fit) = self.left_by(&opened, self.start.other.clone().as_ref());
            (self.other, self.other_fit) = (other.map(|other| other.params), other_fit);
            // A run's sliders stand where its fit ended.
            let mut values = scene.clone();
            if let Some(Point { params, gains }) = fitted {
                self.fitted = Some(params.clone());
                (values.params, values.gains) = (params, gains);
            }
            self.values = Some(History::new(values));
            self.first = Some(scene);
        }
        // A scene may bring effects along: lights one each, morph targets with weights.
        let loaded = opened.baked.scene.effects;
        if let Some(history) = &mut self.values {
            history.amend(|values| values.effects = loaded);
        }
        self.view = self.view.min(opened.views().len().saturating_sub(1));
        self.opened = Some(opened);
        self.asked.clear();
    }

    /// What a run has left: its constants, and what is known of them. What cannot be read is told.
    fn left_by(&mut self, opened: &Opened, run: Option<&Run>) -> (Option<Point>, Option<Fitted>) {
        let Some(Run { params, report }) = run else { return (None, None) };
        let scene = &opened.baked.scene;
        let file = match ParamsFile::read(params, scene.form, &scene.params) {
            Ok(file) => file.of_scene(&scene.path),
            Err(error) => {
                self.told.push(error.to_string());
                return (None, None);
            }
        };
        let mut gains = opened.baked.gains.clone();
        files::take_gains(&file, opened.views(), &mut gains);
        let end = Point { params: file.params, gains };
        let known = report.as_ref().map(|report| reported(report, end.clone()));
        let known = known.transpose().unwrap_or_else(|error| {
            self.told.push(error);
            None
        });
        (Some(end), known)
    }

    /// The camera that images are seen from.
    #[must_use]
    pub fn camera(&self) -> Option<Camera> {
        let opened = self.opened.as_ref()?;
        let view = opened.views().get(self.view)?;
        Some(self.orbit.turned(&view.camera, opened.extent.0))
    }

    /// Whether images are seen from the view's own camera.
    #[must_use]
    pub fn is_at_home(&self) -> bool {
        self.orbit == Orbit::default()
    }

    /// The scene, once it is opened.
    #[must_use]
    pub const fn opened(&self) -> Option<&Arc<Opened>> {
        self.opened.as_ref()
    }

    /// The values that one edits.
    #[must_use]
    pub fn values(&self) -> Option<&Values> {
        self.values.as_ref().map(History::now)
    }

    /// Those and their past, to edit them; not while a fit moves them.
    pub fn history(&mut self) -> Option<&mut History<Values>> {
        if self.fitting.is_some() { None } else { self.values.as_mut() }
    }

    /// Whether there is a step back, and one forward.
    #[must_use]
    pub fn steps(&self) -> (bool, bool) {
        let idle = self.values.as_ref().filter(|_| self.fitting.is_none());
        idle.map_or((false, false), |history| (history.can_undo(), history.can_redo()))
    }

    /// Turn the environment's light by so many degrees, as part of a drag.
    pub fn turn_light(&mut self, degrees: f64) {
        if let Some(history) = self.history() {
            history.drag(|values| {
                let at = values.params.scalar(Param::EnvironmentRotation) + degrees;
                values.params.set(Param::EnvironmentRotation, (at + 540.0).rem_euclid(360.0) - 180.0);
            });
        }
    }

    /// Where the sliders began.
    #[must_use]
    pub const fn first(&self) -> Option<&Values> {
        self.first.as_ref()
    }

    /// What the last fit found.
    #[must_use]
    pub const fn fitted(&self) -> Option<&Params> {
        self.fitted.as_ref()
    }

    /// The constants of the run that is compared.
    #[must_use]
    pub const fn other(&self) -> Option<&Params> {
        self.other.as_ref()
    }

    /// What is known of those, and how good they are, where there is a report of it.
    #[must_use]
    pub const fn other_fit(&self) -> Option<&Fitted> {
        self.other_fit.as_ref()
    }

    /// What is known of the last fit of this window.
    #[must_use]
    pub const fn found(&self) -> Option<&Found> {
        self.found.as_ref()
    }

    /// How good the last fit of this window is in each view.
    #[must_use]
    pub fn scores(&self) -> &[ViewScore] {
        &self.scores
    }

    /// A slot's image.
    #[must_use]
    pub fn image(&self, slot: Slot) -> Option<&Painted> {
        self.images.get(&slot)
    }

    /// What draws.
    #[must_use]
    pub fn engine(&self) -> &str {
        &self.engine
    }

    /// What an effect brought or took when it was switched last.
    #[must_use]
    pub fn change(&self, effect: Effect) -> Option<Change> {
        self.changes.get(effect.name()).copied()
    }

    /// The fit that runs.
    #[must_use]
    pub const fn fitting(&self) -> Option<&Fitting> {
        self.fitting.as_ref()
    }

    /// The same, to pause or stop it.
    pub const fn fitting_mut(&mut self) -> Option<&mut Fitting> {
        self.fitting.as_mut()
    }

    /// The steps of the fit that runs, or of the last one.
    #[must_use]
    pub fn path(&self) -> &[Step] {
        &self.path
    }

    /// The loss at the start and after each iteration, of the fit that runs or of the last one.
    #[must_use]
    pub fn losses(&self) -> Vec<f64> {
        match (self.path.is_empty(), &self.found) {
            (true, Some(found)) => found.losses.clone(),
            _ => self.path.iter().map(|step| step.iteration.loss).collect(),
        }
    }

    /// Where fits are left.
    #[must_use]
    pub fn run_folder(&self) -> &Path {
        &self.start.run
    }

    /// Leave fits elsewhere.
    pub fn set_run_folder(&mut self, run: PathBuf) {
        self.start.run = run;
    }

    /// What the user should know, the newest last.
    #[must_use]
    pub fn told(&self) -> &[String] {
        &self.told
    }

    /// Let the user know.
    pub fn tell(&mut self, words: String) {
        self.told.push(words);
    }

    /// That it is known.
    pub fn forget_told(&mut self) {
        self.told.clear();
    }

    /// Whether a scene is being read.
    #[must_use]
    pub const fn is_opening(&self) -> bool {
        self.opening.is_some()
    }

    /// Whether all that is asked for is there.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.opening.is_none() && self.fitting.is_none() && self.painter.is_idle()
    }

    /// Give the adapter's device up, as a driver that is reset does: the window goes on without it.
    pub fn lose_device(&mut self) {
        self.painter.lose_device();
        self.asked.clear();
    }
}

/// Do long work on a thread of its own; in a browser's worker, which is one, at once.
fn aside(work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    #[cfg(target_family = "wasm")]
    work();
    #[cfg(not(target_family = "wasm"))]
    std::thread::Builder::new().name("open".to_owned()).spawn(work)?;
    Ok(())
}
