//! What a fit leaves in its run folder, and what it says at its end.

use std::path::Path;
use std::time::Instant;

use super::Arguments;
use super::evidence::{Evidence, evidence};
use super::scenes::Scenes;
use super::solve::Solving;
use super::words::{Times, advice, advice_on_maps, tell_run};
use crate::cli::fitted_scene::{Changes, Start};
use crate::cli::machine::made;
use crate::cli::maps::MapsLeft;
use crate::cli::opened::scene_file;
use crate::cli::run_folder::RunFolder;
use crate::cli::{Exit, Refusal, say, tell, tell_warnings};
use crate::engine::Engine;
use crate::fit::outcome::{Ending, Outcome};
use crate::fit::params_file::{Origin, ParamsFile, SceneValues};
use crate::model::choices::Choices;
use crate::model::effects::Effect;
use crate::model::params::Param;
use crate::prepare::JointScene;
use crate::report::{self, RunInfo, ViewEvidence};
use crate::scene::Scene;

/// What was fitted, what was left of its maps, and when the command began.
#[derive(Clone, Copy)]
pub(super) struct Fitted<'a> {
    pub(super) scenes: &'a Scenes,
    pub(super) maps: Option<&'a MapsLeft>,
    pub(super) begun: Instant,
}

/// Leave the run folder's files, and tell how it ended.
pub(super) fn conclude(
    arguments: &Arguments,
    solving: Solving,
    folder: &RunFolder,
    Fitted { scenes, maps, begun }: Fitted<'_>,
    outcome: &Outcome,
) -> Result<Exit, Refusal> {
    let clock = Instant::now();
    let Evidence { views, diffused } = evidence(scenes, &outcome.end)?;
    let mut seconds = scenes.seconds();
    // Of every process that had a part in it, where the fit was resumed.
    seconds.fit = outcome.seconds;
    seconds.render = clock.elapsed().as_secs_f64();
    let (mut named, mut files) = (Vec::new(), Vec::new());
    for part in &scenes.parts {
        let file = scene_file(&part.name, scenes.several());
        let maps = maps.map_or(&[][..], |left| &left.named);
        named.extend(folder.write_scene(
            part.path(),
            &file,
            Changes { maps, ..changes(arguments, scenes, part) },
        )?);
        files.extend(scenes.several().then_some(file));
    }
    write_params(arguments, scenes, folder, outcome)?;
    let mut run = RunInfo { seconds, diffused, named, files, ..run_info(arguments, solving, scenes, views) };
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
        tell_run(folder.path(), scenes, &run, outcome, &report.summary, times)?;
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

/// Where the fit differed from a scene's file.
fn changes<'a>(arguments: &'a Arguments, scenes: &'a Scenes, part: &'a JointScene) -> Changes<'a> {
    let Scene { form, params, fit, .. } = &*part.baked.scene;
    let start = Start { form: *form, params, free: &fit.free };
    // Where maps are fitted, the constants start from what their last round found; of several scenes, from the first's.
    let elsewhere = arguments.params.is_some() || !arguments.set.checked().is_empty() || arguments.maps.any();
    Changes {
        loss: arguments.loss.as_deref(),
        start: (elsewhere || scenes.several()).then_some(start),
        free: (!arguments.free.is_empty()).then_some(&fit.free),
        cameras: &part.baked.cameras,
        of_material: part.baked.scene.maps.material.is_some(),
        ..Changes::default()
    }
}

