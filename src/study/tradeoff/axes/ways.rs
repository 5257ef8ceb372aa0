//! Named choices of the model: several ways to one quantity, each beside the reference.

use std::sync::Arc;

use crate::StudyError;
use crate::model::choices::{
    Bounces, LobeLookup, NormalFilter, SkinReflection, SpecularModel, SpecularVisibility, SplitSum,
    Visibility,
};
use crate::model::effects::Effect;
use crate::model::texture_filter::TextureFilter;
use crate::model::transmission::Method;
use crate::reference::Difference;
use crate::scene::Scene;
use crate::tradeoff::axis::{Rates, SceneAxis, Setting, Sweep, mark_pareto};
use crate::tradeoff::bench::{Bench, TimedImages};

/// A way, by its name in scene files, and what it changes of a scene: choices, effects, `[quality]`, `[diffusion]`,
/// parameters, no more (`Bench::reference`).
pub(super) type Way = (&'static str, fn(&mut Scene));

/// The ways to a quantity. The last one is the reference.
pub(super) struct Ways {
    pub(super) axis: &'static str,
    pub(super) title: &'static str,
    pub(super) method: &'static str,
    /// Of which one has to be on.
    pub(super) effects: &'static [&'static str],
    pub(super) idle: &'static str,
    pub(super) ways: &'static [Way],
}

/// How a point sees the sky.
pub(super) const SKY: Ways = Ways {
    axis: "visibility",
    title: "The sky that a point sees",
    method: "Images with the sky's light found by each way; rays a sample are the reference. Seconds are those of baking, tracing \
             and one pass, nothing cached.",
    effects: &["directional_occlusion"],
    idle: "the effect directional_occlusion is off",
    ways: &[
        ("scalar", |scene| scene.choices.visibility = Visibility::Scalar),
        ("cone", |scene| scene.choices.visibility = Visibility::Cone),
        ("sh2", |scene| scene.choices.visibility = Visibility::Sh2),
        ("sh3", |scene| scene.choices.visibility = Visibility::Sh3),
        ("sh4", |scene| scene.choices.visibility = Visibility::Sh4),
        ("sh5", |scene| scene.choices.visibility = Visibility::Sh5),
        ("sh6", |scene| scene.choices.visibility = Visibility::Sh6),
        ("rays", |scene| scene.choices.visibility = Visibility::Rays),
    ],
};

/// What the specular lobe shows of the environment.
pub(super) const LOBE: Ways = Ways {
    axis: "specular_visibility",
    title: "What the specular lobe shows of the environment",
    method: "Images with the share of the lobe that the sky fills found by each way; the reference has the lobe's light itself, by \
             rays, the skin's where these meet it. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["fresnel"],
    idle: "the effect fresnel is off",
    ways: &[
        ("none", |scene| scene.choices.specular_visibility = SpecularVisibility::None),
        ("lagarde", |scene| scene.choices.specular_visibility = SpecularVisibility::Lagarde),
        ("cone", |scene| scene.choices.specular_visibility = SpecularVisibility::Cone),
        ("lobe", |scene| scene.choices.specular_visibility = SpecularVisibility::Lobe),
        ("rays", |scene| scene.choices.specular_visibility = SpecularVisibility::Rays),
    ],
};

/// The specular BRDF.
pub(super) const MODEL: Ways = Ways {
    axis: "specular_model",
    title: "The specular BRDF",
    method: "Images with each BRDF at the same roughness, in the lobe and in the lights' highlights; ggx, which masks and shadows \
             facets, is the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["fresnel", "light_specular"],
    idle: "the effects fresnel and light_specular are off",
    ways: &[
        ("kelemen", |scene| scene.choices.specular_model = SpecularModel::Kelemen),
        ("ggx", |scene| scene.choices.specular_model = SpecularModel::Ggx),
    ],
};

/// By which Fresnel factor the environment is reflected.
pub(super) const SPLIT_SUM: Ways = Ways {
    axis: "split_sum",
    title: "What the specular lobe gives back of the environment",
    method: "Images with the split sum of Schlick's Fresnel factor, and with that of the BRDF's own, which is the reference; \
             with kelemen they are the same. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["fresnel"],
    idle: "the effect fresnel is off",
    ways: &[
        ("schlick", |scene| scene.choices.split_sum = SplitSum::Schlick),
        ("exact", |scene| scene.choices.split_sum = SplitSum::Exact),
    ],
};

/// Where the environment is looked up for the specular lobe.
pub(super) const LOOKUP: Ways = Ways {
    axis: "lobe_lookup",
    title: "Where the environment is looked up for the specular lobe",
    method: "Images with the prefiltered environment looked up along the mirrored view and off the lobe's peak; the reference has the \
             lobe's light itself, by rays. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["fresnel"],
    idle: "the effect fresnel is off",
    ways: &[
        ("mirror", |scene| scene.choices.lobe_lookup = LobeLookup::Mirror),
        ("off_peak", |scene| scene.choices.lobe_lookup = LobeLookup::OffPeak),
        ("rays", |scene| scene.choices.specular_visibility = SpecularVisibility::Rays),
    ],
};

