//! All that the window holds, without a widget: the scene, the values that one edits, the images that are asked for, the
//! fit that runs.

mod camera;
mod progress;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

pub use camera::Orbit;
pub use progress::watch_progress;
pub(crate) use progress::words as progress_words;

use crate::fit::outcome::{Ending, Outcome};
use crate::fit::params_file::{Origin, ParamsFile};
use crate::fitting::{Fitting, Message, Step};
use crate::history::History;
use crate::host::{FitRequest, Fitted, Host, ViewScore};
use crate::model::effects::Effect;
use crate::model::params::{Param, Params};
use crate::opened::{Opened, Reading};
use crate::paint::{Answer, Engine, Job, PaintWorker, Painted, Slot, Wake};
use crate::scene::view::Camera;
use crate::values::Values;

/// What a window begins with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// The scene.
    pub reading: Reading,
    /// Constants that were fitted to it, as `params.toml`.
    pub fitted: Option<PathBuf>,
    /// Constants of another run, to be compared.
    pub other: Option<PathBuf>,
    /// Where fits are left.
    pub run: PathBuf,
    /// What draws.
    pub engine: Engine,
}

/// What an effect brought when it was turned on, or took when it was turned off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// Seconds a frame.
    pub seconds: f64,
    /// Bytes on the adapter.
    pub bytes: i64,
    /// dB of the view that is shown, where it has a target.
    pub psnr: Option<f64>,
}

