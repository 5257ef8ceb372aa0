//! `skinfit export`: tuned constants for other engines.

use std::path::{Path, PathBuf};

use super::{Exit, Refusal, tell, tell_warnings, write_or_say};
use crate::export::{self, Provenance, Target};
use crate::fit::params_file::ParamsFile;
use crate::model::effects::{Effect, Effects, Form};
use crate::model::params::{Param, Params};
use crate::scene::load::LoadOptions;
use crate::scene::{Scene, suggestion};
use crate::shader::{Budget, Facts};

/// Write tuned constants, alone or with their shader, for another engine
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  skinfit export runs/a/params.toml --to glsl -o skin.glsl\n  skinfit export runs/a/params.toml --to c -o skin.h\n\nTargets: wgsl, glsl, hlsl, cg, msl, godot and unity hold the shader; c, json and toml constants alone."
)]
pub(super) struct Arguments {
    /// The parameters: params.toml of a run folder.
    params: PathBuf,
    /// Language or format: wgsl, glsl, hlsl, cg, msl, c, json, toml, godot or unity.
    #[arg(long, value_name = "TARGET", value_parser = parse_target)]
    to: Target,
    /// The constants alone, without the shader.
    #[arg(long)]
    constants: bool,
    /// The scene that the parameters belong to [default: scene.toml beside them].
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// A file to write instead of standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// An engine's own mesh may be coarse and its filtering is the hardware's: errors up to the sum of all
/// lookups' are allowed, but silhouettes are not interpolated.
const ENGINE_BUDGET: Budget = Budget::Within(0.05);

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    if !arguments.params.is_file() {
        ParamsFile::read(&arguments.params, Form::Corrected, &Params::defaults(Form::Corrected))?;
    }
    let beside = |name: &str| arguments.params.parent().unwrap_or(Path::new("")).join(name);
    let path = arguments.scene.clone().unwrap_or_else(|| beside("scene.toml"));
    if arguments.scene.is_none() && arguments.params.exists() && !path.exists() {
        return Err(Refusal::new(format!(
            "{}: no scene.toml lies beside it, so it is not known which effects its constants belong to. Name the scene with --scene.",
            arguments.params.display()
        )));
    }
    let (scene, warnings) = Scene::load(&path, &LoadOptions { targets: false, ..LoadOptions::default() })?;
    let file = ParamsFile::read(&arguments.params, scene.form, &scene.params)?;
    tell_foreign(arguments, &path, &scene, &file);
    let from = provenance(arguments, &path, &file, &beside("report.json"));
    // Some targets hold nothing else.
    let text = if arguments.constants || arguments.to.dialect().is_none() {
        export::constants(arguments.to, scene.effects, &file.params, &from)
    } else {
        tell_warnings(&warnings.iter().map(ToString::to_string).collect::<Vec<_>>());
        export::function(arguments.to, &facts(&scene, &file), &file.params, &from)?
    };
    write_or_say(arguments.output.as_deref(), &text)?;
    Ok(Exit::Done)
}

/// Say so when the parameters were fitted with other effects than the scene has.
fn tell_foreign(arguments: &Arguments, path: &Path, scene: &Scene, file: &ParamsFile) {
    let Some(fitted) = file.effects.filter(|&effects| effects != scene.effects) else { return };
    let names = |effects: Effects| effects.iter().map(Effect::name).collect::<Vec<_>>().join(", ");
    tell(&format!(
        "{}: was fitted with the effects {}, but {} has {}. What is exported is the latter's, with constants that \
         were not tuned for it. If that is not meant, name the scene that was fitted with --scene.",
        arguments.params.display(),
        names(fitted),
        path.display(),
        names(scene.effects)
    ));
}

/// What the scene calls for in an engine: maps stay apart, the mesh is not known.
fn facts(scene: &Scene, file: &ParamsFile) -> Facts {
    let mut facts = Facts::of_scene(scene, &file.params, ENGINE_BUDGET, false);
    facts.maps.color_specular = false;
    facts.maps.normal_attenuator = false;
    facts.tessellation = 1.0;
    facts
}

fn parse_target(name: &str) -> Result<Target, String> {
    let known: Vec<&str> = Target::ALL.into_iter().map(Target::name).collect();
    Target::from_name(name).ok_or_else(|| format!("unknown target. {}.", suggestion(name, &known)))
}

/// What the files beside the parameters tell; without a report, less is told.
fn provenance(arguments: &Arguments, scene: &Path, file: &ParamsFile, report: &Path) -> Provenance {
    let text = std::fs::read_to_string(report).unwrap_or_default();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        match value {
            serde_json::Value::Array(list) => list.iter().filter_map(serde_json::Value::as_f64).collect(),
            one => one.as_f64().into_iter().collect(),
        }
    };
    let errors = Param::all()
        .map(|param| (param, numbers(&report["params"][param.name()]["std_error"])))
        .filter(|(_, errors)| !errors.is_empty());
    let loss = file.loss.zip(report["loss"]["end"].as_f64());
    Provenance {
        scene: scene.display().to_string(),
        params: arguments.params.display().to_string(),
        loss: loss.map(|(loss, end)| (loss.name().to_owned(), end)),
        std_errors: errors.collect(),
    }
}
