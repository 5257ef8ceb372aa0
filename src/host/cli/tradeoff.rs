//! `skinfit tradeoff`: error against time for every approximation.

use std::path::PathBuf;

use super::fitted_scene::Changes;
use super::run_folder::{RunFolder, Work};
use super::scene::SceneArguments;
use super::{Exit, Refusal, say, tell, tell_warnings, unfinished};
use crate::scene::suggestion;
use crate::study::tradeoff::choose::Goal;
use crate::study::tradeoff::{TradeoffOptions, axes, files, tradeoff};

/// Measure what accuracy costs in time: each approximation swept, error beside cost
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("DIR gets report.html (open it in a browser), results.csv, results.json, a plot of each axis and, with --within or --budget, scene.toml with the settings that meet it.\n\nAxes:\n  format      f64, f32, f16, and the 12-bit fixed point of the paper's hardware, as its listing declares it\n  silhouette  per vertex, per fragment, bumped; against how fine the mesh is\n  irradiance, specular, hilite  texels a face of the cubes\n  filter      of the cubes: exact, the hardware's, nearest\n  lobes       specular cubes an octave of the exponent\n  rays        a vertex, for ambient occlusion\n  samples     along a pixel's side\n  pixels      used in a fit\n  solver      of a fit\n\nErrors are root mean square differences of linear radiance, relative to the reference's own.\n\nExamples:\n  skinfit tradeoff -o runs/cost                                the built-in scene, every axis\n  skinfit tradeoff scene.toml -o runs/cost --axis rays --axis samples\n  skinfit tradeoff scene.toml -o runs/cost --within 0.5%       the cheapest settings with that error\n  skinfit tradeoff scene.toml -o runs/cost --budget 200ms      the most accurate settings in that time", "no settings meet --within or --budget, or the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Sweep this axis; may be given several times [default: every one].
    #[arg(long, value_name = "NAME", value_parser = parse_axis)]
    axis: Vec<String>,
    /// Constants of an earlier fit, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    /// Name the cheapest settings that are off by no more than this together, such as 0.5%.
    #[arg(long, value_name = "ERROR", allow_hyphen_values = true, value_parser = parse_error)]
    within: Option<f64>,
    /// Name the most accurate settings whose baking, tracing and one pass take no longer than this, such as 20ms or
    /// 1.5s.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse_time, conflicts_with = "within")]
    budget: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    unfinished::install();
    let mut folder = RunFolder::of_study(&arguments.output, Work::Tradeoff)?;
    let path = arguments.scene.kept_path(folder.path())?;
    // Settings are evaluated more than once: without a cache of the user's, bakes are kept for as long as this takes.
    let scratch = unfinished::scratch()?;
    let options = TradeoffOptions {
        axes: arguments.axis.clone(),
        params: arguments.params.clone(),
        cache: Some(arguments.scene.cache().unwrap_or_else(|| scratch.path().to_owned())),
        goal: arguments.within.map(Goal::Within).or(arguments.budget.map(Goal::Seconds)),
    };
    let found = tradeoff(&path, &options)?;
    tell_warnings(&found.warnings);
    folder.keep_results();
    let mut written = files::write(folder.path(), &arguments.scene.name(&path), &found)?.len();
    if let Some(choice) = found.choice() {
        folder.write_scene(&path, Changes { settings: &choice.keys, ..Changes::default() })?;
        written += 1;
    }
    say(files::table(&found).trim_end())?;
    say(&format!("wrote {written} files to {}; open report.html there", folder.path().display()))?;
    if let Some(missed) = found.missed() {
        let place = folder.path().display();
        tell(&format!("{place}: no settings are {}: {}. Allow more.", missed.goal, missed.least));
        return Ok(Exit::Failed);
    }
    Ok(Exit::Done)
}

fn parse_axis(name: &str) -> Result<String, String> {
    let known: Vec<&str> = axes::all().iter().map(|axis| axis.name()).collect();
    match known.contains(&name) {
        true => Ok(name.to_owned()),
        false => Err(format!("unknown axis. {}.", suggestion(name, &known))),
    }
}

/// `0.5%`
fn parse_error(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    match percent {
        Some(percent) if percent > 0.0 && percent <= 100.0 => Ok(0.01 * percent),
        _ => Err("give a percentage above 0 and up to 100, such as 0.5%".to_owned()),
    }
}

/// `20ms` or `1.5s`
fn parse_time(text: &str) -> Result<f64, String> {
    let number =
        |suffix: &str| text.strip_suffix(suffix).and_then(|number| number.trim().parse::<f64>().ok());
    match number("ms").map(|ms| 1e-3 * ms).or_else(|| number("s")) {
        Some(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("give a time above 0, such as 20ms or 1.5s".to_owned()),
    }
}
