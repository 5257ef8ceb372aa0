//! Images, and how far they are from their targets, made beside the window.
//!
//! Of each slot the latest request wins: what was asked for before it is not drawn any more. An image is answered as soon
//! as it is there; its scores and terms follow when nothing else waits.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use skinfit_core::shader::Budget;
use web_time::Instant;

use crate::gpu::painter::{Beside, CpuPainter, GpuPainter, PaintError, Painter, Picture};
use crate::gpu::{Choice, Gpu, GpuError, RenderOptions};
use crate::model::effects::Effects;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::opened::Opened;
use crate::render::antialias::Antialias;
use crate::render::image::Image;
use crate::render::shading::Shading;
use crate::report::metrics::Comparison;
use crate::scene::view::Camera;

/// What an image is for; the first are drawn first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Slot {
    /// The sliders.
    Now,
    /// The last fit.
    Fit,
    /// Where the sliders began.
    Start,
    /// The run that is compared.
    Other,
}

/// An image that is asked for.
#[derive(Clone, Debug)]
pub struct Job {
    /// Its scene.
    pub opened: Arc<Opened>,
    /// At these constants.
    pub params: Params,
    /// A factor on it.
    pub gain: f64,
    /// From here.
    pub camera: Camera,
    /// The target to compare it with, where the camera is a view's.
    pub target: Option<Arc<Image>>,
    /// Whether its terms are wanted, too.
    pub terms: bool,
}

/// An image that was drawn.
#[derive(Clone, Debug)]
pub struct Painted {
    /// Radiance premultiplied by coverage.
    pub image: Arc<Image>,
    /// Each term alone.
    pub terms: Vec<(TermName, Arc<Image>)>,
    /// How far it is from its target.
    pub compared: Option<Compared>,
    /// How long it took, read back.
    pub seconds: f64,
    /// At these constants.
    pub params: Params,
    /// From here.
    pub camera: Camera,
    /// With these effects.
    pub effects: Effects,
    /// Whether it has a sample a pixel until one with all of the scene's follows.
    pub quick: bool,
    /// Bytes of the scene on the adapter; 0 of the CPU engine.
    pub uploaded: u64,
}

/// How long a whole image may take before those that are soon replaced have a sample a pixel: a frame's time on a card.
const LONG: f64 = 0.016;

/// How far an image is from its target.
#[derive(Clone, Debug)]
pub struct Compared {
    /// dB, as in the report.
    pub psnr: f64,
    /// The mean of the map.
    pub flip: f64,
    /// FLIP's error in each channel; no coverage where nothing is compared.
    pub map: Arc<Image>,
}

/// What the worker has to say.
#[derive(Debug)]
pub enum Answer {
    /// A slot's image; its scores and terms follow.
    Painted(Slot, Painted),
    /// A slot's image with scores and terms.
    Whole(Slot, Painted),
    /// A slot's image could not be drawn.
    Failed(Slot, String),
    /// What draws from now on.
    Engine(String),
    /// What the user should know.
    Told(String),
}

/// What draws.
#[derive(Clone, Debug, Default)]
pub struct Engine {
    /// The CPU, whether or not there is an adapter.
    pub cpu: bool,
    /// Part of the adapter's name.
    pub adapter: Option<String>,
}

/// How long nothing is asked for before scores and terms follow: a slider that is moved comes first.
const QUIET: Duration = Duration::from_millis(60);

/// Is called when there is an answer.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// The worker.
pub struct PaintWorker {
    shared: Arc<Shared>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    wanted: Mutex<Wanted>,
    changed: Condvar,
}

#[derive(Default)]
struct Wanted {
    jobs: BTreeMap<Slot, Job>,
    /// Images whose scores and terms are to follow, once nothing is asked for that long.
    follow: BTreeMap<Slot, (Job, Painted)>,
    /// What is being done.
    under_way: bool,
    /// Whether the device is to be given up, as if it were lost.
    lose: bool,
    over: bool,
}

impl Shared {
    fn wanted(&self) -> MutexGuard<'_, Wanted> {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for PaintWorker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PaintWorker").field("idle", &self.is_idle()).finish()
    }
}

