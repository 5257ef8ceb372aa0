//! The program as its users meet it: every test here runs the binary.

mod built_in;
mod desk;
mod exported;
#[cfg(feature = "gpu")]
mod graphics;
mod interrupted;
mod maps;
mod outputs;
mod refusals;
mod refused_files;
mod runs;
mod stages;
mod words;
