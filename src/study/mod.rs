//! Studies: what is measured about the model and the fits.
//!
//! - [`stability`]: hard cases on every evaluator, and a random search for new ones
//! - [`sweep`]: many jobs over scenes and settings, on this machine or under a scheduler

pub mod stability;
pub mod sweep;
