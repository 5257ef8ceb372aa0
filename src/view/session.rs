//! All that the window holds, without a widget: the scenes, the values that one edits, the requested images, the fit
//! that runs.
//!
//! - `opening`: scenes and runs that are read; `edits`: what one does to the values; `places`: which view is looked at,
//!   and `camera`: from where
//! - `images`: which are requested, and what effects change in them
//! - `known`: what is known of a parameter beside its value
//! - `fits`: the fit beside the window; `files`: constants and scenes as files; `aside`: what is written beside the window

mod aside;
mod camera;
mod edits;
mod files;
mod fits;
mod images;
mod known;
mod opening;
mod places;

use aside::Aside;
pub use camera::Orbit;
pub use edits::GAINS;
use images::Before;
pub use images::Change;
pub use known::{START, least};
use opening::Opening;
pub use places::Place;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::engine::Point;
use crate::fitting::{Fitting, Step};
use crate::history::History;
use crate::host::{Fitted, Found, Host, ViewScore};
use crate::model::effects::Effect;
use crate::model::params::Params;
use crate::opened::Opened;
use crate::paint::{Job, PaintWorker, Painted, Slot, Wake};
use crate::skin::Skin;
use crate::start::Start;
use crate::values::Values;

/// The window's state. One of its scenes is looked at: what is said of constants, views and images is said of that.
pub struct Session {
    host: Arc<dyn Host>,
    start: Start,
    wake: Wake,
    opening: Option<Opening>,
    /// What is to be looked at in the place of this, once it is opened.
    next: Option<Box<Self>>,
    /// How many there were before this.
    number: u64,
    scenes: Vec<Arc<Opened>>,
    values: Option<History<Skin>>,
    first: Option<Skin>,
    fitted: Option<Vec<Point>>,
    other: Option<Vec<Point>>,
    other_fit: Option<Fitted>,
    found: Option<Found>,
    scores: Vec<ViewScore>,
    painter: PaintWorker,
    /// Which images somebody looks at.
    looked_at: Vec<Slot>,
    images: BTreeMap<Slot, Painted>,
    asked: BTreeMap<Slot, Arc<Job>>,
    engine: String,
    switched: Option<Before>,
    /// By scene and effect.
    changes: BTreeMap<(usize, &'static str), Change>,
    fitting: Option<Fitting>,
    path: Vec<Step>,
    /// The run folder that these steps were made in.
    path_of: PathBuf,
    aside: Aside,
    /// Which of the scenes is looked at, and which of its views.
    at: (usize, usize),
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
    /// Begin to open scenes; `wake` is called when there is something to [`poll`](Self::poll).
    #[must_use]
    pub fn new(host: Arc<dyn Host>, start: Start, wake: Wake) -> Self {
        let painter = PaintWorker::new(start.engine.clone(), Arc::clone(&wake));
        let mut session = Self {
            host,
            start,
            aside: Aside::new(Arc::clone(&wake)),
            wake,
            opening: None,
            next: None,
            number: 0,
            scenes: Vec::new(),
            values: None,
            first: None,
            fitted: None,
            other: None,
            other_fit: None,
            found: None,
            scores: Vec::new(),
            painter,
            looked_at: vec![Slot::Now],
            images: BTreeMap::new(),
            asked: BTreeMap::new(),
            engine: String::new(),
            switched: None,
            changes: BTreeMap::new(),
            fitting: None,
            path: Vec::new(),
            path_of: PathBuf::new(),
            at: (0, 0),
            orbit: Orbit::default(),
            terms: false,
            told: Vec::new(),
        };
        session.read(session.start.scenes.clone());
        session
    }

    /// Take in what was answered, and ask for what is to be shown.
    pub fn poll(&mut self) {
        self.follow_opening();
        self.follow_next();
        for answer in self.painter.answers().collect::<Vec<_>>() {
            self.painted(answer);
        }
        self.follow_fit();
        self.told.extend(self.aside.told());
        self.ask();
    }

    /// The scene that is looked at, once it is opened.
    #[must_use]
    pub fn opened(&self) -> Option<&Arc<Opened>> {
        self.scenes.get(self.at.0)
    }

    /// Every scene, once they are opened.
    #[must_use]
    pub fn scenes(&self) -> &[Arc<Opened>] {
        &self.scenes
    }

    /// The number of the scene that is looked at.
    #[must_use]
    pub const fn scene(&self) -> usize {
        self.at.0
    }

    /// The values that one edits.
    #[must_use]
    pub fn values(&self) -> Option<&Values> {
        self.values_of(self.at.0)
    }

    /// Those of a scene.
    #[must_use]
    pub fn values_of(&self, scene: usize) -> Option<&Values> {
        self.values.as_ref()?.now().scenes().get(scene)
    }

    /// Where the sliders began.
    #[must_use]
    pub fn first(&self) -> Option<&Values> {
        self.first.as_ref().map(|first| first.in_scene(self.at.0))
    }

    /// What the last fit found.
    #[must_use]
    pub fn fitted(&self) -> Option<&Params> {
        self.here(self.fitted.as_deref()).map(|point| &point.params)
    }

    /// The constants of the run that is compared.
    #[must_use]
    pub fn other(&self) -> Option<&Params> {
        self.here(self.other.as_deref()).map(|point| &point.params)
    }

    /// Whether there is anything to draw in a slot.
    #[must_use]
    pub const fn has(&self, slot: Slot) -> bool {
        match slot {
            Slot::Now | Slot::Start => true,
            Slot::Fit => self.fitted.is_some(),
            Slot::Other => self.other.is_some(),
        }
    }

    /// What a list has of the scene that is looked at.
    fn here<'a>(&self, points: Option<&'a [Point]>) -> Option<&'a Point> {
        points?.get(self.at.0)
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

