//! A folder for Unity's `Assets`: what `skinfit bake` wrote there, and beside it a material with all that it names.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::asset::{Guid, Importer};
use super::maps::{Png, png};
use super::saved::{self, Slot};
use super::{shader, tuned};
use crate::export::material::{Bound, Parts, with_parts};
use crate::export::{ExportError, Provenance, Target, function};
use crate::files;
use crate::model::params::{Param, Params};
use crate::output::{self, OutputError};
use crate::scene::maps::Maps;
use crate::shader::{Facts, Resource};

/// A folder for Unity cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum UnityError {
    /// No material of this shader.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A path without a name that Unity could show.
    #[error(
        "{}: has no name that a material could have. Give a file such as Skin.mat.",
        path.display()
    )]
    Name {
        /// The path.
        path: PathBuf,
    },
    /// Two files of one name, as systems have it that take capitals for small letters.
    #[error(
        "{}: the material's folder has another file of that name. Name the shader that it includes otherwise, such as \
         Skin.hlsl.",
        path.display()
    )]
    Twice {
        /// The path.
        path: PathBuf,
    },
    /// A file beside an asset that Unity could not have written.
    #[error(
        "{}: has no line `guid:` with 32 hexadecimal digits. Restore it, as a project may refer to the asset by them, or \
         delete it.",
        path.display()
    )]
    Meta {
        /// The path.
        path: PathBuf,
    },
    /// A file that is there cannot be read.
    #[error("{}: cannot be read: {reason}. Make it readable, or delete it.", path.display())]
    Unreadable {
        /// The path.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A map that is no picture.
    #[error("{}: cannot be written: {reason}. Give the scene a smaller map.", path.display())]
    Picture {
        /// The path.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file system.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// What a material is made of.
#[derive(Clone, Copy, Debug)]
pub struct UnitySkin<'a> {
    /// The scene, as [`function`] takes it.
    pub facts: &'a Facts,
    /// The constants.
    pub params: &'a Params,
    /// Where they come from.
    pub from: &'a Provenance,
    /// The scene's maps.
    pub maps: &'a Maps,
}

/// The files of a material for Unity, to be written.
#[derive(Debug, Default)]
pub struct UnityFolder {
    folder: PathBuf,
    /// The material's name.
    name: String,
    /// What stands beside assets, which is written before them: Unity makes up its own for an asset that has none.
    metas: Vec<(PathBuf, Vec<u8>)>,
    /// The assets, the material last.
    assets: Vec<(PathBuf, Vec<u8>)>,
    warnings: Vec<String>,
}

impl UnityFolder {
    /// The files of the material at that path, and of its shader, which includes another by the name `include`. If that is
    /// no path, it is one of these files. What has a `.meta` already keeps it, and is referred to by its GUID.
    ///
    /// # Errors
    /// [`UnityError`]; nothing is written yet.
    pub fn new(material: &Path, include: &str, skin: UnitySkin<'_>) -> Result<Self, UnityError> {
        with_parts(skin.facts, skin.params, include, |parts| Self::of(material, parts, skin))
    }

    fn of(material: &Path, parts: &Parts<'_>, skin: UnitySkin<'_>) -> Result<Self, UnityError> {
        let names = material.file_stem().zip(material.file_name());
        let names = names.and_then(|(name, file)| name.to_str().zip(file.to_str()));
        let names = names.filter(|(name, _)| !name.trim().is_empty() && !name.contains(char::is_control));
        let Some((name, file)) = names else { return Err(UnityError::Name { path: material.to_owned() }) };
        let folder = material.parent().unwrap_or(Path::new(""));
        let mut all = Self { folder: folder.to_owned(), name: name.to_owned(), ..Self::default() };
        let slots = parts.bound().map(|bound| all.texture(&bound, parts, skin.maps));
        let slots = slots.collect::<Result<Vec<_>, _>>()?;
        if !parts.shader.contains(['/', '\\']) {
            let text = function(Target::Unity, skin.facts, skin.params, skin.from)?;
            all.assets.push((folder.join(parts.shader), text.into_bytes()));
        }
        let of_shader = format!("{name}.shader");
        let guid = all.identified(&of_shader, Importer::Shader)?;
        all.assets.push((folder.join(of_shader), shader::text(parts, name)?.into_bytes()));
        all.identified(file, Importer::Material)?;
        let text = saved::text(name, &guid, &slots, &tuned(parts));
        all.assets.push((material.to_owned(), text.into_bytes()));
        all.refuse_clashes()?;
        Ok(all)
    }

    /// What fills a place of the material. A map is a picture among the files, a cube is there already.
    fn texture(&mut self, bound: &Bound, parts: &Parts<'_>, maps: &Maps) -> Result<Slot, UnityError> {
        let Bound { resource, name, cube, color, .. } = bound;
        let (file, importer) = if *cube {
            self.cube(*resource, bound.short(), parts.params)
        } else {
            let file = format!("{}_{}.png", self.name, bound.short());
            self.map(*resource, &file, maps)?;
            (file, Importer::Map { color: *color, filter: parts.plan.facts.maps.filter })
        };
        let guid = self.identified(&file, importer)?;
        Ok(Slot { name: name.clone(), cube: *cube, guid })
    }

    /// The file of a cube, as `skinfit bake` names it: DDS, which keeps alpha, before EXR. Where it is not there, the first that
    /// would do.
    fn cube(&mut self, resource: Resource, short: &str, params: &Params) -> (String, Importer) {
        let mut names = vec![short.to_owned()];
        if resource == Resource::SpecularCube {
            // Where one lobe alone was baked.
            names.push(format!("lobe_{}", params.scalar(Param::SpecularLobe)));
        }
        for (ending, importer) in [("dds", Importer::Cube), ("exr", Importer::Faces)] {
            let mut files = names.iter().map(|name| format!("{name}.{ending}"));
            if let Some(file) = files.find(|file| self.is_there(file)) {
                return (file, importer);
            }
        }
        let file = format!("{short}.dds");
        self.warn_missing(&file, "`skinfit bake --cubes dds` writes it there");
        (file, Importer::Cube)
    }

    /// The picture of a map.
    fn map(&mut self, resource: Resource, file: &str, maps: &Maps) -> Result<(), UnityError> {
        let path = self.folder.join(file);
        match png(resource, maps) {
            Some(Ok(Png { bytes, clamped })) => {
                if clamped > 0 {
                    let words = "numbers lie beyond what a picture holds, and are 0 or 1 in it";
                    self.warnings.push(format!("{}: {clamped} {words}", path.display()));
                }
                self.assets.push((path, bytes));
            }
            Some(Err(reason)) => return Err(UnityError::Picture { path, reason }),
            None if !self.is_there(file) => self.warn_missing(file, "the scene has no such map"),
            None => {}
        }
        Ok(())
    }

    fn is_there(&self, file: &str) -> bool {
        files::length(&self.folder.join(file)).is_ok_and(|length| length.is_some())
    }

    fn warn_missing(&mut self, file: &str, remedy: &str) {
        let path = self.folder.join(file);
        let words = format!("is not there, and Unity forgets a .meta without its file: {remedy}");
        self.warnings.push(format!("{}: {words}", path.display()));
    }

    /// Who a file is: as its `.meta` says, else as one that is written will say.
    fn identified(&mut self, file: &str, importer: Importer) -> Result<Guid, UnityError> {
        let path = self.folder.join(format!("{file}.meta"));
        let kept = match files::read_to_string(&path) {
            Ok(kept) => kept,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let guid = Guid::of(&self.name, file);
                self.metas.push((path, importer.meta(&guid).into_bytes()));
                return Ok(guid);
            }
            Err(error) => return Err(UnityError::Unreadable { path, reason: error.to_string() }),
        };
        let Some(guid) = Guid::read(&kept) else { return Err(UnityError::Meta { path }) };
        let lacks = |line: &&&str| !kept.lines().any(|other| other.trim() == **line);
        let lacking: Vec<&str> = importer.needed().iter().filter(lacks).copied().collect();
        if !lacking.is_empty() {
            let (path, lacking) = (path.display(), lacking.join(", "));
            let words = "set it in Unity, or delete the file";
            self.warnings.push(format!("{path}: is kept, but the shader wants {lacking}: {words}"));
        }
        Ok(guid)
    }

    fn refuse_clashes(&self) -> Result<(), UnityError> {
        let mut known = BTreeSet::new();
        let again = |path: &&Path| !known.insert(path.to_string_lossy().to_lowercase());
        match self.files().find(again) {
            Some(path) => Err(UnityError::Twice { path: path.to_owned() }),
            None => Ok(()),
        }
    }

    /// What is written, in that order; the material comes last.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.metas.iter().chain(&self.assets).map(|(path, _)| path.as_path())
    }

    /// What is not as the material wants it.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Write the files.
    ///
    /// # Errors
    /// When one cannot be written. No file is half written, and the material is there when all others are.
    pub fn write(&self) -> Result<(), OutputError> {
        if let Some(path) = self.files().find(|path| path.is_dir()) {
            return Err(OutputError::new(path, "a folder stands there"));
        }
        self.metas.iter().chain(&self.assets).try_for_each(|(path, bytes)| output::write(path, bytes))
    }
}
