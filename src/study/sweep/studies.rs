//! Ablations and tradeoffs as jobs: a row for each part that is left out, and for each setting that is measured.

use std::path::PathBuf;

use serde_json::Value;

use super::inputs::{Inputs, JobError};
use super::job::Job;
use super::result::{Figures, Findings, add_constant, number};
use crate::ablation::{self, AblationOptions, GpuTiming, ablate};
use crate::timing::Timed;
use crate::tradeoff::axis::{Setting, Sweep};
use crate::tradeoff::{TradeoffOptions, tradeoff};

/// Where a study keeps its bakes.
fn cache(inputs: &Inputs<'_>) -> Option<PathBuf> {
    inputs.cache.or(inputs.scratch).map(Into::into)
}

/// An ablation; the renderer is not timed, as not every machine has an adapter.
pub(super) fn ablation(job: &Job, inputs: Inputs<'_>) -> Result<Findings, JobError> {
    let options = AblationOptions {
        pairs: job.is_set("pairs"),
        refit: job.is_set("refit"),
        params: inputs.constants.map(Into::into),
        hold_out: Vec::new(),
        cache: cache(&inputs),
        gpu: GpuTiming::Never,
    };
    let found = ablate(&[inputs.scene.to_owned()], &options)?;
    let figures = Figures::from([("unconverged".to_owned(), found.unconverged().join("; ").into())]);
    Ok(Findings { figures, rows: found.rows.iter().map(case).collect() })
}

fn case(row: &ablation::Row) -> Figures {
    let mean = row.mean();
    let mut figures = scores((mean.linear_rms, mean.relative_rms), [mean.psnr, mean.ssim, mean.flip]);
    figures.extend(named([
        ("left_out", row.left_out.name().into()),
        ("loss", number(row.loss)),
        ("loss_change", number(row.change.loss)),
        ("loss_change_error", number(row.change.std_error)),
        ("t", row.change.t.map_or(Value::Null, number)),
        ("operations", number(row.counts.operations)),
        ("bytes_a_sample", row.counts.bytes_a_sample.into()),
        ("baked_bytes", row.counts.baked_bytes.into()),
    ]));
    if let Some(starts) = &row.starts {
        figures.extend(named([
            ("starts", starts.tried.len().into()),
            ("best_start", starts.best.as_str().into()),
        ]));
    }
    for constant in &row.constants {
        add_constant(&mut figures, &constant.name, constant.value, constant.std_error);
    }
    add_time(&mut figures, row.cpu);
    figures
}

/// A tradeoff.
pub(super) fn tradeoffs(job: &Job, inputs: Inputs<'_>) -> Result<Findings, JobError> {
    let axes = job.get("axes").and_then(toml::Value::as_array).into_iter().flatten();
    let options = TradeoffOptions {
        axes: axes.filter_map(|axis| axis.as_str().map(str::to_owned)).collect(),
        params: inputs.constants.map(Into::into),
        hold_out: Vec::new(),
        cache: cache(&inputs),
        goal: None,
    };
    let found = tradeoff(&[inputs.scene.to_owned()], &options, None)?;
    let rows = found.sweeps.iter().flat_map(|sweep| sweep.settings.iter().map(|s| setting(sweep, s)));
    Ok(Findings { figures: Figures::new(), rows: rows.collect() })
}

fn setting(sweep: &Sweep, setting: &Setting) -> Figures {
    let error = &setting.error;
    let mut figures = scores((error.linear, error.relative), [error.psnr, None, error.flip]);
    figures.extend(named([
        ("axis", sweep.axis.into()),
        ("setting", setting.name.as_str().into()),
        ("reference", setting.reference.into()),
    ]));
    // A cost in seconds is a time; so is whether it is Pareto-optimal.
    if setting.time.is_none() {
        figures.extend(named([("cost", number(setting.cost)), ("cost_unit", sweep.cost.into())]));
    }
    for (name, count) in &setting.counts {
        figures.insert(format!("count.{name}"), number(*count));
    }
    add_time(&mut figures, setting.time);
    figures
}

fn named<const N: usize>(figures: [(&str, Value); N]) -> impl Iterator<Item = (String, Value)> {
    figures.map(|(name, value)| (name.to_owned(), value)).into_iter()
}

fn scores((linear, relative): (f64, f64), [psnr, ssim, flip]: [Option<f64>; 3]) -> Figures {
    let score = |x: Option<f64>| x.map_or(Value::Null, number);
    named([
        ("linear_rms", number(linear)),
        ("relative_rms", number(relative)),
        ("psnr_db", score(psnr)),
        ("ssim", score(ssim)),
        ("flip", score(flip)),
    ])
    .collect()
}

/// The median, its quartiles, and the ratio to the first row's.
fn add_time(figures: &mut Figures, time: Option<Timed>) {
    let Some(Timed { seconds, ratio, .. }) = time else { return };
    figures.extend(named([
        ("seconds", number(seconds.median)),
        ("seconds.lower", number(seconds.lower)),
        ("seconds.upper", number(seconds.upper)),
        ("seconds.ratio", number(ratio.median)),
    ]));
}
