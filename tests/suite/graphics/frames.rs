//! Tiles, sequences of frames, layers.

use skinfit::gpu::{Choice, RenderOptions, Renderer};
use skinfit::model::compose::TermName;
use skinfit::model::effects::Effect;
use skinfit::render::antialias::Antialias;
use skinfit::render::image::Image;
use skinfit::scene::animation::Animation;

use super::bench::*;

#[test]
fn an_image_in_tiles_is_the_image_in_one() {
    // 3300 samples across in targets of 2046: two tiles, the second narrower.
    let (Some(gpu), Some(small)) = (gpu(), open(&Choice { max_side: Some(2048), ..Choice::default() }))
    else {
        return;
    };
    for effects in [SURFACE, everything()] {
        let mut prepared = prepared(&built_in(), effects, 100);
        prepared.scene.views[0].camera.width = 1100;
        let options = RenderOptions { antialias: Antialias::Grid(3), ..EXACT };
        let (whole, tiled) = (on_gpu(gpu, &prepared, options), on_gpu(&small, &prepared, options));
        assert_eq!(whole.alpha, tiled.alpha, "{effects:?}");
        let Difference { interior, .. } = Difference::new(&whole, &tiled, 9);
        // The tile's clip space is rounded otherwise: a few 1e-7 of a pixel's place; hardware snaps it anew.
        let most = if gpu.is_software() { 1e-4 } else { 5e-3 };
        assert!(quantile(&interior, 0.99) < most, "{effects:?}: {}", keep("tiles", &whole, &tiled));
    }
}

#[test]
fn each_term_agrees_with_the_cpu_engines_and_they_add_up_to_the_whole() {
    let Some(gpu) = gpu() else { return };
    let prepared = prepared(&built_in(), everything().without(Effect::Bloom), 64);
    let camera = prepared.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, content(&prepared), EXACT).unwrap();
    let whole = renderer.render(&camera, 0.5).unwrap().image;
    let mut sum = Image { alpha: whole.alpha.clone(), ..Image::new(64, 64) };
    for term in TermName::of(prepared.scene.effects) {
        let image = renderer.render_term(term, &camera, 0.5).unwrap();
        assert_eq!(image.alpha, whole.alpha, "{term:?}");
        let brightest = image.rgb.iter().flatten().fold(0.0_f32, |most, &x| most.max(x.abs()));
        assert!(brightest > 1e-4, "{term:?} shows nothing");
        for (sum, rgb) in sum.rgb.iter_mut().zip(&image.rgb) {
            (0..3).for_each(|c| sum[c] += rgb[c]);
        }
    }
    for (sum, whole) in sum.rgb.iter().flatten().zip(whole.rgb.iter().flatten()) {
        // Each term is its own shader: a few roundings of f32 of its own.
        assert!((sum - whole).abs() < 1e-5 * (1.0 + whole.abs()), "{sum} is not {whole}");
    }
}

#[test]
fn a_renderer_goes_through_an_animation_as_the_cpu_engine_does() {
    let Some(gpu) = gpu() else { return };
    let mut prepared = prepared(&built_in(), everything(), 96);
    let animation = Animation::open(&prepared.scene).unwrap().unwrap();
    let camera = prepared.scene.views[0].camera;
    let (first, last) = animation.seconds;
    assert!(last > first);
    let meshes = [0.0, 0.35, 0.8].map(|share| animation.mesh(first + share * (last - first)).unwrap());
    let still = prepared.scene.clone();
    let at_rest = skinfit::gpu::upload::Content { scene: &still, ..content(&prepared) };
    let mut renderer = Renderer::new(gpu, at_rest, RenderOptions { animated: true, ..EXACT }).unwrap();
    let mut frames = Vec::new();
    for mesh in &meshes {
        renderer.set_mesh(mesh);
        frames.push(renderer.render(&camera, 1.0).unwrap().image);
    }
    assert!(frames[0].rgb != frames[1].rgb, "nothing moves");
    drop(renderer);
    for (i, (mesh, frame)) in meshes.into_iter().zip(frames).enumerate() {
        prepared.scene.mesh = mesh;
        let reference = on_cpu(&mut prepared, 2);
        let Difference { interior, .. } = Difference::new(&reference, &frame, 4);
        // As in `parity`.
        let (found, most) = (quantile(&interior, 0.99), if gpu.is_software() { 1e-4 } else { 5e-3 });
        assert!(found < most, "frame {i}: {found}; {}", keep(&format!("animation_{i}"), &reference, &frame));
    }
}
