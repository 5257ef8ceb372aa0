//! The files that a page takes along: those that the scene is read from, under names that say nothing of where they were,
//! and the bakes of its effects.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;
use skinfit_view::Run;
use skinfit_view::archive::{self, pack};
use skinfit_view::opened::{Opened, Reading};
use skinfit_view::skin::{Skin, params_text};
use skinfit_view::values::Values;

use crate::cli::Refusal;
use crate::cli::fitted_scene::with_files;
use crate::files::{plain, recorded};
use crate::fit::params_file::ParamsFile;
use crate::model::effects::{Effect, Effects};
use crate::progress;
use crate::scene::names::names_of;

/// What the page shows of a report.
const NUMBERS: [&str; 8] =
    ["loss", "views", "iterations", "evaluations", "seconds", "ending", "unknowns", "history"];

/// An archive of the scenes' files, all that they name, bakes, and what the run that is shown and the one that is compared
/// have left.
pub(super) fn taken(scenes: &[PathBuf], runs: [Option<&Run>; 2], cache: &Path) -> Result<Vec<u8>, Refusal> {
    let (opened, from) = read_from(scenes, cache)?;
    let (mut places, mut files) = (Places(Vec::new()), Vec::new());
    for (path, opened) in scenes.iter().zip(&opened) {
        let home = plain(path);
        let home = home.parent().unwrap_or(Path::new("/"));
        let text = String::from_utf8(read(path)?)?;
        let text = with_files(&text, &mut |path| places.place(&plain(&home.join(path))));
        let text = text.map_err(|error| Refusal::new(format!("{}: {error}", path.display())))?;
        files.push((Path::new(archive::SCENES).join(scene_file(scenes, opened, runs)), text.into_bytes()));
    }
    let (cache, own): (_, Vec<PathBuf>) = (plain(cache), scenes.iter().map(|path| plain(path)).collect());
    for path in from.into_iter().filter(|path| !own.contains(path) && path.is_file()) {
        let bake = path.parent() == Some(&cache) && path.extension().is_some_and(|ending| ending == "bake");
        let names = match path.file_name().filter(|_| bake) {
            Some(name) => vec![Path::new(archive::BAKES).join(name)],
            None => places.known(&path),
        };
        if names.is_empty() {
            return Err(Refusal::new(format!(
                "{}: nothing in the scene's file leads to it. Put it beside a file of the scene's.",
                path.display()
            )));
        }
        let bytes = read(&path)?;
        files.extend(names.into_iter().map(|name| (name, bytes.clone())));
    }
    let names = [(archive::FITTED, archive::REPORT), (archive::OTHER, archive::OTHER_REPORT)];
    for (run, (params, report)) in runs.into_iter().zip(names) {
        let Some(run) = run else { continue };
        files.push((PathBuf::from(params), constants(run, &opened)?));
        if let Some(numbers_of) = &run.report {
            files.push((PathBuf::from(report), numbers(numbers_of)?));
        }
    }
    Ok(pack(files.iter().map(|(path, bytes)| (path.as_path(), bytes.as_slice()))))
}

/// The name of a scene's file in the page: of one it says nothing of where it was, but where runs of several know it by
/// its name.
fn scene_file(scenes: &[PathBuf], opened: &Opened, runs: [Option<&Run>; 2]) -> String {
    let scene = &opened.baked.scene;
    let known = |run: &Run| {
        let file = ParamsFile::read(&run.params, scene.form, &scene.params).ok()?;
        names_of(&scene.path).into_iter().find(|name| file.scenes.iter().any(|own| own.name == *name))
    };
    let name = match scenes.len() {
        1 => runs.into_iter().flatten().find_map(known).unwrap_or_else(|| "scene".to_owned()),
        _ => opened.name.clone(),
    };
    format!("{name}.toml")
}