    /// A slot's image of the scene that is looked at.
    #[must_use]
    pub fn image(&self, slot: Slot) -> Option<&Painted> {
        let path = self.opened()?.path();
        self.images.get(&slot).filter(|painted| painted.job.opened.path() == path)
    }

    /// What draws.
    #[must_use]
    pub fn engine(&self) -> &str {
        &self.engine
    }

    /// What an effect brought or took when it was switched last.
    #[must_use]
    pub fn change(&self, effect: Effect) -> Option<Change> {
        self.changes.get(&(self.scene(), effect.name())).copied()
    }

    /// The fit that runs.
    #[must_use]
    pub const fn fitting(&self) -> Option<&Fitting> {
        self.fitting.as_ref()
    }

    /// The steps of the fit that runs, or of the last one.
    #[must_use]
    pub fn path(&self) -> &[Step] {
        &self.path
    }

    /// The loss at the start and after each iteration, of the fit that runs or of the last one.
    #[must_use]
    pub fn losses(&self) -> Vec<f64> {
        match (&self.fitting, &self.found) {
            // Those of a fit that was resumed, too.
            (None, Some(found)) => found.losses.clone(),
            _ => self.path.iter().map(|step| step.iteration.loss).collect(),
        }
    }

    /// A number that is another once something else was [opened](Self::open).
    #[must_use]
    pub const fn number(&self) -> u64 {
        self.number
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

    /// Do something that takes a while, as writing a file, beside the window; what it says is told.
    pub fn aside(&mut self, work: impl FnOnce() -> String + Send + 'static) {
        self.aside.begin(work);
    }

    /// Whether scenes are being read.
    #[must_use]
    pub const fn is_opening(&self) -> bool {
        self.opening.is_some() || self.next.is_some()
    }

    /// Whether nothing is being opened, fitted, drawn or written.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        !self.is_opening() && self.fitting.is_none() && self.painter.is_idle() && self.aside.is_idle()
    }

    /// Give the adapter's device up, as a driver that is reset does: the window goes on without it.
    pub fn lose_device(&mut self) {
        self.painter.lose_device();
        self.asked.clear();
    }
}
