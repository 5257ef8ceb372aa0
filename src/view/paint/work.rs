//! What the worker does: requested images first, then scores and terms of what was drawn.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use skinfit_core::shader::Budget;
use web_time::Instant;

use super::{Answer, Compared, Engine, Job, Painted, Shared, Slot, Wake};
use crate::gpu::painter::{Beside, CpuPainter, GpuPainter, PaintError, Painter, Picture};
use crate::gpu::{Choice, Gpu, GpuError, RenderOptions};
use crate::model::gain::Gain;
use crate::model::terms::TermName;
use crate::opened::Opened;
use crate::render::antialias::Antialias;
use crate::render::image::Image;
use crate::render::shading::Shading;
use crate::report::metrics::Comparison;
use crate::scene::view::Camera;

/// How long a whole image may take before those that are soon replaced have a sample a pixel: a frame's time on a card.
const LONG: f64 = 0.016;

/// The worker's own.
pub(super) struct Work {
    engine: Engine,
    send: Sender<Answer>,
    wake: Wake,
    gpu: Option<Gpu>,
    /// Whether a whole image takes long.
    slow: bool,
    /// What draws each scene, the last one that did last.
    painters: Vec<Drawing>,
}

/// What draws a scene.
struct Drawing {
    opened: Arc<Opened>,
    painter: Box<dyn Painter>,
    /// Whether it has drawn: of the first image most is making pipelines.
    warm: bool,
}

/// Scenes whose painters are kept: one goes back and forth between them.
const MOST: usize = 4;

/// Layers by their names.
type Layers = Vec<(String, Image)>;

/// What is done next, and whether the device is to be given up first.
pub(super) struct Piece {
    pub(super) slot: Slot,
    pub(super) next: Next,
    pub(super) lose: bool,
}

/// An image, or what follows it.
pub(super) enum Next {
    Paint(Arc<Job>),
    Follow(Box<Painted>),
}

impl Work {
    pub(super) const fn new(engine: Engine, send: Sender<Answer>, wake: Wake) -> Self {
        Self { engine, send, wake, gpu: None, slow: false, painters: Vec::new() }
    }

    /// Do what is next.
    pub(super) async fn step(&mut self, Piece { slot, next, lose }: Piece, shared: &Shared) {
        if lose && let Some(gpu) = &self.gpu {
            gpu.close();
        }
        let follow = match next {
            Next::Paint(job) => self.paint(slot, &job).await,
            Next::Follow(painted) => self.follow(slot, *painted, shared).await,
        };
        let mut wanted = shared.wanted();
        if let Some(painted) = follow
            && !wanted.jobs.contains_key(&slot)
        {
            wanted.follow.insert(slot, painted);
        }
        wanted.under_way = false;
        drop(wanted);
        (self.wake)();
    }

    fn answer(&self, answer: Answer) {
        // The window may be gone.
        let _ = self.send.send(answer);
        (self.wake)();
    }

    async fn paint(&mut self, slot: Slot, job: &Arc<Job>) -> Option<Painted> {
        match self.picture(job, false, self.slow).await {
            Ok((_, painted)) => {
                self.answer(Answer::Painted(slot, painted.clone()));
                Some(painted)
            }
            Err(error) => self.failed(slot, &error),
        }
    }

    /// What follows an image: it with all samples, its terms, its scores. Requests in between come first: then the
    /// image so far is given back, to be followed once more.
    async fn follow(&mut self, slot: Slot, mut painted: Painted, shared: &Shared) -> Option<Painted> {
        let job = Arc::clone(&painted.job);
        if painted.quick || painted.cold {
            match self.picture(&job, false, false).await {
                Ok((_, whole)) => painted = whole,
                Err(error) => return self.failed(slot, &error),
            }
        }
        if shared.is_asked() {
            return Some(painted);
        }
        if job.terms && painted.terms.is_empty() {
            let named = |(name, image): (String, Image)| Some((TermName::from_name(&name)?, Arc::new(image)));
            match self.picture(&job, true, false).await {
                Ok((layers, _)) => painted.terms = layers.into_iter().filter_map(named).collect(),
                Err(error) => return self.failed(slot, &error),
            }
        }
        if shared.is_asked() {
            return Some(painted);
        }
        painted.compared = job.target.as_ref().and_then(|target| compared(target, &painted.image));
        self.answer(Answer::Whole(slot, painted));
        None
    }

