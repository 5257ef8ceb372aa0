//! What may be added to a set of effects at once.

use crate::model::diffusion::{DiffusionChoices, Method, Seams};
use crate::model::effects::{Effect, Effects, Prerequisite};
use crate::samples::atlas::overlap;
use crate::scene::{Offers, Scene};
use crate::shader::term::library;

/// Effects that are added together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Move(Vec<Effect>);

/// Effects that make no picture by themselves: they pose the mesh, or belong to an output's alpha.
const OTHERS: [Effect; 4] = [Effect::Morph, Effect::Skin, Effect::Haze, Effect::Bloom];

fn named(name: &str) -> Option<Effect> {
    Effect::from_name(name)
}

/// Whether a scene has what an effect is about.
fn is_possible(scene: &Scene, offers: Offers, effect: Effect) -> bool {
    match effect.info().asks {
        Some(Prerequisite::NormalMap) => offers.normal_map,
        Some(Prerequisite::Environment) => offers.environment,
        Some(Prerequisite::Lights) => offers.lights,
        // One that the renderer can draw is what its cost is told of.
        Some(Prerequisite::Atlas) => has_atlas(scene),
        Some(Prerequisite::Hand) => scene.effects.has(effect),
        None => true,
    }
}

/// Whether light can stand in texels of the mesh's UV atlas, and be blurred there by a renderer.
fn has_atlas(scene: &Scene) -> bool {
    let DiffusionChoices { method, seams, .. } = scene.choices.diffusion;
    let drawn = method == Method::Separable && seams == Seams::Cut;
    drawn && overlap(scene.mesh.atlas_uvs(), &scene.mesh.triangles, scene.diffusion.light_map_size).is_ok()
}

impl Move {
    /// The moves that a scene has something for: each effect by itself, and those together that hide each other's worth.
    #[must_use]
    pub fn all(scene: &Scene, offers: Offers) -> Vec<Self> {
        let singles = Effect::all()
            .filter(|effect| !OTHERS.contains(effect) && effect.info().within.is_none())
            .filter(|effect| effect.is_built_in() || library::is_own(*effect) || scene.effects.has(*effect))
            .map(|effect| vec![effect.name()]);
        // A light without its shadow is worse than none; gloss that nothing shades drowns what shadows gain.
        let together = [
            &["lights", "shadows"][..],
            &["lights", "shadows", "light_specular"],
            &["lights", "shadows", "light_specular", "fresnel"],
            &["lights", "shadows", "light_specular", "fresnel", "directional_occlusion"],
            &["fresnel", "occlusion"],
            &["fresnel", "directional_occlusion"],
        ];
        let all = singles.chain(together.map(<[_]>::to_vec));
        let known = all.map(|names| names.into_iter().map(named).collect::<Option<Vec<_>>>());
        let moves = known.flatten().filter(|effects| effects.iter().all(|&e| is_possible(scene, offers, e)));
        moves.map(Self).collect()
    }

    /// The cheapest set that shows something, and what the scene's mesh is posed by.
    #[must_use]
    pub fn start(scene: &Scene, offers: Offers) -> Effects {
        let posed = OTHERS.into_iter().filter(|&effect| scene.effects.has(effect));
        let light = if offers.environment { Effect::Diffuse } else { Effect::Lights };
        posed.fold(Effects::of(&[light]), Effects::with)
    }

    /// The set with these effects too; `None` where that says nothing new, or an effect would do nothing.
    #[must_use]
    pub fn onto(&self, set: Effects) -> Option<Effects> {
        let with = self.0.iter().fold(set, |set, &effect| set.with(effect));
        let idle = |effect: &Effect| effect.info().upon.is_some_and(|other| !with.has(other));
        let known = self.0.iter().any(|effect| set.has(*effect)) && self.0.len() > 1;
        (with != set && !known && !self.0.iter().any(idle)).then_some(with)
    }

    /// `lights + shadows`
    #[must_use]
    pub fn words(&self) -> String {
        self.0.iter().map(|effect| effect.name()).collect::<Vec<_>>().join(" + ")
    }
}

/// Whether a set may lose an effect: what is left shows something, and no other effect is about it.
#[must_use]
pub fn can_go(set: Effects, effect: Effect) -> bool {
    let shows = [Effect::Diffuse, Effect::Lights].iter().any(|&other| other != effect && set.has(other));
    let wanted = set.iter().any(|other| other.info().upon == Some(effect));
    !OTHERS.contains(&effect) && effect.info().within.is_none() && shows && !wanted
}
