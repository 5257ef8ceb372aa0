//! Images, and how far they are from their targets, made beside the window.
//!
//! Of each slot the latest request wins: requests before it are not drawn any more. An image is answered as soon
//! as it is there; its scores and terms follow when nothing else waits.
//!
//! - `work`: what is done; `thread`: on a thread; `browser`: between the events of a browser's worker

#[cfg(target_family = "wasm")]
mod browser;
#[cfg(not(target_family = "wasm"))]
mod thread;
mod work;

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::model::gain::Gain;
use crate::model::params::Params;
use crate::model::terms::TermName;
use crate::opened::Opened;
use crate::render::image::Image;
use crate::scene::view::Camera;
#[cfg(target_family = "wasm")]
use browser::{Changed, Task};
#[cfg(not(target_family = "wasm"))]
use thread::{Changed, Task};
use work::{Next, Piece, Work};

/// What an image is for; the first are drawn first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Slot {
    /// The sliders.
    #[default]
    Now,
    /// The last fit.
    Fit,
    /// Where the sliders began.
    Start,
    /// The run that is compared.
    Other,
}

impl Slot {
    /// Every one.
    pub const ALL: [Self; 4] = [Self::Now, Self::Fit, Self::Start, Self::Other];
}

/// A requested image.
#[derive(Clone, Debug)]
pub struct Job {
    /// Its scene.
    pub opened: Arc<Opened>,
    /// At these constants.
    pub params: Params,
    /// A factor on it.
    pub gain: Gain,
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
    /// The request.
    pub job: Arc<Job>,
    /// Whether it has a sample a pixel until one with all of the scene's follows.
    pub quick: bool,
    /// Whether it is its scene's first: most of its time went into what is made once.
    pub cold: bool,
    /// Bytes of the scene on the adapter; 0 of the CPU engine.
    pub uploaded: u64,
}

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

/// Is called when there is an answer.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Milliseconds without a request before scores and terms follow: a slider that is moved comes first.
const QUIET: u32 = 60;

/// The worker.
pub struct PaintWorker {
    shared: Arc<Shared>,
    answers: Receiver<Answer>,
    task: Task,
}

#[derive(Default)]
struct Shared {
    wanted: Mutex<Wanted>,
    changed: Changed,
}

#[derive(Default)]
struct Wanted {
    jobs: BTreeMap<Slot, Arc<Job>>,
    /// Images whose scores and terms are to follow, after `QUIET` without a request.
    follow: BTreeMap<Slot, Painted>,
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

    /// Whether a request is open.
    fn is_asked(&self) -> bool {
        !self.wanted().jobs.is_empty()
    }
}

impl Wanted {
    /// What is done next: a requested image, or after a `quiet` time what follows; `None` when there is nothing.
    fn next(&mut self, quiet: bool) -> Option<Piece> {
        let (slot, next) = match self.jobs.pop_first() {
            Some((slot, job)) => (slot, Next::Paint(job)),
            None if quiet => {
                let (slot, painted) = self.follow.pop_first()?;
                (slot, Next::Follow(Box::new(painted)))
            }
            None => return None,
        };
        self.under_way = true;
        Some(Piece { slot, next, lose: std::mem::take(&mut self.lose) })
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
        let task = Task::begin(Arc::clone(&shared), move || Work::new(engine, send, wake));
        Self { shared, answers, task }
    }

    /// Have an image drawn, in the place of the one requested in this slot.
    pub fn ask(&self, slot: Slot, job: Arc<Job>) {
        let mut wanted = self.shared.wanted();
        wanted.follow.remove(&slot);
        wanted.jobs.insert(slot, job);
        drop(wanted);
        self.shared.changed.tell();
    }

    /// What was answered since.
    pub fn answers(&self) -> impl Iterator<Item = Answer> + '_ {
        self.answers.try_iter()
    }

    /// Whether every request is answered.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        // Requests to a worker that has ended are never answered.
        if self.task.is_over() {
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
        self.shared.changed.tell();
        self.task.end();
    }
}
