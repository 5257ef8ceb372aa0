//! `skinfit fit`: a scene goes in, fitted constants come out, with the evidence of how good they are.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::fingerprint::fingerprint;
use super::fit_engine::{Chosen, FitEngine, FitEngineArguments};
use super::fitted_scene::{Changes, Start};
use super::interrupt::Interrupt;
use super::maps::{MapArguments, MapRun, MapsLeft};
use super::run_folder::RunFolder;
use super::scene::SceneArguments;
use super::{Exit, Refusal, quieten_graphics, say, tell, tell_warnings};
use crate::engine::Unknown;
use crate::engine::view::ObservedView;
use crate::fit::outcome::{Ending, Outcome};
use crate::fit::params_file::ParamsFile;
use crate::fit::state::Saved;
use crate::fit::{self, FitError, FitOptions, SolverKind};
use crate::output::OutputError;
use crate::prepare::{PrepareOptions, Prepared};
use crate::progress;
use crate::render::image::Image;
use crate::render::shade::Shader;
use crate::report::{self, RunInfo, ViewEvidence};
use crate::scene::view::View;
use crate::scene::{Loss, Scene};

/// Fit a scene's free parameters to its target images
#[derive(clap::Args)]
#[command(
    after_help = super::with_exit_codes("The run folder holds report.html (open it in a browser), report.json, params.toml (feeds render and the next fit), scene.toml, a picture and an EXR of the terms for each view, and what --resume needs; with --maps, maps.json and the fitted maps in maps/ instead of the latter.\n\nExamples:\n  skinfit fit                                  the built-in scene\n  skinfit fit scene.toml -o runs/a             your own\n  skinfit fit scene.toml -o runs/a --resume    go on after Ctrl-C\n  skinfit fit scene.toml --params runs/a/params.toml --solver lm --starts 8 --seed 1\n  skinfit fit scene.toml --engine gpu --samples gpu    passes and samples on a graphics adapter\n  skinfit fit scene.toml --maps color,specular --hold-out left    whole maps too (a build with --features burn)")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The run folder [default: runs/<the scene's folder>].
    #[arg(short, long, value_name = "RUN")]
    output: Option<PathBuf>,
    /// Start from these parameters, instead of the scene's start values.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
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
    arguments.maps.check()?;
    arguments.engine.check(arguments.maps.any())?;
    if arguments.engine.may_be_gpu() {
        quieten_graphics();
    }
    let mut folder = RunFolder::open(arguments.output.as_deref(), arguments.scene.scene.as_deref())?;
    let path = arguments.scene.kept_path(folder.path())?;
    let options = PrepareOptions {
        fit: true,
        params: arguments.params.clone(),
        cache: arguments.scene.cache(),
        ..PrepareOptions::default()
    };
    let own = arguments.engine.makes_samples();
    let mut prepared = if own { Prepared::baked(&path, &options) } else { Prepared::new(&path, &options) }?;
    if let Some(loss) = &arguments.loss {
        prepared.scene.fit.loss = Loss::ALL.into_iter().find(|l| l.name() == loss).unwrap_or_default();
    }
    let solving = Solving::of(arguments, folder.path())?;
    let observed = if own { prepared.keep_targets().map(|()| None) } else { prepared.observed().map(Some) }?;
    tell_warnings(&prepared.warnings);
    let interrupt = Interrupt::default();
    let (observed, maps) = match observed {
        Some(observed) if arguments.maps.any() => {
            let (adapter, quiet) = (arguments.engine.adapter(), arguments.json);
            let run = MapRun { adapter, interrupt: interrupt.watch(), quiet };
            let (observed, maps) = arguments.maps.fit(&mut prepared, observed, &run)?;
            (Some(observed), maps)
        }
        observed => (observed, None),
    };
    arguments.engine.with_engine(&prepared, observed, |chosen| {
        let outcome = solve(arguments, solving, &folder, &prepared, &chosen.engine, &interrupt)?;
        folder.keep();
        let maps = maps.map(|maps| maps.conclude(folder.path(), arguments.json)).transpose()?;
        let fitted = Fitted { path: &path, maps: maps.as_ref() };
        conclude(arguments, solving, &folder, fitted, &prepared, chosen, &outcome)
    })
}

