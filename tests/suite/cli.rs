//! The program as its users meet it: every test here runs the binary.

mod ablation;
mod added_term;
mod browser;
mod built_in;
mod clip;
mod constants;
mod damaged;
mod engines;
mod exported;
mod followed;
#[cfg(target_os = "linux")]
mod godot;
mod graphics;
mod held_out;
mod interrupted;
mod joint;
mod joint_studies;
mod lit;
mod maps;
mod moved_cameras;
mod outputs;
mod own_head;
mod page;
mod panorama;
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
mod vertex_streams;
mod words;
