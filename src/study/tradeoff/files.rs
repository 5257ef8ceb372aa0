//! What a tradeoff leaves in its folder, and what it prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::axis::{Setting, Sweep};
use super::choose::Choice;
use super::{Tradeoff, page};
use crate::output::{self, OutputError};
use crate::study::StudyError;

/// Write `results.csv`, `results.json`, `report.html` and a plot for each axis, `<axis>.svg`. What was written.
///
/// # Errors
/// When a file cannot be written; each is whole or not there.
pub fn write(folder: &Path, scene: &str, tradeoff: &Tradeoff) -> Result<Vec<PathBuf>, StudyError> {
    let mut files = vec![
        ("results.csv".to_owned(), csv(&tradeoff.sweeps)),
        ("results.json".to_owned(), json(scene, tradeoff).map_err(|e| OutputError::new(folder, &e))?),
        ("report.html".to_owned(), page::page(scene, tradeoff)),
    ];
    files.extend(
        tradeoff.sweeps.iter().map(|sweep| (format!("{}.svg", sweep.axis), page::plot(sweep).file())),
    );
    let mut written = Vec::new();
    for (name, text) in files {
        output::write(&folder.join(&name), text.as_bytes())?;
        written.push(folder.join(name));
    }
    Ok(written)
}

fn csv(sweeps: &[Sweep]) -> String {
    let mut text = String::from(
        "axis,setting,relative_rms,linear_rms,psnr_db,flip,cost,unit,seconds,seconds_lower,seconds_upper,reference,front,counts\n",
    );
    for sweep in sweeps {
        for Setting { name, error, cost, time, counts, reference, front, .. } in &sweep.settings {
            let score = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.5}"));
            let time = time.map_or_else(
                || ",,".to_owned(),
                |t| format!("{:.6},{:.6},{:.6}", t.seconds.median, t.seconds.lower, t.seconds.upper),
            );
            let counts: Vec<String> =
                counts.iter().map(|(name, n)| format!("{} {n}", name.replace(',', ""))).collect();
            let _ = writeln!(
                text,
                "{},{},{:e},{:e},{},{},{cost},{},{time},{reference},{front},{}",
                sweep.axis,
                name.replace(',', ";"),
                error.relative,
                error.linear,
                score(error.psnr),
                score(error.flip),
                sweep.cost,
                counts.join("; ")
            );
        }
    }
    text
}

fn json(scene: &str, tradeoff: &Tradeoff) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct File<'a> {
        scene: &'a str,
        axes: &'a [Sweep],
        choice: Option<&'a Choice>,
        warnings: &'a [String],
    }
    let Tradeoff { sweeps, choice, warnings } = tradeoff;
    Ok(serde_json::to_string_pretty(&File { scene, axes: sweeps, choice: choice.as_ref(), warnings })? + "\n")
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
            let mark = match (setting.reference, setting.front) {
                (true, _) => "  reference",
                (_, true) => "  front",
                _ => "",
            };
            let _ = writeln!(
                text,
                "  {:width$}  {:>10.4} {:>8} {:>8} {:>12}{mark}",
                setting.name,
                100.0 * setting.error.relative,
                score(setting.error.psnr, 2),
                score(setting.error.flip, 5),
                if sweep.cost == "seconds" {
                    format!("{:.4}", setting.cost)
                } else {
                    format!("{:.0}", setting.cost)
                },
            );
        }
    }
    if let Some(choice) = &tradeoff.choice {
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
