//! `skinfit export`: tuned constants for other engines.

use std::path::{Path, PathBuf};

use super::set::SetArguments;
use super::{Exit, Refusal, say, tell_warnings, write_or_say};
use crate::export::unity::{UnityFolder, UnitySkin};
use crate::export::{self, Constants, Provenance, Target};
use crate::files;
use crate::fit::params_file::{Foreign, ParamsFile};
use crate::model::params::Param;
use crate::scene::load::LoadOptions;
use crate::scene::{Loss, Scene, register_terms, suggestion};
use crate::shader::Facts;

/// Write tuned constants, alone or with their shader, for another engine
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  skinfit export runs/a/params.toml --to glsl -o skin.glsl\n  skinfit export runs/a/params.toml --to c -o skin.h\n  skinfit export runs/a/params.toml --to unity --set reflection=0 -o Skin.hlsl\n  skinfit export runs/a/params.toml --to godot --material skin.gdshaderinc -o skin.tres\n  skinfit export runs/a/params.toml --to unity --material Skin.hlsl -o baked/Skin.mat\n  skinfit export runs/a/params.toml --to unreal --material Skin -o Skin.txt\n\nTargets: wgsl, glsl, hlsl, cg, msl, godot, unity and unreal hold the shader, and of light that scatters the passes before it, with how to wire them in the head; c, json and toml constants alone, for which the parameters' file is enough. What toml holds is a file of parameters again."
)]
pub(super) struct Arguments {
    /// The parameters: params.toml of a run folder.
    params: PathBuf,
    /// Language or format: wgsl, glsl, hlsl, cg, msl, c, json, toml, godot, unity or unreal.
    #[arg(long, value_name = "TARGET", value_parser = parse_target)]
    to: Target,
    /// The constants alone, without the shader.
    #[arg(long)]
    constants: bool,
    /// The scene that the parameters belong to [default: scene.toml beside them; constants alone need none].
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// For godot and unity: in place of the shader a material that includes it by this name. Unity's is a ShaderLab file, and
    /// with an output that ends in .mat a folder for Assets: the material, its shader and what that includes, the scene's maps
    /// as PNG, and a .meta for each of them and for the baked cubes beside them. For unreal: nodes to paste into a material,
    /// with the shader within and this title, or included by a path of a shader directory (/Project/Skin.ush).
    #[arg(long, value_name = "SHADER", conflicts_with = "constants")]
    material: Option<String>,
    #[command(flatten)]
    set: SetArguments,
    /// A file to write instead of standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    arguments.set.values()?;
    let folder = unity_folder(arguments)?;
    // Some targets hold nothing else.
    let alone = arguments.material.is_none() && (arguments.constants || arguments.to.dialect().is_none());
    let beside = |name: &str| arguments.params.parent().unwrap_or(Path::new("")).join(name);
    let path = arguments.scene.clone().unwrap_or_else(|| beside("scene.toml"));
    let there = arguments.scene.is_some() || path.exists();
    if there {
        // Constants may be of terms that the scene brings along. What is wrong with it is told where it is needed.
        let _ = register_terms(&path);
    }
    let mut file = ParamsFile::read_alone(&arguments.params)?;
    let (scene, read) = match (alone && arguments.scene.is_none(), file.effects) {
        (true, Some(_)) => (None, Vec::new()),
        _ if !there => return Err(no_scene(arguments, alone)),
        _ => {
            let (scene, read) = files::recorded(|| loaded(arguments, &path, &mut file));
            (Some(scene?), read)
        }
    };
    arguments.set.apply(&mut file.params);
    let effects = scene.as_ref().map(|scene| scene.effects).or(file.effects).unwrap_or_default();
    arguments.set.tell_idle(effects);
    if let Some(scene) = &scene {
        tell_foreign(arguments, &path, scene, &file);
    }
    let from = provenance(arguments, there.then_some(&path), &file, &beside("report.json"));
    if let (Some(scene), Some((output, include))) = (&scene, folder) {
        let (facts, params, maps) = (&facts(scene, &file), &file.params, &scene.maps);
        let made = UnityFolder::new(output, include, UnitySkin { facts, params, from: &from, maps })?;
        return write_folder(&made, output, &read);
    }
    let text = match (&scene, &arguments.material) {
        (Some(scene), Some(shader)) => {
            export::material(arguments.to, &facts(scene, &file), &file.params, shader)?
        }
        (Some(scene), None) if !alone => {
            export::function(arguments.to, &facts(scene, &file), &file.params, &from)?
        }
        _ => {
            let constants = Constants {
                form: file.form,
                effects,
                params: &file.params,
                loss: file.loss.map(Loss::name),
                gains: &file.gains,
            };
            export::constants(arguments.to, constants, &from)
        }
    };
    write_or_say(arguments.output.as_deref(), &text)?;
    Ok(Exit::Done)
}

