//! Times: of each effect in the renderer, over workers and threads, of the benchmarks, of a network's training.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv};
use crate::studies::number;

/// experiments/effects_cost: what each effect costs in the renderer, on the adapter that is there.
pub(crate) fn effects_cost(lab: &Lab) -> Result<Value> {
    let scene = lab.data.join("lps_forest/scene.toml").display().to_string();
    let table = lab.scratch.path().join("effects.csv").display().to_string();
    // A software adapter takes a tenth of a second a frame: fewer of them, and smaller.
    let size = ["--width", "480", "--height", "270", "--frames", "40"];
    let mut raw = json!({ "image": "480 x 270" });
    for (name, accuracy) in [("paper", None), ("exact", Some("--exact"))] {
        let mut arguments = vec![scene.as_str(), "-o", &table];
        arguments.extend(size);
        arguments.extend(accuracy);
        lab.example("effects_cost", &format!("effects' cost, {name}"), &arguments)?;
        effects(&mut raw, name, csv(&std::fs::read_to_string(&table)?)?);
    }
    Ok(raw)
}

/// experiments/effects_cost: the same on a graphics card, in the sizes of screens.
pub(crate) fn effects_cost_on_a_card(lab: &Lab) -> Result<Value> {
    let scene = lab.data.join("lps_forest/scene.toml").display().to_string();
    let table = lab.scratch.path().join("effects.csv").display().to_string();
    let mut raw = json!({ "adapter": card(lab)? });
    for (name, options) in [
        ("paper", &[][..]),
        ("paper_3840x2160", &["--full", "--width", "3840", "--height", "2160"]),
        ("exact", &["--full", "--exact"]),
    ] {
        let mut arguments = vec![scene.as_str(), "-o", &table];
        arguments.extend(options);
        lab.example("effects_cost", &format!("effects' cost on a card, {name}"), &arguments)?;
        effects(&mut raw, name, csv(&std::fs::read_to_string(&table)?)?);
    }
    let demo = lab.scratch.path().join("demo");
    lab.skinfit("the built-in scene", &["demo", &demo.display().to_string()], false)?;
    let mut lit = Vec::new();
    for filter in ["hardware", "pcf", "pcss"] {
        let settings = LIT.into_iter().map(|(key, value)| (key, value.to_owned()));
        let settings: Vec<(&str, String)> =
            settings.chain([("quality.shadow_filter", format!("\"{filter}\""))]).collect();
        let settings: Vec<(&str, &str)> =
            settings.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let scene = lab.scene(&format!("lit {filter}"), &demo.join("scene.toml"), &settings)?;
        let arguments = [&scene.display().to_string(), "-o", &table, "--full"];
        lab.example("effects_cost", &format!("four lights, {filter}"), &arguments)?;
        let rows = csv(&std::fs::read_to_string(&table)?)?;
        let [frame, alone] = rows.as_slice() else {
            return Err("two rows: the frame, and its fetches".into());
        };
        lit.push(json!({
            "filter": filter,
            "planned operations": frame["planned operations"],
            "frame ms": frame["median ms"],
            "fetches ms": alone["median ms"],
            "forward ms": frame["forward median ms"],
            "forward fetches ms": alone["forward median ms"],
            "to forward fetches": number(&frame["median ms"]) / number(&alone["forward median ms"]),
        }));
    }
    raw["lit"] = lit.into();
    raw["diffused"] = diffused(lab, &demo.join("scene.toml"), &table)?;
    Ok(raw)
}

