//! `skinfit tradeoff`: error against time for every approximation.

use std::path::PathBuf;

use super::fitted_scene::Changes;
use super::run_folder::{RunFolder, Work};
use super::scene::{HoldOutArguments, ScenesArguments};
use super::{Exit, Refusal, say, tell, tell_warnings, unfinished};
use crate::scene::suggestion;
use crate::study::StudyError;
use crate::study::tradeoff::choose::Goal;
use crate::study::tradeoff::{Tradeoff, TradeoffOptions, Watcher, axes, files, tradeoff};

/// Measure what accuracy costs in time: each approximation swept, error beside cost
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("DIR gets report.html (open it in a browser), results.csv, results.json, a plot of each axis and, with --within or --budget, scene.toml with the settings that meet it; what is measured stands there axis by axis, so that Ctrl-C leaves the axes that are done. How long it will take is said before.\n\nAxes:\n  format      f64, f32, f16, and the 12-bit fixed point of the paper's hardware, as its listing declares it\n  silhouette  per vertex, per fragment, bumped; against how fine the mesh is\n  irradiance, specular, hilite  texels a face of the cubes\n  filter      of the cubes: exact, the hardware's, nearest\n  lobes       specular cubes an octave of the exponent\n  rays        a vertex, for ambient occlusion\n  sky_lights  lights taken out of the panorama\n  visibility, specular_visibility  ways to the sky that a point and its specular lobe see\n  specular_model  the specular BRDFs\n  split_sum, lobe_lookup, skin_reflection  ways to what a specular lobe reflects\n  normal_filter  of bumps that are smaller than a sample\n  bounces     ways to the light that the skin throws back at itself\n  taps, light_map_size, seams, ambient_normal, stretch, unblurred, combined, levels  of texture-space diffusion\n  samples     along a pixel's side\n  texture_filter  of maps: bilinear, trilinear, anisotropic\n  shadows     in the renderer: at vertices, or shadow maps by size and filter\n  pixels      used in a fit\n  solver      of a fit\n\nErrors are root mean square differences of linear radiance, relative to the reference's own. A setting is marked\n`pareto` where no other is both as cheap and as accurate, `reference` where errors are measured against it, and\n`the scene's` where the scene has it.\n\nSeveral scenes are one skin, as of `skinfit fit`. Each is measured by itself; errors are those of all of their views together, seconds are added up, other costs and counts are means. The fits of `pixels` and `solver` are of all scenes as one skin, without what --hold-out names; no other axis fits anything, so with --hold-out one of these two has to be among the axes. Chosen settings are those of every scene: scenes/NAME.toml for each.\n\nExamples:\n  skinfit tradeoff -o runs/cost                                the built-in scene, every axis\n  skinfit tradeoff scene.toml -o runs/cost --axis rays --axis samples\n  skinfit tradeoff scene.toml -o runs/cost --within 0.5%       the cheapest settings with that error\n  skinfit tradeoff scene.toml -o runs/cost --budget 200ms      the most accurate settings in that time\n  skinfit tradeoff noon.toml night.toml -o runs/cost           one skin in two lights, taken together\n  skinfit tradeoff noon.toml night.toml -o runs/cost --axis pixels --hold-out night/left    a view that no fit sees", "no settings meet --within or --budget, or the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scenes: ScenesArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Sweep this axis; may be given several times [default: every one].
    #[arg(long, value_name = "NAME", value_parser = parse_axis)]
    axis: Vec<String>,
    /// Constants of an earlier fit, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    #[command(flatten)]
    held: HoldOutArguments,
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
    let paths = arguments.scenes.kept_paths(folder.path())?;
    // Settings are evaluated more than once: without a cache of the user's, bakes are kept for as long as this takes.
    let scratch = unfinished::scratch()?;
    let options = TradeoffOptions {
        axes: arguments.axis.clone(),
        params: arguments.params.clone(),
        hold_out: arguments.held.hold_out.clone(),
        cache: Some(arguments.scenes.bakes.cache().unwrap_or_else(|| scratch.path().to_owned())),
        goal: arguments.within.map(Goal::Within).or(arguments.budget.map(Goal::Seconds)),
    };
    let name = arguments.scenes.words();
    let mut leaving = Leaving { folder: &mut folder, scene: &name };
    let found = tradeoff(&paths, &options, Some(&mut leaving))?;
    tell_warnings(&found.warnings);
    folder.keep_results();
    let mut written = files::write(folder.path(), &name, &found)?.len();
    if let Some(choice) = found.choice() {
        for (path, file) in paths.iter().zip(files::chosen(&found)) {
            folder.write_scene(path, &file, Changes { settings: &choice.keys, ..Changes::default() })?;
            written += 1;
        }
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

/// Says how long it will take, and leaves the results of each axis as they come.
struct Leaving<'a> {
    folder: &'a mut RunFolder,
    scene: &'a str,
}

impl Watcher for Leaving<'_> {
    fn estimated(&mut self, seconds: &[(&'static str, f64)]) {
        let whole: f64 = seconds.iter().map(|(_, seconds)| seconds).sum();
        let of_axes = seconds.iter().map(|(axis, seconds)| format!("{axis} {}", about(*seconds)));
        let of_axes: Vec<String> = of_axes.collect();
        tell(&format!("this will take about {} ({}).", about(whole), of_axes.join(", ")));
    }

    fn measured(&mut self, so_far: &Tradeoff) -> Result<(), StudyError> {
        self.folder.keep_results();
        files::write(self.folder.path(), self.scene, so_far)?;
        let place = self.folder.path().display();
        let there: Vec<&str> = so_far.sweeps.iter().map(|sweep| sweep.axis).collect();
        let missing = match so_far.pending.as_slice() {
            [] => "no settings were chosen".to_owned(),
            pending => format!("not those of {}", pending.join(", ")),
        };
        unfinished::written(format!(
            "{place}: interrupted: the results of {} are there, {missing}.",
            there.join(", ")
        ));
        Ok(())
    }
}

/// Seconds to one digit, as an estimate deserves.
fn about(seconds: f64) -> String {
    match seconds {
        s if s >= 90.0 => format!("{:.0} min", s / 60.0),
        s if s >= 9.5 => format!("{:.0} s", 5.0 * (s / 5.0).round()),
        s if s >= 0.95 => format!("{s:.0} s"),
        s => format!("{:.1} s", s.max(0.1)),
    }
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
