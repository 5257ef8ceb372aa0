//! The files that a page takes along: those that the scene is read from, under names that say nothing of where they were,
//! and the bakes of its effects.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;
use skinfit_view::Run;
use skinfit_view::archive::{self, pack};
use skinfit_view::opened::{Opened, Reading};
use skinfit_view::values::Values;

use crate::cli::Refusal;
use crate::cli::fitted_scene::with_files;
use crate::cli::opened::SceneOrRun;
use crate::files::{plain, recorded};
use crate::fit::params_file::{Origin, ParamsFile};
use crate::progress;

/// The folder of the scene in an archive.
const FOLDER: &str = "/scene";

/// What the page shows of a report.
const NUMBERS: [&str; 8] =
    ["loss", "views", "iterations", "evaluations", "seconds", "ending", "unknowns", "history"];

/// An archive of the scene's file, all that it names, fitted constants, and bakes.
pub(super) fn taken(scene: &Path, of: &SceneOrRun, cache: &Path) -> Result<Vec<u8>, Refusal> {
    let (opened, from) = read_from(scene, cache)?;
    let text = String::from_utf8(read(scene)?)?;
    let home = plain(scene);
    let home = home.parent().unwrap_or(Path::new("/"));
    let mut places = Places(Vec::new());
    let text = with_files(&text, &mut |path| places.place(&plain(&home.join(path))));
    let text = text.map_err(|error| Refusal::new(format!("{}: {error}", scene.display())))?;
    let mut files = vec![(PathBuf::from(archive::SCENE), text.into_bytes())];
    let (cache, own) = (plain(cache), plain(scene));
    for path in from.into_iter().filter(|path| *path != own && path.is_file()) {
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
    if let Some(run) = &of.fitted {
        files.push((PathBuf::from(archive::FITTED), constants(run, &opened)?));
        if let Some(report) = &run.report {
            files.push((PathBuf::from(archive::REPORT), numbers(report)?));
        }
    }
    Ok(pack(files.iter().map(|(path, bytes)| (path.as_path(), bytes.as_slice()))))
}

/// What the scene is read from, with its effects as they are and without each of them: one that is switched off in the
/// page may ask for another bake.
fn read_from(scene: &Path, cache: &Path) -> Result<(Opened, Vec<PathBuf>), Refusal> {
    let reading =
        Reading { scene: scene.to_owned(), params: None, cache: Some(cache.to_owned()), effects: None };
    let (opened, mut files) = recorded(|| Opened::read(&reading));
    let first = opened.map_err(Refusal::new)?;
    let effects = first.baked.scene.effects;
    let values = Values::of(&first.baked);
    let each: Vec<_> = effects.iter().filter(|effect| effect.info().within.is_none()).collect();
    let bar = progress::bar("effects", each.len() as u64);
    for effect in each {
        let mut without = values.clone();
        without.set_effect(effect, false);
        let reading = Reading { effects: Some(without.effects), ..reading.clone() };
        let (opened, read) = recorded(|| Opened::read(&reading));
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

/// Fitted constants as the page reads them: those of this scene, and no word of where they come from.
fn constants(run: &Run, opened: &Opened) -> Result<Vec<u8>, Refusal> {
    let scene = &opened.baked.scene;
    let file = ParamsFile::read(&run.params, scene.form, &scene.params)?.of_scene(&scene.path);
    let origin = Origin { scene: Path::new("scene.toml"), outcome: None, set: &[], numbers: &[] };
    Ok(file.to_toml(origin).into_bytes())
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
            Some(Path::new(FOLDER).join(number.to_string()).join(rest))
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