/// What the scenes are read from, with their effects as they are and without each of them: one that is switched off in the
/// page may ask for another bake.
fn read_from(scenes: &[PathBuf], cache: &Path) -> Result<(Vec<Opened>, Vec<PathBuf>), Refusal> {
    let reading = |scene: &PathBuf| Reading {
        scene: scene.clone(),
        cache: Some(cache.to_owned()),
        ..Reading::default()
    };
    let readings: Vec<Reading> = scenes.iter().map(reading).collect();
    let (opened, mut files) = recorded(|| Opened::read_all(&readings));
    let first = opened.map_err(Refusal::new)?;
    let skin = Skin::of(&first);
    let whole = |effect: &Effect| effect.info().within.is_none();
    let each: Vec<(usize, Effect)> = (skin.scenes().iter().enumerate())
        .flat_map(|(scene, values)| values.effects.iter().filter(whole).map(move |effect| (scene, effect)))
        // The skin's are switched in all scenes at once.
        .filter(|(scene, effect)| *scene == 0 || effect.is_of_scene())
        .collect();
    let bar = progress::bar("effects", each.len() as u64);
    for (scene, effect) in each {
        let mut without = skin.clone();
        without.change(scene, |values| values.set_effect(effect, false));
        let readings = readings.iter().zip(without.scenes());
        let readings = readings
            .map(|(reading, values)| Reading { effects: Some(values.effects), ..reading.clone() })
            .collect::<Vec<_>>();
        let (opened, read) = recorded(|| Opened::read_all(&readings));
        // A scene that cannot be read without it has nothing to be baked then.
        if opened.is_ok() {
            files.extend(read);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    files.sort();
    files.dedup();
    Ok((first, files))
}

/// Fitted constants as the page reads them: those of its scenes, and no word of where they come from.
fn constants(run: &Run, opened: &[Opened]) -> Result<Vec<u8>, Refusal> {
    let mut skin = Skin::of(opened);
    let points: Result<Vec<_>, _> = opened.iter().map(|opened| opened.point_in(&run.params, None)).collect();
    skin.set_points(&points?);
    // Effects that the page's scenes have off may be switched on there, with the run's constants.
    let scene = opened.first().map(|opened| &opened.baked.scene);
    let file = scene.map(|scene| ParamsFile::read(&run.params, scene.form, &scene.params)).transpose()?;
    let fitted = file.and_then(|file| file.effects).unwrap_or_default();
    let effects = |values: &mut Values| {
        values.effects = fitted.iter().fold(values.effects, Effects::with);
    };
    let mut values = skin.scenes().to_vec();
    values.iter_mut().for_each(effects);
    let scenes: Vec<&Opened> = opened.iter().collect();
    Ok(params_text(&values, &scenes, "scene.toml", true).map(String::into_bytes).unwrap_or_default())
}

/// What the page shows of a report, which also says where it was made, and by which command.
fn numbers(report: &Path) -> Result<Vec<u8>, Refusal> {
    let damaged = |error: serde_json::Error| {
        Refusal::new(format!("{}: this is no report of a fit: {error}. Fit again.", report.display()))
    };
    let mut numbers: BTreeMap<String, Value> = serde_json::from_slice(&read(report)?).map_err(damaged)?;
    numbers.retain(|key, _| NUMBERS.contains(&key.as_str()));
    Ok(serde_json::to_vec(&numbers)?)
}

fn read(path: &Path) -> Result<Vec<u8>, Refusal> {
    std::fs::read(path).map_err(|error| {
        Refusal::new(format!(
            "{}: cannot be read: {error}. Check the path and its permissions.",
            path.display()
        ))
    })
}

/// Folders of the scene's files, each under its number.
struct Places(Vec<PathBuf>);

impl Places {
    /// The path of a file that the scene names, from the scene's own place.
    fn place(&mut self, path: &Path) -> String {
        let (folder, name) = (path.parent().unwrap_or(Path::new("/")), path.file_name().unwrap_or_default());
        let number = self.0.iter().position(|other| other == folder).unwrap_or_else(|| {
            self.0.push(folder.to_owned());
            self.0.len() - 1
        });
        format!("{number}/{}", name.to_string_lossy())
    }

    /// Where the archive has a file that is, or lies below, one that the scene names: as seen from each of these.
    fn known(&self, path: &Path) -> Vec<PathBuf> {
        let within = self.0.iter().enumerate().filter_map(|(number, folder)| {
            let rest = path.strip_prefix(folder).ok()?;
            Some(Path::new(archive::SCENES).join(number.to_string()).join(rest))
        });
        within.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_names_that_say_nothing_of_where_they_were() {
        let mut places = Places(Vec::new());
        assert_eq!(places.place(Path::new("/home/a/head/head.gltf")), "0/head.gltf");
        assert_eq!(places.place(Path::new("/home/a/env/sky.exr")), "1/sky.exr");
        assert_eq!(places.place(Path::new("/home/a/head/ao.png")), "0/ao.png");
        // What a mesh names stands beside it.
        let beside = places.known(Path::new("/home/a/head/textures/skin.png"));
        assert_eq!(beside, [Path::new("/scene/0/textures/skin.png")]);
        // What is named by two is where either looks for it.
        assert_eq!(places.place(Path::new("/home/a/head/textures/pores.png")), "2/pores.png");
        let both = places.known(Path::new("/home/a/head/textures/skin.png"));
        assert_eq!(both, [Path::new("/scene/0/textures/skin.png"), Path::new("/scene/2/skin.png")]);
        assert!(places.known(Path::new("/etc/hosts")).is_empty());
    }
}
