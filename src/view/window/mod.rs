//! The window: widgets over a [`Session`](crate::Session).
//!
//! - [`app`]: the window; `rows` (parameters), `table` (constants side by side), `effects`, `panes` over `picture` (images on the adapter), `probe_table`,
//!   `curves`, `keys`, `progress` (how far long work is)
//! - without a display: [`offscreen`] (the window as an image), [`mod@bench`] (how fast it is)

pub mod app;
pub mod bench;
mod curves;
mod effects;
mod keys;
pub mod offscreen;
mod panes;
mod picture;
mod probe_table;
mod progress;
mod rows;
mod table;

pub use app::{Window, open_window};
pub use progress::watch_progress;
