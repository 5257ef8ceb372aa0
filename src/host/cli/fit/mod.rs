//! `skinfit fit`: a scene goes in, fitted constants come out, with the evidence of how good they are.
//!
//! - `scenes`: the scenes of a fit, each read, baked and given an engine
//! - `solve`: the search, and what it goes on from
//! - `evidence`: each view's target, fit and terms
//! - `conclude`: what is left in the run folder; `words`: the outcome in words

mod conclude;
mod evidence;
mod scenes;
mod solve;
mod words;

use std::path::PathBuf;
use std::time::Instant;

use super::fit_engine::FitEngineArguments;
use super::interrupt::Interrupt;
use super::maps::MapArguments;
use super::opened::START;
use super::run_folder::RunFolder;
use super::scene::{HoldOutArguments, ScenesArguments};
use super::set::SetArguments;
use super::{Exit, Refusal, quieten_graphics, unfinished};
use crate::contained::is_contained;
use crate::engine::Point;
use crate::fit::outcome::Iteration;
use crate::model::params::Param;
use crate::output::OutputError;
use crate::scene::suggestion;
use conclude::{Fitted, conclude};
use scenes::Scenes;
use solve::{Solving, solve};

/// Fit the free parameters of a scene, or of several as one skin, to their target images
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("The run folder holds report.html (open it in a browser), report.json, params.toml (feeds render and the next fit), scene.toml, a picture and an EXR of the terms for each view, and what --resume needs; of several scenes, scenes/NAME.toml for each instead of scene.toml, and pictures named SCENE_VIEW; with --maps, maps.json and the fitted maps in maps/ instead of the latter.\n\nSeveral scenes are fitted as one skin: form, silhouette, lookups, loss, the skin's effects and what is free of it have to be the same in all; the skin's values start as in the first. Mesh, maps, views, gains, light and what belongs to it (`each scene's own` in `skinfit params`) stay each scene's. A scene is called by its file, or by its folder where the file is scene.toml.\n\nExamples:\n  skinfit fit                                  the built-in scene\n  skinfit fit scene.toml -o runs/a             your own\n  skinfit fit scene.toml -o runs/a --resume    go on after Ctrl-C\n  skinfit fit scene.toml --params runs/a/params.toml --solver lm --starts 8 --seed 1\n  skinfit fit scene.toml --set hilite=0.7,0.6,0.5    start there\n  skinfit fit scene.toml --hold-out left    how well do the constants hold for a view that the fit has not seen?\n  skinfit fit noon.toml night.toml -o runs/skin    one skin in two lights\n  skinfit fit noon.toml night.toml dusk.toml --hold-out dusk    and how it does in a third\n  skinfit fit scene.toml --engine gpu --samples gpu    passes and samples on a graphics adapter\n  skinfit fit scene.toml --maps color,specular --hold-out left    whole maps too (a build with --features burn)")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scenes: ScenesArguments,
    /// The run folder [default: runs/<the scene's folder>, or of a NAME.toml that is not scene.toml
    /// runs/<the scene's folder>.NAME; of several scenes these names with a + between them].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// Start from these parameters, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
    #[command(flatten)]
    set: SetArguments,
    #[command(flatten)]
    held: HoldOutArguments,
    /// What is free (comma-separated parameters), instead of the scenes' own [fit] free.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse_param)]
    free: Vec<Param>,
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

/// Is told of each iteration, and where it has led in each scene; the fit goes on when it returns.
pub(super) type Watch<'a> = dyn FnMut(&Iteration, &[Point]) + 'a;

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    run_watched(arguments, &Interrupt::default(), &mut |_, _| {}).map(|(exit, _)| exit)
}

/// What Ctrl-C leaves while scenes are read and baked.
const BEFORE_THE_SEARCH: &str =
    "interrupted before the search began: the run folder is as it was; only bakes in the cache were kept.";

/// As [`run`], watched: how it ended, and where in each scene.
pub(super) fn run_watched(
    arguments: &Arguments,
    interrupt: &Interrupt,
    watch: &mut Watch<'_>,
) -> Result<(Exit, Vec<Point>), Refusal> {
    let begun = Instant::now();
    arguments.check()?;
    if arguments.engine.may_be_gpu() {
        quieten_graphics();
    }
    unfinished::install_saying(BEFORE_THE_SEARCH.into());
    let mut folder = RunFolder::open(arguments.output.as_deref(), &arguments.scenes.named)?;
    let loaded = scenes::read(arguments, folder.path())?;
    let solving = Solving::of(arguments, folder.path())?;
    let (scenes, maps) = Scenes::ready(arguments, loaded, interrupt)?;
    // Nothing ends the process of a program that contains this one: who has given up wants no run.
    if is_contained() && interrupt.is_set() {
        return Err(Refusal::failure(BEFORE_THE_SEARCH));
    }
    let outcome = solve(arguments, solving, &folder, &scenes, interrupt, watch)?;
    folder.keep();
    // Of an earlier fit of the window: this one started elsewhere.
    let start = folder.path().join(START);
    if !arguments.resume && arguments.params.as_ref() != Some(&start) && start.is_file() {
        std::fs::remove_file(&start).map_err(|error| OutputError::new(&start, &error))?;
    }
    let maps = maps.map(|maps| maps.conclude(folder.path(), arguments.json)).transpose()?;
    let fitted = Fitted { scenes: &scenes, maps: maps.as_ref(), begun };
    let exit = conclude(arguments, solving, &folder, fitted, &outcome)?;
    Ok((exit, scenes.points(&outcome.end)))
}

impl Arguments {
    /// Refuse what cannot be together.
    fn check(&self) -> Result<(), Refusal> {
        self.maps.check()?;
        self.engine.check(self.maps.any())?;
        if self.scenes.named.len() > 1 && self.maps.any() {
            return Err(Refusal::new(
                "--maps fits the maps of one scene, and several are named. Name one scene, or leave --maps out.",
            ));
        }
        if let Some(twice) = self.free.iter().enumerate().find(|(i, param)| self.free[..*i].contains(param)) {
            let name = twice.1.name();
            return Err(Refusal::new(format!("--free lists {name} twice. List it once.")));
        }
        Ok(())
    }
}

/// A parameter by its name.
fn parse_param(name: &str) -> Result<Param, String> {
    let known: Vec<&str> = Param::all().map(Param::name).collect();
    let unknown = || format!("unknown parameter `{name}`. {}.", suggestion(name, &known));
    let param = Param::from_name(name.trim()).ok_or_else(unknown)?;
    if param.info().held {
        return Err(format!(
            "{} is the scene's: no fit moves it. Free the light's `color` in its place.",
            param.name()
        ));
    }
    Ok(param)
}
