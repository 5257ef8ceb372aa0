//! The race: our passes and fits on the CPU and on a graphics card, beside what other programs left of theirs.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv, head_of};
use crate::pages::significant;
use crate::studies::number;
use crate::timings::card;

/// Lookups of the race: done anew in each pass, or before.
const MODES: [&str; 2] = ["sampled", "pre"];

/// A row of the race's example.
fn raced(lab: &Lab, pixels: &str, mode: &str, options: &[&str]) -> Result<Value> {
    let folder = lab.race.as_ref().ok_or("name the folder of the race's data by --race")?;
    let data = folder.join("data").join(pixels).display().to_string();
    let row = lab.scratch.path().join("row.json").display().to_string();
    let mut arguments = vec![data.as_str(), "--mode", mode, "-o", &row];
    arguments.extend(options);
    lab.example("race", &format!("the race, {pixels} {mode} {}", options.join(" ")), &arguments)?;
    Ok(serde_json::from_str(&std::fs::read_to_string(&row)?)?)
}

/// experiments/race: our rows on the CPU, on two threads and on all, beside what the other frameworks' program left of
/// theirs.
pub(crate) fn processor(lab: &Lab) -> Result<Value> {
    let folder = lab.race.as_ref().ok_or("name the folder of the race's data by --race")?;
    let all = std::thread::available_parallelism()?.get();
    let mut threads = vec![all.min(2), all];
    threads.dedup();
    let mut raw = json!({});
    for pixels in ["65536", "1048576"] {
        for mode in MODES {
            let mut rows = Vec::new();
            for threads in &threads {
                rows.push(raced(lab, pixels, mode, &["--threads", &threads.to_string()])?);
            }
            let others = folder.join("results").join(format!("{pixels}_{mode}_cpu.json"));
            if let Ok(text) = std::fs::read_to_string(others) {
                rows.extend(serde_json::from_str::<Vec<Value>>(&text)?);
            }
            let rows: Vec<Value> = rows.iter().filter(|row| row["error"].is_null()).map(racer).collect();
            raw[format!("{mode}_{pixels}")] = rows.into();
        }
    }
    Ok(raw)
}

/// experiments/race: our row of texture-space diffusion on two threads, beside what the other frameworks' program left of
/// theirs.
pub(crate) fn diffusion(lab: &Lab) -> Result<Value> {
    Ok(json!({ "rows": diffused(lab, &["--threads", "2"], "cpu")? }))
}

/// experiments/race: the same on a graphics card.
pub(crate) fn diffusion_on_a_card(lab: &Lab) -> Result<Value> {
    let rows = diffused(lab, &["--engine", "gpu", "--reps", "20"], "cuda")?;
    Ok(json!({ "adapter": card(lab)?, "rows": rows }))
}

/// What the data of texture-space diffusion is called: texels a side, pixels.
const DIFFUSED: &str = "512_442368";

/// Our row of texture-space diffusion, beside those that the other frameworks left of that device.
fn diffused(lab: &Lab, options: &[&str], device: &str) -> Result<Vec<Value>> {
    let folder = lab.race.as_ref().ok_or("name the folder of the diffusion race's data by --race")?;
    let data = folder.join("data").join(DIFFUSED).display().to_string();
    let row = lab.scratch.path().join("row.json").display().to_string();
    let mut arguments = vec![data.as_str(), "--diffusion", "-o", &row];
    arguments.extend(options);
    lab.example("race", &format!("the race of diffusion, {DIFFUSED}"), &arguments)?;
    let mut rows: Vec<Value> = vec![serde_json::from_str(&std::fs::read_to_string(&row)?)?];
    let others = folder.join("results").join(format!("{DIFFUSED}_{device}.json"));
    if let Ok(text) = std::fs::read_to_string(others) {
        rows.extend(serde_json::from_str::<Vec<Value>>(&text)?);
    }
    let rows = rows.iter().filter(|row| row["error"].is_null()).map(|row| {
        let milliseconds = |what: &str| row[what]["median"].as_f64().map(|seconds| 1e3 * seconds);
        let mut shown = racer(row);
        for (key, what) in [("forward", "forward"), ("gradient", "grad"), ("normal", "normal")] {
            shown[key] = milliseconds(what).into();
        }
        shown
    });
    Ok(rows.collect())
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
        "name": row["peer"], "version": row["version"], "device": row["device"], "threads": row["threads"],
        "forward": a_pixel("forward"), "gradient": a_pixel("grad"), "normal": a_pixel("normal"),
        "clean": fit("clean"), "noisy": fit("noisy"), "max_error": row["forward_max_err"],
        "peak_mb": row["peak_rss_mb"], "raw": row,
    })
}

/// What the tables of a card call each timing of the race's example.
const TIMINGS: [(&str, &str); 5] = [
    ("forward", "/forward/median"),
    ("gradient", "/grad/median"),
    ("normal", "/normal/median"),
    ("clean", "/fits/clean~1lm/median"),
    ("noisy", "/fits/noisy~1lm/median"),
];

/// experiments/race: our rows on a graphics card, from the least to the greatest median of a few runs; passes alone at
/// the size that has no fits.
pub(crate) fn graphics_card(lab: &Lab) -> Result<Value> {
    let folder = lab.race.as_ref().ok_or("name the folder of the race's data by --race")?;
    let runs = 3;
    let mut raw = json!({ "adapter": card(lab)? });
    for (pixels, options) in [
        ("1048576", &["--engine", "gpu", "--reps", "20"][..]),
        ("16777216", &["--engine", "gpu", "--reps", "20", "--passes-only"]),
    ] {
        // Who has not made the greatest data goes without its rows.
        if !folder.join("data").join(pixels).is_dir() {
            continue;
        }
        for (mode, lookups) in MODES.into_iter().zip(["live", "kept"]) {
            let mut rows = Vec::new();
            for _ in 0..runs {
                rows.push(raced(lab, pixels, mode, options)?);
            }
            let mut row = json!({ "name": rows[0]["peer"], "runs": runs });
            for (key, at) in TIMINGS {
                let seconds = rows.iter().filter_map(|row| row.pointer(at)?.as_f64());
                row[key] = span(&seconds.map(|seconds| 1e3 * seconds).collect::<Vec<_>>());
            }
            row["raw"] = rows.into();
            raw[format!("{lookups}_{pixels}")] = json!([row]);
        }
    }
    Ok(raw)
}

/// From the least to the greatest, in words; nothing of none.
fn span(times: &[f64]) -> Value {
    let (least, most) = times.iter().fold((f64::MAX, 0.0_f64), |(a, b), &x| (a.min(x), b.max(x)));
    let (least, most) = (significant(least, 2), significant(most, 2));
    match times {
        [] => Value::Null,
        _ if least == most => least.into(),
        _ => format!("{least} to {most}").into(),
    }
}

/// experiments/race: what an earlier engine and other programs took on a card, from the least to the greatest of several
/// runs.
pub(crate) fn earlier(lab: &Lab) -> Result<Value> {
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
                row[key] = measured.get(measure).map_or(Value::Null, |times| span(times));
            }
            row
        });
        raw[table] = rows.collect::<Vec<_>>().into();
    }
    Ok(raw)
}
