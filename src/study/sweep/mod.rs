//! Many jobs over scenes and settings, on this machine or under a scheduler.
//!
//! - [`plan`]: the plan file: what each job runs, and with which settings
//! - [`command`]: what can be run, and which settings that takes
//! - [`scene_text`]: a scene file's text with some of its keys set
//! - [`job`]: what a job is; [`inputs`]: what it reads; [`run`]: from its scene to its figures; `studies`: those of
//!   ablations and tradeoffs
//! - [`result`]: the one file that a job leaves
//! - [`collect`]: every job's figures in one table
//!
//! A job is known by its number in the plan and by a hash of all that it depends on, its settings and its
//! scene's text. Its result is written whole, so that whoever finds one need not run the job again: jobs may
//! be started twice, in any order, on any machine that sees the plan's folder.

pub mod collect;
pub mod command;
pub mod inputs;
pub mod job;
pub mod plan;
pub mod result;
pub mod run;
pub mod scene_text;
mod studies;
