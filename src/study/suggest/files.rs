//! What a suggestion leaves in its folder, and what it prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Set, Step, Suggestion, names, words};
use crate::StudyError;
use crate::leftovers::Leftovers;
use crate::output::{self, OutputError};
use crate::report::page::{Cell, Page, Table, escape, section, tile};
use crate::report::plot::{Dot, Joined, Plot};
use crate::titles::title;

/// What the CLI adds: the scene with what was chosen.
pub const CHOSEN: &str = "scene.toml";

/// Write `results.csv`, `results.json`, `report.html` and `front.svg`; what an earlier suggestion left there and this one
/// does not write anew goes. What was written.
///
/// # Errors
/// When a file cannot be written; each is whole or not there.
pub fn write(folder: &Path, scene: &str, found: &Suggestion) -> Result<Vec<PathBuf>, StudyError> {
    let earlier = Leftovers::of(folder);
    let mut files = vec![
        ("results.csv", csv(found)),
        ("report.html", page(scene, found)),
        ("front.svg", plot(found).file()),
    ];
    let names: Vec<String> =
        ["results.csv", "report.html", "front.svg", "results.json", CHOSEN].map(str::to_owned).to_vec();
    files.push(("results.json", json(scene, found).map_err(|e| OutputError::new(folder, &e))?));
    let mut written = Vec::new();
    for (name, text) in files {
        output::write(&folder.join(name), text.as_bytes())?;
        written.push(folder.join(name));
    }
    earlier.remove(&names)?;
    Ok(written)
}

/// Whether no set is both cheaper and better.
fn on_front(found: &Suggestion, set: &Set) -> bool {
    !found.sets.iter().any(|other| {
        let (cheaper, better) = (other.operations <= set.operations, other.held_out >= set.held_out);
        cheaper && better && (other.operations < set.operations || other.held_out > set.held_out)
    })
}

fn csv(found: &Suggestion) -> String {
    let mut text = String::from("effects,held_out_psnr_db,operations,front,step\n");
    for (place, set) in found.sets.iter().enumerate() {
        let step = found.steps.iter().find(|step| step.set == place).map_or("", |step| step.what.as_str());
        let _ = writeln!(
            text,
            "{},{:.4},{:.0},{},{step}",
            names(set.effects).join(" "),
            set.held_out,
            set.operations,
            on_front(found, set)
        );
    }
    text
}

fn json(scene: &str, found: &Suggestion) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct Judged<'a> {
        effects: Vec<&'static str>,
        front: bool,
        #[serde(flatten)]
        set: &'a Set,
    }
    #[derive(Serialize)]
    struct File<'a> {
        scene: &'a str,
        suggested: Vec<&'static str>,
        steps: &'a [Step],
        sets: Vec<Judged<'a>>,
        adapter: Option<&'a String>,
        warnings: &'a [String],
    }
    fn judged<'a>(found: &Suggestion, set: &'a Set) -> Judged<'a> {
        Judged { effects: names(set.effects), front: on_front(found, set), set }
    }
    let file = File {
        scene,
        suggested: names(found.sets[found.chosen].effects),
        steps: &found.steps,
        sets: found.sets.iter().map(|set| judged(found, set)).collect(),
        adapter: found.adapter.as_ref(),
        warnings: &found.warnings,
    };
    Ok(serde_json::to_string_pretty(&file)? + "\n")
}

/// A row of the steps' table.
struct Row {
    what: String,
    held_out: f64,
    gain: Option<f64>,
    cpu: f64,
    gpu: Option<f64>,
    operations: f64,
    bakes: String,
}

fn rows(found: &Suggestion) -> Vec<Row> {
    let mut before: Option<&Step> = None;
    let mut rows = Vec::new();
    for step in &found.steps {
        let set = &found.sets[step.set];
        let bakes = match before {
            Some(before) => step.counts.bakes_saved(&before.counts),
            None => step.counts.bakes.clone(),
        };
        rows.push(Row {
            what: if before.is_none() { words(set.effects) } else { step.what.clone() },
            held_out: set.held_out,
            gain: before.map(|before| set.held_out - found.sets[before.set].held_out),
            cpu: step.cpu.ratio.median,
            gpu: step.gpu.map(|gpu| gpu.ratio.median),
            operations: step.counts.operations,
            bakes: bakes.join(", "),
        });
        before = Some(step);
    }
    rows
}

