//! `skinfit fit`: a scene goes in, fitted constants come out, with the evidence of how good they are.
//!
//! - `hold_out`: which views it does not see
//! - `solve`: the search, and what it goes on from
//! - `evidence`: each view's target, fit and terms
//! - `conclude`: what is left in the run folder; `words`: the outcome in words

mod conclude;
mod evidence;
mod hold_out;
mod solve;
mod words;

use std::path::PathBuf;
use std::time::Instant;

use super::fit_engine::{FitEngineArguments, SelectedEngine};
use super::interrupt::Interrupt;
use super::maps::{MapArguments, MapRun, MapsFound};
use super::run_folder::RunFolder;
use super::scene::SceneArguments;
use super::set::SetArguments;
use super::{Exit, Refusal, quieten_graphics, tell_warnings, unfinished};
use crate::prepare::{Baked, HeldOut, Loaded, Observed, PrepareOptions};
use crate::scene::Loss;
use conclude::{Fitted, conclude};
#[cfg(feature = "burn")]
pub(super) use evidence::compared;
use solve::{Solving, solve};

/// Fit a scene's free parameters to its target images
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("The run folder holds report.html (open it in a browser), report.json, params.toml (feeds render and the next fit), scene.toml, a picture and an EXR of the terms for each view, and what --resume needs; with --maps, maps.json and the fitted maps in maps/ instead of the latter.\n\nExamples:\n  skinfit fit                                  the built-in scene\n  skinfit fit scene.toml -o runs/a             your own\n  skinfit fit scene.toml -o runs/a --resume    go on after Ctrl-C\n  skinfit fit scene.toml --params runs/a/params.toml --solver lm --starts 8 --seed 1\n  skinfit fit scene.toml --set hilite=0.7,0.6,0.5    start there\n  skinfit fit scene.toml --hold-out left    how well do the constants hold for a view that the fit has not seen?\n  skinfit fit scene.toml --engine gpu --samples gpu    passes and samples on a graphics adapter\n  skinfit fit scene.toml --maps color,specular --hold-out left    whole maps too (a build with --features burn)")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The run folder [default: runs/<the scene's folder>, or of a NAME.toml that is not scene.toml
    /// runs/<the scene's folder>.NAME].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// Start from these parameters, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    #[command(flatten)]
    set: SetArguments,
    /// Leave a view out of the fit, and tell how well it is matched all the same: the report has its scores beside
    /// those of the views that were fitted. May be given several times; with --maps, once.
    #[arg(long, value_name = "VIEW")]
    hold_out: Vec<String>,
    /// Which solver: varpro and lm take few passes; lbfgs, nelder-mead and adam are there to
    /// compare
    /// [default: varpro].
    #[arg(long, value_parser = ["varpro", "lm", "lbfgs", "nelder-mead", "adam"], help_heading = "Solver")]
    solver: Option<String>,
    /// What is minimised, instead of the scene's loss.
    #[arg(long, value_parser = ["l2", "relative_l2", "huber", "smape"], help_heading = "Solver")]
    loss: Option<String>,
    /// Fit from this many starts and keep the best: the given one, and others drawn about it
    /// [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000), help_heading = "Solver")]
    starts: Option<u32>,
    /// What the other starts are drawn from [default: 0].
    #[arg(long, help_heading = "Solver")]
    seed: Option<u64>,
    /// Most iterations of each start.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), help_heading = "Solver")]
    max_iterations: Option<u64>,
    /// Go on from where an interrupted fit in this run folder stopped, with its solver, starts and seed.
    #[arg(long, help_heading = "Solver")]
    resume: bool,
    #[command(flatten)]
    maps: MapArguments,
    #[command(flatten)]
    engine: FitEngineArguments,
    /// Print report.json on standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let begun = Instant::now();
    arguments.maps.check()?;
    arguments.engine.check(arguments.maps.any())?;
    if arguments.engine.may_be_gpu() {
        quieten_graphics();
    }
    unfinished::install_saying(
        "interrupted before the search began: the run folder is as it was; only bakes in the cache were kept.".into(),
    );
    let mut folder = RunFolder::open(arguments.output.as_deref(), arguments.scene.scene.as_deref())?;
    let path = arguments.scene.kept_path(folder.path())?;
    let options = PrepareOptions {
        fit: true,
        params: arguments.params.clone(),
        set: arguments.set.values()?.to_vec(),
        cache: arguments.scene.cache(),
        ..PrepareOptions::default()
    };
    let mut loaded = Loaded::read(&path, &options)?;
    if let Some(loss) = &arguments.loss {
        loaded.scene.fit.loss = Loss::ALL.into_iter().find(|l| l.name() == loss).unwrap_or_default();
    }
    let solving = Solving::of(arguments, folder.path())?;
    let interrupt = Interrupt::default();
    let Ready { observed, chosen, held, maps } = ready(arguments, loaded.bake()?, &interrupt)?;
    let outcome = solve(arguments, solving, &folder, (&observed, &held), &*chosen.engine, &interrupt)?;
    folder.keep();
    let maps = maps.map(|maps| maps.conclude(folder.path(), arguments.json)).transpose()?;
    let fitted = Fitted { path: &path, maps: maps.as_ref(), begun };
    conclude(arguments, solving, &folder, fitted, (&observed, &held), &chosen, &outcome)
}

