//! The figures in the project's pages: measured anew, written to raw files, and quoted from them.
//!
//! ```text
//! cargo run --release --example figures                         bring every page up to date with its raw files
//! cargo run --release --example figures -- docs/results.json    measure these anew first
//! cargo run --release --example figures -- --all                measure everything anew that this machine can
//! ```
//!
//! Each raw file holds a head (command, commit, date, machine) and what was measured; README.md beside this file says
//! how pages quote it. `tests/suite/documents.rs` reads every page against its raw files.

mod accuracy;
mod animation;
mod blurs;
mod builds;
mod clip;
mod closeup;
mod diffusion;
mod flicker;
mod lab;
mod light;
mod lobes;
mod normals;
mod page;
mod pages;
mod passes;
mod portrait;
mod race;
mod results;
mod speed;
mod squares;
mod strays;
mod studies;
mod suggested;
mod timings;
mod transfer;
mod unchanged;
mod ways;
mod window;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Parser;
use lab::{Lab, Result};
use serde_json::Value;

/// How a raw file is measured.
type Measure = fn(&Lab) -> Result<Value>;

/// The raw files, and what measures each.
const FILES: &[(&str, Measure)] = &[
    ("docs/results.json", results::measure),
    ("docs/light.json", light::measure),
    ("docs/suggest.json", suggested::measure),
    ("docs/diffusion.json", diffusion::measure),
    ("docs/accuracy.json", accuracy::tests),
    ("docs/noise.json", accuracy::noise),
    ("docs/closeup.json", closeup::measure),
    ("docs/portrait.json", portrait::measure),
    ("docs/animation.json", animation::measure),
    ("docs/normals.json", normals::measure),
    ("docs/page.json", page::measure),
    ("docs/window.json", window::software),
    ("docs/window_card.json", window::graphics_card),
    ("experiments/ablation/results.json", studies::ablation),
    ("experiments/accuracy_vs_time/results.json", studies::tradeoff),
    ("experiments/accuracy_vs_time/light.json", ways::light),
    ("experiments/accuracy_vs_time/diffusion.json", ways::diffusion),
    ("experiments/accuracy_vs_time/transmission.json", ways::transmission),
    ("experiments/accuracy_vs_time/blurs.json", blurs::measure),
    ("experiments/effects_cost/results.json", timings::effects_cost),
    ("experiments/effects_cost/card.json", timings::effects_cost_on_a_card),
    ("experiments/effects_cost/passes.json", passes::processor),
    ("experiments/effects_cost/passes_card.json", passes::graphics_card),
    ("experiments/rays/results.json", timings::rays),
    ("experiments/scaling/results.json", timings::scaling),
    ("experiments/builds/results.json", builds::measure),
    ("experiments/unchanged/results.json", unchanged::measure),
    ("experiments/unchanged/speed.json", speed::processor),
    ("experiments/unchanged/card.json", speed::graphics_card),
    ("experiments/bench/results.json", timings::bench),
    ("experiments/network/results.json", timings::network),
    ("experiments/race/results.json", race::processor),
    ("experiments/race/diffusion.json", race::diffusion),
    ("experiments/race/diffusion_card.json", race::diffusion_on_a_card),
    ("experiments/race/card.json", race::graphics_card),
    ("experiments/race/h200.json", race::earlier),
];

