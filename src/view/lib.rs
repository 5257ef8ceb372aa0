//! The window: a fit that is seen and touched.
//!
//! - [`host`]: what the program around the window does for it
//! - state, which knows no widgets: [`values`] (what one edits), [`history`] (undo and redo), [`opened`] (a scene that
//!   is looked at), [`look`] (how images are shown), [`session`] (all of it)
//! - work beside the window, whose answers the session polls: [`paint`] (images and their scores), [`fitting`]
//! - widgets: [`app`] (the window), `rows` (parameters), `effects`, `panes` over `picture` (images on the adapter),
//!   `probe`, `curves`, `keys`
//! - without a display: [`offscreen`] (the window as an image), [`mod@bench`] (how fast it is)
//!
//! Images are drawn by the production renderer's planned shaders, or by the CPU engine where no adapter works; fits are
//! the command line's. No frame waits for either.

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{bake, engine, fit, model, prepare, render, samples, scene};
use skinfit_gpu as gpu;
use skinfit_report as report;

pub mod app;
pub mod bench;
mod curves;
mod effects;
pub mod fitting;
pub mod history;
pub mod host;
mod keys;
pub mod look;
pub mod offscreen;
pub mod opened;
pub mod paint;
mod panes;
mod picture;
mod probe;
mod rows;
pub mod session;
pub mod values;

pub use app::{Window, open_window};
pub use eframe::egui;
pub use host::{FitRequest, Host, ViewError};
pub use session::{Session, Start};