/// The lit head with light that scatters within the skin, in the sizes of light maps and by the taps of blurs.
fn diffused(lab: &Lab, demo: &Path, table: &str) -> Result<Value> {
    let mut rows = Vec::new();
    for (size, taps) in [("512", "5"), ("1024", "5"), ("1024", "\"full\"")] {
        let effects = LIT[1].1.replace("[", "[\"diffusion\", ");
        let settings: Vec<(&str, &str)> = LIT
            .into_iter()
            .map(|(key, value)| if key == LIT[1].0 { (key, effects.as_str()) } else { (key, value) })
            .chain([("diffusion.light_map_size", size), ("diffusion.taps", taps)])
            .collect();
        let name = format!("{size} x {size}, {} taps", taps.trim_matches('"'));
        let scene = lab.scene(&format!("diffused {size} {}", taps.trim_matches('"')), demo, &settings)?;
        let arguments = [&scene.display().to_string(), "-o", table, "--full", "--exact"];
        lab.example("effects_cost", &format!("light map {name}"), &arguments)?;
        let found = csv(&std::fs::read_to_string(table)?)?;
        let frame = found.first().ok_or("no row of the frame")?;
        let bytes = number(&frame["atlas bytes"]);
        let floor = 1e3 * bytes / number(&frame["copied bytes a second"]);
        rows.push(json!({
            "name": name,
            "passes": frame["atlas passes"],
            "mib": bytes / f64::from(1 << 20),
            "atlas ms": frame["atlas median ms"],
            "GB a second": 1e-9 * number(&frame["copied bytes a second"]),
            "bytes ms": floor,
            "to bytes": number(&frame["atlas median ms"]) / floor,
            "frame ms": frame["median ms"],
        }));
    }
    Ok(rows.into())
}

/// What is changed in the built-in scene: four lights with shadow maps, the sky that each point sees, and a specular with
/// Fresnel.
const LIT: [(&str, &str); 8] = [
    ("environment.lights", "4"),
    (
        "model.effects",
        r#"["diffuse", "normal_map", "occlusion", "rim", "morph", "skin", "lights", "shadows", "light_specular", "fresnel", "directional_occlusion"]"#,
    ),
    ("model.visibility", "\"sh4\""),
    ("model.bounces", "\"gathered\""),
    ("model.specular_model", "\"ggx\""),
    ("model.specular_visibility", "\"cone\""),
    ("model.specular_map", "\"f0\""),
    ("quality.shadow_map_size", "2048"),
];

/// The graphics card that is here.
///
/// # Errors
/// Where there is none, or a driver that is a program on the CPU.
pub(crate) fn card(lab: &Lab) -> Result<Value> {
    let info: Value = serde_json::from_str(&lab.skinfit("the adapters", &["info", "--json"], false)?)?;
    let of = |what: &str| info["adapters"][0][what].as_str().unwrap_or_default();
    if of("kind").is_empty() || of("kind").contains("software") {
        return Err("there is no graphics card here".into());
    }
    Ok(format!("{} ({}, driver {})", of("name"), of("interface"), of("driver")).into())
}

/// A table of effects, and how far the full model is from its fetches alone.
fn effects(raw: &mut Value, name: &str, mut rows: Vec<Value>) {
    for row in &mut rows {
        row["name"] = row["effects"].take();
        row["kib"] = (number(&row["uploaded bytes"]) / 1024.0).into();
    }
    let frame = |name: &str, what: &str| {
        rows.iter().find(|row| row["name"] == name).map_or(f64::NAN, |row| number(&row[what]))
    };
    let (whole, alone) = ("the scene's effects", "the same fetches alone");
    let (forward, buffered) = ("forward median ms", "median ms");
    raw[format!("{name}_ratio")] = (frame(whole, buffered) / frame(alone, buffered)).into();
    raw[format!("{name}_forward_ratio")] = (frame(whole, forward) / frame(alone, forward)).into();
    raw[name] = rows.into();
}

/// experiments/rays: transfer vectors of the scanned head beside Embree's rays.
pub(crate) fn rays(lab: &Lab) -> Result<Value> {
    let python = lab.python.as_ref().ok_or("name a Python that has numpy and embreex by --python")?;
    let scene = lab.head_scene("forest", "scene.toml").display().to_string();
    let row = lab.scratch.path().join("rays.json").display().to_string();
    let arguments = [scene.as_str(), "-o", &row, "--python", &python.display().to_string()];
    lab.example("rays", "rays beside Embree", &arguments)?;
    let raw: Value = serde_json::from_str(&std::fs::read_to_string(&row)?)?;
    let rows = ["any", "nearest"].map(|query| {
        let mut row = raw[query].clone();
        row["name"] = query.into();
        row["skinfit"] = (number(&row["skinfit"]) / 1e6).into();
        row["embree"] = (number(&row["embree"]) / 1e6).into();
        row
    });
    Ok(json!({ "rows": rows, "vertices": raw["vertices"], "distinct": raw["distinct"],
        "triangles": raw["triangles"], "threads": raw["threads"] }))
}

