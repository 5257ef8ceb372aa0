//! A scene file and everything that it names, read and checked.

use std::path::Path;

use rayon::prelude::*;

use super::animation::{Pose, ask, idle_effects, mesh_file};
use super::cameras::{self, MeshCameras, ViewPlan};
use super::dapple::dapple;
use super::diffusion;
use super::error::{SceneError, Warning, Warnings, warn};
use super::file::{EnvironmentTable, ResponseValue, SceneFile, Source};
use super::gltf::Ask;
use super::lit::{self, Lights};
use super::map_files::{normal_flip, read_maps};
use super::maps::Environment;
use super::numbers::{interval, number};
use super::settings::{self, spots};
use super::shadow_maps::shadow_maps;
use super::skin_material::SkinMaterial;
use super::sky_lights::sky_lights;
use super::terms::terms;
use super::view::{Background, View};
use super::{FitSettings, Scene, images, transmission};
use crate::model::choices::{Choices, NormalFilter, SpecularVisibility};
use crate::model::dapple::Dapple;
use crate::model::effects::{Effect, Effects};
use crate::model::evaluate::Setup;
use crate::model::fields::Fields;
use crate::model::needs::Needs;
use crate::model::params::Param;
use crate::model::shares;
use crate::progress;
use crate::shader::term::library;

/// What a command wants of a scene beyond what its file says.
#[derive(Clone, Copy, Debug)]
pub struct LoadOptions {
    /// Instead of the file's `effects`.
    pub effects: Option<Effects>,
    /// Whether targets and masks are read.
    pub targets: bool,
    /// Seconds into the animation, instead of the file's `time`.
    pub time: Option<f64>,
    /// Whether the mesh will go through its animation: then the targets are marked that it moves.
    pub clip: bool,
    /// Instead of the views' `background`.
    pub background: Option<Background>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { effects: None, targets: true, time: None, clip: false, background: None }
    }
}

impl Scene {
    /// Read a scene file and what its effects ask for; paths in it are relative to it.
    ///
    /// Effects are those of `options`, else the file's, else [`Effects::SURFACE`] with `morph` and
    /// `skin` where the mesh carries them, and the effects of the terms that the file names. The keys `morph_weights`
    /// and `time` ask for `morph` and `skin` by themselves.
    ///
    /// # Errors
    /// When a file is missing, damaged or does not fit the others, or a value makes no sense; what
    /// could be mended is in the warnings instead.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<(Self, Vec<Warning>), SceneError> {
        let source = Source::read(path)?;
        let file: SceneFile = source.parse()?;
        let mut warnings = Warnings::new();
        let folder = path.parent().unwrap_or(Path::new(""));
        library::register_all();
        let terms = terms(&source, &file.model, folder)?;
        let (form, silhouette) = settings::form(&source, &file.model)?;
        let lookups = settings::lookups(&source, &file.model)?;
        let choices = settings::choices(&source, &file.model)?;
        let dapple = read_dapple(&source, &file)?;
        let quality = settings::quality(&source, &file.quality)?;
        let shadow_maps = shadow_maps(&source, &file.quality)?;
        let bloom = settings::bloom(&source, &file.bloom)?;
        let (diffusion, by) = diffusion::read(&source, &file.diffusion)?;
        let through = transmission::read(&source, &file.transmission)?;
        let choices = Choices { diffusion: by, transmission: through, ..choices };
        let pose = Pose::check(&source, &file)?.at(options.time);
        let metres_per_unit = metres(&source, &file)?;