#[derive(Parser)]
#[command(about = "Measure the figures of the project's pages, and bring the pages up to date")]
struct Arguments {
    /// Raw files to measure anew.
    files: Vec<String>,
    /// Measure every one.
    #[arg(long)]
    all: bool,
    /// The folder of the scanned head and its scenes [default: $SKINFIT_DATA, or ../shared/data]
    #[arg(long)]
    data: Option<PathBuf>,
    /// The program that is measured.
    #[arg(long, default_value = "target/release/skinfit")]
    skinfit: PathBuf,
    /// The tests' program, where it is built already.
    #[arg(long)]
    suite: Option<PathBuf>,
    /// A Python that has numpy and embreex.
    #[arg(long)]
    python: Option<PathBuf>,
    /// The program of the last commit with a single package, where it is built already, the race's in `examples` beside it
    /// [default: both are built]
    #[arg(long)]
    before: Option<PathBuf>,
    /// That program with `experiments/unchanged/as_today.patch`, where it is built already [default: it is built]
    #[arg(long)]
    patched: Option<PathBuf>,
    /// A copy of what runs the race of other frameworks, with its data and its rows.
    #[arg(long)]
    race: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("figures: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let known: Vec<&str> = FILES.iter().map(|(file, _)| *file).collect();
    if let Some(unknown) = arguments.files.iter().find(|file| !known.contains(&file.as_str())) {
        return Err(format!("nothing measures {unknown}; there are {}", known.join(", ")).into());
    }
    let root = Command::new("git").args(["rev-parse", "--show-toplevel"]).output()?;
    let root = PathBuf::from(String::from_utf8(root.stdout)?.trim());
    let data = arguments.data.clone().or_else(|| std::env::var_os("SKINFIT_DATA").map(PathBuf::from));
    let data = data.unwrap_or_else(|| root.join("../shared/data"));
    let mut wrong = Vec::new();
    for (file, measure) in FILES {
        if arguments.all || arguments.files.iter().any(|named| named == file) {
            let mut lab = Lab::new(&root, &data, &root.join(&arguments.skinfit))?;
            lab.suite.clone_from(&arguments.suite);
            lab.race.clone_from(&arguments.race);
            lab.python.clone_from(&arguments.python);
            lab.before.clone_from(&arguments.before);
            lab.patched.clone_from(&arguments.patched);
            // One that cannot be measured leaves its file as it was, and the others go on.
            if let Err(error) = measured(&lab, file, *measure) {
                eprintln!("figures: {file}: {error}");
                wrong.push(format!("{file}: {error}"));
            }
        }
    }
    for page in pages(&root)? {
        let told = |error| format!("{}: {error}", page.display());
        let text = std::fs::read_to_string(root.join(&page))?;
        let filled = match pages::filled(&root.join(&page), &text) {
            Ok(filled) => filled,
            Err(error) => {
                wrong.push(told(error));
                continue;
            }
        };
        if filled != text {
            write(&root.join(&page), &filled)?;
        }
        for file in pages::quoted(&filled).map_err(told)? {
            let raw: Value = serde_json::from_slice(&std::fs::read(root.join(&page).with_file_name(&file))?)?;
            if let Some(key) = pages::head_lacks(&raw) {
                wrong.push(told(format!("the head of {file} lacks its {key}")));
            }
        }
        let strays = strays::strays(&page, &filled).map_err(told)?;
        wrong.extend(strays.into_iter().map(|words| told(format!("no raw file gives `{words}`"))));
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\n").into()) }
}

/// Measure, and write the raw file with its head.
fn measured(lab: &Lab, file: &str, measure: fn(&Lab) -> Result<Value>) -> Result<()> {
    // Before the measurement, as it says what else the machine does.
    let head = lab.head(file)?;
    let mut raw = measure(lab)?;
    // What was measured elsewhere brings its own.
    if raw["head"].is_null() {
        raw["head"] = head.into();
    }
    if let Some(key) = pages::head_lacks(&raw) {
        return Err(format!("the head lacks its {key}").into());
    }
    write(&lab.root.join(file), &(serde_json::to_string_pretty(&raw)? + "\n"))
}

/// Every page that git knows, by its path in the project.
fn pages(root: &Path) -> Result<Vec<PathBuf>> {
    let run = Command::new("git").current_dir(root).args(["ls-files", "*.md"]).output()?;
    Ok(String::from_utf8(run.stdout)?.lines().map(PathBuf::from).collect())
}

/// Whole or not at all.
fn write(path: &Path, text: &str) -> Result<()> {
    let fresh = path.with_extension("new");
    std::fs::write(&fresh, text)?;
    std::fs::rename(&fresh, path)?;
    eprintln!("figures: wrote {}", path.display());
    Ok(())
}
