//! What holds of every effect that comes with the library, of tables and of files: the list is the program's own.

use skinfit::engine::Unknown;
use skinfit::model::choices::SpecularMap;
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::{Column, Param, Scale};
use skinfit::prepare::{Baked, Loaded, PrepareOptions, Views};
use skinfit::scene::Scene;
use skinfit::shader::term::{library, terms};

use crate::graphics::bench::cache;
use crate::sky::{beside_a_lamp, brighter, on_cpu};
use crate::slopes::{self, Nearness};

/// In the order of documentation.
pub(crate) fn every_effect() -> Vec<Effect> {
    library::register_all();
    Effect::all().filter(|&effect| effect.is_built_in() || library::is_own(effect)).collect()
}

/// An effect with what it takes to see it: bumped skin that mirrors, its light, and what the effect is part of.
fn seen(effect: Effect) -> Effects {
    let whole = std::iter::successors(Some(effect), |part| part.info().within);
    let mut skin = Effects::of(&[Effect::Diffuse, Effect::NormalMap, Effect::Reflection]);
    if !effect.is_built_in() || effect == Effect::Shadows {
        skin = skin.with(Effect::Lights);
    }
    whole.fold(skin, Effects::with)
}

/// What a fit may move of what a scene's effects ask for.
fn free(scene: &Scene) -> impl Iterator<Item = Param> + use<'_> {
    // A picture's bloom is no part of a fit.
    let fitted = |param: &Param| !scene.effects.has(Effect::Bloom) || *param != Param::HazeWeight;
    Param::all().filter(move |param| param.asked_for(scene.effects) && !param.info().held && fitted(param))
}

/// The built-in head beside a lamp under an effect that shows, `size` x `size` pixels.
pub(crate) fn shown(effect: Effect, size: u32) -> Baked {
    let options = PrepareOptions {
        effects: Some(seen(effect)),
        fit: true,
        views: Views::First,
        cache: Some(cache()),
        ..PrepareOptions::default()
    };
    let mut loaded = Loaded::read(beside_a_lamp(), &options).unwrap();
    let scene = &mut loaded.scene;
    let camera = &mut scene.views[0].camera;
    (camera.width, camera.height) = (size, size);
    scene.quality.occlusion_rays = 64;
    scene.diffusion.light_map_size = 64;
    // What is 0 by default would show nothing.
    let params: Vec<Param> = free(scene).collect();
    for &param in &params {
        let [default, ..] = scene.params.rgb(param);
        if param.info().linear && default == 0.0 {
            scene.params.set(param, 0.25);
        }
        // A slope has two sides where a cube was baked.
        if param.info().scale == Scale::Log {
            scene.params.set(param, 0.9 * default);
        }
    }
    // Of what the maps do, all.
    scene.choices.specular_map = SpecularMap::F0;
    let columns = params.into_iter().flat_map(|param| match scene.params.rgb(param) {
        [r, g, b] if r == g && g == b => vec![Column::tied(param)],
        _ => Column::per_channel(param).to_vec(),
    });
    scene.fit.free = columns.collect();
    loaded.bake().unwrap()
}

/// As of engines elsewhere, but that an angle's degree moves little, and levels of an atlas round some tens of times more.
const NEAR: Nearness = Nearness { step: 1e-4, difference: 1e-5, loss: 1e-5, slope: [1e-3, 1e-5] };

/// Exports leave such an effect out.
#[test]
fn what_a_weight_of_0_leaves_is_what_is_there_without_its_effect() {
    let mut tried = Vec::new();
    // The scene's lamp is registered with the first scene.
    let weighed = |effect: Effect| {
        let weights = terms().into_iter().flat_map(|term| term.weighed.iter().copied());
        let own = move |idle: Effect| {
            idle == effect || (effect == Effect::Lights && idle.info().within == Some(effect))
        };
        weights.filter(move |(idle, _)| own(*idle)).collect::<Vec<_>>()
    };
    for effect in
        every_effect().into_iter().filter(|&effect| !weighed(effect).is_empty() || effect == Effect::Lights)
    {
        let baked = shown(effect, 16);
        let as_it_is = on_cpu(&baked).rgb;
        for (idle, weight) in weighed(effect).into_iter().filter(|(idle, _)| baked.scene.effects.has(*idle)) {
            let nothing = baked.clone().with_scene(|scene| scene.params.set(weight, 0.0));
            let without = baked.clone().with_scene(|scene| scene.effects = scene.effects.without(idle));
            let nothing = on_cpu(&nothing).rgb;
            assert_eq!(nothing, on_cpu(&without).rgb, "{} at {} = 0", idle.name(), weight.name());
            assert_ne!(nothing, as_it_is, "{} shows nothing anyway", idle.name());
            tried.push(weight.name());
        }
    }
    tried.sort_unstable();
    assert_eq!(tried, ["light.side.color", "specular_weight", "specular_weight", "transmission_weight"]);
}

#[test]
fn slopes_by_its_parameters_are_finite_differences_on_every_engine() {
    for effect in every_effect() {
        let baked = shown(effect, 16);
        let mut target = brighter(on_cpu(&baked));
        target.haze = baked.scene.effects.has(Effect::Haze).then(|| vec![0.1; 16 * 16]);
        let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
        let unknowns: Vec<Unknown> = baked.scene.fit.free.iter().copied().map(Unknown::Param).collect();
        let observed = baked.sample().unwrap().observe().unwrap();
        slopes::assert_slopes(&observed, &unknowns, &NEAR, effect.name());
    }
}
