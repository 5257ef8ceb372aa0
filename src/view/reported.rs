//! What a run's `report.json` says of its fit, as far as it is shown.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use skinfit_core::files;

use crate::engine::Point;
use crate::fit::outcome::{Ending, Iteration};
use crate::host::{Fitted, Found, Known, ViewScore};

/// The file.
#[derive(Deserialize)]
struct Report {
    loss: StartEnd,
    views: BTreeMap<String, View>,
    iterations: u64,
    evaluations: u64,
    seconds: Seconds,
    ending: Ending,
    unknowns: Vec<Known>,
    history: Vec<Iteration>,
}

#[derive(Deserialize)]
struct StartEnd {
    end: f64,
}

#[derive(Deserialize)]
struct Seconds {
    fit: f64,
}

/// A view's scores; nothing is scored where nothing is covered.
#[derive(Deserialize)]
struct View {
    held_out: bool,
    psnr: Option<f64>,
    ssim: Option<f64>,
    flip: Option<f64>,
}

/// What the report of a fit that has ended at `ends`, in each scene, says.
///
/// # Errors
/// When it cannot be read, or is no report of this version.
pub fn reported(report: &Path, ends: Vec<Point>) -> Result<Fitted, String> {
    let unreadable = |reason: String| format!("{}: {reason}. Fit again.", report.display());
    let bytes = files::read(report).map_err(|error| unreadable(error.to_string()))?;
    let report: Report = serde_json::from_slice(&bytes).map_err(|error| unreadable(error.to_string()))?;
    let number = |number: Option<f64>| number.unwrap_or(f64::NAN);
    let score = |(view, of): (String, View)| ViewScore {
        view,
        held_out: of.held_out,
        psnr: number(of.psnr),
        ssim: number(of.ssim),
        flip: number(of.flip),
    };
    let found = Found {
        ends,
        known: report.unknowns,
        ending: report.ending,
        loss: report.loss.end,
        losses: report.history.iter().map(|iteration| iteration.loss).collect(),
        iterations: report.iterations,
        evaluations: report.evaluations,
        seconds: report.seconds.fit,
    };
    Ok(Fitted { found, views: report.views.into_iter().map(score).collect() })
}
