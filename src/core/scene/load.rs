//! A scene file and everything that it names, read and checked.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::animation::{Pose, ask, idle_effects};
use super::cameras::{self, ViewPlan};
use super::error::{SceneError, Warning, Warnings, warn};
use super::file::{EnvironmentTable, SceneFile, Source};
use super::gltf::Document;
use super::maps::{Environment, Maps};
use super::settings::{self, interval, number};
use super::view::View;
use super::{Scene, images};
use crate::model::effects::{Effects, Needs};
use crate::progress;

/// What a command wants of a scene beyond what its file says.
#[derive(Clone, Copy, Debug)]
pub struct LoadOptions {
    /// Instead of the file's `effects`.
    pub effects: Option<Effects>,
    /// Whether targets and masks are read.
    pub targets: bool,
    /// Seconds into animation 0, instead of the file's `time`.
    pub time: Option<f64>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { effects: None, targets: true, time: None }
    }
}

impl Scene {
    /// Read a scene file and what its effects ask for; paths in it are relative to it.
    ///
    /// Effects are those of `options`, else the file's, else [`Effects::SURFACE`] with `morph` and
    /// `skin` where the mesh carries them. The keys `morph_weights` and `time` ask for `morph` and
    /// `skin` by themselves.
    ///
    /// # Errors
    /// When a file is missing, damaged or does not fit the others, or a value makes no sense; what
    /// could be mended is in the warnings instead.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<(Self, Vec<Warning>), SceneError> {
        let source = Source::read(path)?;
        let file: SceneFile = source.parse()?;
        let mut warnings = Warnings::new();
        let (form, silhouette) = settings::form(&source, &file.model)?;
        let params = settings::params(&source, &file.model.params, form)?;
        let plans = cameras::plan(&source, &file.view)?;
        let quality = settings::quality(&source, &file.quality)?;
        let pose = Pose::check(&source, &file)?.at(options.time);
        let metres_per_unit = metres(&source, &file)?;
        let given = settings::effects(&source, &file.model)?;

        let bar = progress::bar("loading", 3 + plans.len() as u64);
        let folder = path.parent().unwrap_or(Path::new(""));
        let document = Document::open(&folder.join(&file.mesh.file))?;
        let effects = pose.effects(options.effects.or(given), &document)?;
        let needs = effects.needs(silhouette);
        let mut idle = Warnings::new();
        let fit = settings::fit(&source, &file.fit, &file.model.params, effects, &mut idle)?;
        if options.targets {
            // What is free concerns a fit alone.
            warnings.append(&mut idle);
        }
        let mesh = document.mesh(&ask(&file, form, effects, needs, &pose), &mut warnings)?;
        idle_effects(&document, effects, &mesh, &mut warnings)?;
        drop(document);
        bar.inc(1);
        let maps = read_maps(&source, &file, folder, needs)?;
        bar.inc(1);
        let environment = if needs.environment() {
            Some(read_environment(&source, &file, folder, &mut warnings)?)
        } else {
            None
        };
        bar.inc(1);
        let views = read_views(plans, folder, options.targets, &bar, &mut warnings)?;
        bar.finish_and_clear();
        let path = path.to_owned();
        let scene = Self {
            path,
            mesh,
            metres_per_unit,
            maps,
            environment,
            form,
            silhouette,
            effects,
            params,
            views,
            fit,
            quality,
        };
        Ok((scene, warnings))
    }
}

fn read_maps(source: &Source, file: &SceneFile, folder: &Path, needs: Needs) -> Result<Maps, SceneError> {
    let maps = &file.maps;
    let flip = normal_flip(source, file)?;
    let wanted =
        |path: &Option<PathBuf>, need: bool| path.as_ref().filter(|_| need).map(|path| folder.join(path));
    let (color, normal) = (wanted(&maps.color, needs.color_map), wanted(&maps.normal, needs.normal_map));
    let specular = wanted(&maps.specular, needs.specular_map);
    let attenuator = wanted(&maps.attenuator, needs.attenuator_map);
    let ((color, normal), (specular, attenuator)) = rayon::join(
        || {
            (
                color.map(|path| images::color_map(&path)).transpose(),
                normal.map(|path| images::normal_map(&path, flip)).transpose(),
            )
        },
        || {
            (
                specular.map(|path| images::scalar_map(&path)).transpose(),
                attenuator.map(|path| images::scalar_map(&path)).transpose(),
            )
        },
    );
    Ok(Maps { color: color?, normal: normal?, specular: specular?, attenuator: attenuator? })
}