/// Unity's material and the shader that it includes, where a folder with all of them is to be written.
fn unity_folder(arguments: &Arguments) -> Result<Option<(&Path, &str)>, Refusal> {
    let Some(output) = arguments.output.as_deref() else { return Ok(None) };
    let saved = output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mat"));
    match (arguments.to == Target::Unity && saved, arguments.material.as_deref()) {
        (false, _) => Ok(None),
        (true, Some(include)) => Ok(Some((output, include))),
        (true, None) => Err(Refusal::new(format!(
            "{}: no material holds a shader's text. Name the shader that it is to include, such as --material Skin.hlsl.",
            output.display()
        ))),
    }
}

/// Write a material's folder, but over nothing that the scene was read from.
fn write_folder(made: &UnityFolder, material: &Path, read: &[PathBuf]) -> Result<Exit, Refusal> {
    if let Some(path) = made.files().find(|path| read.contains(&files::plain(path))) {
        return Err(Refusal::new(format!(
            "{}: the scene was read from this file, which the material's would replace. Give the material another name or folder.",
            path.display()
        )));
    }
    tell_warnings(made.warnings());
    made.write()?;
    let names = made.files().filter(|path| *path != material).filter_map(|path| path.file_name());
    let names: Vec<_> = names.map(|name| name.to_string_lossy()).collect();
    say(&format!("wrote {}, and beside it {}", material.display(), names.join(", ")))?;
    Ok(Exit::Done)
}

/// The scene, with the parameters over its own.
fn loaded(arguments: &Arguments, path: &Path, file: &mut ParamsFile) -> Result<Scene, Refusal> {
    let (scene, warnings) = Scene::load(path, &LoadOptions { targets: false, ..LoadOptions::default() })?;
    *file = ParamsFile::read(&arguments.params, scene.form, &scene.params)?.of_scene(path);
    if !arguments.constants && arguments.to.dialect().is_some() {
        let mut words: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        words.extend(scene.maps.material.iter().flatten().map(|told| {
            format!("{}: {told}. The shader wants them so: have the engine do it.", path.display())
        }));
        tell_warnings(&words);
    }
    Ok(scene)
}

fn no_scene(arguments: &Arguments, alone: bool) -> Refusal {
    let what = match alone {
        true => {
            "it names no effects and no scene.toml lies beside it, so it is not known which constants are meant"
        }
        false => {
            "no scene.toml lies beside it, and the shader depends on the scene's maps, silhouette and effects"
        }
    };
    let other = if alone { "" } else { ", or export the constants alone with --constants" };
    Refusal::new(format!("{}: {what}. Name the scene with --scene{other}.", arguments.params.display()))
}

/// Say so when the parameters were fitted with other effects than the scene has.
fn tell_foreign(arguments: &Arguments, path: &Path, scene: &Scene, file: &ParamsFile) {
    let foreign = Foreign {
        file: &arguments.params,
        fitted: file.effects,
        scene: path,
        effects: scene.effects,
        params: &file.params,
        chosen: &arguments.set.params(),
    };
    let remedy = "If that is not meant, name the scene that was fitted with --scene.";
    let words = foreign.words("exported", remedy, true);
    tell_warnings(&words.into_iter().collect::<Vec<_>>());
}

/// What the scene calls for in an engine: maps stay apart, the mesh is not known.
fn facts(scene: &Scene, file: &ParamsFile) -> Facts {
    let mut facts = scene.facts(&file.params, export::BUDGET, false);
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
fn provenance(
    arguments: &Arguments,
    scene: Option<&PathBuf>,
    file: &ParamsFile,
    report: &Path,
) -> Provenance {
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
        scene: scene.map(|scene| scene.display().to_string()),
        params: arguments.params.display().to_string(),
        loss: loss.map(|(loss, end)| (loss.name().to_owned(), end)),
        set: arguments.set.words(),
        std_errors: errors.collect(),
    }
}
