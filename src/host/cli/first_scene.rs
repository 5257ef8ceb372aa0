//! A first scene file for a mesh, and the pictures within the mesh file that it names as maps.

use std::path::{Path, PathBuf};

use super::Refusal;
use crate::output;
use crate::scene::draft::Draft;
use crate::scene::images;
use crate::scene::import::ImportedView;
use crate::scene::inspect::{FilePicture, MeshContents, Picture};
use crate::scene::view::Camera;

/// What a first scene file is made with.
pub(super) struct FirstScene<'a> {
    /// A panorama.
    pub environment: Option<&'a Path>,
    /// Cameras, each with the file of its target; without any, cameras are made.
    pub views: Vec<(ImportedView, Option<PathBuf>)>,
    /// A camera whose pose is not known.
    pub calibrated: Option<Camera>,
    /// Pixels along a side of the images of cameras that are made.
    pub size: u32,
}

impl FirstScene<'_> {
    /// Write it; nothing that is there is written over.
    pub(super) fn write(self, contents: &MeshContents, scene: &Path) -> Result<(), Refusal> {
        free(scene)?;
        self.environment.map_or(Ok(()), check_panorama)?;
        let folder = match scene.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let material = contents.largest_material();
        let pictures = material.map(|material| [("color", &material.color), ("normal", &material.normal)]);
        let (mut maps, mut within) = (Vec::new(), Vec::new());
        for (key, picture) in pictures.into_iter().flatten() {
            match picture {
                // What a scene names is looked up by the first set of texture coordinates as it stands.
                Some(Picture { file: FilePicture::Beside(path), uv_set: 0, moved: false, .. }) => {
                    let beside = contents.file.parent().unwrap_or(Path::new("")).join(path);
                    maps.push((key, named_from(folder, &beside)));
                }
                Some(Picture {
                    file: FilePicture::Within { index, ending },
                    uv_set: 0,
                    moved: false,
                    ..
                }) => {
                    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
                    let name = format!("{stem}_{key}.{ending}");
                    free(&folder.join(&name))?;
                    within.push((folder.join(&name), contents.picture_bytes(*index)?));
                    maps.push((key, name));
                }
                _ => {}
            }
        }
        let views = self.views.into_iter();
        let draft = Draft {
            contents,
            mesh: named_from(folder, &contents.file),
            environment: self.environment.map(|file| named_from(folder, file)),
            maps,
            views: views.map(|(view, target)| (view, target.map(|file| named_from(folder, &file)))).collect(),
            calibrated: self.calibrated,
            size: self.size,
        };
        for (path, bytes) in within {
            output::write(&path, &bytes)?;
        }
        output::write(scene, draft.text().as_bytes())?;
        Ok(())
    }
}

/// Refuse what no scene takes for a panorama: that is read as a scene would read it, before anything is written.
fn check_panorama(file: &Path) -> Result<(), Refusal> {
    if !file.is_file() {
        return Err(Refusal::new(format!("{}: is not there. Name a panorama.", file.display())));
    }
    // What is doubtful about it is told whenever the scene is read.
    images::color_map(file, &mut Vec::new())?;
    Ok(())
}

/// Refuse to write over a file.
fn free(path: &Path) -> Result<(), Refusal> {
    if path.exists() {
        let path = path.display();
        return Err(Refusal::new(format!(
            "{path}: is there already and may hold your changes. Name another file, or remove it first."
        )));
    }
    Ok(())
}

/// How a scene file in `folder` names a file: from there where it lies below, as a whole path otherwise.
fn named_from(folder: &Path, file: &Path) -> String {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let file = whole(file);
    let named = file.strip_prefix(whole(folder)).map_or(file.clone(), Path::to_owned);
    // TOML's strings and all systems take the slash.
    if cfg!(windows) {
        named.to_string_lossy().replace('\\', "/")
    } else {
        named.to_string_lossy().into_owned()
    }
}
