//! Programs of experiments run, and leave what they say.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::graphics::bench::{built_in, cache, gpu};

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
    (printed_in(folder.path(), name, &[]), folder)
}

/// What an example prints, run in that folder.
fn printed_in(folder: &Path, name: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(program(name));
    let run = command.current_dir(folder).env("SKINFIT_CACHE", cache()).args(arguments).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success(), "{name}: {}\n{out}\n{err}", run.status);
    out.into_owned()
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

/// The built-in scene's file.
fn scene() -> String {
    built_in().to_string_lossy().into_owned()
}

#[test]
fn a_rate_of_rays() {
    let folder = tempfile::tempdir().unwrap();
    printed_in(folder.path(), "rays", &[&scene(), "-o", "row.json", "--threads", "2"]);
    let row: Value = serde_json::from_slice(&std::fs::read(folder.path().join("row.json")).unwrap()).unwrap();
    assert_eq!(row["rays"].as_f64(), row["distinct"].as_f64().map(|vertices| 256.0 * vertices), "{row}");
    for query in ["any", "nearest"] {
        assert!(row[query]["skinfit"].as_f64().is_some_and(|rate| rate > 0.0), "{row}");
    }
}

#[test]
fn what_effects_cost_a_frame() {
    if gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = scene();
    let small = ["-o", "table.csv", "--width", "64", "--height", "48", "--frames", "4", "--full"];
    printed_in(folder.path(), "effects_cost", &[&[scene.as_str()], &small[..]].concat());
    let table = std::fs::read_to_string(folder.path().join("table.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 3, "{table}");
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{table}");
    assert_eq!(rows[0][6], "SPIR-V instructions");
    let instructions: Vec<usize> = rows[1..].iter().map(|row| row[6].parse().unwrap()).collect();
    assert!(instructions[0] > instructions[1], "the scene's effects are more than their fetches\n{table}");
}

/// Planes of 32-bit numbers: a plane a channel, of the vector's pixels or its one number each.
fn planes(of: &Value) -> Vec<u8> {
    let pixels = of.as_array().unwrap();
    let channel = |pixel: &Value, c: usize| pixel.get(c).unwrap_or(pixel).as_f64().unwrap() as f32;
    let channels = pixels[0].as_array().map_or(1, Vec::len);
    let plane = |c: usize| pixels.iter().flat_map(move |pixel| channel(pixel, c).to_le_bytes());
    (0..channels).flat_map(plane).collect()
}

/// All numbers of a nest of lists, as 32-bit ones.
fn flat(of: &Value) -> Vec<u8> {
    match of.as_array() {
        Some(list) => list.iter().flat_map(flat).collect(),
        None => (of.as_f64().unwrap() as f32).to_le_bytes().to_vec(),
    }
}

/// A data folder of the race, made of the vector that holds its sixteen pixels.
fn race_data(folder: &Path) {
    let read = |name: &str| -> Value {
        let path = crate::common::own_vectors().join(name);
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    };
    let (bench, cubes) = (read("bench_16.json"), read("cubes_ldr.json"));
    let (inputs, cubes) = (&bench["inputs"], &cubes["inputs"]);
    let names =
        "rim_weight_r rim_weight_g rim_weight_b rim_exponent hilite reflection occlusion side_spec bump haze";
    let names: Vec<&str> = names.split(' ').collect();
    let of =
        |params: &Value| -> Vec<f64> { names.iter().map(|&name| params[name].as_f64().unwrap()).collect() };
    let (truth, start) = (of(&inputs["params"]), of(&inputs["params_init"]));
    let manifest = json!({
        "format": "dawn-race-1", "pixels": 16, "side": 4, "param_names": names, "params_true": truth,
        "params_init": start, "params_opt_noisy": truth, "loss_opt_noisy": 1.0,
        "hessian_half_noisy": [], "cube_size": cubes["size"],
    });
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    write("manifest.json", manifest.to_string().as_bytes());
    let files = [
        ("A", "base"),
        ("B", "bump"),
        ("E", "view"),
        ("o", "occ"),
        ("c", "albedo"),
        ("p", "spec"),
        ("a", "atten"),
    ];
    for (symbol, name) in files {
        write(&format!("{name}.f32"), &planes(&inputs["gbuffer"][symbol]));
    }
    write("target_clean.f32", &planes(&bench["expected"]["forward"]));
    for cube in ["diffuse", "spec", "hilite"] {
        write(&format!("cube_{cube}.f32"), &flat(&cubes[cube]));
    }
}

#[test]
fn the_race_shades_its_pixels_right() {
    let folder = tempfile::tempdir().unwrap();
    race_data(folder.path());
    for mode in ["sampled", "pre"] {
        let arguments = [".", "--mode", mode, "--passes-only", "--reps", "1", "-o", "row.json"];
        printed_in(folder.path(), "race", &arguments);
        let row: Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("row.json")).unwrap()).unwrap();
        // The vectors' tolerance of 32 bits.
        assert!(row["forward_max_err"].as_f64().is_some_and(|error| error < 2e-5), "{mode}: {row}");
        for pass in ["forward", "grad", "normal"] {
            assert!(row[pass]["median"].as_f64().is_some_and(|seconds| seconds > 0.0), "{mode}: {row}");
        }
    }
}
