//! The scene's `[diffusion]` table: how texture-space diffusion is computed, and presets of its constants.

use toml::Spanned;

use super::Scene;
use super::error::SceneError;
use super::file::{DiffusionTable, Source, TapsValue};
use super::gltf::TextureUv;
use super::maps::Maps;
use super::numbers::whole;
use crate::model::diffusion::{
    AmbientNormal, Combined, DiffusionChoices, Lookup, Method, Seams, Stretch, Taps, Unblurred,
};
use crate::model::effects::{Effect, Effects};
use crate::model::params::{Param, Params};

/// How finely texels of the UV atlas are made, and what is computed there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diffusion {
    /// Texels along a side of the UV atlas.
    pub light_map_size: u32,
    /// Whose constants it starts from.
    pub preset: Preset,
}

impl Default for Diffusion {
    fn default() -> Self {
        Self { light_map_size: 512, preset: Preset::Article }
    }
}

/// Constants of texture-space diffusion that have been published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Preset {
    /// Three blurs: the parameters' own defaults.
    Article,
    /// Five blurs (d'Eon and Luebke 2007, GPU Gems 3, chapter 14).
    HumanHead,
}

impl Preset {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Article, Self::HumanHead];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Article => "article",
            Self::HumanHead => "human_head",
        }
    }
}

impl Preset {
    /// Put a preset's levels and constants into a scene, in the place of all of another's.
    pub fn put(self, scene: &mut Scene) {
        let of_radii =
            |name: &str| name.starts_with("diffusion_weight_") || name.starts_with("diffusion_radius_");
        if scene.diffusion.preset == self {
            return;
        }
        scene.diffusion.preset = self;
        let defaults = Params::defaults(scene.form);
        for param in Param::all().filter(|param| of_radii(param.name())) {
            scene.params.set_rgb(param, defaults.rgb(param));
        }
        if let Some(five) = Effect::from_name(FIVE) {
            scene.effects = scene.effects.without(five);
        }
        scene.effects = scene.diffusion.switched(scene.effects);
        // The unit is the scene's.
        let unit = |name: &str| name == "diffusion_unit";
        scene.diffusion.set(&mut scene.params, 1.0, unit);
    }
}

/// The effect of two blurs more.
pub(super) const FIVE: &str = "diffusion_five";

/// The sum of six Gaussians that the human head demo has for skin (GPU Gems 3, chapter 14, figure 14-13): each one's variance
/// in mm^2, and its weight a channel. The first is taken for no blur.
const HUMAN_HEAD: [(f64, [f64; 3]); 6] = [
    (0.0064, [0.233, 0.455, 0.649]),
    (0.0484, [0.1, 0.336, 0.344]),
    (0.187, [0.118, 0.198, 0.0]),
    (0.567, [0.113, 0.007, 0.007]),
    (1.99, [0.358, 0.004, 0.0]),
    (7.41, [0.078, 0.0, 0.0]),
];

/// The texture coordinates of the mesh, and those by which it lies in the atlas where these are others: the set that the
/// table names beside the maps'. Where no map is looked up one set is enough. `asked` says that something is computed in the
/// atlas.
pub(super) fn uvs(
    source: &Source,
    table: &DiffusionTable,
    (maps, of_maps): (&Maps, TextureUv),
    asked: bool,
) -> Result<(TextureUv, Option<TextureUv>), SceneError> {
    let Some(given) = &table.uv_set else { return Ok((of_maps, None)) };
    let of_atlas = TextureUv::of_set(uv_set(source, Some(given))?);
    if maps.are_none() {
        return Ok((of_atlas, None));
    }
    Ok((of_maps, Some(of_atlas).filter(|of_atlas| asked && of_atlas.set != of_maps.set)))
}

fn uv_set(source: &Source, given: Option<&Spanned<i64>>) -> Result<u32, SceneError> {
    whole(source, given, "uv_set", [0, 15], 0)
}