/// What was known of the image before an effect was switched.
#[derive(Clone, Copy, Debug)]
struct Before {
    effect: Effect,
    seconds: f64,
    uploaded: u64,
    psnr: Option<f64>,
}

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
    outcome: Option<Outcome>,
    scores: Vec<ViewScore>,
    painter: PaintWorker,
    images: BTreeMap<Slot, Painted>,
    asked: BTreeMap<Slot, Job>,
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
            outcome: None,
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
        let thread = std::thread::Builder::new().name("open".to_owned());
        let work = move || {
            // The window may be gone.
            let _ = send.send(Opened::read(&reading));
            wake();
        };
        if let Err(error) = thread.spawn(work) {
            self.told.push(format!("no thread can be had: {error}"));
        }
        self.opening = Some(opening);
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
        self.told.extend(
            opened
                .baked
                .warnings
                .iter()
                .filter(|words| !self.told.contains(words))
                .cloned()
                .collect::<Vec<_>>(),
        );
        let scene = Values::of(&opened.baked);
        let first = self.values.is_none().then_some(scene);
        let params = |file: &Option<PathBuf>| -> Option<Result<Params, String>> {
            let (scene, file) = (&opened.baked.scene, file.as_ref()?);
            let read = ParamsFile::read(file, scene.form, &scene.params);
            Some(read.map(|file| file.of_scene(&scene.path).params).map_err(|error| error.to_string()))
        };
        let (fitted, other) = (params(&self.start.fitted), params(&self.start.other));
        for (place, read) in [(&mut self.fitted, fitted), (&mut self.other, other)] {
            match read {
                Some(Ok(params)) if place.is_none() => *place = Some(params),
                Some(Err(error)) if !self.told.contains(&error) => self.told.push(error),
                _ => {}
            }
        }
        if let Some(scene) = first {
            // A run's sliders stand where its fit ended.
            let params = self.fitted.clone().unwrap_or_else(|| scene.params.clone());
            self.values = Some(History::new(Values { params, ..scene.clone() }));
            self.first = Some(scene);
        }
        self.view = self.view.min(opened.views().len().saturating_sub(1));
        self.opened = Some(opened);
        self.asked.clear();
    }

    fn painted(&mut self, answer: Answer) {
        match answer {
            Answer::Painted(slot, mut painted) => {
                if !self.is_asked(slot, &painted) {
                    return;
                }
                if let Some(before) =
                    self.images.remove(&slot).filter(|before| before.camera == painted.camera)
                {
                    // Until its own are there, those of the image before are shown.
                    (painted.terms, painted.compared) = (before.terms, before.compared);
                }
                self.images.insert(slot, painted);
            }
            Answer::Whole(slot, painted) => {
                if !self.is_asked(slot, &painted) {
                    return;
                }
                self.images.insert(slot, painted);
                if slot == Slot::Now {
                    self.weigh();
                }
            }
            Answer::Failed(slot, words) => {
                self.images.remove(&slot);
                self.told.push(words);
            }
            Answer::Engine(name) => self.engine = name,
            Answer::Told(words) => self.told.push(words),
        }
    }

    /// Whether an image is of the scene and the camera that are shown now.
    fn is_asked(&self, slot: Slot, painted: &Painted) -> bool {
        self.asked.get(&slot).is_some_and(|asked| {
            asked.camera == painted.camera && asked.opened.baked.scene.effects == painted.effects
        })
    }

    /// What the effect that was switched has changed, once its image is there.
    fn weigh(&mut self) {
        let drawn = self.images.get(&Slot::Now).map(|now| now.effects);
        let wanted = self.values.as_ref().map(|values| values.now().effects);
        if drawn != wanted {
            return;
        }
        if let (Some(before), Some(now)) = (self.switched.take(), self.images.get(&Slot::Now)) {
            let psnr = now.compared.as_ref().map(|compared| compared.psnr);
            let change = Change {
                seconds: now.seconds - before.seconds,
                bytes: now.uploaded as i64 - before.uploaded as i64,
                psnr: psnr.zip(before.psnr).map(|(now, before)| now - before),
            };
            self.changes.insert(before.effect.name(), change);
        }
    }

    fn follow_fit(&mut self) {
        let Some(fitting) = &self.fitting else { return };
        let views = self.opened.as_ref().map(|opened| opened.views().to_vec()).unwrap_or_default();
        for message in fitting.messages() {
            match message {
                Message::Step(step) => {
                    if let Some(history) = &mut self.values {
                        history.drag(|values| values.take(&step.point, &views));
                    }
                    self.path.push(*step);
                }
                Message::Done(done) => {
                    self.fitting = None;
                    match *done {
                        Ok(fitted) => self.fitted_to(fitted),
                        Err(error) => self.told.push(error),
                    }
                    if let Some(history) = &mut self.values {
                        history.settle();
                    }
                    return;
                }
            }
        }
    }

    fn fitted_to(&mut self, Fitted { outcome, views }: Fitted) {
        self.scores = views;
        if let Some(history) = &mut self.values {
            let views = self.opened.as_ref().map_or(&[][..], |opened| opened.views());
            history.drag(|values| values.take(&outcome.end, views));
        }
        if outcome.ending != Ending::Converged {
            self.told.push(format!(
                "the fit {}.",
                match outcome.ending {
                    Ending::Interrupted => "was stopped",
                    ending => ending.words(),
                }
            ));
        }
        self.fitted = Some(outcome.end.params.clone());
        self.outcome = Some(outcome);
    }

    /// Ask for every image that is not the one that would be drawn now.
    fn ask(&mut self) {
        let (Some(opened), Some(values), Some(camera)) = (&self.opened, &self.values, self.camera()) else {
            return;
        };
        let values = values.now();
        if values.effects != opened.baked.scene.effects {
            if self.opening.is_none() {
                let effects = Some(values.effects);
                self.read(Reading { effects, params: None, ..self.start.reading.clone() });
            }
            return;
        }
        let first = self.first.as_ref().map(|first| &first.params);
        let wanted = [
            (Slot::Now, Some(&values.params)),
            (Slot::Fit, self.fitted.as_ref()),
            (Slot::Start, first),
            (Slot::Other, self.other.as_ref()),
        ];
        let at_home = self.is_at_home();
        for (slot, params) in wanted {
            let Some(params) = params else { continue };
            let job = Job {
                opened: Arc::clone(opened),
                params: params.clone(),
                gain: values.gains.get(self.view).copied().unwrap_or(1.0),
                camera,
                target: opened.targets.get(self.view).cloned().flatten().filter(|_| at_home),
                terms: self.terms && slot == Slot::Now,
            };
            if self.asked.get(&slot).is_none_or(|asked| !same(asked, &job)) {
                self.asked.insert(slot, job.clone());
                self.painter.ask(slot, job);
            }
        }
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

    /// What is known of the last fit of this window.
    #[must_use]
    pub const fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
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

    /// The steps of the fit that runs, or of the last one.
    #[must_use]
    pub fn path(&self) -> &[Step] {
        &self.path
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

    /// Turn an effect on or off: a step of the history. What that changes is told once its image is there.
    pub fn set_effect(&mut self, effect: Effect, on: bool) {
        let now = self.images.get(&Slot::Now);
        self.switched = now.map(|now| Before {
            effect,
            seconds: now.seconds,
            uploaded: now.uploaded,
            psnr: now.compared.as_ref().map(|compared| compared.psnr),
        });
        if let Some(history) = self.history() {
            history.edit(|values| values.set_effect(effect, on));
        }
    }

    /// Fit from where the sliders stand; `resume`: go on with the fit that was stopped.
    pub fn begin_fit(&mut self, resume: bool) {
        let (Some(opened), Some(values), None) = (&self.opened, &mut self.values, &self.fitting) else {
            return;
        };
        values.settle();
        let request = FitRequest {
            scene: opened.path().to_owned(),
            values: values.now().clone(),
            run: self.start.run.clone(),
            resume,
        };
        if !resume {
            self.path.clear();
        }
        (self.outcome, self.scores) = (None, Vec::new());
        self.fitting = Some(Fitting::begin(Arc::clone(&self.host), request, Arc::clone(&self.wake)));
    }

    /// Take the constants of a `params.toml`: a step of the history.
    pub fn load_params(&mut self, file: &Path) {
        if let (Some(opened), Some(history), None) = (&self.opened, &mut self.values, &self.fitting) {
            let scene = &opened.baked.scene;
            match ParamsFile::read(file, scene.form, &history.now().params) {
                Ok(read) => {
                    let read = read.of_scene(&scene.path);
                    let names: Vec<String> = opened.views().iter().map(|view| view.name.clone()).collect();
                    history.edit(|values| {
                        values.params = read.params;
                        for (name, gain) in &read.gains {
                            let place = names.iter().position(|other| other == name);
                            if let Some(own) = place.and_then(|place| values.gains.get_mut(place)) {
                                *own = *gain;
                            }
                        }
                    });
                }
                Err(error) => self.told.push(error.to_string()),
            }
        }
    }

    /// Leave the constants as a `params.toml`.
    pub fn save_params(&mut self, file: &Path) {
        let (Some(opened), Some(values)) = (&self.opened, self.values()) else { return };
        let scene = &opened.baked.scene;
        let names = scene.views.iter().map(|view| view.name.clone());
        let saved = ParamsFile {
            form: scene.form,
            effects: Some(values.effects),
            loss: None,
            params: values.params.clone(),
            gains: names.zip(values.gains.iter().copied()).collect(),
            scenes: Vec::new(),
        };
        let origin = Origin { scene: &scene.path, outcome: None, set: &[], numbers: &[] };
        let done = saved.write(file, origin);
        self.told.push(match done {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error.to_string(),
        });
    }

    /// Leave the scene with the window's values as a scene file.
    pub fn save_scene(&mut self, file: &Path) {
        let (Some(opened), Some(values)) = (&self.opened, &self.values) else { return };
        let done = self.host.save_scene(opened.path(), values.now(), file);
        self.told.push(match done {
            Ok(()) => format!("wrote {}", file.display()),
            Err(error) => error,
        });
    }
}

/// Whether two jobs draw the same.
fn same(a: &Job, b: &Job) -> bool {
    let target = match (&a.target, &b.target) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    };
    Arc::ptr_eq(&a.opened, &b.opened)
        && (a.gain, a.camera, a.terms) == (b.gain, b.camera, b.terms)
        && target
        && Param::all().all(|param| a.params.rgb(param) == b.params.rgb(param))
}