impl PaintWorker {
    /// Begin; `wake` is called when there is an answer.
    #[must_use]
    pub fn new(engine: Engine, wake: Wake) -> Self {
        let shared = Arc::new(Shared::default());
        let (send, answers) = channel();
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("paint".to_owned());
        let thread = thread
            .spawn(move || Work { engine, send, wake, gpu: None, slow: false, scene: None }.run(&theirs))
            .ok();
        Self { shared, answers, thread }
    }

    /// Have an image drawn, in the place of the one that was asked for in this slot.
    pub fn ask(&self, slot: Slot, job: Job) {
        let mut wanted = self.shared.wanted();
        wanted.follow.remove(&slot);
        wanted.jobs.insert(slot, job);
        self.shared.changed.notify_one();
    }

    /// What was answered since.
    pub fn answers(&self) -> impl Iterator<Item = Answer> + '_ {
        self.answers.try_iter()
    }

    /// Whether everything that was asked for is answered.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        // What a thread that has ended was asked for never comes.
        if self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
            return true;
        }
        let wanted = self.shared.wanted();
        wanted.jobs.is_empty() && wanted.follow.is_empty() && !wanted.under_way
    }

    /// Give the device up, as a driver that is reset does.
    pub fn lose_device(&self) {
        self.shared.wanted().lose = true;
    }
}

impl Drop for PaintWorker {
    fn drop(&mut self) {
        self.shared.wanted().over = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panic of the worker's has been told on standard error.
            let _ = thread.join();
        }
    }
}

/// The worker's own.
struct Work {
    engine: Engine,
    send: Sender<Answer>,
    wake: Wake,
    gpu: Option<Gpu>,
    /// Whether a whole image takes long.
    slow: bool,
    scene: Option<(Arc<Opened>, Box<dyn Painter>)>,
}

/// Layers by their names.
type Layers = Vec<(String, Image)>;

/// What is done next.
enum Next {
    Paint(Slot, Box<Job>),
    Follow(Slot, Box<(Job, Painted)>),
}

impl Work {
    fn run(mut self, shared: &Shared) {
        while let Some((next, lose)) = next(shared) {
            if lose && let Some(gpu) = &self.gpu {
                gpu.close();
            }
            let follow = match next {
                Next::Paint(slot, job) => self.paint(slot, *job),
                Next::Follow(slot, what) => {
                    let (job, painted) = *what;
                    self.follow(slot, &job, painted);
                    None
                }
            };
            let mut wanted = shared.wanted();
            if let Some((slot, job, painted)) = follow
                && !wanted.jobs.contains_key(&slot)
            {
                wanted.follow.insert(slot, (job, painted));
            }
            wanted.under_way = false;
            drop(wanted);
            (self.wake)();
        }
    }

    fn answer(&self, answer: Answer) {
        // The window may be gone.
        let _ = self.send.send(answer);
        (self.wake)();
    }

    fn paint(&mut self, slot: Slot, job: Job) -> Option<(Slot, Job, Painted)> {
        match self.picture(&job, false, self.slow) {
            Ok((_, painted)) => {
                self.answer(Answer::Painted(slot, painted.clone()));
                Some((slot, job, painted))
            }
            Err(error) => {
                self.answer(Answer::Failed(slot, error.to_string()));
                None
            }
        }
    }

    fn follow(&mut self, slot: Slot, job: &Job, mut painted: Painted) {
        if painted.quick {
            match self.picture(job, false, false) {
                Ok((_, whole)) => painted = whole,
                Err(error) => return self.answer(Answer::Failed(slot, error.to_string())),
            }
        }
        if job.terms {
            let named = |(name, image): (String, Image)| Some((TermName::from_name(&name)?, Arc::new(image)));
            match self.picture(job, true, false) {
                Ok((layers, _)) => painted.terms = layers.into_iter().filter_map(named).collect(),
                Err(error) => return self.answer(Answer::Failed(slot, error.to_string())),
            }
        }
        painted.compared = job.target.as_ref().and_then(|target| compared(target, &painted.image));
        self.answer(Answer::Whole(slot, painted));
    }

    /// An image, and its layers where they are wanted. Where the device fails, the CPU engine draws from now on.
    fn picture(&mut self, job: &Job, layers: bool, quick: bool) -> Result<(Layers, Painted), PaintError> {
        match self.drawn(job, layers, quick) {
            Err(PaintError::Gpu(error)) => {
                self.answer(Answer::Told(format!("{error} The CPU engine draws from now on.")));
                (self.engine.cpu, self.gpu, self.scene) = (true, None, None);
                self.drawn(job, layers, quick)
            }
            done => done,
        }
    }

