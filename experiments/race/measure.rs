//! What both races measure with: repetitions, memory, a Gauss-Newton step.

use std::time::Instant;

use serde_json::{Value, json};
use skinfit::engine::{Objective, Point};
use skinfit::fit::bounded;
use skinfit::fit::coordinates::Coordinates;

/// Seconds of a first and of at least `reps` further runs, median and least; the first is not counted.
pub(crate) fn timed(reps: usize, mut run: impl FnMut()) -> Value {
    run();
    let (mut seconds, start) = (Vec::new(), Instant::now());
    while seconds.len() < reps || (start.elapsed().as_secs_f64() < 1.0 && seconds.len() < 200) {
        let t = Instant::now();
        run();
        seconds.push(t.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    json!({"median": seconds[seconds.len() / 2], "min": seconds[0], "reps": seconds.len()})
}

/// The most memory that was resident so far.
pub(crate) fn peak_rss_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").trim().parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

/// One bounded Gauss-Newton step over all pixels.
pub(crate) fn gauss_newton_step(engine: &dyn Objective, point: &Point) -> Point {
    let sums = engine.normal_equations(point);
    let coordinates = Coordinates::new(engine.unknowns(), point);
    let at = coordinates.origin();
    let slope: Vec<f64> = (0..at.len()).map(|i| coordinates.slope(i, at[i])).collect();
    let k = at.len();
    let hessian: Vec<f64> = (0..k * k).map(|ij| sums.jtj[ij] * slope[ij / k] * slope[ij % k]).collect();
    let gradient: Vec<f64> = (0..k).map(|i| sums.jtr[i] * slope[i]).collect();
    let step = bounded::minimise(&hessian, &gradient, &coordinates.room(at));
    coordinates.point(&coordinates.moved(at, &step))
}
