//! The worker that fits, with the CPU engine. Nothing may wait in a browser, and what is asked of a worker arrives between
//! its turns alone: so a fit is done in slices, each of which goes on from the state that the last one left, to the bit as
//! if there had been none.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use js_sys::Function;
use wasm_bindgen::JsError;
use wasm_bindgen::prelude::wasm_bindgen;
use web_time::Instant;

use crate::engine::Point;
use crate::fit::outcome::{Ending, Outcome};
use crate::fit::{FitOptions, fit_watched};
use crate::held::hold;
use crate::message::{Ask, At, Request, Say, Told};
use crate::prepare::{
    Baked, JointScene, JointScenes, Loaded, NamedScene, PrepareError, PrepareOptions, ReadyScene,
    read_one_skin_each,
};
use crate::render::shade::Shader;
use crate::report::compared::compared;
use crate::report::metrics::Comparison;
use crate::told::tell_progress;
use skinfit_view::host::{Found, ViewScore};
use skinfit_view::opened::Reading;

/// Milliseconds that a slice takes at the least.
const SLICE: u128 = 200;
/// What a slice leaves for the next.
const STATE: &str = "/fit/state.json";

/// A worker's fits.
#[wasm_bindgen]
pub struct Fitter {
    scenes: Vec<Reading>,
    under_way: Option<UnderWay>,
    /// Whether it is to do nothing for now.
    paused: bool,
    /// What it has to say.
    say: Vec<Say>,
}

/// A fit, and how far it is.
struct UnderWay {
    request: Request,
    scenes: JointScenes,
    /// Whether there is a state to go on from.
    begun: bool,
    outcome: Option<Outcome>,
    running: bool,
}

#[wasm_bindgen]
impl Fitter {
    /// Over the page's scene, as an archive; `tell` is called with words on long work.
    ///
    /// # Errors
    /// When it is none.
    #[wasm_bindgen(constructor)]
    pub fn new(archive: &[u8], tell: Function) -> Result<Self, JsError> {
        tell_progress(tell);
        let held = hold(archive).map_err(|words| JsError::new(&words))?;
        Ok(Self { scenes: held.readings(), under_way: None, paused: false, say: Vec::new() })
    }

    /// Do what is asked, as JSON.
    ///
    /// # Errors
    /// When it is something else.
    pub fn ask(&mut self, ask: &str) -> Result<(), JsError> {
        match serde_json::from_str(ask)? {
            Ask::Fit(request) => {
                (self.paused, self.under_way) = (false, None);
                match UnderWay::new(request, &self.scenes) {
                    Ok(fit) => self.under_way = Some(fit),
                    Err(words) => self.say.push(Say::Failed { words }),
                }
            }
            Ask::Resume(request) => {
                self.paused = false;
                let words = match &mut self.under_way {
                    Some(fit) if fit.request.goes_on_as(&request) => {
                        fit.running = true;
                        return Ok(());
                    }
                    Some(_) => {
                        "the fit that was stopped had other effects, free constants or views. Put these back, or fit."
                    }
                    None => "there is no fit to go on with: this page has stopped none. Fit.",
                };
                self.say.push(Say::Failed { words: words.to_owned() });
            }
            Ask::Pause { on } => self.paused = on,
            Ask::Stop => {
                self.paused = false;
                if let Some(fit) = self.under_way.as_mut().filter(|fit| fit.running) {
                    let said = fit.done();
                    self.say.push(said);
                }
            }
        }
        Ok(())
    }

    /// Fit for a while: whether there is more to do.
    pub fn slice(&mut self) -> bool {
        let running = |fit: &&mut UnderWay| fit.running;
        let Some(fit) = self.under_way.as_mut().filter(running).filter(|_| !self.paused) else {
            return false;
        };
        fit.slice(&mut self.say);
        fit.running
    }

    /// What it has to say, as a list of JSON texts.
    pub fn said(&mut self) -> Vec<String> {
        // Numbers and names are all that is in them: they can be written.
        self.say.drain(..).filter_map(|say| serde_json::to_string(&say).ok()).collect()
    }
}