        let bar = progress::bar("loading", 3 + file.view.len() as u64);
        let document = mesh_file(&source, &file, folder)?;
        let of_file = MeshCameras { document: &document, time: pose.time() };
        let mut plans = cameras::plan(&source, &file.view, Some(of_file), &mut warnings)?;
        if let Some(background) = options.background {
            plans.iter_mut().for_each(|plan| plan.background = background);
        }
        let lights = Lights::read(&source, &file, Some((&document, pose.time())), &mut warnings)?;
        let mut params = settings::params(&source, &file.model.params, form)?;
        let given = settings::effects(&source, &file.model)?;
        let listed = options.effects.or(given);
        let mut effects = pose.effects(listed, &document)?;
        if listed.is_none() {
            effects = terms.iter().fold(effects, |effects, term| effects.with(term.effect));
        }
        let effects = diffusion.switched(lights.switched(effects));
        lights.idle(&source.path, effects, options.effects.is_some(), &mut warnings);
        for (effect, other) in effects.idle() {
            let (effect, other) = (effect.name(), other.name());
            warn(
                &mut warnings,
                &source.path,
                format!("the effect `{effect}` does nothing without `{other}`"),
            );
        }
        transmission::idle(&source, effects, (through, &shadow_maps), &mut warnings);
        let setup = Setup { lookups, dapple, choices, ..Setup::new(form, silhouette, effects) };
        let needs = setup.needs();
        let mut idle = Warnings::new();
        let fit = settings::fit(&source, &file.fit, &file.model.params, effects, &mut idle)?;
        if options.targets {
            // What is free concerns a fit alone.
            warnings.append(&mut idle);
            check_haze(&source, &mut plans, &fit, needs, &mut warnings);
        }
        if effects.has(Effect::NormalMap) && !setup.bumps() {
            let message = "looks cubes up along the smooth normal, and nothing else sees a normal map: the effect \
                           `normal_map` does nothing without `key_light`";
            warn(&mut warnings, &source.path, message);
        }
        check_lobe(&source, &file, &setup, &mut warnings);
        let declared = Fields::of(terms.iter().flat_map(|term| term.fields.iter())).of_maps();
        let mut maps = read_maps(&source, &file, folder, (needs, declared), &mut warnings)?;
        let of_file = (&source, &file);
        let material = SkinMaterial::read(of_file, &document, (&pose, needs), &mut maps, &mut warnings)?;
        let uv = material.as_ref().map(SkinMaterial::uv).unwrap_or_default();
        let (uv, atlas_uv) = diffusion::uvs(&source, &file.diffusion, (&maps, uv), needs.atlas)?;
        if choices.normal_filter == NormalFilter::Toksvig {
            maps.normalise_normals();
        }
        bar.inc(1);
        let ask = Ask { clip: options.clip, uv, atlas_uv, ..ask(&maps, form, effects, needs, &pose) };
        let mut mesh = document.mesh(&ask, &mut warnings)?;
        if let Some(material) = material {
            material.finish(&document, (&mut maps, &mut mesh), &mut warnings);
        }
        idle_effects(&document, effects, &mesh, &mut warnings)?;
        drop(document);
        bar.inc(1);
        // Targets have a background of their own; it is a picture that shows the environment.
        let shown = !options.targets && plans.iter().any(|plan| plan.background == Background::Environment);
        let of_sky = effects.has(Effect::Lights) && lights.are_of_sky();
        let environment = if needs.environment() || shown || of_sky {
            Some(read_environment(&source, &file, folder, shown, &mut warnings)?)
        } else {
            None
        };
        let sky_lights = match &environment {
            Some(environment) if of_sky => sky_lights(environment).lights_in_world(environment),
            _ => Vec::new(),
        };
        if let Some(Environment { spots, .. }) = environment.as_ref().filter(|_| of_sky)
            && sky_lights.len() < spots.count as usize
        {
            let (found, wanted) = (sky_lights.len(), spots.count);
            let message = format!("has {found} bright spots, not {wanted}: the other lights are black");
            warn(&mut warnings, &source.path, message);
        }
        let gives = |name: &str| file.model.params.keys().any(|key| key.get_ref() == name);
        diffusion.set(&mut params, metres_per_unit, gives);
        transmission::set(&mut params, metres_per_unit);
        for light in lights.own.iter().chain(&sky_lights) {
            lit::set(light, &mut params, gives);
        }
        for message in shares::overfull(&params, effects) {
            warn(&mut warnings, &source.path, message);
        }
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
            lights: lights.own,
            sky_lights,
            form,
            silhouette,
            lookups,
            dapple,
            choices,
            effects,
            params,
            views,
            fit,
            quality,
            shadow_maps,
            bloom,
            diffusion,
        };
        Ok((scene, warnings))
    }
}

/// What a fit is to know of haze: it is not read where no enabled effect makes one, and nothing but it tells of
/// `haze_weight`.
fn check_haze(
    source: &Source,
    plans: &mut [ViewPlan],
    fit: &FitSettings,
    needs: Needs,
    warnings: &mut Warnings,
) {
    let compared = plans.iter().any(|plan| plan.haze.is_some() && plan.target.is_some());
    if compared && !needs.haze {
        let message = "names the haze of its views, but neither `haze` nor `bloom` is enabled: not read";
        warn(warnings, &source.path, message);
        plans.iter_mut().for_each(|plan| plan.haze = None);
    }
    let free = fit.free.iter().any(|column| column.param == Param::HazeWeight);
    if free && needs.haze && !compared {
        let message = "haze_weight is free, but no view that has a target names a `haze` to compare with";
        warn(warnings, &source.path, message);
    }
}

/// What the user should know where the specular lobe is to be occluded by an open share that no effect finds.
fn check_lobe(source: &Source, file: &SceneFile, setup: &Setup, warnings: &mut Warnings) {
    let effects = setup.effects;
    let visibility = setup.choices.specular_visibility;
    let by_share = matches!(visibility, SpecularVisibility::Lagarde | SpecularVisibility::Cone);
    let wanted = file.model.specular_visibility.is_some() || library::sees_sky(effects);
    if library::reflects(effects) && by_share && wanted && !effects.has(Effect::Occlusion) {
        let message = format!(
            "specular_visibility = \"{}\" in [model] goes by the open share that the effect `occlusion` finds, which \
             is off: the effect `fresnel` shows all of the environment. Add \"occlusion\" to the effects, or choose \
             specular_visibility = \"none\" or, by rays, \"lobe\"",
            visibility.name()
        );
        warn(warnings, &source.path, message);
    }
}

