//! Programs of experiments/library run, and leave what they say.

use std::path::PathBuf;
use std::process::Command;

use crate::graphics::bench::gpu;

/// An example's program, which `cargo test` builds beside this one.
fn program(name: &str) -> PathBuf {
    let tests = std::env::current_exe().unwrap();
    let path = tests.parent().unwrap().with_file_name("examples").join(name);
    assert!(
        path.is_file(),
        "{} is not there: cargo build --release --features burn --examples",
        path.display()
    );
    path
}

/// What an example prints, run in a folder of its own, and that folder.
fn printed(name: &str) -> (String, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new(program(name)).current_dir(folder.path()).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{name}: {}\n{out}\n{err}", run.status);
    (out.into_owned(), folder)
}

#[test]
fn a_fit_and_a_term_of_ones_own() {
    let (fit, _) = printed("library_fit");
    assert!(fit.contains("converged") && fit.contains("base_weight"), "{fit}");
    let (term, folder) = printed("library_term");
    assert!(term.contains("fresnel_weight") && term.contains("fresnel_f0"), "{term}");
    let shader = std::fs::read_to_string(folder.path().join("library_term.glsl")).unwrap();
    assert!(shader.contains("fresnel"), "{shader}");
}

#[test]
fn a_rendering() {
    if gpu().is_none() {
        return;
    }
    let (render, folder) = printed("library_render");
    assert!(render.contains(" pixels differ "), "{render}");
    assert!(
        folder.path().join("library_gpu.exr").is_file() && folder.path().join("library_cpu.exr").is_file()
    );
}

/// It ends with an error unless it learns.
#[cfg(feature = "burn")]
#[test]
fn a_network_learns_through_the_shader() {
    if gpu().is_some() {
        printed("network");
    }
}

#[cfg(feature = "burn")]
#[test]
fn gradients_on_tensors() {
    if gpu().is_none() {
        return;
    }
    let (gradients, _) = printed("library_gradients");
    assert_eq!(gradients.matches("by differences").count(), 3, "{gradients}");
}
