//! The worker that draws: a session, told what one does on the page.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use js_sys::Function;
use skinfit_core::render::image::Image;
use skinfit_view::fitting::{FitControl, Tell};
use skinfit_view::look::{Look, Pane};
use skinfit_view::paint::Engine;
use skinfit_view::pixels::{pixels, ramp};
use skinfit_view::shown::{self, Kind};
use skinfit_view::table::{constants, scores};
use skinfit_view::values::Values;
use skinfit_view::{FitRequest, Host, Run, Session, Start};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsError, JsValue};

use crate::command::{self, Command, pane};
use crate::held::hold;
use crate::message::{Ask, Request, Say};
use crate::model::params::Column;
use crate::state::State;
use crate::told::tell_progress;

thread_local! {
    static WAKE: RefCell<Option<Function>> = const { RefCell::new(None) };
}

/// Have the page poll soon.
fn wake() {
    WAKE.with_borrow(|wake| {
        if let Some(wake) = wake {
            // It only notes that it is to poll.
            let _ = wake.call0(&JsValue::UNDEFINED);
        }
    });
}

/// What goes between the session and the worker that fits.
#[derive(Debug, Default)]
struct Post {
    /// What that is to be asked.
    asks: Vec<Ask>,
    /// Who hears what it says.
    tell: Option<Tell>,
    paused: bool,
}

type Shared = Arc<Mutex<Post>>;

fn post(shared: &Shared) -> std::sync::MutexGuard<'_, Post> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The page, as the session knows it.
struct PageHost(Shared);

impl Host for PageHost {
    fn begin_fit(&self, request: FitRequest, tell: Tell) -> Box<dyn FitControl> {
        let sent = Request::of(&request);
        let ask = if request.resume { Ask::Resume(sent) } else { Ask::Fit(sent) };
        let mut post = post(&self.0);
        post.asks.push(ask);
        (post.tell, post.paused) = (Some(tell), false);
        drop(post);
        Box::new(Control(Arc::clone(&self.0)))
    }

    fn start(&self, _: &Path) -> Result<Start, String> {
        Err("a page opens no other scene: write a page of that.".to_owned())
    }

    fn run(&self, _: &Path) -> Result<Run, String> {
        Err("a page compares no other run: load its constants.".to_owned())
    }

    fn save_scene(&self, _: &Path, _: &Values, _: &Path) -> Result<(), String> {
        Err("a page writes no scene files: save the constants.".to_owned())
    }
}

/// The fit in the other worker.
#[derive(Debug)]
struct Control(Shared);

impl FitControl for Control {
    fn set_paused(&mut self, paused: bool) {
        let mut post = post(&self.0);
        post.paused = paused;
        post.asks.push(Ask::Pause { on: paused });
    }

    fn is_paused(&self) -> bool {
        post(&self.0).paused
    }

    fn stop(&mut self) {
        let mut post = post(&self.0);
        post.paused = false;
        post.asks.push(Ask::Stop);
    }
}

/// A pane that was given to the page: its images, and how they were shown.
struct Given {
    images: [Arc<Image>; 2],
    look: String,
}

/// The page's worker.
#[wasm_bindgen]
pub struct Stage {
    session: Session,
    look: Look,
    post: Shared,
    /// Whether the scene's bakes were looked at.
    checked: bool,
    /// What of a fit was told: how many losses and the last of them, and of which scene's constants the ways.
    told: Option<(usize, Option<f64>, usize, Vec<Column>)>,
    given: HashMap<String, Given>,
}

#[wasm_bindgen]
impl Stage {
    /// Over the page's scene, as an archive, drawn on the CPU where `cpu` says so. `wake` is called when there is
    /// something to poll, `tell` with words on long work.
    ///
    /// # Errors
    /// When it is none.
    #[wasm_bindgen(constructor)]
    pub fn new(archive: &[u8], cpu: bool, wake_page: Function, tell: Function) -> Result<Self, JsError> {
        WAKE.set(Some(wake_page));
        tell_progress(tell);
        let held = hold(archive).map_err(|words| JsError::new(&words))?;
        let start = Start {
            scenes: held.readings(),
            fitted: held.fitted,
            other: held.other,
            run: PathBuf::from("/fit"),
            engine: Engine { cpu, adapter: None },
        };
        let shared = Shared::default();
        let host = Arc::new(PageHost(Arc::clone(&shared)));
        let session = Session::new(host, start, Arc::new(wake));
        Ok(Self {
            session,
            look: Look::default(),
            post: shared,
            checked: false,
            told: None,
            given: HashMap::new(),
        })
    }

