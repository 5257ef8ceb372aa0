//! What is baked for the sky that each vertex sees: transfer vectors, and the environment as coefficients (MODEL 10).

use std::borrow::Cow;
use std::sync::Arc;

use super::baker::Baker;
use super::coefficients::Coefficients;
use super::harmonics::Order;
use super::interreflection::Albedo;
use super::inward::gathers_inside;
use super::transfer::VertexTransfer;
use super::{all_sets, all_weights};
use crate::model::choices::{Bounces, SpecularVisibility, Visibility};
use crate::model::effects::Effect;
use crate::model::fields::Fields;
use crate::scene::Scene;
use crate::scene::maps::Environment;
use crate::scene::mesh::PosedMesh;
use crate::scene::sky_lights::sky_lights;

/// The field of the sky that a sample sees: a share of what an open point receives, rgb.
pub const SKY_RATIO: &str = "sky_ratio";
/// The fields of how that moves with the cosine and the sine of the environment's turn, and of its second derivative.
pub const SKY_TURNS: [&str; 3] = ["sky_cosine", "sky_sine", "sky_curve"];
/// The field of the mean direction of the open sky.
pub const BENT_NORMAL: &str = "bent_normal";

/// The field of the skin that a point sees: its mean radiance, rgb.
pub const SKIN_SEEN: &str = "skin_seen";

/// The fields of light that rays into a specular lobe bring, each at one of three roughnesses.
pub const LOBES: [&str; 3] = ["lobe_sharp", "lobe_middle", "lobe_wide"];
/// The field of these roughnesses.
pub const LOBE_NODES: &str = "lobe_nodes";

/// Whether a scene's samples, which are to have `fields`, have light of their lobes by rays.
#[must_use]
pub fn traces_lobes(scene: &Scene, fields: Fields) -> bool {
    scene.choices.specular_visibility == SpecularVisibility::Rays
        && LOBES.iter().any(|name| fields.named(name).is_some())
}

/// Whether what is found for `fields` of a scene's samples is found of the skin's own light.
#[must_use]
pub fn sees_skin(scene: &Scene, fields: Fields) -> bool {
    fields.named(SKIN_SEEN).is_some() || traces_lobes(scene, fields) && scene.reflects_skin()
}

/// The sky as each vertex sees it.
#[derive(Clone, Debug)]
pub struct SkyBake {
    /// What arrives at each vertex of it.
    pub transfer: VertexTransfer,
    /// The environment, where its light is to be baked.
    pub light: Option<SkyLight>,
}

/// The light of the environment before `environment_rotation`.
#[derive(Clone, Debug)]
pub struct SkyLight {
    /// Without the lights that were taken out of it: what the cubes are made of.
    pub rest: Coefficients,
    /// All of it: what the skin throws back.
    pub whole: Coefficients,
    /// The rest as a picture, where rays look it up; shared, as each frame of an animation has it.
    pub panorama: Option<Arc<Environment>>,
}

/// Which transfer vectors the fields of a scene's samples are found from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Bands.
    pub order: Order,
    /// Whether with those of light that the mesh throws back.
    pub bounces: bool,
    /// Whether the environment's light is looked at.
    pub light: bool,
}

impl Wanted {
    /// What `scene` asks for; `None` where it asks for no transfer at all.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        let fields = scene.needs().fields;
        let wanted = |name| fields.named(name).is_some();
        // Of the environment's light at the far side.
        let through = gathers_inside(scene) && scene.effects.has(Effect::Diffuse);
        if !wanted(SKY_RATIO) {
            // The skin's own light is as smooth as what it throws back.
            let light = through || sees_skin(scene, fields);
            let order = if light { Order::FOUR } else { Order::LEAST };
            return (light || wanted(BENT_NORMAL)).then_some(Self { order, bounces: false, light });
        }
        let choices = scene.choices;
        let gathered = choices.bounces == Bounces::Gathered;
        let order = match choices.visibility {
            // Rays meet places whose light is known by as many bands as there are.
            Visibility::Rays if gathered => Order::MOST,
            // What is thrown back is smooth.
            Visibility::Scalar | Visibility::Cone | Visibility::Rays if gathered || through => Order::FOUR,
            visibility => visibility.bands().and_then(Order::new).unwrap_or(Order::LEAST),
        };
        // Rays gather by themselves.
        let bounces = gathered && choices.visibility != Visibility::Rays;
        Some(Self { order, bounces, light: true })
    }
}