/// The table over the defaults: what is made, and by which choices.
pub(super) fn read(
    source: &Source,
    table: &DiffusionTable,
) -> Result<(Diffusion, DiffusionChoices), SceneError> {
    fn choice<T: Copy>(
        source: &Source,
        key: &str,
        given: Option<&Spanned<String>>,
        (known, name): (&[T], fn(T) -> &'static str),
        default: T,
    ) -> Result<T, SceneError> {
        let known: Vec<(&str, T)> = known.iter().map(|&choice| (name(choice), choice)).collect();
        given.map_or(Ok(default), |given| source.choose(key, given, &known))
    }
    let default = Diffusion::default();
    // Which one it is depends on the maps.
    uv_set(source, table.uv_set.as_ref())?;
    let size =
        whole(source, table.light_map_size.as_ref(), "light_map_size", [64, 8192], default.light_map_size)?;
    let presets = (&Preset::ALL[..], Preset::name as fn(Preset) -> _);
    let preset = choice(source, "preset", table.preset.as_ref(), presets, default.preset)?;
    let DiffusionChoices { method, ambient_normal, stretch, seams, lookup, unblurred, combined, .. } =
        DiffusionChoices::DEFAULT;
    let choices = DiffusionChoices {
        method: choice(source, "method", table.method.as_ref(), (Method::ALL, Method::name), method)?,
        taps: taps(source, table.taps.as_ref())?,
        ambient_normal: choice(
            source,
            "ambient_normal",
            table.ambient_normal.as_ref(),
            (AmbientNormal::ALL, AmbientNormal::name),
            ambient_normal,
        )?,
        stretch: choice(source, "stretch", table.stretch.as_ref(), (Stretch::ALL, Stretch::name), stretch)?,
        seams: choice(source, "seams", table.seams.as_ref(), (Seams::ALL, Seams::name), seams)?,
        lookup: choice(source, "lookup", table.lookup.as_ref(), (Lookup::ALL, Lookup::name), lookup)?,
        unblurred: choice(
            source,
            "unblurred",
            table.unblurred.as_ref(),
            (Unblurred::ALL, Unblurred::name),
            unblurred,
        )?,
        combined: choice(
            source,
            "combined",
            table.combined.as_ref(),
            (Combined::ALL, Combined::name),
            combined,
        )?,
    };
    Ok((Diffusion { light_map_size: size, preset }, choices))
}

fn taps(source: &Source, given: Option<&Spanned<TapsValue>>) -> Result<Taps, SceneError> {
    let Some(given) = given else { return Ok(DiffusionChoices::DEFAULT.taps) };
    let name = match given.get_ref() {
        TapsValue::Count(count) => count.to_string(),
        TapsValue::Name(name) => name.clone(),
    };
    let known = Taps::ALL.iter().copied().find(|taps| taps.name() == name);
    known.ok_or_else(|| {
        source.error(
            given,
            format!("taps is {name}"),
            "Give 5, 7, 9 or \"full\": places that each blur counts",
        )
    })
}

impl Diffusion {
    /// The effects, those of the preset's further blurs with them.
    pub(super) fn switched(&self, effects: Effects) -> Effects {
        let five = Effect::from_name(FIVE).filter(|_| self.preset == Preset::HumanHead);
        five.filter(|five| five.lacks(effects).is_none()).map_or(effects, |five| effects.with(five))
    }

    /// Set what the scene gives of the parameters, and the preset's, but for those that the file `gives`.
    pub(super) fn set(&self, params: &mut Params, metres_per_unit: f64, gives: impl Fn(&str) -> bool) {
        let mut set = |name: &str, rgb: [f64; 3]| {
            if let Some(param) = Param::from_name(name).filter(|_| !gives(name)) {
                params.set_rgb(param, rgb);
            }
        };
        set("diffusion_unit", [1e3 * metres_per_unit; 3]);
        if self.preset == Preset::HumanHead {
            // Each blur is of the level before: variances add.
            for (k, pair) in HUMAN_HEAD.windows(2).enumerate() {
                let before = if k == 0 { 0.0 } else { pair[0].0 };
                set(&format!("diffusion_weight_{}", k + 1), pair[1].1);
                set(&format!("diffusion_radius_{}", k + 1), [(pair[1].0 - before).sqrt(); 3]);
            }
        }
    }
}
