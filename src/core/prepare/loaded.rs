//! A scene that was read, before anything is made of it.

use std::path::{Path, PathBuf};
use web_time::Instant;

use super::{Baked, ClipOcclusion, PrepareError, PrepareOptions, StageSeconds};
use crate::bake::rays::any_can_be_hit;
use crate::fit::params_file::ParamsFile;
use crate::model::effects::Effects;
use crate::model::gain::Gain;
use crate::model::params::{Channels, Column, Param, Params};
use crate::scene::load::LoadOptions;
use crate::scene::{Assignment, Scene};

/// A scene at the constants that it starts from. Whoever wants another one changes it here: what is baked and sampled
/// follows from it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; its params are those to start from.
    pub scene: Scene,
    /// The effects that the parameter file's values were fitted with, where it says.
    pub fitted: Option<Effects>,
    /// A factor on each view's image.
    pub gains: Vec<Gain>,
    /// Seconds by stage so far.
    pub seconds: StageSeconds,
    /// What the user should know.
    pub warnings: Vec<String>,
    pub(super) asked: Asked,
}

/// What is asked of the bakes.
#[derive(Clone, Debug)]
pub(super) struct Asked {
    /// Whether the scene will be fitted: then the lobe may become any that it is free to.
    pub(super) fit: bool,
    /// Whether occlusion is its caller's to bake, frame by frame.
    pub(super) light_alone: bool,
    pub(super) cache: Option<PathBuf>,
}

impl Loaded {
    /// Read the scene at `path`.
    ///
    /// # Errors
    /// When a file cannot be read or is not sound, or there is no such view.
    pub fn read(path: &Path, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let start = Instant::now();
        let load = LoadOptions {
            effects: options.effects,
            targets: options.fit,
            time: options.time,
            clip: options.clip == Some(ClipOcclusion::Targets),
            background: options.background,
        };
        let (mut scene, warnings) = Scene::load(path, &load)?;
        // An animation may begin with nothing and go on with something.
        if options.time.is_none() {
            check_area(&scene)?;
        }
        let known: Vec<String> = scene.views.iter().map(|view| view.name.clone()).collect();
        options.views.choose(&mut scene)?;
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        let (mut gains, mut fitted) = (vec![Gain::ONE; scene.views.len()], None);
        if let Some(path) = &options.params {
            let file = ParamsFile::read(path, scene.form, &scene.params)?.of_scene(&scene.path);
            (scene.params, fitted) = (file.params, file.effects);
            for (gain, view) in gains.iter_mut().zip(&scene.views) {
                let given = file.gains.iter().find(|(name, _)| *name == view.name);
                *gain = given.map_or(Gain::ONE, |&(_, gain)| gain);
            }
            warnings.extend(unknown_gains(path, &file.gains, &known));
        }
        options.set.iter().for_each(|assignment| assignment.apply(&mut scene.params));
        scene.fit.free = untied(&scene.fit.free, &scene.params, &options.set);
        let asked = Asked {
            fit: options.fit,
            light_alone: options.clip == Some(ClipOcclusion::Frames),
            cache: options.cache.clone(),
        };
        let seconds = StageSeconds { load: start.elapsed().as_secs_f64(), ..StageSeconds::default() };
        Ok(Self { scene, fitted, gains, seconds, warnings, asked })
    }

    /// Leave these parameters free, instead of the scene's own: in each channel those that were so, or that start at three
    /// values. One that no enabled effect asks for is warned of.
    pub fn set_free(&mut self, params: &[Param]) {
        let scene = &mut self.scene;
        let split = |param: Param| {
            let coloured = |column: &Column| column.param == param && column.channels != Channels::Tied;
            scene.fit.free.iter().any(coloured)
        };
        let columns = |&param: &Param| match split(param) {
            true => Column::per_channel(param).to_vec(),
            false => vec![Column::tied(param)],
        };
        let free: Vec<Column> = params.iter().flat_map(columns).collect();
        scene.fit.free = untied(&free, &scene.params, &[]);
        let idle = params.iter().filter(|param| !param.asked_for(scene.effects));
        let path = scene.path.display();
        self.warnings.extend(idle.map(|param| {
            let name = param.name();
            format!("{path}: {name} is free, but no enabled effect asks for it: it will be reported as unidentifiable.")
        }));
    }

    /// Bake what the scene's effects ask for.
    ///
    /// # Errors
    /// When the scene lacks what its effects ask for.
    pub fn bake(self) -> Result<Baked, PrepareError> {
        Baked::of(self)
    }
}

/// Refuse a mesh of which posing leaves nothing: at rest the reader has seen to it, but bones and morph targets may
/// draw all of it together.
fn check_area(scene: &Scene) -> Result<(), PrepareError> {
    let posed = scene.mesh.pose();
    match any_can_be_hit(&posed.positions, &posed.triangles) {
        true => Ok(()),
        false => Err(PrepareError::Collapsed { scene: scene.path.display().to_string() }),
    }
}

/// What is to be said of gains that no view of the scene has.
fn unknown_gains(path: &Path, gains: &[(String, Gain)], known: &[String]) -> Option<String> {
    let unknown: Vec<&str> =
        gains.iter().map(|(name, _)| name.as_str()).filter(|name| !known.iter().any(|k| k == name)).collect();
    let (names, file) = (unknown.join(", "), path.display());
    (!unknown.is_empty()).then(|| {
        format!(
            "{file}: [gains] has {names}, and no view of the scene is called so; there are {}. These gains do nothing.",
            known.join(", ")
        )
    })
}

/// The free columns, with one a channel for each parameter whose start has three different values (a tied column would
/// begin by throwing two of them away), or that was set to three.
pub fn untied(free: &[Column], start: &Params, set: &[Assignment]) -> Vec<Column> {
    let coloured = |param: Param| {
        let [r, g, b] = start.rgb(param);
        r != g || g != b || set.iter().any(|assignment| assignment.param == param && assignment.coloured)
    };
    let split = |column: &Column| match column.channels {
        Channels::Tied if coloured(column.param) => Column::per_channel(column.param).to_vec(),
        _ => vec![*column],
    };
    free.iter().flat_map(split).collect()
}