    fn failed(&self, slot: Slot, error: &PaintError) -> Option<Painted> {
        self.answer(Answer::Failed(slot, error.to_string()));
        None
    }

    /// An image, and its layers where they are wanted. Where the device fails, the CPU engine draws from now on.
    async fn picture(
        &mut self,
        job: &Arc<Job>,
        layers: bool,
        quick: bool,
    ) -> Result<(Layers, Painted), PaintError> {
        match self.drawn(job, layers, quick).await {
            Err(PaintError::Gpu(error)) => {
                self.answer(Answer::Told(format!("{error} The CPU engine draws from now on.")));
                (self.engine.cpu, self.gpu) = (true, None);
                self.painters.clear();
                self.drawn(job, layers, quick).await
            }
            done => done,
        }
    }

    async fn drawn(
        &mut self,
        job: &Arc<Job>,
        layers: bool,
        quick: bool,
    ) -> Result<(Layers, Painted), PaintError> {
        // The CPU engine keeps its samples: it has no use for fewer.
        let quick = quick && !self.engine.cpu;
        let Drawing { painter, warm, .. } = self.drawing(&job.opened).await?;
        let samples = job.opened.baked.scene.quality.samples_per_axis;
        painter.set_samples(if quick { 1 } else { samples });
        painter.set_params(&job.params)?;
        let start = Instant::now();
        let Picture { image, layers, .. } =
            drawn_by(&mut **painter, &job.camera, job.gain, Beside { layers, haze: false }).await?;
        let seconds = start.elapsed().as_secs_f64();
        let cold = !std::mem::replace(warm, true);
        let uploaded = painter.uploaded_bytes();
        if !quick && layers.is_empty() {
            self.slow = seconds > LONG && samples > 1;
        }
        let image = Arc::new(image);
        let painted = Painted {
            image,
            terms: Vec::new(),
            compared: None,
            seconds,
            uploaded,
            job: Arc::clone(job),
            quick,
            cold,
        };
        Ok((layers, painted))
    }

    /// What draws a scene, which is made where there is none.
    async fn drawing(&mut self, opened: &Arc<Opened>) -> Result<&mut Drawing, PaintError> {
        let place = self.painters.iter().position(|drawing| Arc::ptr_eq(&drawing.opened, opened));
        let drawing = match place {
            Some(place) => self.painters.remove(place),
            None => {
                // Of a scene that was read anew nobody asks for the one before.
                self.painters.retain(|drawing| drawing.opened.path() != opened.path());
                if self.painters.len() >= MOST {
                    self.painters.remove(0);
                }
                let painter = self.painter(opened).await?;
                self.answer(Answer::Engine(painter.name()));
                Drawing { opened: Arc::clone(opened), painter, warm: false }
            }
        };
        self.painters.push(drawing);
        self.painters.last_mut().ok_or_else(|| GpuError::NoAdapter.into())
    }

    async fn painter(&mut self, opened: &Opened) -> Result<Box<dyn Painter>, PaintError> {
        let cpu = self.engine.cpu || opened.baked.scene.cpu_alone().is_some();
        if !cpu && self.gpu.is_none() {
            let choice = Choice { name: self.engine.adapter.clone(), ..Choice::default() };
            self.gpu = Some(Gpu::request(&choice).await?);
        }
        let Some(gpu) = self.gpu.as_ref().filter(|_| !cpu) else {
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

/// A picture; waited for where one may wait.
async fn drawn_by(
    painter: &mut dyn Painter,
    camera: &Camera,
    gain: Gain,
    beside: Beside,
) -> Result<Picture, PaintError> {
    #[cfg(target_family = "wasm")]
    return painter.paint_async(camera, gain, beside).await;
    #[cfg(not(target_family = "wasm"))]
    painter.paint(camera, gain, beside)
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
