//! Tiles, sequences of frames, layers.

use std::sync::Arc;

use skinfit::bake::bake_pose;
use skinfit::gpu::{Choice, Gpu, GpuError, RenderOptions, Renderer};
use skinfit::model::effects::Effect;
use skinfit::model::terms::TermName;
use skinfit::prepare::Baked;
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
        let baked = baked(&built_in(), effects, 100).with_scene(|scene| scene.views[0].camera.width = 1100);
        let options = RenderOptions { antialias: Antialias::Grid(3), ..EXACT };
        let (whole, tiled) = (on_gpu(gpu, &baked, options), on_gpu(&small, &baked, options));
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
    let baked = baked(&built_in(), everything().without(Effect::Bloom), 64);
    let camera = baked.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let whole = renderer.render(&camera, 0.5).unwrap().image;
    let mut sum = Image { alpha: whole.alpha.clone(), ..Image::new(64, 64) };
    for term in TermName::of(baked.scene.effects) {
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
    // The same with and without an occlusion of each frame's own.
    for of_its_own in [false, true] {
        goes_through_an_animation(gpu, of_its_own);
    }
}

fn goes_through_an_animation(gpu: &Gpu, of_its_own: bool) {
    let baked = baked(&built_in(), everything(), 96);
    let animation = Animation::open(&baked.scene).unwrap().unwrap();
    let camera = baked.scene.views[0].camera;
    let (first, last) = animation.seconds;
    assert!(last > first);
    let meshes = [0.0, 0.35, 0.8].map(|share| animation.mesh(first + share * (last - first)).unwrap());
    let mut renderer =
        Renderer::new(gpu, Content::of(&baked), RenderOptions { animated: true, ..EXACT }).unwrap();
    let (mut frames, mut occlusions) = (Vec::new(), Vec::new());
    for mesh in &meshes {
        let own = of_its_own.then(|| bake_pose(&baked.scene, &mesh.pose(), None, Some(&cache())).0);
        renderer.set_mesh(mesh, own.as_ref()).unwrap();
        occlusions.push(own.and_then(|own| own.occlusion));
        frames.push(renderer.render(&camera, 1.0).unwrap().image);
    }
    assert!(frames[0].rgb != frames[1].rgb, "nothing moves");
    drop(renderer);
    for (i, ((mesh, occlusion), frame)) in meshes.into_iter().zip(occlusions).zip(frames).enumerate() {
        let baked = baked.clone().with_scene(|scene| scene.mesh = mesh);
        let occlusion = occlusion.map(Arc::new).or(baked.occlusion.clone());
        let reference = on_cpu(&Baked { occlusion, ..baked }, 2);
        let Difference { interior, .. } = Difference::new(&reference, &frame, 4);
        // As in `parity`.
        let (found, most) = (quantile(&interior, 0.99), if gpu.is_software() { 1e-4 } else { 5e-3 });
        assert!(found < most, "frame {i}: {found}; {}", keep(&format!("animation_{i}"), &reference, &frame));
    }
}

#[test]
fn an_image_that_is_not_waited_for_is_the_same_and_so_is_that_of_an_adopted_device() {
    let Some(gpu) = gpu() else { return };
    let baked = baked(&built_in(), everything(), 64);
    let camera = baked.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let waited = renderer.render(&camera, 0.7).unwrap().image;
    assert!(waited.rgb.iter().flatten().any(|x| *x > 0.0));
    let arrived = pollster::block_on(renderer.render_async(&camera, 0.7)).unwrap().image;
    assert!(waited == arrived);
    // As an application does that has opened a device for its window.
    let own = pollster::block_on(Gpu::request(&Choice::default())).unwrap();
    let adopted = Gpu::adopt(own.adapter.clone(), own.device.clone(), own.queue.clone());
    let mut renderer = Renderer::new(&adopted, Content::of(&baked), EXACT).unwrap();
    assert!(renderer.render(&camera, 0.7).unwrap().image == waited);
    adopted.close();
    let lost = pollster::block_on(renderer.render_async(&camera, 0.7)).map(|_| ());
    assert!(matches!(lost, Err(GpuError::Lost { .. })), "{lost:?}");
}

#[test]
fn a_frame_that_is_left_on_the_adapter_changes_none_that_is_read() {
    let Some(gpu) = gpu() else { return };
    let baked = baked(&built_in(), everything(), 64);
    let camera = baked.scene.views[0].camera;
    let mut renderer = Renderer::new(gpu, Content::of(&baked), EXACT).unwrap();
    let read = renderer.render(&camera, 0.7).unwrap().image;
    renderer.draw_unread(&camera, 0.3).unwrap();
    gpu.wait().unwrap();
    assert!(renderer.render(&camera, 0.7).unwrap().image == read);
}

#[test]
fn bones_and_weights_alone_move_a_frame_as_a_mesh_in_that_pose_does() {
    let Some(gpu) = gpu() else { return };
    let baked = baked(&built_in(), everything(), 64);
    let camera = baked.scene.views[0].camera;
    let options = RenderOptions { animated: true, ..EXACT };
    let renderer = || Renderer::new(gpu, Content::of(&baked), options).unwrap();
    let (mut by_mesh, mut by_pose) = (renderer(), renderer());
    let still = by_pose.render(&camera, 1.0).unwrap().image;
    let mut mesh = baked.scene.mesh.clone();
    let turn = glam::Mat4::from_rotation_x(0.2);
    mesh.bones.iter_mut().for_each(|bone| *bone = turn * *bone);
    mesh.morphs.iter_mut().for_each(|morph| morph.weight = 0.5);
    by_mesh.set_mesh(&mesh, None).unwrap();
    let weights: Vec<f32> = mesh.morphs.iter().map(|morph| morph.weight).collect();
    by_pose.set_pose(&mesh.bones, &weights).unwrap();
    let moved = by_pose.render(&camera, 1.0).unwrap().image;
    assert!(moved == by_mesh.render(&camera, 1.0).unwrap().image && moved != still);
    // What is not given stands as in the scene.
    by_pose.set_pose(&[], &[]).unwrap();
    assert!(by_pose.render(&camera, 1.0).unwrap().image == still);
}
