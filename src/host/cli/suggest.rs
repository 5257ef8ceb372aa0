//! `skinfit suggest`: which effects a scene calls for.

use std::path::PathBuf;

use super::ablate::timing;
use super::fitted_scene::{Changes, Start};
use super::run_folder::{RunFolder, Work};
use super::scene::SceneArguments;
use super::{Exit, Refusal, say, tell_warnings, unfinished};
use crate::study::suggest::{SuggestOptions, files, names, suggest};

/// Find the effects that a scene calls for: sets of them, judged on views that their fit did not see
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("From the cheapest set on, what gains most is added for as long as it earns its cost, then what the others make up for is taken out again. Effects that hide each other's worth (lights, their shadows and their gloss) are tried together. Each view is scored by a fit of the others.\n\nDIR gets report.html (open it in a browser), results.csv, results.json, front.svg, and scene.toml: the scene with the suggested effects and their fitted constants.\n\nThe table on standard output:\n  held out   mean PSNR of views that the fit did not see\n  CPU, GPU   a pass, and a frame, beside the first set's\n  ops        operations of a fragment in the renderer, as its planner counts them\n  bakes      what has to be baked beside what the set before has\n\nExamples:\n  skinfit suggest -o runs/which                     the built-in scene\n  skinfit suggest scene.toml -o runs/which --least 0.3")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The least gain in dB that an addition is worth.
    #[arg(long, value_name = "DB", default_value_t = SuggestOptions::default().least, value_parser = parse_gain)]
    least: f64,
    /// The least gain in dB for an addition that doubles what a fragment costs.
    #[arg(long, value_name = "DB", default_value_t = SuggestOptions::default().worth, value_parser = parse_gain)]
    worth: f64,
    /// Time the renderer, too: `auto`, where there is a graphics adapter of hardware; `always`, on one of software
    /// as well; or `never`.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = ["auto", "always", "never"])]
    gpu: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let gpu = timing(&arguments.gpu);
    unfinished::install();
    let mut folder = RunFolder::of_study(&arguments.output, Work::Suggestion)?;
    let path = arguments.scene.kept_path(folder.path())?;
    // Sets share bakes: without a cache of the user's, they are kept for as long as this takes.
    let scratch = unfinished::scratch()?;
    let options = SuggestOptions {
        least: arguments.least,
        worth: arguments.worth,
        cache: Some(arguments.scene.cache().unwrap_or_else(|| scratch.path().to_owned())),
        gpu,
    };
    let found = suggest(&path, &options)?;
    tell_warnings(&found.warnings);
    folder.keep_results();
    let written = files::write(folder.path(), &arguments.scene.name(&path), &found)?.len();
    let effects = names(found.sets[found.chosen].effects);
    let start = Start { form: found.form, params: &found.point.params, free: &found.free };
    let changes = Changes {
        effects: Some(&effects),
        free: Some(&found.free),
        start: Some(start),
        ..Changes::default()
    };
    folder.write_scene(&path, files::CHOSEN, changes)?;
    say(files::table(&found).trim_end())?;
    say(&format!("wrote {} files to {}; open report.html there", written + 1, folder.path().display()))?;
    Ok(Exit::Done)
}

fn parse_gain(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(gain) if gain.is_finite() && gain >= 0.0 => Ok(gain),
        _ => Err("give a number of dB from 0 up, such as 0.1".to_owned()),
    }
}
