//! experiments/unchanged: passes and fits of the race by the last program that was one package and by today's, in turns.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::builds::ONE_PACKAGE;
use crate::lab::{Lab, Result};
use crate::timings::card;
use crate::unchanged::program_before;

/// What is timed, and where a row of the race has it.
const TIMINGS: [(&str, &str); 5] = [
    ("forward", "/forward/min"),
    ("gradient", "/grad/min"),
    ("normal", "/normal/min"),
    ("clean", "/fits/clean~1lm/min"),
    ("noisy", "/fits/noisy~1lm/min"),
];
/// Turns: the least time of them all counts, as other programs of a machine make a turn slower and never faster.
const TURNS: usize = 15;

/// One of the race's ways.
struct Way<'a> {
    pixels: u64,
    mode: &'a str,
    threads: usize,
    options: &'a [&'a str],
}

/// The modes at two sizes.
fn ways() -> impl Iterator<Item = (u64, &'static str)> {
    [65_536, 1_048_576].into_iter().flat_map(|pixels| ["sampled", "pre"].map(|mode| (pixels, mode)))
}

/// On the processor, on one thread and on all.
pub(crate) fn processor(lab: &Lab) -> Result<Value> {
    let all = std::thread::available_parallelism()?.get();
    let mut rows = Vec::new();
    for (pixels, mode) in ways() {
        for threads in [1, all] {
            rows.push(compared(lab, &Way { pixels, mode, threads, options: &["--reps", "20"] })?);
        }
    }
    Ok(json!({ "before": ONE_PACKAGE, "turns": TURNS, "rows": rows }))
}

/// On a graphics card.
pub(crate) fn graphics_card(lab: &Lab) -> Result<Value> {
    let threads = std::thread::available_parallelism()?.get();
    let options = ["--engine", "gpu", "--reps", "200"];
    let rows = ways().map(|(pixels, mode)| compared(lab, &Way { pixels, mode, threads, options: &options }));
    let rows = rows.collect::<Result<Vec<_>>>()?;
    Ok(json!({ "before": ONE_PACKAGE, "adapter": card(lab)?, "turns": TURNS, "rows": rows }))
}

/// A row: for each timing the least of both programs in milliseconds, and how many times as fast today's is; the peak of
/// resident memory of both.
fn compared(lab: &Lab, way: &Way<'_>) -> Result<Value> {
    let then = program_before(lab)?.with_file_name("examples").join("race");
    let now = std::env::current_exe()?.with_file_name("race");
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for turn in 1..=TURNS {
        before.push(raced(lab, &then, &format!("turn {turn}, before"), way)?);
        after.push(raced(lab, &now, &format!("turn {turn}, now"), way)?);
    }
    let mut row = json!({ "pixels": way.pixels, "mode": way.mode, "threads": way.threads });
    for (name, at) in TIMINGS {
        let milliseconds = |row: &Value| row.pointer(at)?.as_f64().map(|seconds| 1e3 * seconds);
        let least = |rows: &[Value]| rows.iter().filter_map(milliseconds).min_by(f64::total_cmp);
        let (before, now) = (least(&before), least(&after));
        let times = before.zip(now).map(|(before, now)| before / now);
        row[name] = json!({ "before": before, "now": now, "times": times });
    }
    let peak =
        |rows: &[Value]| rows.iter().filter_map(|row| row["peak_rss_mb"].as_f64()).min_by(f64::total_cmp);
    row["peak_mb"] = json!({ "before": peak(&before), "now": peak(&after) });
    Ok(row)
}

/// A row of a program's race.
fn raced(lab: &Lab, program: &Path, turn: &str, way: &Way<'_>) -> Result<Value> {
    let folder = lab.race.as_ref().ok_or("name the folder of the race's data by --race")?;
    let Way { pixels, mode, threads, options } = way;
    let mut command = Command::new(program);
    command.arg(folder.join("data").join(pixels.to_string())).args(["--mode", mode]).args(*options);
    // Both programs read it; only today's has an option for it.
    command.env("RAYON_NUM_THREADS", threads.to_string());
    let what = format!("the race, {pixels} {mode} on {threads} threads, {turn}");
    Ok(serde_json::from_str(&lab.run(&what, command, false)?)?)
}
