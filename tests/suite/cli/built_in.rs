//! The scene that the program makes by itself.

use std::path::Path;
use std::time::Instant;

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use serde_json::Value;
use skinfit::builtin;
use skinfit::render::files::{Image, ImageOptions, write_exr};

use super::sandbox::{Ran, program};
use crate::fixtures::read_exr;
use crate::graphics::bench::{built_in, cache};

#[test]
fn a_bake_tells_of_the_morph_targets_that_have_a_weight() {
    let folder = tempfile::tempdir().unwrap();
    let scene = built_in();
    let mut command = program(&cache());
    Ran::of(command.arg("bake").arg(scene).args(["-o", "baked"]).current_dir(folder.path())).done();
    let table = std::fs::read_to_string(folder.path().join("baked/occlusion.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("vertex,open,morph_0,morph_2"));
    assert!(lines.all(|line| line.split(',').count() == 4));
}

/// Each free parameter's fitted values and standard errors, beside its true values.
fn against_truth(report: &Value) -> Vec<(String, [f64; 3])> {
    let mut rows = Vec::new();
    for (param, truth) in builtin::truth() {
        let found = &report["params"][param.name()];
        let channel = |value: &Value, c: usize| {
            value.get(c).unwrap_or(value).as_f64().unwrap_or_else(|| panic!("{}: {found}", param.name()))
        };
        for (c, &truth) in truth.iter().enumerate() {
            let row = [channel(&found["value"], c), channel(&found["std_error"], c), truth];
            rows.push((format!("{}, channel {c}", param.name()), row));
        }
    }
    rows
}

#[test]
fn a_fit_without_a_scene_finds_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let ran = Ran::of(program(&cache()).args(["fit", "--json"]).current_dir(folder.path())).done();
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    for (name, [value, error, truth]) in against_truth(&report) {
        crate::figures::measured("built-in constants", (value / truth - 1.0).abs());
        crate::figures::measured("built-in constants over errors", (value - truth).abs() / error);
        crate::figures::measured("built-in errors", error / truth.abs());
        // The targets are rounded to f32, 6e-8 of each pixel at random, of which half a million pixels leave less; the
        // sums' roundings are of one sign (4e-7 was found).
        assert!((value - truth).abs() <= 1e-6 * truth.abs(), "{name}: {value} is not {truth}");
        // Without noise, the error bars are those of rounding, and true all the same (2e-7 to 6e-6 were found).
        assert!((value - truth).abs() <= 3.0 * error, "{name}: {value} +- {error} is not {truth}");
        assert!(error < 1e-5 * truth.abs(), "{name}: +- {error}");
    }
    let params = std::fs::read_to_string(folder.path().join("runs/builtin/params.toml")).unwrap();
    let params: toml::Table = params.parse().unwrap();
    for (param, truth) in builtin::truth() {
        let value = &params["params"][param.name()];
        let value = value.get(0).unwrap_or(value).as_float().unwrap();
        assert!((value - truth[0]).abs() <= 1e-6 * truth[0], "{}: {value}", param.name());
    }
}

#[test]
fn the_time_that_a_fit_tells_is_the_clocks() {
    let folder = tempfile::tempdir().unwrap();
    let clock = Instant::now();
    let ran = Ran::of(program(&cache()).arg("fit").current_dir(folder.path())).done();
    let clock = clock.elapsed().as_secs_f64();
    let line = ran.out.lines().find(|line| line.starts_with("converged")).unwrap();
    // `...; 3.61 s, 1.55 s of them the fit's`
    let told = line.rsplit("; ").next().unwrap();
    let mut seconds = told.split(" s").filter_map(|part| part.trim_start_matches(", ").parse::<f64>().ok());
    let (whole, fit) = (seconds.next().unwrap(), seconds.next().unwrap());
    // Rounded to hundredths, beside the program's start and end, which other programs may hold up.
    assert!(whole <= clock + 0.005, "{whole} s of {clock} s: {line}");
    let report: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("runs/builtin/report.json")).unwrap())
            .unwrap();
    let of = |stage: &str| report["seconds"][stage].as_f64().unwrap();
    assert!((of("fit") - fit).abs() <= 0.006, "{line}");
    // All that is done is in it, up to the page that is written last.
    let stages: f64 = report["seconds"].as_object().unwrap().keys().map(|stage| of(stage)).sum();
    assert!(whole >= stages - 0.006, "{whole} s of {stages} s: {line}");
}

/// Two independent normal deviates (Box and Muller 1958).
fn normal(random: &mut StdRng) -> [f64; 2] {
    let (u, v): (f64, f64) = (random.random(), random.random());
    let radius = (-2.0 * (1.0 - u).ln()).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
    [radius * cos, radius * sin]
}

/// `from` with normal noise of `share` of its mean over what is covered, as `to`.
fn add_noise(from: &Path, to: &Path, share: f64, random: &mut StdRng) {
    let planes = read_exr(from);
    let mut image = Image::new(planes.width, planes.height);
    image.alpha.clone_from(&planes.planes["A"]);
    let rgb = planes.rgb(["R", "G", "B"]);
    let sum: f64 = rgb.iter().flatten().map(|&x| f64::from(x)).sum();
    let mean = sum / (3.0 * image.alpha.iter().map(|&a| f64::from(a)).sum::<f64>());
    for ((out, rgb), alpha) in image.rgb.iter_mut().zip(rgb).zip(&image.alpha) {
        let [r, g] = normal(random);
        let [b, _] = normal(random);
        let noise = [r, g, b].map(|n| (share * mean * n) as f32 * alpha);
        *out = [0, 1, 2].map(|c| rgb[c] + noise[c]);
    }
    write_exr(to, &image, &ImageOptions::default()).unwrap();
}

#[test]
fn with_noise_the_truth_lies_within_three_standard_errors() {
    let file = built_in();
    let scene = file.parent().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut text = std::fs::read_to_string(scene.join("scene.toml")).unwrap();
    let mut random = StdRng::seed_from_u64(20);
    for view in ["front", "three_quarter", "profile"] {
        let name = format!("targets/{view}.exr");
        add_noise(&scene.join(&name), &folder.path().join(&name), 0.01, &mut random);
    }
    for file in ["head.glb", "color.png", "normal.png", "specular.png", "attenuator.png", "environment.exr"] {
        text = text.replace(&format!("\"{file}\""), &format!("{:?}", scene.join(file).to_str().unwrap()));
    }
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let fit = |loss: &str| {
        let mut command = program(&cache());
        command.args(["fit", "scene.toml", "--json", "--loss", loss]).current_dir(folder.path());
        let report: Value = serde_json::from_str(&Ran::of(&mut command).done().out).unwrap();
        against_truth(&report)
    };
    for (name, [value, error, truth]) in fit("l2") {
        assert!((value - truth).abs() <= 3.0 * error, "{name}: {value} +- {error} is not {truth}");
        assert!(error > 0.0 && error < 0.01 * truth, "{name}: +- {error} says nothing");
    }
    // This noise is not of the variance that the relative loss takes it to be of: its sandwich errors hold all the same.
    // Of 13 constants the furthest is expected 1.7 errors away; one in 50 such fits has one beyond 3.
    for (name, [value, error, truth]) in fit("relative_l2") {
        assert!((value - truth).abs() <= 4.0 * error, "{name}: {value} +- {error} is not {truth}");
        assert!(error > 0.0 && error < 0.02 * truth, "{name}: +- {error} says nothing");
    }
}