/// Bumps that are smaller than what a sample covers.
pub(super) const NORMALS: Ways = Ways {
    axis: "normal_filter",
    title: "Bumps that are smaller than a sample",
    method: "Images with mean normals alone, and with specular lobes widened by how far the normals below a sample are apart, both \
             of filtered maps; the reference has many samples a pixel, each of the finest texels. Errors hold what more samples change \
             beside bumps, at outlines, the same for every way. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["light_specular"],
    idle: "the effect light_specular is off, whose highlights bumps widen",
    ways: &[
        ("trilinear, none", |scene| filtered(scene, TextureFilter::Trilinear, NormalFilter::None)),
        ("trilinear, toksvig", |scene| filtered(scene, TextureFilter::Trilinear, NormalFilter::Toksvig)),
        ("anisotropic, none", |scene| filtered(scene, TextureFilter::Anisotropic, NormalFilter::None)),
        ("anisotropic, toksvig", |scene| filtered(scene, TextureFilter::Anisotropic, NormalFilter::Toksvig)),
        ("bilinear, many samples", |scene| {
            filtered(scene, TextureFilter::Bilinear, NormalFilter::None);
            scene.quality.samples_per_axis = scene.quality.samples_per_axis.max(MANY);
        }),
    ],
};

/// Samples along a pixel's side of the reference, at the least, as of `texture_filter`.
const MANY: u32 = 8;

fn filtered(scene: &mut Scene, textures: TextureFilter, normals: NormalFilter) {
    scene.quality.texture_filter = textures;
    scene.choices.normal_filter = normals;
    if normals == NormalFilter::Toksvig {
        // As a scene file that says so has them.
        scene.maps.normalise_normals();
    }
}

/// Light that the skin throws back at itself.
pub(super) const BOUNCES: Ways = Ways {
    axis: "bounces",
    title: "Light that the skin throws back at itself",
    method: "Images without that light, with it by a polynomial of the open share and the albedo, and gathered over the mesh, which is \
             the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["directional_occlusion"],
    idle: "the effect directional_occlusion is off",
    ways: &[
        ("none", |scene| scene.choices.bounces = Bounces::None),
        ("polynomial", |scene| scene.choices.bounces = Bounces::Polynomial),
        ("gathered", |scene| scene.choices.bounces = Bounces::Gathered),
    ],
};

/// What the specular lobe sees where it does not see the sky.
pub(super) const REFLECTION: Ways = Ways {
    axis: "skin_reflection",
    title: "What the specular lobe sees where it does not see the sky",
    method: "Images with nothing there, and with the skin that the point sees on average; the reference has the lobe's light itself, by \
             rays, which meet the skin. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["fresnel"],
    idle: "the effect fresnel is off",
    ways: &[
        ("none", |scene| scene.choices.skin_reflection = SkinReflection::None),
        ("gathered", |scene| scene.choices.skin_reflection = SkinReflection::Gathered),
        ("rays", |scene| scene.choices.specular_visibility = SpecularVisibility::Rays),
    ],
};

/// Light that comes through thin parts.
pub(super) const THROUGH: Ways = Ways {
    axis: "transmission",
    title: "Light that comes through thin parts",
    method: "Images with each place's own thickness and each light's own way inside, and with the light that rays inward gather where \
             they leave, which is the reference. Seconds are those of baking, tracing and one pass, nothing cached.",
    effects: &["transmission"],
    idle: "the effect transmission is off",
    ways: &[
        // Of samples, shadow maps or not are one.
        ("thickness", |scene| {
            let method = &mut scene.choices.transmission.method;
            *method = if *method == Method::Gathered { Method::Thickness } else { *method };
        }),
        ("gathered", |scene| scene.choices.transmission.method = Method::Gathered),
    ],
};

impl SceneAxis for Ways {
    fn name(&self) -> &'static str {
        self.axis
    }

    fn applies(&self, bench: &Bench<'_>) -> Result<(), &'static str> {
        let on = |name: &&str| Effect::from_name(name).is_some_and(|one| bench.baked.scene.effects.has(one));
        self.effects.iter().any(on).then_some(()).ok_or(self.idle)
    }

    fn seconds(&self, bench: &Bench<'_>, rates: Rates) -> Result<f64, StudyError> {
        // Rays a sample take about as long as tracing it that often, and bakes are made anew.
        let each = rates.trace + rates.images + rates.pass + bench.baked.seconds.bake;
        Ok(each * self.ways.len() as f64 + 80.0 * rates.trace)
    }

    fn sweep(&self, bench: &Bench<'_>) -> Result<Sweep, StudyError> {
        let own = &bench.baked.scene;
        let last = self.ways.len().saturating_sub(1);
        let mut found = Vec::new();
        for (i, &(name, way)) in self.ways.iter().enumerate() {
            let mut scene = Scene::clone(own);
            way(&mut scene);
            let kept = (scene.choices, scene.diffusion, scene.effects, scene.quality);
            let present = kept == (own.choices, own.diffusion, own.effects, own.quality);
            let made = if i == last { bench.reference(scene)? } else { Arc::new(bench.way(scene)?) };
            found.push((name, present, made));
        }
        let exact = found.last().map(|(.., made)| Arc::clone(made));
        let exact = exact.as_ref().map_or(&[][..], |made| &made.images);
        let setting = |(i, (name, present, made)): (usize, &(&str, bool, Arc<TimedImages>))| Setting {
            name: (*name).to_owned(),
            choose: None,
            error: Difference::of_all(exact, &made.images),
            cost: made.seconds,
            time: None,
            counts: Vec::new(),
            reference: i == last,
            present: *present,
            pareto: false,
        };
        let mut settings: Vec<Setting> = found.iter().enumerate().map(setting).collect();
        mark_pareto(&mut settings);
        let method = self.method.to_owned();
        Ok(Sweep {
            axis: self.axis,
            title: self.title,
            method,
            cost: "seconds",
            settings,
            traces: Vec::new(),
        })
    }
}