/// Leave the fitted parameters, to be used again.
fn write_params(
    arguments: &Arguments,
    scenes: &Scenes,
    folder: &RunFolder,
    outcome: &Outcome,
) -> Result<(), Refusal> {
    let Some(first) = scenes.parts.first() else { return Ok(()) };
    let gains = |part: &JointScene| {
        let fitted = part.baked.scene.views.iter().zip(scenes.point_of(part, &outcome.end).gains);
        // They stand after those that were fitted, whose numbers the unknowns know.
        let held = part.held.views.iter().zip(part.held.gains.iter().copied());
        fitted.chain(held).map(|(view, gain)| (view.name.clone(), gain)).collect::<Vec<_>>()
    };
    let (mut numbers, mut first_view) = (Vec::new(), 0);
    for part in &scenes.parts {
        numbers.push(part.number.map(|number| (number, first_view)));
        first_view += part.number.map_or(0, |_| part.baked.scene.views.len());
    }
    let own = |part: &JointScene| {
        let at = scenes.point_of(part, &outcome.end);
        let free = |param: Param| part.baked.scene.fit.free.iter().any(|column| column.param == param);
        let given = |param: Param| param.info().held || (param.info().found && !free(param));
        let params =
            Param::of(part.baked.scene.effects).filter(|param| param.is_of_scene() && !given(*param));
        let params = params.map(|param| (param, at.params.rgb(param))).collect();
        let effects = Some(part.baked.scene.effects).filter(|own| *own != first.baked.scene.effects);
        SceneValues { name: part.name.clone(), effects, params, gains: gains(part) }
    };
    let several = scenes.several();
    let file = ParamsFile {
        form: first.baked.scene.form,
        effects: Some(first.baked.scene.effects),
        loss: Some(first.baked.scene.fit.loss),
        params: outcome.end.params.clone(),
        gains: if several { Vec::new() } else { gains(first) },
        scenes: if several { scenes.parts.iter().map(own).collect() } else { Vec::new() },
    };
    let (files, set) = (scenes.files(), arguments.set.checked());
    let origin = Origin {
        scene: Path::new(&files),
        outcome: Some(outcome),
        set,
        free: &[],
        numbers: if several { &numbers } else { &[] },
    };
    Ok(file.write(&folder.path().join("params.toml"), origin)?)
}

fn run_info(arguments: &Arguments, solving: Solving, scenes: &Scenes, views: Vec<ViewEvidence>) -> RunInfo {
    let each = |of: &dyn Fn(&JointScene) -> String| alike(scenes.parts.iter().map(of).collect());
    let set = arguments.set.words();
    let held: Vec<String> = views.iter().filter(|view| view.held_out).map(|view| view.name.clone()).collect();
    let effects = |part: &JointScene| {
        let names: Vec<&str> = part.baked.scene.effects.iter().map(Effect::name).collect();
        names.join(", ")
    };
    let filter = |part: &JointScene| part.baked.scene.quality.texture_filter.name().to_owned();
    let filtered = scenes.parts.iter().any(|part| part.baked.scene.quality.texture_filter.reads_levels());
    let mut engine_facts: Vec<(String, String)> = Vec::new();
    for fact in scenes.joint.engines().flat_map(Engine::provenance) {
        if !engine_facts.contains(&fact) {
            engine_facts.push(fact);
        }
    }
    let loss = scenes.parts.first().map_or_else(Default::default, |part| part.baked.scene.fit.loss);
    RunInfo {
        scene: arguments.scenes.words(),
        scenes: match scenes.several() {
            true => scenes.fitted().map(|part| part.name.clone()).collect(),
            false => Vec::new(),
        },
        loss,
        engine: alike(scenes.joint.engines().map(|engine| engine.name().to_owned()).collect()),
        samples: scenes.joint.engines().map(Engine::samples).sum(),
        seconds: scenes.seconds(),
        views,
        warnings: scenes.parts.iter().flat_map(|part| part.baked.warnings.iter().cloned()).collect(),
        provenance: vec![
            ("form".to_owned(), each(&|part| part.baked.scene.form.name().to_owned())),
            ("silhouette".to_owned(), each(&|part| part.baked.scene.silhouette.name().to_owned())),
            ("lookups".to_owned(), each(&|part| part.baked.scene.lookups.name().to_owned())),
        ]
        .into_iter()
        .chain((0..Choices::default().named().len()).map(|i| {
            let chosen = |part: &JointScene| part.baked.scene.choices.named()[i].1.to_owned();
            (Choices::default().named()[i].0.to_owned(), each(&chosen))
        }))
        .chain([
            ("effects".to_owned(), each(&effects)),
            ("starts".to_owned(), format!("{}, seed {}", solving.starts, solving.seed)),
        ])
        .chain(filtered.then(|| ("texture_filter".to_owned(), each(&filter))))
        .chain((!set.is_empty()).then(|| ("set".to_owned(), set.join(", "))))
        .chain((!held.is_empty()).then(|| ("held out".to_owned(), held.join(", "))))
        .chain(engine_facts)
        .collect(),
        made: made(),
        maps: None,
        diffused: Vec::new(),
        named: Vec::new(),
        files: Vec::new(),
    }
}

/// What scenes have, once where it is the same in all.
fn alike(mut all: Vec<String>) -> String {
    all.dedup();
    all.join("; ")
}