/// How the unknowns are searched for: as the command line says, else as the fit that is resumed was
/// begun.
#[derive(Clone, Copy)]
struct Solving {
    solver: SolverKind,
    starts: u32,
    seed: u64,
}

impl Solving {
    fn of(arguments: &Arguments, folder: &Path) -> Result<Self, Refusal> {
        let (solver, starts, seed) = match arguments.resume {
            true => Saved::begun_with(&folder.join(STATE))?,
            false => (SolverKind::default(), 1, 0),
        };
        Ok(Self {
            solver: arguments.solver.as_deref().and_then(SolverKind::from_name).unwrap_or(solver),
            starts: arguments.starts.unwrap_or(starts),
            seed: arguments.seed.unwrap_or(seed),
        })
    }
}

/// What a fit goes on from, in its run folder.
const STATE: &str = "state.json";

/// The scene file that was fitted, and what was left of its maps.
#[derive(Clone, Copy)]
struct Fitted<'a> {
    path: &'a Path,
    maps: Option<&'a MapsLeft>,
}

/// Leave the run folder's files, and tell how it ended.
fn conclude(
    arguments: &Arguments,
    solving: Solving,
    folder: &RunFolder,
    Fitted { path, maps }: Fitted<'_>,
    prepared: &Prepared,
    chosen: &Chosen<'_>,
    outcome: &Outcome,
) -> Result<Exit, Refusal> {
    let engine = &chosen.engine;
    let clock = Instant::now();
    let views = evidence(prepared, engine, outcome)?;
    let mut seconds = prepared.seconds;
    seconds.samples = chosen.sample_seconds().unwrap_or(seconds.samples);
    // Of every process that had a part in it, where the fit was resumed.
    seconds.fit = outcome.seconds;
    seconds.render = clock.elapsed().as_secs_f64();
    let maps_named = maps.map_or(&[][..], |left| &left.named);
    let named = folder.write_scene(path, Changes { maps: maps_named, ..changes(arguments, prepared) })?;
    params_file(prepared, outcome).write(&folder.path().join("params.toml"), path, Some(outcome))?;
    let mut run = RunInfo { seconds, named, ..run_info(arguments, solving, path, prepared, engine, views) };
    if let Some(left) = maps {
        tell_warnings(&left.warnings);
        run.warnings.extend(left.warnings.iter().cloned());
        run.provenance.extend(left.provenance.iter().cloned());
        run.maps = Some(left.evidence.clone());
    }
    // A fit of maps that was interrupted is so as a whole, even where the constants had nothing left to do.
    let interrupted = maps.is_some_and(|left| left.evidence.interrupted);
    let ending = if interrupted { Ending::Interrupted } else { outcome.ending };
    let outcome = &Outcome { ending, ..outcome.clone() };
    let report = report::write_run(folder.path(), &run, outcome)?;
    if arguments.json {
        say(report.json.trim_end())?;
    } else {
        tell_outcome(outcome, &prepared.scene.views)?;
        if engine.name() == "gpu" {
            let by = if engine.own_sample_seconds().is_some() { "GPU" } else { "CPU" };
            say(&format!("{} samples made by the {by} in {:.3} s", engine.samples(), seconds.samples))?;
        }
        if let Some(why) = &chosen.reasons.why {
            say(&format!("passes on the {}: {why}", engine.name().to_uppercase()))?;
        }
        say(&format!("{}: final loss {:.6e}", folder.path().display(), outcome.loss_end))?;
    }
    let advice = match maps {
        Some(left) => advice_on_maps(arguments, folder.path(), left, outcome),
        None => advice(outcome),
    };
    if let Some(advice) = advice {
        tell(&format!("{}: {advice}", folder.path().display()));
        return Ok(Exit::Failed);
    }
    Ok(Exit::Done)
}

/// Where the fit differed from its scene file.
fn changes<'a>(arguments: &'a Arguments, prepared: &'a Prepared) -> Changes<'a> {
    let Scene { form, params, fit, .. } = &prepared.scene;
    let start = Start { form: *form, params, free: &fit.free };
    Changes {
        loss: arguments.loss.as_deref(),
        // Where maps are fitted, the constants start from what their last round found.
        start: (arguments.params.is_some() || arguments.maps.any()).then_some(start),
        ..Changes::default()
    }
}

