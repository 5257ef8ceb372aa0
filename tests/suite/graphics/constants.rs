//! Other constants and samples in a renderer that is there already, beside one that is made with them.

use skinfit::gpu::upload::Content;
use skinfit::gpu::{RenderOptions, Renderer};
use skinfit::model::params::{Param, Params};
use skinfit::prepare::Baked;
use skinfit::render::antialias::Antialias;
use skinfit::render::image::Image;
use skinfit::render::shading::Shading;
use skinfit::shader::Budget;

use super::bench::{gpu, on_gpu};
use crate::every_effect::{every_effect, shown};

const OPTIONS: RenderOptions = RenderOptions {
    antialias: Antialias::Grid(2),
    shading: Shading::VisibilityBuffer,
    budget: Budget::Exact,
    timed: false,
    animated: false,
};

fn drawn(renderer: &mut Renderer, baked: &Baked) -> Image {
    renderer.render(&baked.scene.views[0].camera, baked.gains[0]).unwrap().image
}

/// A parameter moved within its bounds by so much that it shows.
fn moved(params: &mut Params, param: Param) {
    let (lower, upper) = param.info().range();
    let by = if param.info().unit == "degrees" { 7.0 } else { 0.0 };
    let rgb = params.rgb(param).map(|value| (0.9 * value + by).clamp(lower, upper));
    params.set_rgb(param, rgb);
}

/// All that is linear is moved, and then what an effect itself asks for.
#[test]
fn constants_that_are_taken_later_draw_what_they_draw_from_the_start() {
    let Some(gpu) = gpu() else { return };
    for effect in every_effect() {
        let baked = shown(effect, 24);
        let mut renderer = Renderer::new(gpu, Content::of(&baked), OPTIONS).unwrap();
        renderer.set_background(baked.scene.views[0].background);
        let params = Param::of(baked.scene.effects).filter(|param| param.asked_for(baked.scene.effects));
        let params = params.filter(|param| !param.info().held);
        let (linear, others): (Vec<Param>, Vec<Param>) = params.partition(|param| param.info().linear);
        let own: Vec<Param> =
            others.into_iter().filter(|param| param.info().effects.contains(&effect)).collect();
        let before = drawn(&mut renderer, &baked);
        let mut other = baked.scene.params.clone();
        for group in [linear, own].into_iter().filter(|group| !group.is_empty()) {
            group.iter().for_each(|&param| moved(&mut other, param));
            renderer.set_params(&other).unwrap();
            let names: Vec<&str> = group.iter().map(|param| param.name()).collect();
            let after = drawn(&mut renderer, &baked);
            // Weights show whatever they are of.
            let weights = group.iter().all(|param| param.info().linear);
            assert!(!weights || after != before, "{}: {names:?} show nothing", effect.name());
            // The same device runs the same shader over the same numbers.
            let anew = baked.clone().with_scene(|scene| scene.params = other.clone());
            assert!(after == on_gpu(gpu, &anew, OPTIONS), "{}: {names:?}", effect.name());
        }
        // Back again, nothing of it is left.
        renderer.set_params(&baked.scene.params).unwrap();
        assert!(drawn(&mut renderer, &baked) == before, "{}, back", effect.name());
    }
}

#[test]
fn fewer_samples_draw_what_a_renderer_of_fewer_draws() {
    let Some(gpu) = gpu() else { return };
    let baked = shown(every_effect()[0], 48);
    let mut renderer = Renderer::new(gpu, Content::of(&baked), OPTIONS).unwrap();
    renderer.set_background(baked.scene.views[0].background);
    let whole = drawn(&mut renderer, &baked);
    renderer.set_grid(1);
    let one = drawn(&mut renderer, &baked);
    assert!(one == on_gpu(gpu, &baked, RenderOptions { antialias: Antialias::Grid(1), ..OPTIONS }));
    assert!(one != whole);
    renderer.set_grid(2);
    assert!(drawn(&mut renderer, &baked) == whole);
}
