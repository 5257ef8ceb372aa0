//! How the mesh of a scene is to be posed: morph weights, time, what the effects want of it.

use std::path::Path;

use toml::Spanned;

use super::diffusion;
use super::error::{SceneError, Warnings, warn};
use super::file::{SceneFile, Source};
use super::gltf::{Ask, Document, SkinMaps, Tangents, TextureUv, Uvs};
use super::map_layout::MapLayout;
use super::maps::Maps;
use super::mesh::Mesh;
use super::numbers::{interval, number, short};
use super::{Scene, suggestion};
use crate::model::effects::{Effect, Effects, Form};
use crate::model::fields::Fields;
use crate::model::needs::Needs;

/// The mesh of a scene through its animation.
pub struct Animation {
    document: Document,
    ask: Ask,
    layout: Option<MapLayout>,
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
        let document = mesh_file(&source, &file, folder)?;
        let needs = scene.needs();
        let own = own_maps(&file, &document, (&pose, needs), &mut Warnings::new())?;
        let uv = own.map(|own| own.uv()).unwrap_or_default();
        let (uv, atlas_uv) = diffusion::uvs(&source, &file.diffusion, (&scene.maps, uv), needs.atlas)?;
        let ask = Ask { uv, atlas_uv, ..ask(&scene.maps, scene.form, scene.effects, needs, &pose) };
        let seconds = document.animation_seconds()?;
        Ok(seconds.map(|seconds| Self { document, ask, layout: scene.maps.layout, seconds }))
    }

    /// The mesh at `time` seconds.
    ///
    /// # Errors
    /// When the animation does not fit the mesh.
    pub fn mesh(&self, time: f64) -> Result<Mesh, SceneError> {
        // What is mended was told when the scene was read.
        let mut mesh =
            self.document.mesh(&Ask { time: Some(time), ..self.ask.clone() }, &mut Warnings::new())?;
        if let Some(layout) = self.layout {
            layout.place(&mut mesh);
        }
        Ok(mesh)
    }
}

/// The mesh file of a scene, in `folder`, whose nodes the animation moves that the scene names: else the first.
pub(super) fn mesh_file(source: &Source, file: &SceneFile, folder: &Path) -> Result<Document, SceneError> {
    let document = Document::open(&folder.join(&file.mesh.file))?;
    let Some(wanted) = &file.mesh.animation else { return Ok(document) };
    let names = document.animation_names();
    let of_name: Vec<usize> = (0..names.len()).filter(|&i| names[i] == *wanted.get_ref()).collect();
    let path = document.path().display().to_string();
    match of_name.as_slice() {
        [clip] => Ok(document.with_animation(*clip)),
        [] => {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            let what = format!("{path} has no animation `{}`", wanted.get_ref());
            Err(source.error(wanted, what, suggestion(wanted.get_ref(), &known)))
        }
        several => {
            let what = format!("{path} has {} animations `{}`", several.len(), wanted.get_ref());
            Err(source.error(wanted, what, "Give each a name of its own there"))
        }
    }
}

/// Beyond f32's range a position would not be finite: weights times deltas must stay well within.
const MOST_WEIGHT: f64 = 1e6;
/// Thirty years: whatever an animation's length, its last pose is meant.
const MOST_SECONDS: f64 = 1e9;

/// How the mesh is to be posed.
pub(super) struct Pose {
    morph_weights: Option<Vec<f32>>,
    time: Option<f64>,
    skin: Option<Vec<String>>,
}