/// The table on standard output.
#[must_use]
pub fn table(found: &Suggestion) -> String {
    let rows = rows(found);
    let width = rows.iter().map(|row| row.what.chars().count()).max().unwrap_or(0).max(8);
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:width$}  {:>12} {:>8} {:>8} {:>8} {:>8}  bakes",
        "step", "held out, dB", "gain, dB", "CPU", "GPU", "ops"
    );
    for row in rows {
        let gain = row.gain.map_or_else(|| "-".to_owned(), |gain| format!("{gain:+.2}"));
        let gpu = row.gpu.map_or_else(|| "-".to_owned(), |ratio| format!("x {ratio:.2}"));
        let (cpu, ops) = (format!("x {:.2}", row.cpu), format!("{:.0}", row.operations));
        let _ = writeln!(
            text,
            "{:width$}  {:>12.2} {gain:>8} {cpu:>8} {gpu:>8} {ops:>8}  {}",
            row.what, row.held_out, row.bakes
        );
    }
    let chosen = &found.sets[found.chosen];
    let _ = writeln!(text, "{} sets judged; suggested: {}", found.sets.len(), words(chosen.effects));
    text
}

/// Error over cost of every set.
fn plot(found: &Suggestion) -> Plot<'static> {
    let dot = |(place, set): (usize, &Set)| {
        let step = found.steps.iter().find(|step| step.set == place);
        Dot {
            x: set.operations,
            // Scores are of values in [0, 1].
            y: 10.0_f64.powf(-set.held_out / 20.0),
            label: step.map(|step| step.what.clone()).unwrap_or_default(),
            title: format!("{}: {:.2} dB", words(set.effects), set.held_out),
            series: 0,
            front: on_front(found, set),
        }
    };
    Plot {
        x: "operations a fragment",
        y: "error on views held out (sRGB, root mean square)",
        log_x: false,
        dots: found.sets.iter().enumerate().map(dot).collect(),
        series: Vec::new(),
        joined: Joined::Front,
    }
}

fn page(scene: &str, found: &Suggestion) -> String {
    let mut main = String::new();
    for warning in &found.warnings {
        let _ = write!(main, "<p class=\"quiet\">{}</p>", escape(warning));
    }
    let mut table = Table::new(&[
        ("step", "what was added to the set before, or taken out"),
        ("held out, dB", "mean PSNR of views that the fit did not see"),
        ("gain, dB", "beside the set before"),
        ("CPU, times", "a pass over all samples, beside the first set's"),
        ("GPU, times", "a frame of the renderer, beside the first set's"),
        ("operations", "of a fragment in the renderer, as its planner counts them"),
        ("bakes.", "what has to be baked beside what the set before has"),
    ]);
    for row in rows(found) {
        table.row(
            "",
            &[
                Cell::text(&row.what),
                Cell::score(Some(row.held_out), 2),
                row.gain.map_or_else(Cell::none, |gain| Cell::value(format!("{gain:+.2}"), gain)),
                Cell::score(Some(row.cpu), 2),
                Cell::score(row.gpu, 2),
                Cell::value(format!("{:.0}", row.operations), row.operations),
                Cell::text(&row.bakes),
            ],
        );
    }
    main += &section("steps", "From the cheapest set on", &table.html("steps-table"));
    main += &section("front", "Every set that was judged", &plot(found).svg());
    let method = "<p>Each view is scored by a fit of the others (of more than six views, six parts take turns), at one sample \
                  a pixel; the score is the mean PSNR of sRGB values over covered pixels. Times are of passes and frames at \
                  the scene's own sampling, beside the first set's, taken in turns.</p>";
    main += &section("method", "How it was judged", method);
    let chosen = &found.sets[found.chosen];
    let tiles = [
        tile("sets judged", &found.sets.len().to_string(), ""),
        tile("held out", &format!("{:.2} dB", chosen.held_out), "of the suggested set"),
    ];
    let lead = format!("Suggested: {}.", words(chosen.effects));
    Page { kind: "suggest", title: &title(scene), lead, tiles: tiles.concat(), main }.html()
}
