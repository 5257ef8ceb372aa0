//! The program as its users meet it: every test here runs the binary.

mod ablation;
mod added_term;
mod browser;
mod built_in;
mod constants;
mod damaged;
mod exported;
mod graphics;
mod held_out;
mod interrupted;
mod joint;
mod joint_studies;
mod lit;
mod maps;
mod outputs;
mod page;
mod pinned;
mod refusals;
mod refused_files;
mod runs;
pub(crate) mod sandbox;
mod stability;
mod stages;
mod suggest;
mod sweeps;
mod tradeoffs;
mod words;
