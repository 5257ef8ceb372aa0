//! Several scenes, each with its name, read as one skin.

use std::path::{Path, PathBuf};

use super::marked::{HoldOutError, Place, marked};
use super::{Loaded, PrepareError, PrepareOptions, share_skin};
use crate::scene::names::names_apart;

/// A scene that was read, and what it is called among others.
#[derive(Clone, Debug)]
pub struct NamedScene {
    /// Its name.
    pub name: String,
    /// The scene.
    pub loaded: Loaded,
}

/// Read the scenes at `paths`, `change` each of them, and have them share one skin.
///
/// # Errors
/// When a scene cannot be read or is there twice, or what is one for all scenes differs.
pub fn read_one_skin(
    paths: &[PathBuf],
    options: &PrepareOptions,
    change: impl Fn(&mut Loaded),
) -> Result<Vec<NamedScene>, PrepareError> {
    let scenes: Vec<_> = paths.iter().map(|path| (path.clone(), options.clone())).collect();
    read_one_skin_each(&scenes, |_, loaded| change(loaded))
}

/// The same of scenes that are each read in a way of its own; `change` is told the number of each.
///
/// # Errors
/// As of [`read_one_skin`].
pub fn read_one_skin_each(
    scenes: &[(PathBuf, PrepareOptions)],
    change: impl Fn(usize, &mut Loaded),
) -> Result<Vec<NamedScene>, PrepareError> {
    let paths: Vec<PathBuf> = scenes.iter().map(|(path, _)| path.clone()).collect();
    let names = scene_names(&paths)?;
    let one = |(number, (path, options)): (usize, &(PathBuf, PrepareOptions))| {
        let mut loaded = Loaded::read(path, options)?;
        change(number, &mut loaded);
        Ok::<_, PrepareError>(loaded)
    };
    let mut loaded = scenes.iter().enumerate().map(one).collect::<Result<Vec<_>, _>>()?;
    share_skin(&mut loaded)?;
    Ok(names.into_iter().zip(loaded).map(|(name, loaded)| NamedScene { name, loaded }).collect())
}

/// A name for each scene, of which no two are the same file.
///
/// # Errors
/// When two are, or are called the same.
pub fn scene_names(paths: &[PathBuf]) -> Result<Vec<String>, PrepareError> {
    let whole = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
    for (i, path) in paths.iter().enumerate() {
        if paths[..i].iter().any(|earlier| whole(earlier) == whole(path)) {
            return Err(PrepareError::NamedTwice { scene: path.display().to_string() });
        }
    }
    let places: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    names_apart(&places).ok_or_else(|| {
        let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        PrepareError::CalledTheSame { scenes: paths.join(", ") }
    })
}

impl NamedScene {
    /// For each scene which of its views `names` hold out. A name is that of a view (in every scene that has it), that of a
    /// scene (every view of it), or both: `SCENE/VIEW`.
    ///
    /// # Errors
    /// When a name is that of no view with a target, or nothing is left to fit.
    pub fn marked(scenes: &[Self], names: &[String]) -> Result<Vec<Vec<bool>>, HoldOutError> {
        let places: Vec<Place<'_>> = (scenes.iter())
            .map(|Self { name, loaded: Loaded { scene, .. } }| {
                (name.as_str(), scene.path.as_path(), scene.views.as_slice())
            })
            .collect();
        marked(names, &places)
    }
}
