//! `[diffusion] unblurred`: the share of the light that no blur has moved, out of the light map or as it falls in the pixel.

use skinfit::engine::Unknown;
use skinfit::gpu::Renderer;
use skinfit::gpu::upload::Content;
use skinfit::model::diffusion::Unblurred;
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;
use skinfit::render::image::Image;

use crate::graphics::bench::{Difference, EXACT, gpu, quantile};
use crate::sky::{brighter, effect, head_with, on_cpu};
use crate::slopes;

fn param(name: &str) -> Param {
    Param::from_name(name).unwrap()
}

/// The built-in head with a lamp, in `pixels` pixels a side, its light map of 128 texels.
fn head(unblurred: Unblurred, pixels: u32) -> Baked {
    let more = [Effect::NormalMap, Effect::Lights, Effect::Shadows, effect("fresnel"), effect("diffusion")];
    head_with(&more).with_scene(|scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (pixels, pixels);
        scene.diffusion.light_map_size = 128;
        scene.choices.diffusion.unblurred = unblurred;
        scene.metres_per_unit = 1.0;
        for (level, weight) in [("1", 0.3), ("2", 0.2), ("3", 0.1)] {
            scene.params.set(param(&format!("diffusion_weight_{level}")), weight);
        }
    })
}

fn without_weights(baked: Baked) -> Baked {
    baked.with_scene(|scene| {
        for level in ["1", "2", "3"] {
            scene.params.set(param(&format!("diffusion_weight_{level}")), 0.0);
        }
    })
}

fn most(a: &Image, b: &Image) -> f32 {
    let off = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
    a.rgb.iter().zip(&b.rgb).map(off).fold(0.0, f32::max)
}

/// Where all light stays where it falls, diffusion shows what a scene without it does, whatever part of the colour is mixed
/// in beforehand; out of the map it shows what texels make of it.
#[test]
fn with_all_weight_on_it_an_image_is_what_it_is_without_diffusion() {
    let without = head(Unblurred::Pixel, 32).with_scene(|scene| {
        scene.effects = scene.effects.without(effect("diffusion"));
    });
    let plain = on_cpu(&without);
    let in_pixel = without_weights(head(Unblurred::Pixel, 32));
    for mix in [0.0, 0.4, 1.0] {
        let mixed = in_pixel.clone().with_scene(|scene| scene.params.set(param("colour_mix"), mix));
        // Powers of the colour are of exp and log of f32, some roundings of a radiance of 2 at most.
        assert!(most(&on_cpu(&mixed), &plain) < 5e-6, "mix {mix}: {}", most(&on_cpu(&mixed), &plain));
    }
    let in_map = on_cpu(&without_weights(head(Unblurred::Map, 32)));
    assert!(
        most(&in_map, &plain) > 0.05,
        "texels of 128 a side are wider than pixels: {}",
        most(&in_map, &plain)
    );
}

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    let baked = head(Unblurred::Pixel, 16);
    let target = brighter(on_cpu(&baked));
    let baked = baked.with_scene(|scene| {
        scene.views[0].target = Some(target);
        scene.params.set(param("colour_mix"), 0.4);
    });
    let observed = baked.sample().unwrap().observe().unwrap();
    let columns =
        ["base_weight", "diffusion_weight_1", "diffusion_radius_2", "colour_mix", "light.side.color"];
    let unknowns: Vec<Unknown> =
        columns.into_iter().map(|name| Unknown::Param(Column::tied(param(name)))).collect();
    slopes::assert_slopes(&observed, &unknowns, &slopes::EXACT, "unblurred in the pixel");
}

#[test]
fn the_renderer_draws_what_the_processor_does() {
    let Some(gpu) = gpu() else { return };
    let baked = head(Unblurred::Pixel, 48);
    let want = on_cpu(&baked);
    let camera = baked.scene.views[0].camera;
    let got = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap().render(&camera, 1.0).unwrap().image;
    let Difference { interior, .. } = Difference::new(&want, &got, 4);
    // The lamp's shadow is interpolated from vertices there, and found at each sample and texel here.
    assert!(quantile(&interior, 0.5) < 1e-3, "{}", quantile(&interior, 0.5));
}