fn read_environment(
    source: &Source,
    file: &SceneFile,
    folder: &Path,
    shown: bool,
    warnings: &mut Warnings,
) -> Result<Environment, SceneError> {
    let Some(table) = &file.environment else {
        let (what, otherwise) = match shown {
            false => ("the enabled effects look it up", "enable other effects"),
            true => ("a view's background shows it", "choose another background"),
        };
        return Err(SceneError::new(
            &source.path,
            format!("has no [environment], but {what}"),
            format!("Add [environment] with a lat-long EXR or HDR file, or {otherwise}"),
        ));
    };
    let (rotation_degrees, intensity) = turn_and_intensity(source, table)?;
    Ok(Environment {
        rotation_degrees,
        intensity,
        spots: spots(source, table)?,
        panorama: images::panorama(&folder.join(&table.file), warnings)?,
    })
}

/// A turn needs no more; from far larger numbers f64 has no degrees to tell apart.
const MOST_DEGREES: f64 = 36_000.0;

/// The numbers of `[environment]`: its turn in degrees, and its intensity.
fn turn_and_intensity(source: &Source, table: &EnvironmentTable) -> Result<(f64, f64), SceneError> {
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

/// Where light falls through leaves from, in the environment as it is turned.
fn read_dapple(source: &Source, file: &SceneFile) -> Result<Dapple, SceneError> {
    let Some(table) = &file.environment else { return Ok(Dapple::default()) };
    let (degrees, _) = turn_and_intensity(source, table)?;
    dapple(source, table.dapple.as_ref(), degrees)
}

/// Refuse the text of a scene file for whatever [`Scene::load`] would refuse before it reads another file than those of
/// its terms.
pub fn check_values(path: &Path, text: &str) -> Result<(), SceneError> {
    let source = Source::of(path, text.to_owned());
    let file: SceneFile = source.parse()?;
    let terms = terms(&source, &file.model, path.parent().unwrap_or(Path::new("")))?;
    let (form, _) = settings::form(&source, &file.model)?;
    let lights = Lights::of_file(&source, &file)?;
    settings::params(&source, &file.model.params, form)?;
    settings::lookups(&source, &file.model)?;
    settings::choices(&source, &file.model)?;
    cameras::plan(&source, &file.view, None, &mut Warnings::new())?;
    settings::quality(&source, &file.quality)?;
    shadow_maps(&source, &file.quality)?;
    settings::bloom(&source, &file.bloom)?;
    let (diffusion, _) = diffusion::read(&source, &file.diffusion)?;
    transmission::read(&source, &file.transmission)?;
    Pose::check(&source, &file)?;
    metres(&source, &file)?;
    // What the mesh adds to the effects concerns no value here.
    let every = || terms.iter().fold(Effects::SURFACE, |effects, term| effects.with(term.effect));
    let effects = lights.switched(settings::effects(&source, &file.model)?.unwrap_or_else(every));
    let effects = diffusion.switched(effects);
    settings::fit(&source, &file.fit, &file.model.params, effects, &mut Warnings::new())?;
    normal_flip(&source, &file)?;
    read_dapple(&source, &file).map(drop)
}

fn metres(source: &Source, file: &SceneFile) -> Result<f64, SceneError> {
    let metres = file.mesh.metres_per_unit.as_ref();
    number(source, metres, 1.0, "metres_per_unit", "metres above 0", |m| m > 0.0)
}

fn read_response(given: ResponseValue, folder: &Path) -> Result<images::Response, SceneError> {
    match given {
        ResponseValue::Gamma(gamma) => Ok(images::Response::Gamma(gamma)),
        ResponseValue::Table(path) => images::Response::read(&folder.join(path)),
    }
}

fn read_views(
    plans: Vec<ViewPlan>,
    folder: &Path,
    targets: bool,
    bar: &progress::Work,
    warnings: &mut Warnings,
) -> Result<Vec<View>, SceneError> {
    let read = |plan: ViewPlan| {
        let mut warnings = Warnings::new();
        for (file, what) in [(&plan.mask, "masks"), (&plan.haze, "is the haze of")] {
            if let (Some(file), None) = (file, &plan.target) {
                warn(&mut warnings, &folder.join(file), format!("{what} a view without a target: not read"));
            }
        }
        let size = (plan.camera.width, plan.camera.height);
        let mask = plan.mask.map(|mask| folder.join(mask));
        let haze = plan.haze.map(|haze| folder.join(haze));
        let target = match plan.target.filter(|_| targets) {
            Some(target) => {
                let response = plan.response.map(|given| read_response(given, folder)).transpose()?;
                let seen = images::Seen { mask: mask.as_deref(), response: response.as_ref() };
                let mut target = images::target(&folder.join(target), seen, size, &mut warnings)?;
                target.haze = haze.map(|haze| images::haze(&haze, &target, size)).transpose()?;
                Some(target)
            }
            None => None,
        };
        bar.inc(1);
        let view = View { name: plan.name, camera: plan.camera, target, background: plan.background };
        Ok((view, warnings))
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
