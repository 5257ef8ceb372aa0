//! The page: a fit in a browser, over the state that the window has, too.
//!
//! Everything runs in two workers of the browser's, so that the page itself never waits: one draws, the other fits. Each
//! has this library, and the page's scene as files in memory; what they and the page say to each other is JSON and bytes.
//!
//! - `stage`: the worker that draws: a `Session` of the member `view`, told what one does on the page
//! - `fitter`: the worker that fits, an iteration or a few at a time: the CPU engine
//! - `command`, `state`, `message`: what the page says, what it is told, what the workers tell each other
//! - `held`: the scene's files; `told`: how far long work is
//! - `page.html`, `page.css`, `script/`, `worker.js`: the page itself; `build` makes one file of all that, by `pack`
//!
//! For anything but WebAssembly it is empty.
#![cfg(target_family = "wasm")]

// What other members of the workspace hold stands under the names that it has there.
use skinfit_core::{engine, fit, model, prepare, progress, render, scene};
use skinfit_report as report;

mod command;
pub mod fitter;
mod held;
mod message;
pub mod stage;
mod state;
mod told;
