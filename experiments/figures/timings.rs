//! Times: of passes and fits, of each effect in the renderer, over workers and threads, of a network's training.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv, head_of};
use crate::pages::significant;
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

/// experiments/effects_cost: what was measured on a card that is not here, each table with a head of its own.
pub(crate) fn effects_cost_elsewhere(lab: &Lab) -> Result<Value> {
    let folder = lab.root.join("experiments/effects_cost/results");
    let mut raw = json!({});
    for name in ["paper", "paper-3840x2160", "exact"] {
        let text = std::fs::read_to_string(folder.join(format!("h200-{name}.csv")))?;
        raw["head"] = head_of(&text);
        effects(&mut raw, &name.replace('-', "_"), csv(&text)?);
    }
    Ok(raw)
}

/// A table of effects, and how far the full model is from its fetches alone.
fn effects(raw: &mut Value, name: &str, mut rows: Vec<Value>) {
    for row in &mut rows {
        row["name"] = row["effects"].take();
        row["kib"] = (number(&row["uploaded bytes"]) / 1024.0).into();
    }
    let frame = |name: &str| {
        rows.iter().find(|row| row["name"] == name).map_or(f64::NAN, |row| number(&row["median ms"]))
    };
    raw[format!("{name}_ratio")] = (frame("the scene's effects") / frame("the same fetches alone")).into();
    raw[name] = rows.into();
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

/// experiments/race: our rows on the CPU, beside what the other frameworks' program left of theirs.
pub(crate) fn race(lab: &Lab) -> Result<Value> {
    let folder = lab.race.as_ref().ok_or("name the folder of the race's data by --race")?;
    let mut raw = json!({});
    for pixels in ["65536", "1048576"] {
        let data = folder.join("data").join(pixels).display().to_string();
        for mode in ["sampled", "pre"] {
            let row = lab.scratch.path().join("row.json").display().to_string();
            lab.example("race", &format!("the race, {pixels} {mode}"), &[&data, "--mode", mode, "-o", &row])?;
            let ours: Value = serde_json::from_str(&std::fs::read_to_string(&row)?)?;
            let others = folder.join("results").join(format!("{pixels}_{mode}_cpu.json"));
            let others: Vec<Value> = match std::fs::read_to_string(others) {
                Ok(text) => serde_json::from_str(&text)?,
                Err(_) => Vec::new(),
            };
            let rows: Vec<Value> =
                [&ours].into_iter().chain(&others).filter(|row| row["error"].is_null()).map(racer).collect();
            raw[format!("{mode}_{pixels}")] = rows.into();
        }
    }
    Ok(raw)
}

/// A framework's row: nanoseconds a pixel of the fastest repetition, milliseconds of its fastest fits.
fn racer(row: &Value) -> Value {
    let a_pixel =
        |what: &str| row[what]["min"].as_f64().map(|seconds| 1e9 * seconds / number(&row["pixels"]));
    let fit = |target: &str| {
        let fits = row["fits"].as_object().into_iter().flatten();
        let seconds =
            fits.filter(|(name, _)| name.starts_with(target)).filter_map(|(_, fit)| fit["min"].as_f64());
        seconds.min_by(f64::total_cmp).map(|seconds| 1e3 * seconds)
    };
    json!({
        "name": row["peer"], "version": row["version"], "device": row["device"],
        "forward": a_pixel("forward"), "gradient": a_pixel("grad"), "normal": a_pixel("normal"),
        "clean": fit("clean"), "noisy": fit("noisy"), "max_error": row["forward_max_err"],
        "peak_mb": row["peak_rss_mb"], "raw": row,
    })
}

/// experiments/race: what was measured on a card that is not here, from the least to the greatest of several runs.
pub(crate) fn race_elsewhere(lab: &Lab) -> Result<Value> {
    let text = std::fs::read_to_string(lab.root.join("experiments/race/results/h200.csv"))?;
    // Pixels and lookups, then programs in their order, then what was measured.
    /// Variants of a program, each with its columns.
    type Table = Vec<(String, BTreeMap<String, Vec<f64>>)>;
    let mut tables: BTreeMap<String, Table> = BTreeMap::new();
    for row in csv(&text)? {
        let program = row["program"].as_str().unwrap_or_default();
        // Runs of the same program; what differs in the kernel has a comma.
        let program = if program.starts_with("skinfit (") { "skinfit" } else { program };
        let (table, variant) = match program.strip_prefix("skinfit, ") {
            Some(variant) => ("kernels".to_owned(), variant),
            None => {
                let lookups = if row["lookups"] == "before" { "kept" } else { "live" };
                (format!("{lookups}_{}", number(&row["pixels"])), program)
            }
        };
        let table = tables.entry(table).or_default();
        let at = table.iter().position(|(name, _)| name == variant).unwrap_or_else(|| {
            table.push((variant.to_owned(), BTreeMap::new()));
            table.len() - 1
        });
        let measure = row["measure"].as_str().unwrap_or_default().to_owned();
        table[at].1.entry(measure).or_default().push(number(&row["milliseconds"]));
    }
    let mut raw = json!({ "head": head_of(&text) });
    for (table, programs) in tables {
        let rows = programs.iter().map(|(name, measured)| {
            let mut row = json!({ "name": name });
            for (key, measure) in [
                ("forward", "forward"),
                ("gradient", "loss and gradient"),
                ("normal", "loss, JtJ and Jtr"),
                ("clean", "fit of the clean target"),
                ("noisy", "fit of the noisy target"),
            ] {
                row[key] = measured.get(measure).map_or(Value::Null, |times| {
                    let (least, most) =
                        times.iter().fold((f64::MAX, 0.0_f64), |(a, b), &x| (a.min(x), b.max(x)));
                    let (least, most) = (significant(least, 2), significant(most, 2));
                    if least == most { least.into() } else { format!("{least} to {most}").into() }
                });
            }
            row
        });
        raw[table] = rows.collect::<Vec<_>>().into();
    }
    Ok(raw)
}