/// All that a search needs.
struct Ready {
    observed: Observed,
    chosen: SelectedEngine,
    held: HeldOut,
    maps: Option<MapsFound>,
}

/// The views beside their targets, by the maps that are to be fitted, and the engine over them.
fn ready(arguments: &Arguments, baked: Baked, interrupt: &Interrupt) -> Result<Ready, Refusal> {
    let marks =
        hold_out::marked(&arguments.hold_out, &[("", &baked.scene.path, &baked.scene.views)])?.concat();
    if arguments.maps.any() {
        return with_maps(arguments, baked, &marks, interrupt);
    }
    let (baked, held) = baked.hold_out(&marks)?;
    let (observed, chosen) = if arguments.engine.makes_samples() {
        let baked = baked.keep_targets()?;
        tell_of(arguments, &baked);
        arguments.engine.over_own_samples(baked)?
    } else {
        let observed = baked.sample()?.observe()?;
        tell_of(arguments, &observed);
        let chosen = arguments.engine.select(&observed)?;
        (observed, chosen)
    };
    Ok(Ready { observed, chosen, held, maps: None })
}

/// The same after a fit of maps, which leaves one view out itself: with its samples as the fitted maps show them, it is
/// scored beside them.
fn with_maps(
    arguments: &Arguments,
    baked: Baked,
    marks: &[bool],
    interrupt: &Interrupt,
) -> Result<Ready, Refusal> {
    if marks.iter().filter(|mark| **mark).count() > 1 {
        return Err(Refusal::new(format!(
            "{}: --hold-out names several views, and a fit of --maps leaves one out. Leave the others in.",
            baked.scene.path.display()
        )));
    }
    let named =
        baked.scene.views.iter().zip(marks).find(|(_, mark)| **mark).map(|(view, _)| view.name.clone());
    let observed = baked.sample()?.observe()?;
    tell_of(arguments, &observed);
    let held_out = named.and_then(|name| observed.scene.views.iter().position(|view| view.name == name));
    let (adapter, quiet) = (arguments.engine.adapter(), arguments.json);
    let run = MapRun { adapter, held_out, interrupt: interrupt.watch(), quiet };
    let (observed, maps) = arguments.maps.fit(observed, &run)?;
    let chosen = arguments.engine.select(&observed)?;
    Ok(Ready { observed, chosen, held: HeldOut::default(), maps })
}

/// What the user should know before the search.
fn tell_of(arguments: &Arguments, baked: &Baked) {
    tell_warnings(&baked.warnings);
    arguments.set.tell_idle(baked.scene.effects);
}