    fn drawn(&mut self, job: &Job, layers: bool, quick: bool) -> Result<(Layers, Painted), PaintError> {
        if self.scene.as_ref().is_none_or(|(opened, _)| !Arc::ptr_eq(opened, &job.opened)) {
            self.scene = None;
            let painter = self.painter(&job.opened)?;
            self.answer(Answer::Engine(painter.name()));
            self.scene = Some((Arc::clone(&job.opened), painter));
        }
        let Some((_, painter)) = &mut self.scene else { return Err(GpuError::NoAdapter.into()) };
        let samples = job.opened.baked.scene.quality.samples_per_axis;
        // The CPU engine keeps its samples: it has no use for fewer.
        let quick = quick && !self.engine.cpu;
        painter.set_samples(if quick { 1 } else { samples });
        painter.set_params(&job.params)?;
        let start = Instant::now();
        let Picture { image, layers, .. } =
            painter.paint(&job.camera, job.gain, Beside { layers, haze: false })?;
        let seconds = start.elapsed().as_secs_f64();
        if !quick && layers.is_empty() {
            self.slow = seconds > LONG && samples > 1;
        }
        let uploaded = painter.uploaded_bytes();
        let image = Arc::new(image);
        let painted = Painted {
            image,
            terms: Vec::new(),
            compared: None,
            seconds,
            uploaded,
            params: job.params.clone(),
            camera: job.camera,
            effects: job.opened.baked.scene.effects,
            quick,
        };
        Ok((layers, painted))
    }

    fn painter(&mut self, opened: &Opened) -> Result<Box<dyn Painter>, PaintError> {
        if !self.engine.cpu && self.gpu.is_none() {
            let choice = Choice { name: self.engine.adapter.clone(), ..Choice::default() };
            self.gpu = Some(Gpu::open(&choice)?);
        }
        let Some(gpu) = self.gpu.as_ref().filter(|_| !self.engine.cpu) else {
            return Ok(Box::new(CpuPainter::new(&opened.baked)?));
        };
        let options = RenderOptions {
            antialias: Antialias::Grid(opened.baked.scene.quality.samples_per_axis),
            shading: Shading::default(),
            budget: Budget::Exact,
            timed: false,
            animated: false,
        };
        Ok(Box::new(GpuPainter::new(gpu.clone(), &opened.baked, options)?))
    }
}

/// Wait for something to do, and whether the device is to be given up first; `None` when it is over.
fn next(shared: &Shared) -> Option<(Next, bool)> {
    let mut wanted = shared.wanted();
    let mut quiet = false;
    loop {
        if wanted.over {
            return None;
        }
        let next = match wanted.jobs.pop_first() {
            Some((slot, job)) => Some(Next::Paint(slot, Box::new(job))),
            None if quiet => wanted.follow.pop_first().map(|(slot, what)| Next::Follow(slot, Box::new(what))),
            None => None,
        };
        if let Some(next) = next {
            wanted.under_way = true;
            return Some((next, std::mem::take(&mut wanted.lose)));
        }
        if wanted.follow.is_empty() {
            wanted = shared.changed.wait(wanted).unwrap_or_else(PoisonError::into_inner);
        } else {
            let (woken, waited) =
                shared.changed.wait_timeout(wanted, QUIET).unwrap_or_else(PoisonError::into_inner);
            (wanted, quiet) = (woken, waited.timed_out());
        }
    }
}

/// How far an image is from its target; `None` where it covers no pixel.
fn compared(target: &Image, image: &Image) -> Option<Compared> {
    if target.rgb.len() != image.rgb.len() {
        return None;
    }
    let comparison = Comparison::new(target, image, &image.alpha);
    let scores = comparison.scores()?;
    let map = Image {
        width: image.width,
        height: image.height,
        rgb: comparison.flip_map().iter().map(|&error| [error; 3]).collect(),
        alpha: comparison.covered().iter().map(|&covered| f32::from(u8::from(covered))).collect(),
    };
    Some(Compared { psnr: scores.psnr, flip: scores.flip, map: Arc::new(map) })
}