/// experiments/scaling: the middle of three repeats.
pub(crate) fn scaling(lab: &Lab) -> Result<Value> {
    let mut command = Command::new(lab.root.join("experiments/scaling/run"));
    command.env("SKINFIT", lab.program());
    let rows = csv(&lab.run("scaling", command, false)?)?;
    let mut repeats: BTreeMap<(String, u64), Vec<f64>> = BTreeMap::new();
    let mut done = BTreeMap::new();
    for row in &rows {
        let what = row["what"].as_str().unwrap_or_default().to_owned();
        done.insert(what.clone(), row["done"].clone());
        repeats.entry((what, number(&row["count"]) as u64)).or_default().push(number(&row["seconds"]));
    }
    let middle = |repeats: &[f64]| {
        let mut sorted = repeats.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let alone = |what: &str| repeats.get(&(what.to_owned(), 1)).map_or(f64::NAN, |repeats| middle(repeats));
    let table: Vec<Value> = repeats
        .iter()
        .map(|((what, count), seconds)| {
            json!({
                "name": format!("{what} {count}"), "what": what, "count": count, "done": done[what],
                "seconds": middle(seconds), "times": alone(what) / middle(seconds), "repeats": seconds,
            })
        })
        .collect();
    Ok(json!({ "rows": table }))
}

/// experiments/bench: the middle of criterion's interval, and how many of what are done in a second.
pub(crate) fn bench(lab: &Lab) -> Result<Value> {
    let mut cargo = Command::new("cargo");
    cargo.args(["bench", "--bench", "bench", "--", "--warm-up-time", "1", "--measurement-time", "4"]);
    lab.run("the benchmarks", cargo, false)?;
    let mut rows = Vec::new();
    estimates(&lab.root.join("target/criterion"), &mut rows)?;
    rows.sort_by_key(|row| row["name"].as_str().map(str::to_owned));
    if rows.is_empty() {
        return Err("criterion left no estimates".into());
    }
    Ok(json!({ "rows": rows }))
}

/// Every `new/estimates.json` below `folder`, with the benchmark's name and throughput beside it.
fn estimates(folder: &Path, rows: &mut Vec<Value>) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.file_name().is_some_and(|name| name == "new") {
            let read = |name: &str| -> Result<Value> {
                Ok(serde_json::from_str(&std::fs::read_to_string(path.join(name))?)?)
            };
            let (estimate, benchmark) = (read("estimates.json")?, read("benchmark.json")?);
            let time = &estimate["median"];
            let seconds = 1e-9 * number(&time["point_estimate"]);
            let elements = number(&benchmark["throughput"]["Elements"]);
            rows.push(json!({
                "name": benchmark["full_id"],
                "ms": 1e3 * seconds,
                "low_ms": 1e-6 * number(&time["confidence_interval"]["lower_bound"]),
                "high_ms": 1e-6 * number(&time["confidence_interval"]["upper_bound"]),
                "elements": elements,
                "millions_a_second": 1e-6 * elements / seconds,
            }));
        } else if path.is_dir() {
            estimates(&path, rows)?;
        }
    }
    Ok(())
}

/// experiments/network: how far the loss falls on images that were held out.
pub(crate) fn network(lab: &Lab) -> Result<Value> {
    let said = lab.example("network", "the network", &[])?;
    let line =
        said.lines().find(|line| line.starts_with("held-out loss")).ok_or("the network said nothing")?;
    let numbers: Vec<f64> = line.split([' ', ':']).filter_map(|word| word.parse().ok()).collect();
    let [first, last, ..] = numbers[..] else { return Err(format!("no losses in `{line}`").into()) };
    Ok(json!({ "first": first, "last": last, "times": first / last }))
}
