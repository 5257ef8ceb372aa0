//! The race: the same forward pass, gradient, normal equations and fits, on the same inputs, as
//! other frameworks do them. Reads a data folder, writes one row of the table as JSON.
//!
//! `cargo run --release --example race -- DATA_DIR [--mode sampled|pre] [--engine cpu|gpu] -o row.json`
//! `cargo run --release --example race -- DATA_DIR --diffusion [--engine cpu|gpu] -o row.json`
//!
//! - this module: the surface model; [`diffusion`]: light that scatters within the skin, which has data of its own
//! - `data`: the folder of the first; `racer`: both engines; `measure`: what both races measure with

mod data;
mod diffusion;
mod measure;
mod racer;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use data::{Manifest, Result};
use measure::{gauss_newton_step, peak_rss_mb, timed};
use racer::Racer;
use serde_json::{Value, json};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::{GpuEngine, Memory};
use skinfit::engine::{Point, Task, Unknown};
use skinfit::fit::{FitOptions, fit};
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::params::Param;
use skinfit::scene::Loss;

#[derive(Parser)]
#[command(about = "Time skinfit's engines on the race's data")]
struct Arguments {
    /// Folder with manifest.json and the raw planes.
    data: PathBuf,
    /// `sampled`: all four lookups in each pass; `pre`: the bump strength is held at its true value.
    #[arg(long, default_value = "sampled", value_parser = ["sampled", "pre"])]
    mode: String,
    /// What makes the passes.
    #[arg(long, default_value = "cpu", value_parser = ["cpu", "gpu"])]
    engine: String,
    /// The data is that of the race of texture-space diffusion.
    #[arg(long, conflicts_with = "mode")]
    diffusion: bool,
    /// Where the row is written; standard output when left out.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Repetitions of each timing, at the least.
    #[arg(long, default_value_t = 7)]
    reps: usize,
    /// Time the passes and leave the fits out.
    #[arg(long)]
    passes_only: bool,
    /// Threads of the CPU; all of them when left out.
    #[arg(long)]
    threads: Option<usize>,
}

const SETUP: Setup = Setup::new(Form::Corrected, Silhouette::Bumped, Effects::SURFACE.with(Effect::Haze));

/// The engine over the target `which`. With `keep` false the CPU's looks everything up anew in each pass; the GPU's
/// does so where the bump strength is free.
fn engine(arguments: &Arguments, manifest: &Manifest, which: &str, keep: bool) -> Result<Box<dyn Racer>> {
    let columns = Manifest::columns(arguments.mode == "sampled");
    let task = Task {
        setup: SETUP,
        illumination: Arc::new(data::illumination(&arguments.data, manifest)?),
        views: Arc::new([data::view(&arguments.data, manifest, which)?]),
        loss: Loss::L2,
        unknowns: columns.into_iter().map(Unknown::Param).collect(),
    };
    if arguments.engine == "cpu" {
        let engine = CpuEngine::with_kept_terms(task, keep);
        return Ok(Box::new(engine.map_err(|error| error.to_string())?));
    }
    let gpu = adapter()?;
    let start = Point { params: Manifest::params(&manifest.params_true), gains: vec![1.0.into()] };
    let engine = GpuEngine::new(&gpu, task, &start, Memory::default()).map_err(|error| error.to_string())?;
    let (resident, _) = engine.bytes();
    eprintln!("race: {:.1} bytes a pixel on the device", resident as f64 / manifest.pixels as f64);
    Ok(Box::new(engine))
}

/// The adapter that is here.
fn adapter() -> Result<skinfit::gpu::Gpu> {
    skinfit::gpu::Gpu::open(&skinfit::gpu::Choice::default()).map_err(|error| error.to_string())
}

/// Pixels that the coarse stage of a fit reads, about.
const COARSE_PIXELS: usize = 1024;

/// How far `point` is from the race's criterion: the worst parameter error (clean), or the relative
/// excess loss to second order (noisy), over the criterion's tolerance.
fn criterion(manifest: &Manifest, which: &str, point: &Point) -> (f64, f64) {
    let p = Manifest::vector(&point.params);
    if which == "clean" {
        let errors = p.iter().zip(&manifest.params_true).map(|(p, t)| (p - t).abs());
        return (errors.fold(0.0, f64::max), 1e-4);
    }
    let d: Vec<f64> = p.iter().zip(&manifest.params_opt_noisy).map(|(p, o)| p - o).collect();
    let rows = manifest.hessian_half_noisy.iter().zip(&d);
    let excess: f64 = rows.map(|(row, di)| di * row.iter().zip(&d).map(|(h, dj)| h * dj).sum::<f64>()).sum();
    (excess / manifest.loss_opt_noisy, 1e-6)
}

