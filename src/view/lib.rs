//! A fit that is seen and touched: what the window and the page hold, and the window itself.
//!
//! - [`host`]: what the program around them does for them
//! - state, which knows no widgets: [`start`] (what is looked at first), [`values`] (what one edits of a scene), [`skin`] (of several),
//!   [`history`] (undo and redo), [`opened`] (a scene that
//!   is looked at), [`look`] (how images are shown), [`shown`] (what panes show), [`pixels`] (a pane in 8 bits),
//!   [`probe`] (one pixel), [`reported`] (what a run's report says),
//!   [`table`] (constants side by side), [`session`] (all of it)
//! - work beside them, whose answers the session polls: [`paint`] (images and their scores), [`fitting`]
//! - [`archive`]: the scene that a page holds
//! - [`window`]: widgets over all that (feature `window`); the page has its own in HTML
//!
//! Images are drawn by the production renderer's planned shaders, or by the CPU engine where no adapter works; fits are
//! the command line's. No frame waits for either.

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{bake, engine, fit, model, prepare, render, samples, scene};
use skinfit_gpu as gpu;
use skinfit_report as report;

pub mod archive;
pub mod fitting;
pub mod history;
pub mod host;
pub mod look;
pub mod opened;
pub mod paint;
pub mod pixels;
pub mod probe;
pub mod reported;
pub mod session;
pub mod shown;
pub mod skin;
pub mod start;
pub mod table;
pub mod values;
#[cfg(feature = "window")]
pub mod window;

#[cfg(feature = "window")]
pub use eframe::egui;
pub use host::{FitRequest, Host, ViewError};
pub use session::Session;
pub use start::{Run, Start};
#[cfg(feature = "window")]
pub use window::{Window, open_window};
