//! What a fit leaves in its run folder, and what it says at its end.

use std::path::Path;
use std::time::Instant;

use super::Arguments;
use super::evidence::evidence;
use super::solve::Solving;
use super::words::{Times, advice, advice_on_maps, tell_run};
use crate::cli::fit_engine::SelectedEngine;
use crate::cli::fitted_scene::{Changes, Start};
use crate::cli::machine::made;
use crate::cli::maps::MapsLeft;
use crate::cli::run_folder::RunFolder;
use crate::cli::{Exit, Refusal, say, tell, tell_warnings};
use crate::engine::Engine;
use crate::fit::outcome::{Ending, Outcome};
use crate::fit::params_file::{Origin, ParamsFile};
use crate::prepare::{Baked, HeldOut};
use crate::report::{self, RunInfo, ViewEvidence};
use crate::scene::Scene;

/// The scene file that was fitted, what was left of its maps, and when the command began.
#[derive(Clone, Copy)]
pub(super) struct Fitted<'a> {
    pub(super) path: &'a Path,
    pub(super) maps: Option<&'a MapsLeft>,
    pub(super) begun: Instant,
}

/// Leave the run folder's files, and tell how it ended.
pub(super) fn conclude(
    arguments: &Arguments,
    solving: Solving,
    folder: &RunFolder,
    Fitted { path, maps, begun }: Fitted<'_>,
    (baked, held): (&Baked, &HeldOut),
    chosen: &SelectedEngine,
    outcome: &Outcome,
) -> Result<Exit, Refusal> {
    let engine = &*chosen.engine;
    let clock = Instant::now();
    let views = evidence((baked, held), engine, &outcome.end)?;
    let mut seconds = baked.seconds;
    seconds.samples = engine.own_sample_seconds().unwrap_or(seconds.samples);
    // Of every process that had a part in it, where the fit was resumed.
    seconds.fit = outcome.seconds;
    seconds.render = clock.elapsed().as_secs_f64();
    let maps_named = maps.map_or(&[][..], |left| &left.named);
    let named = folder.write_scene(path, Changes { maps: maps_named, ..changes(arguments, baked) })?;
    let origin = Origin { scene: path, outcome: Some(outcome), set: arguments.set.checked() };
    params_file((baked, held), outcome).write(&folder.path().join("params.toml"), origin)?;
    let mut run = RunInfo { seconds, named, ..run_info(arguments, solving, path, baked, engine, views) };
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
        // All that there was to do is done: reading, bakes, samples, the fit, its pictures and the report.
        let times = Times { whole: begun.elapsed().as_secs_f64(), samples: seconds.samples };
        tell_run(folder.path(), &baked.scene.views, chosen, outcome, &report.summary, times)?;
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
fn changes<'a>(arguments: &'a Arguments, baked: &'a Baked) -> Changes<'a> {
    let Scene { form, params, fit, .. } = &*baked.scene;
    let start = Start { form: *form, params, free: &fit.free };
    Changes {
        loss: arguments.loss.as_deref(),
        // Where maps are fitted, the constants start from what their last round found.
        start: (arguments.params.is_some() || !arguments.set.checked().is_empty() || arguments.maps.any())
            .then_some(start),
        ..Changes::default()
    }
}

/// The fitted parameters, to be used again.
fn params_file((baked, held): (&Baked, &HeldOut), outcome: &Outcome) -> ParamsFile {
    let names = baked.scene.views.iter().map(|view| view.name.clone());
    let gains = names.zip(outcome.end.gains.iter().copied());
    // They stand after those that were fitted, whose numbers the unknowns know.
    let others = held.views.iter().map(|view| view.name.clone()).zip(held.gains.iter().copied());
    ParamsFile {
        form: baked.scene.form,
        effects: Some(baked.scene.effects),
        loss: Some(baked.scene.fit.loss),
        params: outcome.end.params.clone(),
        gains: gains.chain(others).collect(),
    }
}

fn run_info(
    arguments: &Arguments,
    solving: Solving,
    path: &Path,
    baked: &Baked,
    engine: &dyn Engine,
    views: Vec<ViewEvidence>,
) -> RunInfo {
    let scene = match &arguments.scene.scene {
        Some(_) => path.display().to_string(),
        None => "the built-in scene".to_owned(),
    };
    let set = arguments.set.words();
    let held: Vec<String> = views.iter().filter(|view| view.held_out).map(|view| view.name.clone()).collect();
    let effects: Vec<&str> = baked.scene.effects.iter().map(crate::model::effects::Effect::name).collect();
    RunInfo {
        scene,
        loss: baked.scene.fit.loss,
        engine: engine.name().to_owned(),
        samples: engine.samples(),
        seconds: baked.seconds,
        views,
        warnings: baked.warnings.clone(),
        provenance: vec![
            ("form".to_owned(), baked.scene.form.name().to_owned()),
            ("silhouette".to_owned(), baked.scene.silhouette.name().to_owned()),
            ("lookups".to_owned(), baked.scene.lookups.name().to_owned()),
            ("effects".to_owned(), effects.join(", ")),
            ("starts".to_owned(), format!("{}, seed {}", solving.starts, solving.seed)),
        ]
        .into_iter()
        .chain((!set.is_empty()).then(|| ("set".to_owned(), set.join(", "))))
        .chain((!held.is_empty()).then(|| ("held out".to_owned(), held.join(", "))))
        .chain(engine.provenance())
        .collect(),
        made: made(),
        maps: None,
        named: Vec::new(),
    }
}
