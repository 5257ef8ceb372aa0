//! What the program around the window does for it.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::engine::Point;
use crate::fit::outcome::{Iteration, Outcome};
use crate::values::Values;

/// A fit that the window asks for: of its scene's file, with what was changed in it.
#[derive(Clone, Debug)]
pub struct FitRequest {
    /// The scene's file.
    pub scene: PathBuf,
    /// Where it starts, what is free, which effects are on, and what is left out of it.
    pub values: Values,
    /// The run folder.
    pub run: PathBuf,
    /// Whether it goes on from where a fit in that folder stopped.
    pub resume: bool,
}

/// What a fit has found, and how good it is.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The constants, with what is known of them.
    pub outcome: Outcome,
    /// How good each view is, as the report says.
    pub views: Vec<ViewScore>,
}

/// How good a view is.
#[derive(Clone, Debug, PartialEq)]
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
    /// Fit, and leave the run folder that the command line leaves. `watch` is told of each iteration, and the fit goes
    /// on when it returns; it ends soon after `interrupt` is set, with a state to be resumed.
    ///
    /// # Errors
    /// What the command line would say.
    fn fit(
        &self,
        request: &FitRequest,
        watch: &mut dyn FnMut(&Iteration, &Point),
        interrupt: &Arc<AtomicBool>,
    ) -> Result<Fitted, String>;

    /// Leave the scene's file with what was changed in it as `file`, which any command reads.
    ///
    /// # Errors
    /// When it cannot be written.
    fn save_scene(
        &self,
        scene: &std::path::Path,
        values: &Values,
        file: &std::path::Path,
    ) -> Result<(), String>;
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