impl UnderWay {
    /// The scenes as they are fitted, as the command line does it.
    fn new(request: Request, readings: &[Reading]) -> Result<Self, String> {
        // Lights and terms of the scenes' own are known once they were read.
        for reading in readings {
            let known = Loaded::read(&reading.scene, &PrepareOptions::default());
            known.map_err(|error| error.to_string())?;
        }
        let (mut scenes, mut free) = (Vec::new(), Vec::new());
        for (reading, asked) in readings.iter().zip(&request.scenes) {
            free.push(asked.free()?);
            let options = PrepareOptions {
                fit: true,
                effects: Some(asked.effects()?),
                cache: reading.cache.clone(),
                ..PrepareOptions::default()
            };
            scenes.push((reading.scene.clone(), options));
        }
        let scenes = read_one_skin_each(&scenes, |number, loaded| {
            request.scenes[number].set(loaded, free[number].clone());
        });
        let scenes = scenes.map_err(|error| error.to_string())?;
        let marks = NamedScene::marked(&scenes, &request.hold_out).map_err(|error| error.to_string())?;
        let ready = |(NamedScene { name, loaded }, marks): (NamedScene, Vec<bool>)| {
            let (baked, held) = loaded.bake()?.hold_out(&marks)?;
            // A scene of which all is held out has nothing to be fitted.
            if held.is_all_of(&baked.scene) {
                return Ok(ReadyScene { name, baked, held, engine: None });
            }
            // Files that are held in memory stay there: what is found with the samples is not kept.
            let observed = Baked { cache: None, ..baked }.sample()?.observe()?;
            let engine = observed.engine()?;
            Ok(ReadyScene { name, baked: observed.baked, held, engine: Some(Box::new(engine)) })
        };
        let ready: Result<Vec<ReadyScene>, PrepareError> = scenes.into_iter().zip(marks).map(ready).collect();
        let scenes = ready.and_then(JointScenes::new).map_err(|error| error.to_string())?;
        Ok(Self { request, scenes, begun: false, outcome: None, running: true })
    }

    /// Some iterations; the end is said.
    fn slice(&mut self, say: &mut Vec<Say>) {
        let (since, over) = (Instant::now(), Arc::new(AtomicBool::new(false)));
        let state = PathBuf::from(STATE);
        let options = FitOptions {
            resume: self.begun.then(|| state.clone()),
            state: Some(state),
            interrupt: Some(Arc::clone(&over)),
            bounds: self.scenes.bounds(),
            effects: Some(self.scenes.effects()),
            widths: self.scenes.widths(),
            ..FitOptions::default()
        };
        let mut watch = |iteration: &_, point: &Point| {
            let at = self.scenes.points(point).iter().map(At::of).collect();
            say.push(Say::Step { iteration: *iteration, at });
            if since.elapsed().as_millis() >= SLICE {
                over.store(true, Ordering::SeqCst);
            }
        };
        let fitted = fit_watched(&self.scenes.joint, &self.scenes.start, &options, &mut watch);
        self.begun = true;
        match fitted {
            Ok(outcome) => {
                let more = outcome.ending == Ending::Interrupted;
                self.outcome = Some(outcome);
                if !more {
                    say.push(self.done());
                }
            }
            Err(error) => {
                self.running = false;
                say.push(Say::Failed { words: error.to_string() });
            }
        }
    }

    /// The end, with what was found up to now.
    fn done(&mut self) -> Say {
        self.running = false;
        let Some(outcome) = &self.outcome else {
            return Say::Failed { words: "the fit was stopped before its first iteration.".to_owned() };
        };
        match scores(&self.scenes, &outcome.end) {
            Ok(views) => {
                let ends = self.scenes.points(&outcome.end);
                let found = Found::of(outcome, ends, |name| self.scenes.label(name));
                Say::Done { found: Told::of(&found), views }
            }
            Err(words) => Say::Failed { words },
        }
    }
}

/// How good each view is, as the report says.
fn scores(scenes: &JointScenes, end: &Point) -> Result<Vec<ViewScore>, String> {
    let mut scores = Vec::new();
    for part in &scenes.parts {
        let JointScene { baked, held, .. } = part;
        let own = scenes.point_of(part, end);
        let shader = Shader::new(baked.setup(), &baked.illumination, &own.params);
        let shader = shader.map_err(|error| error.to_string())?;
        let fitted = baked.scene.views.iter().zip(scenes.views(part)).zip(&own.gains);
        let held = held.views.iter().zip(&held.observed).zip(&held.gains);
        let all = fitted.map(|view| (view, false)).chain(held.map(|view| (view, true)));
        for (((view, observed), &gain), held_out) in all {
            let image = shader.shade(&observed.samples, &view.camera, gain).image;
            let (target, coverage) = compared(view, observed, &image);
            if let Some(found) = Comparison::new(&target, &image, &coverage).scores() {
                let (psnr, ssim, flip) = (found.psnr, found.ssim, found.flip);
                let view = scenes.view_name(part, &view.name);
                scores.push(ViewScore { view, held_out, psnr, ssim, flip });
            }
        }
    }
    Ok(scores)
}
