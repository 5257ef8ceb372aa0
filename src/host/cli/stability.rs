//! `skinfit stability`: hard cases on every evaluator, and a random search for new ones.

use std::path::PathBuf;
use std::rc::Rc;

use super::graphics::Task;
use super::run_folder::{RunFolder, Work};
use super::scene::ScenesArguments;
use super::{Exit, Refusal, say, tell, tell_warnings, unfinished};
use crate::output;
use crate::prepare::scene_names;
use crate::progress;
use crate::study::stability::evaluate::Evaluators;
use crate::study::stability::lights::LightBox;
use crate::study::stability::objectives::{EngineEvaluator, OnAdapter};
use crate::study::stability::scene::SweptScene;
use crate::study::stability::shader::{Adapter, Rules};
use crate::study::stability::{Study, evaluators, kept};

/// Try hard cases on every evaluator, and search for new ones
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("Each evaluator (the model in f64 and f32, the CPU engine, the renderer's shader rules where there is a graphics adapter) is given every hard case of docs/model.md, samples of the scene with each parameter at its bounds and each effect on and off, and random numbers made to break it; engines also random lights, specular lobes and skies under random named choices, and each parameter that files declare for the scene's own effects at hard and random values. Each result must be finite, and as near to f64 as roundings explain. Cases that fail are made as simple as they stay failing and written to DIR/new_cases.toml; DIR/stability.json has every figure.\n\nOf several scenes, which need not be one skin, the samples of each are tried in its own light; one report says which scene a failure is of. Nothing is fitted, so there is nothing to hold out.\n\nExamples:\n  skinfit stability                                    the built-in scene\n  skinfit stability scene.toml -o stable --cases 50000 --seed 7\n  skinfit stability --replay stable/new_cases.toml     try again what failed\n  skinfit stability noon.toml night.toml -o stable    the samples of both", "a case failed on an evaluator, or the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scenes: ScenesArguments,
    /// The folder for stability.json and new_cases.toml; without it only the tables are printed.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Random cases. Ten thousand take less than a second; on a graphics adapter that is a program on the CPU, a
    /// thousand take some twenty seconds. For each 250 there are 64 fragments of lights, which take a second, up to 64
    /// times that.
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    cases: u64,
    /// What the random cases are drawn from.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Try the cases of this file too, as an earlier study left it.
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// Pixels of the case that sums over many.
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pixels: u64,
    /// Leave out what runs on a graphics adapter: the shader rules and the GPU engine.
    #[arg(long)]
    no_gpu: bool,
    /// Part of a graphics adapter's name, in any case [default: $WGPU_ADAPTER_NAME, or the fastest].
    #[arg(long, value_name = "NAME", conflicts_with = "no_gpu")]
    adapter: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    super::quieten_graphics();
    unfinished::install();
    let output = arguments.output.as_deref();
    let folder = output.map(|output| RunFolder::of_study(output, Work::Stability)).transpose()?;
    let mut cases = kept::built_in()?;
    if let Some(path) = &arguments.replay {
        cases.extend(kept::read(path)?);
    }
    let (paths, _scratch) = arguments.scenes.paths()?;
    let cache = arguments.scenes.bakes.cache();
    let mut scenes = Vec::new();
    for (name, path) in scene_names(&paths)?.into_iter().zip(&paths) {
        let scene = SweptScene::read(name, path, cache.as_deref())?;
        tell_warnings(&scene.warnings);
        scenes.push(scene);
    }
    let study = Study {
        scenes,
        lights: LightBox::new(None),
        kept: cases,
        seed: arguments.seed,
        cases: usize::try_from(arguments.cases).unwrap_or(usize::MAX),
        pixels: usize::try_from(arguments.pixels).unwrap_or(usize::MAX),
    };
    study_and_tell(arguments, &study, folder)
}

fn study_and_tell(arguments: &Arguments, study: &Study, folder: Option<RunFolder>) -> Result<Exit, Refusal> {
    let mut evaluators = evaluators();
    let missing = add_gpu(arguments, &mut evaluators)?;
    let bar = progress::bar("cases", study.steps() as u64);
    let mut report = study.run(&evaluators, &|more| bar.inc(more as u64));
    bar.finish_and_clear();
    report.missing = missing.into_iter().collect();
    say(report.text().trim_end())?;
    report.missing.iter().for_each(|words| tell(words));
    if let Some(mut folder) = folder {
        folder.keep_results();
        let folder = folder.path();
        let plain = |error: &dyn std::fmt::Display| Refusal::new(format!("{}: {error}", folder.display()));
        let json = report.json().map_err(|error| plain(&error))?;
        output::write(&folder.join("stability.json"), json.as_bytes())?;
        let cases = kept::to_toml(&report.found).map_err(|error| plain(&error))?;
        output::write(&folder.join("new_cases.toml"), cases.as_bytes())?;
        say(&format!("wrote {}", folder.display()))?;
    }
    let failures = report.failures();
    for failure in &failures {
        tell(failure);
    }
    Ok(if failures.is_empty() { Exit::Done } else { Exit::Failed })
}

/// Add what runs on a graphics adapter; what is to be said, loudly, where it does not.
fn add_gpu(arguments: &Arguments, evaluators: &mut Evaluators) -> Result<Option<String>, Refusal> {
    let without = |why: &str| Ok(Some(format!("SHADER RULES AND GPU ENGINE WERE NOT TRIED: {why}")));
    if arguments.no_gpu {
        return without("--no-gpu leaves them out.");
    }
    let choice = crate::gpu::Choice { name: arguments.adapter.clone(), ..crate::gpu::Choice::default() };
    match Adapter::open(choice) {
        Ok(adapter) => {
            say(&format!("adapter: {}\n", adapter.name()))?;
            let adapter = Rc::new(adapter);
            evaluators.own.push(Box::new(Rules(Rc::clone(&adapter))));
            evaluators.own.push(Box::new(EngineEvaluator(OnAdapter(adapter))));
            Ok(None)
        }
        Err(error @ crate::gpu::GpuError::NoSuchAdapter { .. }) => Err(Task::Study.refusal(&error)),
        Err(error) => without(&Task::Study.words(&error)),
    }
}
