//! How a command finds its scene, its cache and its effects.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::{Refusal, unfinished};
use crate::bake::cache;
use crate::demo;
use crate::model::effects::{Effect, Effects};
use crate::scene::suggestion;

/// What the built-in scene is called in reports.
const BUILT_IN: &str = "the built-in scene";

/// Which scene, and where bakes are kept.
#[derive(clap::Args)]
pub(super) struct SceneArguments {
    /// The scene file; the built-in scene when left out.
    pub scene: Option<PathBuf>,
    /// Others, which these commands do not take: so that it can be said.
    #[arg(hide = true)]
    more: Vec<PathBuf>,
    #[command(flatten)]
    bakes: BakeArguments,
}

/// Which scenes, of a command that takes several, and where bakes are kept.
#[derive(clap::Args)]
pub(super) struct ScenesArguments {
    /// The scene file, or several, as of one skin in different lights; the built-in scene when left out.
    #[arg(value_name = "SCENE")]
    pub named: Vec<PathBuf>,
    #[command(flatten)]
    pub bakes: BakeArguments,
}

/// What is not fitted, and scored all the same.
#[derive(clap::Args)]
pub(super) struct HoldOutArguments {
    /// Leave a view out of what is fitted; it is scored all the same. Of several scenes: a view in every one, a whole scene
    /// by its name, or SCENE/VIEW. May be given several times.
    #[arg(long, value_name = "NAME")]
    pub hold_out: Vec<String>,
}

/// Where bakes are kept, and on how many threads they and all else are computed.
#[derive(clap::Args)]
pub(super) struct BakeArguments {
    /// Folder that keeps bakes between runs [default: $SKINFIT_CACHE, or the user's cache folder].
    #[arg(long, value_name = "DIR", help_heading = "Baking")]
    cache: Option<PathBuf>,
    /// Bake anew, and keep nothing.
    #[arg(long, conflicts_with = "cache", help_heading = "Baking")]
    no_cache: bool,
    /// Threads to use [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl SceneArguments {
    /// The scene's file, and what must stay alive for as long as it is read: without a cache the
    /// built-in scene lives in a folder of its own that goes with it.
    pub(super) fn path(&self) -> Result<(PathBuf, Option<TempDir>), Refusal> {
        if self.scene.is_some() || !self.bakes.no_cache {
            return Ok((self.kept_path(Path::new(""))?, None));
        }
        let scratch = unfinished::scratch()?;
        Ok((self.kept_path(scratch.path())?, Some(scratch)))
    }

    /// As [`BakeArguments::kept_path`], of the scene that is named.
    pub(super) fn kept_path(&self, folder: &Path) -> Result<PathBuf, Refusal> {
        if let Some(other) = self.more.first() {
            return Err(Refusal::new(format!(
                "{}: this command takes one scene; `fit`, `ablate`, `tradeoff` and `stability` alone take several. Name one.",
                other.display()
            )));
        }
        self.bakes.kept_path(self.scene.as_deref(), folder)
    }

    /// What the scene at `path` is called in reports.
    pub(super) fn name(&self, path: &Path) -> String {
        self.scene.as_ref().map_or_else(|| BUILT_IN.to_owned(), |_| path.display().to_string())
    }

    /// Where bakes are kept; `None` with `--no-cache`.
    pub(super) fn cache(&self) -> Option<PathBuf> {
        self.bakes.cache()
    }
}

impl ScenesArguments {
    /// The scenes' files, and what must stay alive for as long as they are read, as of [`SceneArguments::path`].
    pub(super) fn paths(&self) -> Result<(Vec<PathBuf>, Option<TempDir>), Refusal> {
        if !self.named.is_empty() || self.bakes.cache().is_some() {
            return Ok((self.kept_paths(Path::new(""))?, None));
        }
        let scratch = unfinished::scratch()?;
        Ok((self.kept_paths(scratch.path())?, Some(scratch)))
    }

    /// As [`BakeArguments::kept_path`], of each scene that is named.
    pub(super) fn kept_paths(&self, folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
        self.bakes.kept_paths(&self.named, folder)
    }

    /// What the scenes are called in reports: their files.
    pub(super) fn words(&self) -> String {
        match self.named.as_slice() {
            [] => BUILT_IN.to_owned(),
            scenes => scenes.iter().map(|scene| scene.display().to_string()).collect::<Vec<_>>().join(", "),
        }
    }
}

impl BakeArguments {
    /// The scene's file; the built-in scene is written first if it is not there yet, into the cache
    /// or, when there is none, into `folder`.
    pub(super) fn kept_path(&self, scene: Option<&Path>, folder: &Path) -> Result<PathBuf, Refusal> {
        self.set_threads();
        match scene {
            Some(scene) => Ok(scene.to_owned()),
            None => {
                let cache = self.cache();
                Ok(demo::kept_scene(cache.as_deref().unwrap_or(folder), cache.as_deref())?)
            }
        }
    }

    /// The same of several scenes; of none the built-in one.
    pub(super) fn kept_paths(&self, scenes: &[PathBuf], folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
        match scenes {
            [] => Ok(vec![self.kept_path(None, folder)?]),
            scenes => scenes.iter().map(|scene| self.kept_path(Some(scene), folder)).collect(),
        }
    }

    /// Where bakes are kept; `None` with `--no-cache`.
    pub(super) fn cache(&self) -> Option<PathBuf> {
        if self.no_cache { None } else { Some(self.cache.clone().unwrap_or_else(cache::default_folder)) }
    }

    /// The same, as words of a command line that is run from elsewhere.
    pub(super) fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.no_cache {
            words.push("--no-cache".to_owned());
        }
        if let Some(cache) = &self.cache {
            let cache = std::path::absolute(cache).unwrap_or_else(|_| cache.clone());
            words.extend(["--cache".to_owned(), cache.display().to_string()]);
        }
        if let Some(threads) = self.threads {
            words.extend(["--threads".to_owned(), threads.to_string()]);
        }
        words
    }

    fn set_threads(&self) {
        if let Some(threads) = self.threads {
            // It fails only when the pool is there already, from an earlier call in this process.
            let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global();
        }
    }
}

/// `diffuse,rim,...` as a set of effects.
///
/// # Errors
/// A paragraph on the first name that is none, or is there twice.
pub fn parse_effects(list: &str) -> Result<Effects, String> {
    let known: Vec<&str> = Effect::offered().map(Effect::name).collect();
    let parse = |name: &str| {
        Effect::from_name(name)
            .ok_or_else(|| format!("unknown effect `{name}`. {}.", suggestion(name, &known)))
    };
    let names = list.split(',').map(str::trim).filter(|name| !name.is_empty());
    let mut effects = Effects::default();
    for name in names {
        let effect = parse(name)?;
        if effects.has(effect) {
            return Err(format!("the effect {name} is listed twice. Take one of them out."));
        }
        effects = effects.with(effect);
    }
    if effects == Effects::default() {
        return Err(format!("it names no effect. {}.", suggestion("", &known)));
    }
    if let Some((effect, whole)) = effects.iter().find_map(|effect| Some((effect, effect.lacks(effects)?))) {
        let (effect, whole) = (effect.name(), whole.name());
        return Err(format!(
            "the effect {effect} is part of {whole}, which is not listed. Leave it out, or list both."
        ));
    }
    Ok(effects)
}
