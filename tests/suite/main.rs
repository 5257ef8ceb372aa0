//! The tests that go through files, real scenes or the program itself: one binary, so that it is
//! linked once. What concerns one module alone is tested beside it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

mod added_fields;
mod added_maps;
mod added_term;
mod added_texels;
mod animated;
mod bakes;
mod borders;
mod builtin;
mod by_rules;
mod cameras;
mod chain_rule;
mod cli;
mod combined;
mod common;
mod composed;
mod damage;
mod diffused;
mod diffusion;
mod documents;
mod engine;
mod evaluators;
mod every_effect;
mod examples;
mod exported_passes;
mod exports;
mod figures;
mod fits;
mod fixtures;
mod fresnel;
mod graphics;
mod hard_lights;
mod hard_skin;
mod harmonics;
mod imported;
mod instructions;
mod joint;
mod lenient;
mod light_files;
mod light_vectors;
mod lights;
mod lit;
mod lobe;
mod materials;
mod meshes;
mod occlusion;
mod own_atlas;
mod phases;
mod plain;
mod props;
mod readings;
mod refusals;
mod registration;
mod reports;
mod samples;
mod scene_files;
mod scene_folder;
#[cfg(target_os = "linux")]
mod scheduler;
mod shader;
mod silhouettes;
mod sky;
mod slopes;
mod specular;
#[cfg(feature = "burn")]
mod tensors;
mod transfer;
mod transmission;
mod unblurred;
mod unreal;
mod vectors;
mod witness;
