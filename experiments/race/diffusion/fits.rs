//! Whole fits of the diffusion race: first on a window of the atlas, then on all of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde_json::{Value, json};
use skinfit::engine::Point;
use skinfit::fit::{FitOptions, SolverKind, fit, fit_watched};

use super::data::{Data, Manifest, vector};
use super::secant::Secant;
use super::window::Window;
use super::{Options, engine, point};
use crate::data::Result;
use crate::racer::Racer;

/// Texels along a side of the window.
const SIDE: usize = 80;
/// Texels about it that are computed: at the radii where fits end, light from further off weighs nothing.
const HALO: usize = 40;
/// Steps on the window, at the most: what the whole moves is more than further ones gain.
const ON_WINDOW: u64 = 8;
/// Steps over all pixels, at the most.
const MOST: usize = 20;

/// How a fit went.
struct Run {
    /// Until the criterion held, if it did.
    seconds: Option<f64>,
    /// Passes, those on the window for their share of the pixels.
    evaluations: f64,
    /// The least error on the way.
    best: f64,
}

/// Engines over the window and over all of a target.
struct Engines {
    /// The window's, and its share of the pixels; a card makes the whole as fast as a window.
    part: Option<(Box<dyn Racer>, f64)>,
    whole: Box<dyn Racer>,
}

/// How far `point` is from the race's criterion, and how far it may be: the worst relative error of a parameter (clean), or
/// the relative excess loss to second order (noisy).
fn criterion(manifest: &Manifest, which: &str, point: &Point) -> Result<(f64, f64)> {
    let p = vector(&point.params)?;
    if which == "clean" {
        let errors = p.iter().zip(&manifest.params_true).map(|(p, t)| (p / t - 1.0).abs());
        return Ok((errors.fold(0.0, f64::max), 1e-3));
    }
    let d: Vec<f64> = p.iter().zip(&manifest.params_opt_noisy).map(|(p, o)| p - o).collect();
    let rows = manifest.hessian_half_noisy.iter().zip(&d);
    let excess: f64 = rows.map(|(row, di)| di * row.iter().zip(&d).map(|(h, dj)| h * dj).sum::<f64>()).sum();
    Ok((excess / manifest.loss_opt_noisy, 1e-6))
}

/// The window that shows the most pixels, of those that lie side by side.
fn window(data: &Data, manifest: &Manifest) -> Window {
    let across = manifest.texels / SIDE;
    let mut counts = vec![0_usize; across * across];
    for pixel in 0..manifest.pixels {
        let [column, row] = data.texel_of(pixel).map(|at| at / SIDE);
        if column < across && row < across {
            counts[row * across + column] += 1;
        }
    }
    let best = (0..counts.len()).max_by_key(|&at| counts[at]).unwrap_or(0);
    let low = [best % across.max(1), best / across.max(1)].map(|at| at * SIDE);
    Window { low, high: low.map(|at| at + SIDE), halo: HALO }
}

/// A fit on the window or, until the criterion holds, over all pixels: where it ends, and its passes over all of them.
fn begun(engines: &Engines, manifest: &Manifest, which: &str, start: &Point) -> Result<(Point, f64)> {
    let Some((part, share)) = &engines.part else {
        let enough = Arc::new(AtomicBool::new(false));
        let options = FitOptions { interrupt: Some(Arc::clone(&enough)), ..FitOptions::default() };
        let mut watch = |_: &_, point: &Point| {
            let met = criterion(manifest, which, point).is_ok_and(|(error, tolerance)| error < tolerance);
            enough.store(met, Ordering::SeqCst);
        };
        let whole =
            fit_watched(&*engines.whole, start, &options, &mut watch).map_err(|error| error.to_string())?;
        return Ok((whole.end, whole.evaluations as f64));
    };
    let options =
        FitOptions { solver: SolverKind::Lm, max_iterations: Some(ON_WINDOW), ..FitOptions::default() };
    let part = fit(&**part, start, &options, &mut |_| {}).map_err(|error| error.to_string())?;
    Ok((part.end, part.evaluations as f64 * share))
}

/// A first fit, then bounded steps over all pixels until the criterion holds.
fn fit_to_criterion(engines: &Engines, manifest: &Manifest, which: &str, start: &Point) -> Result<Run> {
    let clock = Instant::now();
    let (mut point, mut evaluations) = begun(engines, manifest, which, start)?;
    let mut best = f64::INFINITY;
    let mut secant = Secant::new(&*engines.whole, &point);
    for _ in 0..=MOST {
        let (error, tolerance) = criterion(manifest, which, &point)?;
        best = best.min(error);
        if error < tolerance {
            return Ok(Run { seconds: Some(clock.elapsed().as_secs_f64()), evaluations, best });
        }
        point = secant.step(&*engines.whole);
        evaluations += 1.0;
    }
    Ok(Run { seconds: None, evaluations, best })
}

/// The fits of both targets.
pub(super) fn fits(data: &Data, manifest: &Manifest, options: &Options<'_>) -> Result<Value> {
    let start = point(&manifest.params_init)?;
    let (window, gpu) = (window(data, manifest), options.gpu.as_ref());
    let mut fits = serde_json::Map::new();
    for which in ["clean", "noisy"] {
        let whole = data.view(which, None)?;
        let part = match gpu {
            Some(_) => None,
            None => {
                let part = data.view(which, Some(&window))?;
                let share = part.samples.groups() as f64 / whole.samples.groups() as f64;
                Some((engine(gpu, part, true, &start)?, share))
            }
        };
        let engines = Engines { part, whole: engine(gpu, whole, true, &start)? };
        let (mut seconds, mut evaluations, mut best) = (Vec::new(), 0.0, 0.0);
        let runs = options.reps.max(5);
        // The first is not counted: it is what other frameworks compile in.
        for run in 0..=runs {
            let found = fit_to_criterion(&engines, manifest, which, &start)?;
            if run > 0 {
                seconds.extend(found.seconds);
            }
            (evaluations, best) = (found.evaluations, found.best);
        }
        seconds.sort_by(f64::total_cmp);
        let row = json!({"median": seconds.get(seconds.len() / 2), "min": seconds.first(),
                         "evals": (evaluations * 100.0).round() / 100.0,
                         "best": best, "ok": seconds.len(), "runs": runs});
        fits.insert(format!("{which}/lm"), row);
    }
    Ok(Value::Object(fits))
}
