//! `skinfit ablate`: what each effect and term is worth, and what it costs.

use std::path::PathBuf;

use super::run_folder::{RunFolder, Work};
use super::scene::{HoldOutArguments, ScenesArguments};
use super::{Exit, Refusal, quieten_graphics, say, tell, tell_warnings, unfinished};
use crate::study::ablation::{AblationOptions, GpuTiming, ablate, files};

/// Leave each effect and term out in turn: what the images lose, and what is saved
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("Images are compared with the scene's targets or, where it names none, with the whole model. DIR gets report.html (open it in a browser), results.csv, results.json, and for each part and view a picture: reference, what is left, FLIP error.\n\nThe table on standard output:\n  change, t  of the mean loss, as a share of the whole model's (of next to nothing: as it is), and over its\n             standard error: 3 and more is beyond chance; exact: the whole model left no misfit, so any\n             change is real\n  CPU, GPU   time saved, case and whole model taking turns\n  ops        operations saved of a fragment in the renderer, as its planner counts them\n  bytes      saved of the attributes and texels that a sample reads\n  held out   with --hold-out: the change and its t of the mean loss of what no fit has seen, and the change of its\n             PSNR in dB. A part without which what is fitted gets worse, and what is held out does not, only\n             overfits\n\nSeveral scenes are one skin, as of `skinfit fit`: each part is left out of all of them at once, and the constants are those of one fit of all (or of --params); with --refit each case is fitted to all again.\n\nExamples:\n  skinfit ablate -o runs/parts                                     the built-in scene\n  skinfit ablate scene.toml -o runs/parts --refit                  what is left, fitted again\n  skinfit ablate scene.toml -o runs/parts --params runs/a/params.toml --pairs\n  skinfit ablate noon.toml night.toml -o runs/parts --refit        one skin in two lights: parts are left out of both\n  skinfit ablate noon.toml night.toml dusk.toml -o runs/parts --refit --hold-out dusk    which parts only overfit?", "a fit did not converge, or the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scenes: ScenesArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Leave two parts out at a time, too.
    #[arg(long)]
    pairs: bool,
    /// Fit the constants that are left again in each case, from four starts (the whole model from three of them):
    /// what can the others make up for?
    #[arg(long)]
    refit: bool,
    /// Constants of an earlier fit [default: the whole model is fitted to the targets first; without targets, the
    /// scene's start values].
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    #[command(flatten)]
    held: HoldOutArguments,
    /// Time the renderer, too: `auto`, where there is a graphics adapter of hardware; `always`, on one of software
    /// as well; or `never`.
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = ["auto", "always", "never"])]
    gpu: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let gpu = timing(&arguments.gpu);
    unfinished::install();
    let mut folder = RunFolder::of_study(&arguments.output, Work::Ablation)?;
    let (paths, _scratch) = arguments.scenes.paths()?;
    // Every case looks for its bakes: without a cache of the user's, they are kept for as long as this takes.
    let scratch = unfinished::scratch()?;
    let options = AblationOptions {
        pairs: arguments.pairs,
        refit: arguments.refit,
        params: arguments.params.clone(),
        hold_out: arguments.held.hold_out.clone(),
        cache: Some(arguments.scenes.bakes.cache().unwrap_or_else(|| scratch.path().to_owned())),
        gpu,
    };
    let ablation = ablate(&paths, &options)?;
    tell_warnings(&ablation.warnings);
    folder.keep_results();
    let written = files::write(folder.path(), &arguments.scenes.words(), &ablation)?;
    say(files::table(&ablation).trim_end())?;
    say(&format!("wrote {} files to {}; open report.html there", written.len(), folder.path().display()))?;
    let failed = ablation.unconverged();
    if !failed.is_empty() {
        tell(&format!(
            "{}: the fit did not converge without: {}. Their rows are what it reached.",
            folder.path().display(),
            failed.join(", ")
        ));
        return Ok(Exit::Failed);
    }
    Ok(Exit::Done)
}

/// When the renderer is timed, by the word of `--gpu`.
pub(super) fn timing(when: &str) -> GpuTiming {
    let gpu = match when {
        "always" => GpuTiming::Always,
        "never" => GpuTiming::Never,
        _ => GpuTiming::Auto,
    };
    if gpu != GpuTiming::Never {
        quieten_graphics();
    }
    gpu
}