impl Pose {
    pub(super) fn check(source: &Source, file: &SceneFile) -> Result<Self, SceneError> {
        let weights = file.mesh.morph_weights.as_ref();
        let bad = |weights: &Spanned<Vec<f64>>| {
            weights.get_ref().iter().copied().find(|w| w.is_nan() || w.abs() > MOST_WEIGHT)
        };
        if let Some((spanned, weight)) = weights.and_then(|w| bad(w).map(|weight| (w, weight))) {
            let what = format!("morph_weights holds {}", short(weight));
            let within = interval(-MOST_WEIGHT, MOST_WEIGHT);
            return Err(source.error(spanned, what, format!("Give weights in {within}, mostly in [0, 1]")));
        }
        if let Some(empty) = file.mesh.skin.as_ref().filter(|names| names.get_ref().is_empty()) {
            let remedy = "Name materials or meshes of the file, or leave it out: then all of it is skin";
            return Err(source.error(empty, "skin names nothing", remedy));
        }
        Ok(Self {
            skin: file.mesh.skin.as_ref().map(|names| names.get_ref().clone()),
            morph_weights: weights.map(|w| w.get_ref().iter().map(|&w| w as f32).collect()),
            time: match &file.mesh.time {
                Some(time) => Some(number(
                    source,
                    Some(time),
                    0.0,
                    "time",
                    &format!("seconds in {}", interval(-MOST_SECONDS, MOST_SECONDS)),
                    |seconds| seconds.abs() <= MOST_SECONDS,
                )?),
                None => None,
            },
        })
    }

    /// The names of what is skin.
    pub(super) fn skin(&self) -> Option<&[String]> {
        self.skin.as_deref()
    }

    /// Seconds into the animation.
    pub(super) const fn time(&self) -> Option<f64> {
        self.time
    }

    pub(super) fn at(self, time: Option<f64>) -> Self {
        Self { time: time.or(self.time), ..self }
    }

    pub(super) fn effects(
        &self,
        wanted: Option<Effects>,
        document: &Document,
    ) -> Result<Effects, SceneError> {
        let add = |effects: Effects, on: bool, effect| if on { effects.with(effect) } else { effects };
        let (morphs, skins) = document.carries()?;
        let effects = match wanted {
            Some(effects) => effects,
            None => add(add(Effects::SURFACE, morphs, Effect::Morph), skins, Effect::Skin),
        };
        let effects = add(effects, self.morph_weights.is_some(), Effect::Morph);
        // At a time the mesh is as the animation has it.
        let effects = add(effects, self.time.is_some() && document.moves_morphs(), Effect::Morph);
        Ok(add(effects, self.time.is_some(), Effect::Skin))
    }
}

/// The maps of the skin's own material that the effects ask for: where the scene names no maps, or says that those that it
/// names are looked up as the material's.
pub(super) fn own_maps(
    file: &SceneFile,
    document: &Document,
    (pose, needs): (&Pose, Needs),
    warnings: &mut Warnings,
) -> Result<Option<SkinMaps>, SceneError> {
    let wanted = (needs.color_map, needs.normal_map);
    match file.maps.takes_material() && wanted != (false, false) {
        true => document.skin_maps(pose.skin(), wanted, warnings),
        false => Ok(None),
    }
}

/// What the effects want of the mesh, `maps` being those that they look up.
pub(super) fn ask(maps: &Maps, form: Form, effects: Effects, needs: Needs, pose: &Pose) -> Ask {
    let uvs = match (needs.maps() || needs.atlas, !maps.are_none() || needs.atlas) {
        // What is not skin has maps of its own.
        (false, _) if pose.skin.is_some() => Uvs::Optional,
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
        uv: TextureUv::default(),
        atlas_uv: None,
        colors: false,
        tangents,
        morphs: effects.has(Effect::Morph),
        morph_weights: pose.morph_weights.clone(),
        bones: effects.has(Effect::Skin),
        fields: Fields::of(needs.fields.iter().filter(|field| field.is_of_vertices())),
        time: pose.time.filter(|_| effects.has_any(&[Effect::Morph, Effect::Skin])),
        skin: pose.skin.clone(),
        clip: false,
    }
}

/// Say so when an effect finds nothing in the mesh, or the mesh is made for one that is off.
pub(super) fn idle_effects(
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