/// What to do about a fit that did not converge.
fn advice(outcome: &Outcome) -> Option<String> {
    let iterations = outcome.iterations;
    match outcome.ending {
        Ending::Converged => None,
        Ending::RanOut => Some(format!(
            "the fit ran out after {iterations} iterations and has not converged. Go on with the same command, --resume and a greater \
             --max-iterations."
        )),
        Ending::Stalled => Some(
            "the fit stalled: no step lowers the loss, yet it has not converged. Try --solver lm, or --starts 8."
                .to_owned(),
        ),
        Ending::Interrupted => {
            Some(format!("the fit was interrupted after {iterations} iterations. Go on with the same command and --resume."))
        }
    }
}

/// What to do about a fit of maps that did not end well: no state of it is kept.
fn advice_on_maps(
    arguments: &Arguments,
    folder: &Path,
    left: &MapsLeft,
    outcome: &Outcome,
) -> Option<String> {
    if left.evidence.interrupted {
        return Some(format!("the fit of the maps was interrupted. {}", arguments.maps.advice(folder)));
    }
    let iterations = outcome.iterations;
    match outcome.ending {
        Ending::Interrupted => Some(format!(
            "the last solve of the constants was interrupted after {iterations} iterations; the maps are fitted. {}",
            arguments.maps.advice(folder)
        )),
        Ending::RanOut => Some(format!(
            "the last solve of the constants ran out after {iterations} iterations and has not converged. Fit again \
             with a greater --max-iterations."
        )),
        Ending::Converged | Ending::Stalled => advice(outcome),
    }
}

/// The fitted parameters, to be used again.
fn params_file(prepared: &Prepared, outcome: &Outcome) -> ParamsFile {
    let names = prepared.scene.views.iter().map(|view| view.name.clone());
    ParamsFile {
        form: prepared.scene.form,
        effects: Some(prepared.scene.effects),
        loss: Some(prepared.scene.fit.loss),
        params: outcome.end.params,
        gains: names.zip(outcome.end.gains.iter().copied()).collect(),
    }
}

/// Fit, with a progress line and Ctrl-C that keeps the state.
fn solve(
    arguments: &Arguments,
    solving: Solving,
    folder: &RunFolder,
    prepared: &Prepared,
    engine: &FitEngine<'_>,
    interrupt: &Interrupt,
) -> Result<Outcome, Refusal> {
    let state = folder.path().join(STATE);
    let maps = arguments.maps.any();
    if maps {
        // A state holds no maps: what could be resumed from one is another fit, and so is that of an earlier run.
        match std::fs::remove_file(&state) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(OutputError::new(&state, &error).into());
            }
            _ => {}
        }
    }
    let options = FitOptions {
        solver: solving.solver,
        max_iterations: arguments.max_iterations,
        starts: solving.starts,
        seed: solving.seed,
        fingerprint: fingerprint(&prepared.scene),
        resume: arguments.resume.then(|| state.clone()),
        state: (!maps).then_some(state),
        interrupt: Some(interrupt.watch()),
        ..FitOptions::default()
    };
    let bar = progress::spinner("fit");
    let outcome = fit::fit(engine.objective(), &prepared.start(), &options, &mut |iteration| {
        bar.set_position(iteration.iteration);
        bar.set_message(format!("loss {:.6e}, {} passes", iteration.loss, iteration.evaluations));
    });
    bar.finish_and_clear();
    outcome.map_err(|error| match error {
        // It names its file itself.
        FitError::State(error) => Refusal::from(error),
        FitError::Engine(fault) => {
            Refusal::failure(format!("{}: {}", prepared.scene.path.display(), FitError::Engine(fault)))
        }
        error => Refusal::new(format!("{}: {error}", prepared.scene.path.display())),
    })
}