impl SkyLight {
    /// Of an environment, by as many bands as any choice looks at; with `panorama` also what rays look up.
    #[must_use]
    pub fn of(environment: &Environment, panorama: bool) -> Self {
        let whole = Coefficients::of(environment, Order::MOST);
        let rest = match environment.spots.count {
            0 => Cow::Borrowed(environment),
            _ => Cow::Owned(sky_lights(environment).rest),
        };
        Self {
            rest: Coefficients::of(&rest, Order::MOST),
            whole,
            panorama: panorama.then(|| Arc::new(rest.into_owned())),
        }
    }

    /// That of a scene, where it has an environment. What became lights is left out of the rest.
    pub(super) fn of_scene(scene: &Scene) -> Option<Self> {
        let mut environment = Cow::Borrowed(scene.environment.as_ref()?);
        if scene.sky_lights.is_empty() && environment.spots.count > 0 {
            environment.to_mut().spots.count = 0;
        }
        Some(Self::of(&environment, scene.choices.visibility == Visibility::Rays))
    }
}

/// Directions in which light is looked at.
const DIRECTIONS: u32 = 256;
/// The least share of the mean that open light is to be: what is divided by less may be anything.
const DIM: f64 = 0.01;

/// What the user should know of a scene's light where so few bands make it of a sun that they ring.
pub(super) fn ringing(scene: &Scene, sky: &SkyBake) -> Option<String> {
    let light = sky.light.as_ref()?;
    let visibility = scene.choices.visibility;
    let order = match visibility {
        Visibility::Scalar | Visibility::Rays => return None,
        Visibility::Cone => Order::MOST,
        bands => bands.bands().and_then(Order::new)?,
    };
    let (light, mean) = (light.rest.truncated(order), light.rest.mean());
    let dim = |i: u32| {
        // Even over the sphere: a spiral by the golden angle.
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(DIRECTIONS);
        let (sine, cosine) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        let lit = light.irradiance([radius * sine, y, radius * cosine]);
        (0..3).any(|c| mean[c] > 0.0 && lit[c] < DIM * mean[c])
    };
    (0..DIRECTIONS).any(dim).then(|| {
        format!(
            "{}: the environment is too uneven for visibility = \"{}\": what its harmonics make of open light falls to \
             nothing on one side. Take its sun out with lights = 4 in [environment] and the effects `lights` and \
             `shadows`, or choose visibility = \"scalar\".",
            scene.path.display(),
            visibility.name()
        )
    })
}

/// Transfer vectors of the scene's mesh, with a set for each of the morph targets `used`, by as many rays a vertex as
/// occlusion takes. With `bounces` also those of the light that the mesh throws back, for which `pose` has to give
/// texture coordinates where there is a colour map.
pub(super) fn transfer_of_used(
    scene: &Scene,
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    used: &[usize],
    order: Order,
    bounces: bool,
    baker: &mut Baker<'_>,
) -> VertexTransfer {
    let pose_used = |weights: &[f32]| pose(&all_weights(scene, used, weights));
    let albedo = bounces.then_some(Albedo { map: scene.maps.color.as_ref() });
    let rays = scene.quality.occlusion_rays;
    let baked = baker.transfer(&pose_used, used.len(), rays, order, albedo.as_ref());
    VertexTransfer { order, base: baked.base, morphs: all_sets(scene, used, baked.morphs) }
}
