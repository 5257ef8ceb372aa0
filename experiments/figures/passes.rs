//! experiments/effects_cost: what passes of a fit take with the paper's effects and with those of light, over the same
//! pixels, and whole fits.

use std::time::Instant;

use serde_json::{Value, json};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Objective, Point, Task, Unknown};
use skinfit::gpu::{Choice, Gpu};
use skinfit::model::params::Param;
use skinfit::prepare::{Observed, PrepareOptions};

use crate::lab::{Lab, Result};
use crate::studies::number;
use crate::timings::card;

/// Files of the forest, whose views and samples are the same.
const FILES: [(&str, &str); 2] =
    [("the paper's effects", "scene.toml"), ("light, shadows, Fresnel and the sky", "light.toml")];
/// Rounds, in which all rows take turns: the least time of each counts.
const ROUNDS: usize = 40;

/// An engine that is timed, and what its row says.
struct Timed<E> {
    engine: E,
    start: Point,
    row: Value,
}

/// On the processor: passes, and whole fits.
pub(crate) fn processor(lab: &Lab) -> Result<Value> {
    let engine = |task: Task, start: &Point| {
        let engine = CpuEngine::new(task)?;
        let read = engine.bytes_a_sample(start)?;
        Ok((engine, json!(read)))
    };
    let rows = timed(lab, engine)?;
    Ok(json!({ "passes": rows, "runs": runs(lab)? }))
}

/// On a graphics card: passes.
pub(crate) fn graphics_card(lab: &Lab) -> Result<Value> {
    let adapter = card(lab)?;
    let gpu = Gpu::open(&Choice::default())?;
    let engine = |task: Task, start: &Point| {
        let samples: usize = task.views.iter().map(|view| view.samples.count()).sum();
        let engine = GpuEngine::new(&gpu, task, start, Memory::default())?;
        let (resident, _) = engine.bytes();
        Ok((engine, json!(resident as f64 / samples as f64)))
    };
    Ok(json!({ "adapter": adapter, "passes": timed(lab, engine)? }))
}

/// A row for each file, with the strength of bumps as free as the file has it, and held, so that lookups are kept.
fn timed<E: Objective>(lab: &Lab, engine: impl Fn(Task, &Point) -> Result<(E, Value)>) -> Result<Vec<Value>> {
    let mut all = Vec::new();
    for held in [false, true] {
        for (name, file) in FILES {
            let cache = Some(lab.scratch.path().join("cache"));
            let observed = Observed::new(
                &lab.head_scene("forest", file),
                &PrepareOptions { cache, ..Default::default() },
            )?;
            let start = observed.start();
            let mut task = observed.task();
            let bumps = |unknown: &Unknown| matches!(unknown, Unknown::Param(column) if column.param == Param::NormalStrength);
            task.unknowns.retain(|unknown| !(held && bumps(unknown)));
            let samples: usize = task.views.iter().map(|view| view.samples.count()).sum();
            let columns = task.unknowns.len();
            let (engine, bytes) = engine(task, &start)?;
            let row = json!({
                "name": name, "lookups": if held { "kept" } else { "in every pass" },
                "samples": samples, "columns": columns, "bytes": bytes,
            });
            all.push(Timed { engine, start, row });
        }
    }
    let mut least = vec![[f64::INFINITY; 3]; all.len()];
    for _ in 0..ROUNDS {
        for (of, least) in all.iter().zip(&mut least) {
            least[0] = least[0].min(took(|| of.engine.loss(&of.start)));
            least[1] = least[1].min(took(|| of.engine.gradient(&of.start)));
            least[2] = least[2].min(took(|| of.engine.normal_equations(&of.start)));
        }
    }
    if let Some(fault) = all.iter().find_map(|of| of.engine.fault()) {
        return Err(fault.into());
    }
    let rows = all.into_iter().zip(&least).enumerate().map(|(at, (of, times))| {
        let mut row = of.row;
        // The paper's row of the same lookups stands first.
        let paper = least[at / FILES.len() * FILES.len()];
        for (pass, name) in ["loss", "gradient", "normal"].into_iter().enumerate() {
            row[name] = json!({ "ms": times[pass], "times": times[pass] / paper[pass] });
        }
        row
    });
    Ok(rows.collect())
}

/// The milliseconds that a pass takes.
fn took<T>(pass: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    std::hint::black_box(pass());
    1e3 * start.elapsed().as_secs_f64()
}

/// Whole runs of the forest, as the command line has them: with nothing baked, and the best of five with all baked.
fn runs(lab: &Lab) -> Result<Vec<Value>> {
    let cache = lab.scratch.path().join("cache_of_runs").display().to_string();
    let scene = lab.head_scene("forest", "light.toml");
    let run = |what: &str| -> Result<Value> {
        let start = Instant::now();
        let (report, _) = lab.fit(what, Some(&scene), &["--cache", &cache])?;
        let mut seconds = report["seconds"].clone();
        seconds["whole"] = start.elapsed().as_secs_f64().into();
        seconds["name"] = what.into();
        Ok(seconds)
    };
    let cold = run("nothing baked")?;
    let warm = (0..5).map(|_| run("all baked")).collect::<Result<Vec<Value>>>()?;
    let best = warm.into_iter().min_by(|a, b| number(&a["whole"]).total_cmp(&number(&b["whole"])));
    Ok([cold].into_iter().chain(best).collect())
}
