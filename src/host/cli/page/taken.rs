//! The files that a page takes along: those that the scene is read from, under names that say nothing of where they were,
//! and the bakes of its effects.

use std::path::{Path, PathBuf};

use skinfit_view::archive::{self, pack};
use skinfit_view::opened::{Opened, Reading};

use crate::cli::Refusal;
use crate::cli::fitted_scene::with_files;
use crate::cli::opened::SceneOrRun;
use crate::files::{plain, recorded};
use crate::progress;

/// The folder of the scene in an archive.
const FOLDER: &str = "/scene";

/// An archive of the scene's file, all that it names, fitted constants, and bakes.
pub(super) fn taken(scene: &Path, of: &SceneOrRun, cache: &Path) -> Result<Vec<u8>, Refusal> {
    let read = read_from(scene, cache)?;
    let text = std::fs::read_to_string(scene)?;
    let home = plain(scene);
    let home = home.parent().unwrap_or(Path::new("/"));
    let mut places = Places(Vec::new());
    let text = with_files(&text, &mut |path| places.place(&plain(&home.join(path))));
    let text = text.map_err(|error| Refusal::new(format!("{}: {error}", scene.display())))?;
    let mut files = vec![(PathBuf::from(archive::SCENE), text.into_bytes())];
    let (cache, own) = (plain(cache), plain(scene));
    for path in read.into_iter().filter(|path| *path != own && path.is_file()) {
        let bake = path.parent() == Some(&cache) && path.extension().is_some_and(|ending| ending == "bake");
        let name = match path.file_name().filter(|_| bake) {
            Some(name) => Path::new(archive::BAKES).join(name),
            None => places.known(&path).ok_or_else(|| {
                Refusal::new(format!(
                    "{}: nothing in the scene's file leads to it. Put it beside a file of the scene's.",
                    path.display()
                ))
            })?,
        };
        files.push((name, std::fs::read(&path)?));
    }
    let (params, report) = of.fitted.as_ref().map(|run| (&run.params, &run.report)).unzip();
    for (name, file) in [(archive::FITTED, params), (archive::REPORT, report.and_then(Option::as_ref))] {
        if let Some(file) = file {
            files.push((PathBuf::from(name), std::fs::read(file)?));
        }
    }
    Ok(pack(files.iter().map(|(path, bytes)| (path.as_path(), bytes.as_slice()))))
}

/// What the scene is read from, with its effects as they are and without each of them: one that is switched off in the
/// page may ask for another bake.
fn read_from(scene: &Path, cache: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let reading =
        Reading { scene: scene.to_owned(), params: None, cache: Some(cache.to_owned()), effects: None };
    let (opened, mut files) = recorded(|| Opened::read(&reading));
    let effects = opened.map_err(Refusal::new)?.baked.scene.effects;
    let each: Vec<_> = effects.iter().filter(|effect| effect.info().within.is_none()).collect();
    let bar = progress::bar("effects", each.len() as u64);
    for effect in each {
        let reading = Reading { effects: Some(effects.without(effect)), ..reading.clone() };
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
    Ok(files)
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

    /// Where the archive has a file, which the scene names or a file beside it does.
    fn known(&self, path: &Path) -> Option<PathBuf> {
        let depth = |folder: &Path| folder.components().count();
        let within =
            self.0.iter().enumerate().filter_map(|(number, folder)| {
                Some((number, depth(folder), path.strip_prefix(folder).ok()?))
            });
        let (number, _, rest) = within.max_by_key(|(_, depth, _)| *depth)?;
        Some(Path::new(FOLDER).join(number.to_string()).join(rest))
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
        assert_eq!(beside.as_deref(), Some(Path::new("/scene/0/textures/skin.png")));
        assert_eq!(places.known(Path::new("/etc/hosts")), None);
    }
}
