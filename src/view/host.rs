//! What the program around the window does for it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::engine::Point;
use crate::fit::outcome::{Ending, Outcome};
use crate::fitting::{FitControl, Tell};
use crate::prepare::view_of;
use crate::scene::names::names_of;
use crate::start::{Run, Start};
use crate::values::{Values, column};

/// A fit that the window asks for: of its scenes' files, with what was changed in them.
#[derive(Clone, Debug)]
pub struct FitRequest {
    /// The scenes.
    pub scenes: Vec<FitScene>,
    /// Where it starts as a `params.toml` has it.
    pub start: String,
    /// The run folder.
    pub run: PathBuf,
    /// Whether it goes on from where a fit in that folder stopped.
    pub resume: bool,
}

/// A scene of a fit.
#[derive(Clone, Debug)]
pub struct FitScene {
    /// What it is called among others.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// Where it starts, what is free, which effects are on, and what is left out of it.
    pub values: Values,
}

impl FitRequest {
    /// Which views are held out, as the command line names them.
    #[must_use]
    pub fn hold_out(&self) -> Vec<String> {
        let several = self.scenes.len() > 1;
        let of = |scene: &FitScene| {
            let name = |view: &String| if several { view_of(&scene.name, view) } else { view.clone() };
            scene.values.hold_out.iter().map(name).collect::<Vec<_>>()
        };
        self.scenes.iter().flat_map(of).collect()
    }
}

/// What a fit has found, and how good it is.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The constants, with what is known of them.
    pub found: Found,
    /// How good each view is, as the report says.
    pub views: Vec<ViewScore>,
}

impl Fitted {
    /// What it says of the scene at `path`, where it was of several: by the names that a fit of that alone has.
    #[must_use]
    pub fn of_scene(mut self, path: &Path) -> Self {
        let named = |before: &String| self.views.iter().any(|view| view.view.starts_with(before));
        let Some(before) = names_of(path).map(|name| view_of(&name, "")).into_iter().find(named) else {
            return self;
        };
        let own = |name: &str| name.strip_prefix(&before).map(str::to_owned);
        self.views.retain_mut(|view| own(&view.view).map(|name| view.view = name).is_some());
        // Where one scene alone was fitted, and this was held out, what has no scene before it may be that one's.
        if self.views.iter().all(|view| view.held_out) {
            let skins = |known: &Known| column(&known.name).is_some_and(|column| !column.param.is_of_scene());
            self.found.known.retain(skins);
        }
        for known in &mut self.found.known {
            known.name = own_name(&known.name, &before);
        }
        self
    }
}

/// An unknown's name without the scene's that it begins with.
fn own_name(name: &str, before: &str) -> String {
    let gain = name
        .strip_prefix(GAIN)
        .and_then(|view| view.strip_prefix(before))
        .map(|view| format!("{GAIN}{view}"));
    gain.unwrap_or_else(|| name.strip_prefix(before).unwrap_or(name).to_owned())
}

/// What the name of a view's gain begins with.
pub const GAIN: &str = "gain.";

/// What a fit has found, as far as it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Where it ended, in each scene.
    pub ends: Vec<Point>,
    /// What is known of each that was free, by its name.
    pub known: Vec<Known>,
    /// How it ended.
    pub ending: Ending,
    /// The loss at the end.
    pub loss: f64,
    /// The loss at the start, and after each iteration.
    pub losses: Vec<f64>,
    /// Iterations.
    pub iterations: u64,
    /// Passes over the samples.
    pub evaluations: u64,
    /// Seconds spent.
    pub seconds: f64,
}

/// What is known of a constant that was free.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Its name, as reports have it.
    pub name: String,
    /// One standard error; `None` at a bound or when unidentifiable.
    pub std_error: Option<f64>,
    /// Whether it ended on a bound.
    pub at_bound: bool,
}

impl Found {
    /// Of what a fit yields: where that is in each scene, and how an unknown's name is told.
    #[must_use]
    pub fn of(outcome: &Outcome, ends: Vec<Point>, label: impl Fn(&str) -> String) -> Self {
        let known = outcome.unknowns.iter().map(|unknown| Known {
            name: label(&unknown.unknown.name()),
            std_error: unknown.std_error,
            at_bound: unknown.at_bound,
        });
        Self {
            ends,
            known: known.collect(),
            ending: outcome.ending,
            loss: outcome.loss_end,
            losses: outcome.history.iter().map(|iteration| iteration.loss).collect(),
            iterations: outcome.iterations,
            evaluations: outcome.evaluations,
            seconds: outcome.seconds,
        }
    }

    /// What is known of the constant of that name.
    #[must_use]
    pub fn constant(&self, name: &str) -> Option<&Known> {
        self.known.iter().find(|known| known.name == name)
    }
}

/// How good a view is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewScore {
    /// Its name.
    pub view: String,
    /// Whether the fit has not seen it.
    pub held_out: bool,
    /// dB.
    pub psnr: f64,
    /// Mean structural similarity.
    pub ssim: f64,
    /// Mean FLIP.
    pub flip: f64,
}

/// Fits, as the command line does them, and files that it reads.
pub trait Host: Send + Sync {
    /// Begin a fit beside the window, as the command line would fit, and with its run folder where there are folders.
    /// `tell` hears of each iteration, and of the end.
    fn begin_fit(&self, request: FitRequest, tell: Tell) -> Box<dyn FitControl>;

    /// What is looked at first of a scene's file or a run folder.
    ///
    /// # Errors
    /// When it is neither.
    fn start(&self, path: &Path) -> Result<Start, String>;

    /// What a run has left, or a file of constants.
    ///
    /// # Errors
    /// When it is no run.
    fn run(&self, path: &Path) -> Result<Run, String>;

    /// Leave the scene's file with what was changed in it as `file`, which any command reads.
    ///
    /// # Errors
    /// When it cannot be written.
    fn save_scene(&self, scene: &Path, values: &Values, file: &Path) -> Result<(), String>;
}

/// The window cannot be shown, or what it shows cannot be.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// There is no display.
    #[error("no window can be opened: {0}. It needs a display.")]
    NoWindow(String),
    /// No adapter draws it.
    #[error(
        "the window cannot be drawn: {0}. A Vulkan driver is missing: on Debian and Ubuntu, `apt-get install mesa-vulkan-drivers libvulkan1` brings a software one."
    )]
    NoAdapter(String),
    /// The scene was refused.
    #[error("{0}")]
    Scene(String),
    /// An image could not be written.
    #[error("{path}: {reason}. Choose another file.")]
    Unwritable {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
}