/// For each view the target, the fit and its terms.
fn evidence(
    prepared: &Prepared,
    engine: &FitEngine<'_>,
    outcome: &Outcome,
) -> Result<Vec<ViewEvidence>, Refusal> {
    let observed = engine.surfaced_views()?;
    let shader = Shader::new(prepared.setup(), &prepared.illumination, &outcome.end.params);
    let bar = progress::bar("pictures", prepared.scene.views.len() as u64);
    let views = prepared.scene.views.iter().zip(observed.iter()).enumerate();
    let evidence = views
        .map(|(index, (view, observed))| {
            let shaded = shader.shade(&observed.samples, &view.camera, outcome.end.gains[index]);
            let (target, coverage) = compared(view, observed, &shaded.image);
            bar.inc(1);
            ViewEvidence {
                name: view.name.clone(),
                target,
                fit: shaded.image,
                coverage,
                terms: shaded
                    .terms
                    .into_iter()
                    .map(|(name, image)| (name.name().to_owned(), image))
                    .collect(),
            }
        })
        .collect();
    bar.finish_and_clear();
    Ok(evidence)
}

/// The target as an image, and how much of each pixel is compared.
pub(super) fn compared(view: &View, observed: &ObservedView, fit: &Image) -> (Image, Vec<f32>) {
    let mut target = Image::new(fit.width, fit.height);
    let Some(source) = &view.target else { return (target, fit.alpha.clone()) };
    target.rgb.clone_from(&source.rgb);
    // Without an alpha of its own, the target is opaque.
    target.alpha = source.alpha.clone().unwrap_or_else(|| vec![1.0; source.rgb.len()]);
    let mut coverage = vec![0.0; fit.alpha.len()];
    for (slot, &pixel) in observed.samples.pixel.iter().enumerate() {
        if pixel != u32::MAX && observed.pixel_weight(slot) > 0.0 {
            let at = pixel as usize;
            coverage[at] = observed.samples.coverage[slot].min(target.alpha[at]);
        }
    }
    (target, coverage)
}

fn run_info(
    arguments: &Arguments,
    solving: Solving,
    path: &Path,
    prepared: &Prepared,
    engine: &FitEngine<'_>,
    views: Vec<ViewEvidence>,
) -> RunInfo {
    let scene = match &arguments.scene.scene {
        Some(_) => path.display().to_string(),
        None => "the built-in scene".to_owned(),
    };
    let effects: Vec<&str> = prepared.scene.effects.iter().map(crate::model::effects::Effect::name).collect();
    RunInfo {
        scene,
        loss: prepared.scene.fit.loss,
        engine: engine.name().to_owned(),
        samples: engine.samples() as u64,
        seconds: prepared.seconds,
        views,
        warnings: prepared.warnings.clone(),
        provenance: vec![
            ("form".to_owned(), prepared.scene.form.name().to_owned()),
            ("silhouette".to_owned(), prepared.scene.silhouette.name().to_owned()),
            ("effects".to_owned(), effects.join(", ")),
            ("starts".to_owned(), format!("{}, seed {}", solving.starts, solving.seed)),
        ]
        .into_iter()
        .chain(engine.provenance())
        .collect(),
        maps: None,
        named: Vec::new(),
    }
}

/// The fitted values as a small table.
fn tell_outcome(outcome: &Outcome, views: &[View]) -> Result<(), Refusal> {
    for unknown in &outcome.unknowns {
        let (name, unit) = match unknown.unknown {
            Unknown::Gain(view) => (format!("gain.{}", views[view].name), ""),
            Unknown::Param(column) => (column.name(), column.param.info().unit),
        };
        let error = match unknown.std_error {
            Some(error) => format!("+- {error:.2e}"),
            None if !unknown.identifiable => "not determined by the images".to_owned(),
            None if unknown.at_bound => "at its bound".to_owned(),
            None => String::new(),
        };
        say(format!("{name:>22} {:>12.6}  {error:<11}  {unit}", unknown.value).trim_end())?;
    }
    let ending = outcome.ending.words();
    let count = |n: u64, one: &str, more: &str| format!("{n} {}", if n == 1 { one } else { more });
    say(&format!(
        "{ending} after {} and {} over the samples, {:.2} s; loss {:.6e} -> {:.6e}",
        count(outcome.iterations, "iteration", "iterations"),
        count(outcome.evaluations, "pass", "passes"),
        outcome.seconds,
        outcome.loss_start,
        outcome.loss_end
    ))
}
