//! The files that a page takes along: those that the scene is read from, under names that say nothing of where they were,
//! and the bakes of its effects.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;
use skinfit_view::Run;
use skinfit_view::archive::{self, pack};
use skinfit_view::host::own_name;
use skinfit_view::opened::{Opened, Reading};
use skinfit_view::skin::{Skin, params_file};

use crate::cli::Refusal;
use crate::cli::fitted_scene::with_files;
use crate::files::{plain, recorded};
use crate::fit::params_file::Origin;
use crate::model::effects::Effect;
use crate::prepare::view_of;
use crate::progress;

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
        files.push((Path::new(archive::SCENES).join(scene_file(scenes, opened)), text.into_bytes()));
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
            files.push((PathBuf::from(report), numbers(numbers_of, &opened)?));
        }
    }
    Ok(pack(files.iter().map(|(path, bytes)| (path.as_path(), bytes.as_slice()))))
}

/// The name of a scene's file in the page: of one it says nothing of where it was.
fn scene_file(scenes: &[PathBuf], opened: &Opened) -> String {
    match scenes.len() {
        1 => "scene.toml".to_owned(),
        _ => format!("{}.toml", opened.name),
    }
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
    let file = params_file(skin.scenes(), &opened.iter().collect::<Vec<_>>());
    let origin = Origin { scene: Path::new("scene.toml"), outcome: None, set: &[], numbers: &[] };
    Ok(file.map(|file| file.to_toml(origin).into_bytes()).unwrap_or_default())
}

/// What the page shows of a report, which also says where it was made, and by which command.
fn numbers(report: &Path, opened: &[Opened]) -> Result<Vec<u8>, Refusal> {
    let damaged = |error: serde_json::Error| {
        Refusal::new(format!("{}: this is no report of a fit: {error}. Fit again.", report.display()))
    };
    let mut numbers: BTreeMap<String, Value> = serde_json::from_slice(&read(report)?).map_err(damaged)?;
    numbers.retain(|key, _| NUMBERS.contains(&key.as_str()));
    if let [alone] = opened {
        of_scene(&mut numbers, &view_of(&alone.name, ""));
    }
    Ok(serde_json::to_vec(&numbers)?)
}

/// Of a fit of several scenes what is of that whose names begin so: a scene by itself has another name in the page.
fn of_scene(numbers: &mut BTreeMap<String, Value>, before: &str) {
    let Some(views) = numbers.get_mut("views").and_then(Value::as_object_mut) else { return };
    if !views.keys().any(|name| name.starts_with(before)) {
        return;
    }
    let all = std::mem::take(views);
    views.extend(
        all.into_iter().filter_map(|(name, view)| Some((name.strip_prefix(before)?.to_owned(), view))),
    );
    for unknown in numbers.get_mut("unknowns").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(Value::String(name)) = unknown.get_mut("name") {
            *name = own_name(name, before);
        }
    }
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