    /// Do what is said, as JSON.
    ///
    /// # Errors
    /// When it is something else.
    pub fn command(&mut self, command: &str) -> Result<(), JsError> {
        let command: Command = serde_json::from_str(command)?;
        command::run(&mut self.session, &mut self.look, command);
        let slots = shown::slots(&self.session, &self.look);
        self.session.look_for(slots);
        // A pane that is shown again is given again.
        let shown = &self.look.panes;
        self.given.retain(|name, _| pane(name).is_some_and(|pane| shown.contains(&pane)));
        Ok(())
    }

    /// Take in what was answered, ask for what is to be shown, and give all that the page shows but its images, as JSON.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn poll(&mut self) -> Result<String, JsError> {
        self.session.poll();
        self.check_bakes();
        // What a fit has gone through is told as it grows, and not with every move of a slider.
        let losses = self.session.losses();
        let free = self.session.values().map(|values| values.free.clone()).unwrap_or_default();
        let told = (losses.len(), losses.last().copied(), self.session.scene(), free);
        let grown = self.told.as_ref() != Some(&told);
        self.told = Some(told);
        Ok(serde_json::to_string(&State::of(&self.session, &self.look, grown))?)
    }

    /// What the worker that fits is to be asked, as a list of JSON texts.
    pub fn asks(&mut self) -> Vec<String> {
        // Numbers and names are all that is in them: they can be written.
        post(&self.post).asks.drain(..).filter_map(|ask| serde_json::to_string(&ask).ok()).collect()
    }

    /// Hear what that worker says.
    ///
    /// # Errors
    /// When it is something else.
    pub fn hear(&mut self, said: &str) -> Result<(), JsError> {
        let said: Say = serde_json::from_str(said)?;
        let Some(tell) = post(&self.post).tell.clone() else { return Ok(()) };
        tell.say(said.message(self.session.scenes()));
        Ok(())
    }

    /// A pane's image, where it is another than was given last: its width and height as 32 bits each, the lowest byte
    /// first, then red, green, blue and 255 of each pixel, row by row.
    pub fn pixels(&mut self, name: &str) -> Option<Vec<u8>> {
        let pane = pane(name)?;
        let Some(images) = shown::pair(&self.session, pane, &self.look) else {
            self.given.remove(name);
            return None;
        };
        // It is made of numbers and names.
        let look = serde_json::to_string(&self.look).unwrap_or_default();
        let same = |given: &Given| {
            given.look == look && given.images.iter().zip(&images).all(|(a, b)| Arc::ptr_eq(a, b))
        };
        if self.given.get(name).is_some_and(same) {
            return None;
        }
        let kind = if pane == Pane::Error { Kind::Error(self.look.error) } else { Kind::Image };
        let [first, second] = &images;
        let size = [first.width, first.height].map(|side| (side as u32).to_le_bytes());
        let bytes = [&size.concat()[..], &pixels([first, second], kind, &self.look)].concat();
        self.given.insert(name.to_owned(), Given { images, look });
        Some(bytes)
    }

    /// The 256 colours of an error's scale, from least to greatest: red, green, blue and 255 of each.
    pub fn ramp(&self, signed: bool) -> Vec<u8> {
        ramp(signed)
    }

    /// A pixel as all panes have it: a list of names and words, as JSON.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn probe(&self, x: u32, y: u32) -> Result<String, JsError> {
        Ok(serde_json::to_string(&skinfit_view::probe::rows(
            &self.session,
            shown::error_of(&self.session, &self.look),
            [x, y],
        ))?)
    }

    /// The constants, as `params.toml`.
    pub fn params_file(&self) -> Option<String> {
        self.session.params_text()
    }

    /// All constants and scores side by side: two tables, as JSON.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn tables(&self) -> Result<String, JsError> {
        Ok(serde_json::to_string(&[constants(&self.session), scores(&self.session)])?)
    }

    /// The constants, by the names of their sliders: what a test compares.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn constants(&self) -> Result<String, JsError> {
        let values = self.session.values().map(|values| {
            let of = |column: &Column| (column.name(), column.get(&values.params));
            values.free.iter().map(of).collect::<Vec<_>>()
        });
        Ok(serde_json::to_string(&values.unwrap_or_default())?)
    }
}

impl Stage {
    /// Say so where the page's bakes are not those that this library looks for: then they were made anew.
    fn check_bakes(&mut self) {
        let scenes = self.session.scenes();
        if self.checked || scenes.is_empty() {
            return;
        }
        self.checked = true;
        let mut bakes = scenes.iter().flat_map(|opened| &opened.baked.stats.rows);
        if bakes.any(|row| !row.cached && row.name != "environment") {
            self.session.tell(
                "the page's player is of other sources than the program that wrote it: what that had baked was baked \
                 anew here. Build the player, src/page/build, and write the page anew."
                    .to_owned(),
            );
        }
    }
}
