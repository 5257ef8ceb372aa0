//! A scene file and everything that it names, read and checked.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use toml::Spanned;

use super::cameras::{self, ViewPlan};
use super::error::{SceneError, Warning, Warnings, warn};
use super::file::{SceneFile, Source};
use super::gltf::{Ask, Document, Tangents, Uvs};
use super::maps::{Environment, Maps};
use super::mesh::Mesh;
use super::settings::{self, number};
use super::view::View;
use super::{Scene, images};
use crate::model::effects::{Effect, Effects, Form, Needs};
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
        let metres_per_unit = number(
            &source,
            file.mesh.metres_per_unit.as_ref(),
            1.0,
            "metres_per_unit",
            "metres above 0",
            |m| m > 0.0,
        )?;
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

/// The mesh of a scene through its animation 0.
pub struct Animation {
    document: Document,
    ask: Ask,
    /// Seconds from its first key to its last.
    pub seconds: (f64, f64),
}

impl Animation {
    /// The animation of the scene at `path`, read with `effects`; `None` when the mesh file has none.
    ///
    /// # Errors
    /// When the files have changed for the worse since the scene was read.
    pub fn open(scene: &Scene) -> Result<Option<Self>, SceneError> {
        let source = Source::read(&scene.path)?;
        let file: SceneFile = source.parse()?;
        let pose = Pose::check(&source, &file)?;
        let folder = scene.path.parent().unwrap_or(Path::new(""));
        let document = Document::open(&folder.join(&file.mesh.file))?;
        let needs = scene.effects.needs(scene.silhouette);
        let ask = ask(&file, scene.form, scene.effects, needs, &pose);
        let seconds = document.animation_seconds()?;
        Ok(seconds.map(|seconds| Self { document, ask, seconds }))
    }

    /// The mesh at `time` seconds.
    ///
    /// # Errors
    /// When the animation does not fit the mesh.
    pub fn mesh(&self, time: f64) -> Result<Mesh, SceneError> {
        // What is mended was told when the scene was read.
        self.document.mesh(&Ask { time: Some(time), ..self.ask.clone() }, &mut Warnings::new())
    }
}

/// How the mesh is to be posed.
struct Pose {
    morph_weights: Option<Vec<f32>>,
    time: Option<f64>,
}

impl Pose {
    fn check(source: &Source, file: &SceneFile) -> Result<Self, SceneError> {
        let weights = file.mesh.morph_weights.as_ref();
        // Beyond f32's range a position would not be finite.
        let bad = |weights: &Spanned<Vec<f64>>| {
            weights.get_ref().iter().copied().find(|w| w.is_nan() || w.abs() > 1e6)
        };
        if let Some((spanned, weight)) = weights.and_then(|w| bad(w).map(|weight| (w, weight))) {
            let what = format!("morph_weights holds {weight}");
            return Err(source.error(spanned, what, "Give finite weights, mostly in [0, 1]"));
        }
        let finite = |_| true;
        Ok(Self {
            morph_weights: weights.map(|w| w.get_ref().iter().map(|&w| w as f32).collect()),
            time: match &file.mesh.time {
                Some(time) => Some(number(source, Some(time), 0.0, "time", "finite seconds", finite)?),
                None => None,
            },
        })
    }

    fn at(self, time: Option<f64>) -> Self {
        Self { time: time.or(self.time), ..self }
    }

    fn effects(&self, wanted: Option<Effects>, document: &Document) -> Result<Effects, SceneError> {
        let add = |effects: Effects, on: bool, effect| if on { effects.with(effect) } else { effects };
        let (morphs, skins) = document.carries()?;
        let effects = match wanted {
            Some(effects) => effects,
            None => add(add(Effects::SURFACE, morphs, Effect::Morph), skins, Effect::Skin),
        };
        let effects = add(effects, self.morph_weights.is_some(), Effect::Morph);
        Ok(add(effects, self.time.is_some(), Effect::Skin))
    }
}

/// What the effects want of the mesh.
fn ask(file: &SceneFile, form: Form, effects: Effects, needs: Needs, pose: &Pose) -> Ask {
    let maps = &file.maps;
    let looked_up = needs.color_map && maps.color.is_some()
        || needs.normal_map && maps.normal.is_some()
        || needs.specular_map && maps.specular.is_some()
        || needs.attenuator_map && maps.attenuator.is_some();
    let uvs = match (needs.maps(), looked_up) {
        (false, _) => Uvs::None,
        (true, false) => Uvs::Optional,
        (true, true) => Uvs::Required,
    };
    let tangents = match (needs.tangents, maps.normal.is_some()) {
        (false, _) => Tangents::None,
        (true, true) => Tangents::Exact,
        // Decoded, a missing normal map is N itself; read as printed it leans along T and B.
        (true, false) if form == Form::Listing => Tangents::Exact,
        (true, false) => Tangents::AnyFrame,
    };
    Ask {
        uvs,
        tangents,
        morphs: effects.has(Effect::Morph),
        morph_weights: pose.morph_weights.clone(),
        bones: effects.has(Effect::Skin),
        time: pose.time.filter(|_| effects.has_any(&[Effect::Morph, Effect::Skin])),
    }
}

/// Say so when an effect finds nothing in the mesh, or the mesh is made for one that is off.
fn idle_effects(
    document: &Document,
    effects: Effects,
    mesh: &Mesh,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let (_, skins) = document.carries()?;
    let path = document.path();
    if effects.has(Effect::Morph) && mesh.morphs.is_empty() {
        warn(warnings, path, "has no morph targets: the effect `morph` does nothing");
    }
    if effects.has(Effect::Skin) && !skins && !document.animated() {
        warn(warnings, path, "has no skin and no animation: the effect `skin` does nothing");
    }
    if skins && !effects.has(Effect::Skin) && document.skin_displaces()? {
        warn(warnings, path, "has a skin, but the effect `skin` is off: its mesh stands where its node does");
    }
    Ok(())
}

fn read_maps(source: &Source, file: &SceneFile, folder: &Path, needs: Needs) -> Result<Maps, SceneError> {
    let maps = &file.maps;
    let flip = match &maps.normal_y {
        Some(name) => source.choose("direction", name, &[("up", false), ("down", true)])?,
        None => false,
    };
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
    Ok(Environment {
        rotation_degrees: number(
            source,
            table.rotation_degrees.as_ref(),
            0.0,
            "rotation_degrees",
            "finite degrees",
            |_| true,
        )?,
        intensity: number(source, table.intensity.as_ref(), 1.0, "intensity", "a number from 0 up", |i| {
            i >= 0.0
        })?,
        panorama: images::panorama(&folder.join(&table.file), warnings)?,
    })
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
