//! Programs of experiments run, and leave what they say.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use skinfit::prepare::{Loaded, PrepareOptions};
use skinfit::scene::animation::Animation;
use skinfit::scene::mesh::Mesh;

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
        let folder = tempfile::tempdir().unwrap();
        // A third of its steps, for a part of what they bring.
        printed_in(folder.path(), "network", &["--steps", "100", "--held-out", "8", "--factor", "4"]);
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

/// What the example `animated` says of the built-in scene, and the folder that it ran in.
fn animated(arguments: &[&str]) -> (Value, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene();
    let own = ["dense", "-o", "row.json", "--scene", &scene];
    printed_in(folder.path(), "animated", &[&own[..], arguments].concat());
    let row = serde_json::from_slice(&std::fs::read(folder.path().join("row.json")).unwrap()).unwrap();
    (row, folder)
}

#[test]
fn a_head_goes_through_its_clip_as_the_cpu_engine_draws_it() {
    if gpu().is_none() {
        return;
    }
    let small = ["--width", "64", "--height", "48", "--frames", "4", "--vertices", "45000"];
    let (row, _folder) = animated(&small);
    assert!(row["vertices"].as_u64().is_some_and(|count| (45_000..45_010).contains(&count)), "{row}");
    assert_eq!((&row["bones"], &row["morph_targets"]), (&json!(98), &json!(5)), "{row}");
    let rows = row["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2, "{row}");
    for of in rows {
        // It ends with an error where images are further apart than it says.
        let agreement = of["agreement"].as_array().unwrap();
        assert_eq!(agreement.iter().map(|of| &of["frame"]).collect::<Vec<_>>(), [0, 2, 3], "{row}");
        for frame in agreement {
            let off = |what: &str| frame[what].as_f64().unwrap();
            assert!(
                off("inside_99") <= of["tolerance"].as_f64().unwrap() && off("mean") <= off("max"),
                "{row}"
            );
        }
        for what in ["pose_ms", "upload_and_draw_ms", "frame_ms"] {
            let time = |which: &str| of[what][which].as_f64().unwrap();
            assert!(time("median") > 0.0 && time("median") <= time("p95"), "{what}: {row}");
        }
    }
}

/// Corners less edges and more triangles of a surface, whatever seams there are: cuts change it only where they open it.
fn euler(mesh: &Mesh) -> i64 {
    let place = |vertex: u32| mesh.positions[vertex as usize].to_array().map(|x| (x + 0.0).to_bits());
    let (mut corners, mut edges) = (HashSet::new(), HashSet::new());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(place);
        corners.extend([a, b, c]);
        edges.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b))));
    }
    corners.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64
}

#[test]
fn the_dense_head_has_what_dawn_had_and_all_of_it_moves() {
    let (row, folder) = animated(&["--no-draw"]);
    assert!(row["vertices"].as_u64().is_some_and(|count| count >= 180_000), "{row}");
    let file = folder.path().join("dense/scene.toml");
    let read = |scene: &Path| Loaded::read(scene, &PrepareOptions::default()).unwrap().scene;
    let (dense, own) = (read(&file), read(&built_in()));
    assert_eq!((dense.mesh.bones.len(), dense.mesh.morphs.len()), (98, 5));
    assert_eq!(dense.mesh.positions.len() as u64, row["vertices"].as_u64().unwrap());
    assert_eq!(euler(&dense.mesh), euler(&own.mesh), "the surface has opened");
    let sums = dense.mesh.weights.iter().map(|weights| weights.iter().sum::<f32>());
    assert!(sums.into_iter().all(|sum| (sum - 1.0).abs() < 1e-6));
    let animation = Animation::open(&dense).unwrap().unwrap();
    assert!(animation.seconds.1 - animation.seconds.0 > 1.0);
    let [one, other] = [0.3, 2.6].map(|time| animation.mesh(time).unwrap());
    for (bone, (a, b)) in one.bones.iter().zip(&other.bones).enumerate() {
        assert!(!a.abs_diff_eq(*b, 1e-6), "bone {bone} stands still");
    }
    for (a, b) in one.morphs.iter().zip(&other.morphs) {
        assert!((a.weight - b.weight).abs() > 1e-3, "{} keeps its weight", a.name);
    }
    let mut inspect = Command::new(env!("CARGO_BIN_EXE_skinfit"));
    let inspected = inspect.arg("inspect").arg(file.with_file_name("dense.glb")).output().unwrap();
    assert!(inspected.status.success(), "{}", String::from_utf8_lossy(&inspected.stderr));
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