/// Variable projection to convergence on a share of the pixels, then Gauss-Newton steps over all of
/// them until the criterion holds: one is enough, as the coarse answer is within its standard errors.
/// Every pass counts as one evaluation, the coarse ones for their share.
///
/// In mode `pre` the noisy criterion, whose optimum has the bump strength free, can be out of reach on
/// few pixels; the fit then ends where it no longer comes closer.
fn fit_to_criterion(engine: &mut dyn Racer, manifest: &Manifest, which: &str, start: &Point) -> Result<Run> {
    let clock = Instant::now();
    let stride = (manifest.pixels / COARSE_PIXELS).max(1);
    engine.set_stride(stride);
    let coarse = fit(engine, start, &FitOptions::default(), &mut |_| {}).map_err(|e| e.to_string())?;
    let mut evaluations = coarse.evaluations as f64 / stride as f64;
    let mut point = coarse.end;
    engine.set_stride(1);
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let (error, tolerance) = criterion(manifest, which, &point);
        best = best.min(error);
        if error < tolerance {
            return Ok(Run { seconds: Some(clock.elapsed().as_secs_f64()), evaluations, best });
        }
        point = gauss_newton_step(engine, &point);
        evaluations += 1.0;
    }
    Ok(Run { seconds: None, evaluations, best })
}

/// How a fit went.
struct Run {
    /// Until the criterion held, if it did.
    seconds: Option<f64>,
    evaluations: f64,
    /// The least error on the way.
    best: f64,
}

fn fits(arguments: &Arguments, manifest: &Manifest, start: &Point) -> Result<Value> {
    let mut fits = serde_json::Map::new();
    for which in ["clean", "noisy"] {
        let mut engine = engine(arguments, manifest, which, true)?;
        // The first pass makes the kept terms (mode `pre`: what other frameworks are given in files).
        engine.normal_equations(start);
        let (mut seconds, mut evaluations, mut best) = (Vec::new(), 0.0, 0.0);
        let runs = arguments.reps.max(5);
        for _ in 0..runs {
            let run = fit_to_criterion(&mut *engine, manifest, which, start)?;
            seconds.extend(run.seconds);
            (evaluations, best) = (run.evaluations, run.best);
        }
        seconds.sort_by(f64::total_cmp);
        let row = json!({"median": seconds.get(seconds.len() / 2), "min": seconds.first(),
                         "evals": (evaluations * 100.0).round() / 100.0,
                         "best": best, "ok": seconds.len(), "runs": runs});
        fits.insert(format!("{which}/lm"), row);
    }
    Ok(Value::Object(fits))
}

fn run(arguments: &Arguments) -> Result<Value> {
    if arguments.diffusion {
        let Arguments { data, reps, passes_only, .. } = arguments;
        let gpu = if arguments.engine == "gpu" { Some(adapter()?) } else { None };
        let (reps, passes_only) = (*reps, *passes_only);
        return diffusion::run(&diffusion::Options { folder: data, reps, passes_only, gpu });
    }
    let manifest = Manifest::read(&arguments.data)?;
    let pre = arguments.mode == "pre";
    let truth = Point { params: Manifest::params(&manifest.params_true), gains: vec![1.0.into()] };
    let mut start = Point { params: Manifest::params(&manifest.params_init), gains: vec![1.0.into()] };
    if pre {
        start.params.set(Param::NormalStrength, truth.params.scalar(Param::NormalStrength));
    }
    let before = peak_rss_mb();
    // In mode `sampled` every lookup is done anew; in mode `pre` what the bump strength decides is
    // kept from the first (untimed) pass, as other frameworks are given it in files.
    let engine = engine(arguments, &manifest, "clean", pre)?;
    let inputs = peak_rss_mb();
    let first = Instant::now();
    let image = engine.image_planes(&truth);
    let first_forward = first.elapsed().as_secs_f64();
    let error = |c: usize, i: usize| {
        let want = engine.views()[0].target.number(c, i);
        f64::from((image[c][i] - want).abs() / (1.0 + want.abs()))
    };
    let max_error = (0..4)
        .flat_map(|c| (0..manifest.pixels).map(move |i| (c, i)))
        .map(|(c, i)| error(c, i))
        .fold(0.0, f64::max);
    let mut planes = image;
    let forward = timed(arguments.reps, || engine.forward(&start, &mut planes));
    drop(planes);
    let grad = timed(arguments.reps, || drop(std::hint::black_box(engine.gradient(&start))));
    let normal = timed(arguments.reps, || drop(std::hint::black_box(engine.normal_equations(&start))));
    engine.fault().map_or(Ok(()), Err)?;
    let mut row = json!({
        "peer": "skinfit", "version": format!("skinfit {} ({})", env!("CARGO_PKG_VERSION"), engine.version()),
        "pixels": manifest.pixels, "mode": arguments.mode, "device": engine.name(),
        "threads": rayon::current_num_threads(),
        "forward": forward, "grad": grad, "normal": normal,
        "first_forward_s": first_forward, "forward_max_err": max_error,
        "rss_import_mb": before, "rss_before_fits_mb": inputs, "other_cpu": 0,
    });
    // The fits have engines of their own.
    drop(engine);
    if !arguments.passes_only {
        row["fits"] = fits(arguments, &manifest, &start)?;
    }
    row["peak_rss_mb"] = json!(peak_rss_mb());
    Ok(row)
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.unwrap_or(0)).build_global();
    // From within the pool, so that a pass does not begin by waking another thread.
    let row = pool.map_err(|e| e.to_string()).and_then(|()| rayon::scope(|_| run(&arguments)));
    let written = row.and_then(|row| {
        let text = format!("{row:#}\n");
        match &arguments.output {
            None => {
                print!("{text}");
                Ok(())
            }
            Some(path) => skinfit::output::write(path, text.as_bytes()).map_err(|e| e.to_string()),
        }
    });
    match written {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("race: {message}");
            std::process::ExitCode::from(2)
        }
    }
}