fn read_environment(
    source: &Source,
    file: &SceneFile,
    folder: &Path,
    warnings: &mut Warnings,
) -> Result<Environment, SceneError> {
    let Some(table) = &file.environment else {
        return Err(SceneError::new(
            &source.path,
            "has no [environment], but the enabled effects look it up",
            "Add [environment] with a lat-long EXR or HDR file, or enable other effects",
        ));
    };
    let (rotation_degrees, intensity) = light(source, table)?;
    Ok(Environment {
        rotation_degrees,
        intensity,
        panorama: images::panorama(&folder.join(&table.file), warnings)?,
    })
}

/// A turn needs no more; from far larger numbers f64 has no degrees to tell apart.
const MOST_DEGREES: f64 = 36_000.0;

/// The numbers of `[environment]`: its turn in degrees, and its intensity.
fn light(source: &Source, table: &EnvironmentTable) -> Result<(f64, f64), SceneError> {
    let turn = number(
        source,
        table.rotation_degrees.as_ref(),
        0.0,
        "rotation_degrees",
        &format!("degrees in {}", interval(-MOST_DEGREES, MOST_DEGREES)),
        |degrees| degrees.abs() <= MOST_DEGREES,
    )?;
    let intensity =
        number(source, table.intensity.as_ref(), 1.0, "intensity", "a number from 0 up", |i| i >= 0.0)?;
    Ok((turn, intensity))
}

/// Refuse the text of a scene file for whatever [`Scene::load`] would refuse before it reads another file.
pub fn check_values(path: &Path, text: &str) -> Result<(), SceneError> {
    let source = Source::of(path, text.to_owned());
    let file: SceneFile = source.parse()?;
    let (form, _) = settings::form(&source, &file.model)?;
    settings::params(&source, &file.model.params, form)?;
    cameras::plan(&source, &file.view)?;
    settings::quality(&source, &file.quality)?;
    Pose::check(&source, &file)?;
    metres(&source, &file)?;
    // What the mesh adds to the effects concerns no value here.
    let effects = settings::effects(&source, &file.model)?.unwrap_or(Effects::SURFACE);
    settings::fit(&source, &file.fit, &file.model.params, effects, &mut Warnings::new())?;
    normal_flip(&source, &file)?;
    file.environment.as_ref().map_or(Ok(()), |table| light(&source, table).map(drop))
}

fn metres(source: &Source, file: &SceneFile) -> Result<f64, SceneError> {
    let metres = file.mesh.metres_per_unit.as_ref();
    number(source, metres, 1.0, "metres_per_unit", "metres above 0", |m| m > 0.0)
}

/// Whether the normal map's Y is to be turned.
fn normal_flip(source: &Source, file: &SceneFile) -> Result<bool, SceneError> {
    match &file.maps.normal_y {
        Some(name) => source.choose("direction", name, &[("up", false), ("down", true)]),
        None => Ok(false),
    }
}

fn read_views(
    plans: Vec<ViewPlan>,
    folder: &Path,
    targets: bool,
    bar: &indicatif::ProgressBar,
    warnings: &mut Warnings,
) -> Result<Vec<View>, SceneError> {
    let read = |plan: ViewPlan| {
        let mut warnings = Warnings::new();
        if let (Some(mask), None) = (&plan.mask, &plan.target) {
            warn(&mut warnings, &folder.join(mask), "masks a view without a target: not read");
        }
        let size = (plan.camera.width, plan.camera.height);
        let mask = plan.mask.map(|mask| folder.join(mask));
        let target = match plan.target.filter(|_| targets) {
            Some(target) => Some(images::target(&folder.join(target), mask.as_deref(), size, &mut warnings)?),
            None => None,
        };
        bar.inc(1);
        Ok((View { name: plan.name, camera: plan.camera, target }, warnings))
    };
    // Collected in order, so that the first error and the warnings are the same for any thread count.
    let views: Vec<Result<_, SceneError>> = plans.into_par_iter().map(read).collect();
    views
        .into_iter()
        .map(|view| {
            let (view, mut more) = view?;
            warnings.append(&mut more);
            Ok(view)
        })
        .collect()
}
