//! What a tradeoff leaves in its folder, and what it prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::axis::{Setting, Sweep};
use super::choose::{Choice, Missed};
use super::{Tradeoff, page};
use crate::StudyError;
use crate::leftovers::Leftovers;
use crate::output::{self, OutputError};
use crate::reference::{psnr_in_csv, psnr_in_words};
use crate::report::SCENES;
use crate::timing::Timed;

/// What the CLI adds where settings were chosen: each scene with them.
#[must_use]
pub fn chosen(tradeoff: &Tradeoff) -> Vec<String> {
    match (tradeoff.choice(), tradeoff.scenes.as_slice()) {
        (None, _) => Vec::new(),
        (Some(_), []) => vec!["scene.toml".to_owned()],
        (Some(_), scenes) => scenes.iter().map(|scene| format!("{SCENES}/{scene}.toml")).collect(),
    }
}

/// Write `results.csv`, `results.json`, `report.html` and a plot for each axis, `<axis>.svg`; what an earlier
/// tradeoff left there and this one does not write anew goes. What was written.
///
/// # Errors
/// When a file cannot be written; each is whole or not there.
pub fn write(folder: &Path, scene: &str, tradeoff: &Tradeoff) -> Result<Vec<PathBuf>, StudyError> {
    let earlier = Leftovers::of(folder);
    let plot = |sweep: &Sweep| (format!("{}.svg", sweep.axis), page::plot(sweep).file());
    let mut files = vec![
        ("results.csv".to_owned(), csv(&tradeoff.sweeps)),
        ("report.html".to_owned(), page::page(scene, tradeoff)),
    ];
    files.extend(tradeoff.sweeps.iter().map(plot));
    let mut names: Vec<String> = files.iter().map(|(name, _)| name.clone()).collect();
    names.extend(chosen(tradeoff));
    let json = json(scene, tradeoff, &names).map_err(|e| OutputError::new(folder, &e))?;
    files.push(("results.json".to_owned(), json));
    let mut written = Vec::new();
    for (name, text) in files {
        output::write(&folder.join(&name), text.as_bytes())?;
        written.push(folder.join(name));
    }
    earlier.remove(&names)?;
    Ok(written)
}

fn csv(sweeps: &[Sweep]) -> String {
    let mut text = String::from(
        "axis,setting,relative_rms,linear_rms,psnr_db,flip,cost,unit,seconds,seconds_lower,seconds_upper,rounds,reference,present,pareto,counts\n",
    );
    for sweep in sweeps {
        for Setting { name, error, cost, time, counts, reference, present, pareto, .. } in &sweep.settings {
            let score = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.5}"));
            let time = time.map_or_else(|| ",,,".to_owned(), columns);
            let counts: Vec<String> =
                counts.iter().map(|(name, n)| format!("{} {n}", name.replace(',', ""))).collect();
            let _ = writeln!(
                text,
                "{},{},{:e},{:e},{},{},{cost},{},{time},{reference},{present},{pareto},{}",
                sweep.axis,
                name.replace(',', ";"),
                error.relative,
                error.linear,
                psnr_in_csv(error.psnr),
                score(error.flip),
                sweep.cost,
                counts.join("; ")
            );
        }
    }
    text
}

/// The median, its quartiles where it was run more than once, and how often it was.
fn columns(time: Timed) -> String {
    let quartiles = time.quartiles().map_or_else(|| ",".to_owned(), |[a, b]| format!("{a:.6},{b:.6}"));
    format!("{:.6},{quartiles},{}", time.seconds.median, time.rounds)
}

fn json(scene: &str, tradeoff: &Tradeoff, files: &[String]) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct File<'a> {
        scene: &'a str,
        #[serde(skip_serializing_if = "<[String]>::is_empty")]
        scenes: &'a [String],
        #[serde(skip_serializing_if = "<[String]>::is_empty")]
        held_out: &'a [String],
        axes: &'a [Sweep],
        choice: Option<&'a Choice>,
        missed: Option<&'a Missed>,
        /// Axes that were to be measured and are not: the study was stopped, or goes on.
        pending: &'a [&'static str],
        warnings: &'a [String],
        files: &'a [String],
    }
    let Tradeoff { scenes, held_out, sweeps, warnings, pending, .. } = tradeoff;
    let (choice, missed) = (tradeoff.choice(), tradeoff.missed());
    let file = File { scene, scenes, held_out, axes: sweeps, choice, missed, pending, warnings, files };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

/// The tables on standard output.
#[must_use]
pub fn table(tradeoff: &Tradeoff) -> String {
    let mut text = String::new();
    for sweep in &tradeoff.sweeps {
        let width = sweep.settings.iter().map(|s| s.name.chars().count()).max().unwrap_or(0).max(10);
        let _ = writeln!(text, "{}: {}", sweep.axis, sweep.title);
        let _ = writeln!(
            text,
            "  {:width$}  {:>10} {:>8} {:>8} {:>12}",
            "setting", "error, %", "PSNR", "FLIP", sweep.cost
        );
        for setting in &sweep.settings {
            let score =
                |x: Option<f64>, digits: usize| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
            let notes: Vec<&str> =
                setting.pareto.then_some("pareto").into_iter().chain(setting.notes()).collect();
            let mark = if notes.is_empty() { String::new() } else { format!("  {}", notes.join(", ")) };
            let _ = writeln!(
                text,
                "  {:width$}  {:>10.4} {:>8} {:>8} {:>12}{mark}",
                setting.name,
                100.0 * setting.error.relative,
                psnr_in_words(setting.error.psnr),
                score(setting.error.flip, 5),
                if sweep.cost == "seconds" {
                    format!("{:.4}", setting.cost)
                } else {
                    format!("{:.0}", setting.cost)
                },
            );
        }
    }
    if let Some(choice) = tradeoff.choice() {
        let settings: Vec<String> =
            choice.settings.iter().map(|(axis, name)| format!("{axis} {name}")).collect();
        let _ = writeln!(text, "{}: {}", choice.goal, settings.join(", "));
        let _ = writeln!(
            text,
            "  together: error {:.4}% (measured), {:.3} s beside the reference's {:.3} s",
            100.0 * choice.error.relative,
            choice.seconds,
            choice.reference_seconds
        );
    }
    text
}
