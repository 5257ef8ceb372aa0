//! What the renderer refuses, and lost devices.

use skinfit::gpu::RenderOptions;
use skinfit::gpu::{Choice, Gpu, GpuError, Renderer};
use skinfit::render::shading::Shading;

use super::bench::*;

#[test]
fn an_adapter_that_is_not_there_is_refused_with_those_that_are() {
    let Some(gpu) = gpu() else { return };
    let error = Gpu::open(&Choice { name: Some("Voodoo 2".to_owned()), ..Choice::default() }).unwrap_err();
    let words = error.to_string();
    assert!(matches!(error, GpuError::NoSuchAdapter { .. }), "{words}");
    assert!(words.contains("Voodoo 2") && words.contains(gpu.name()), "{words}");
}

#[test]
fn an_image_or_a_map_beyond_the_adapters_limit_is_refused_and_the_device_goes_on() {
    let Some(small) = open(&Choice { max_side: Some(512), ..Choice::default() }) else { return };
    let baked = baked(&built_in(), SURFACE, 16);
    // The built-in maps are larger than that.
    let Err(GpuError::TextureSize { limit: 512, what, .. }) =
        Renderer::new(&small, Content::of(&baked), EXACT).map(|_| ())
    else {
        panic!("a map of more than 512 texels was taken")
    };
    assert!(what.contains("texels"), "{what}");
    let baked = baked.with_scene(|scene| scene.maps = Default::default());
    let mut renderer = Renderer::new(&small, Content::of(&baked), EXACT).unwrap();
    let mut camera = baked.scene.views[0].camera;
    let seen = renderer.render(&camera, 1.0).unwrap();
    camera.width = 513;
    let Err(GpuError::TextureSize { limit: 512, width: 513, what, .. }) = renderer.render(&camera, 1.0)
    else {
        panic!("an image of 513 pixels was drawn")
    };
    assert_eq!(what, "image");
    camera.width = 16;
    assert_eq!(renderer.render(&camera, 1.0).unwrap().image, seen.image);
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    let Some(gpu) = open(&Choice::default()) else { return };
    let baked = baked(&built_in(), SURFACE, 16);
    let mut renderer = Renderer::new(&gpu, Content::of(&baked), EXACT).unwrap();
    gpu.close();
    let error = renderer.render(&baked.scene.views[0].camera, 1.0).unwrap_err();
    assert!(matches!(error, GpuError::Lost { .. }), "{error}");
    assert!(matches!(Renderer::new(&gpu, Content::of(&baked), EXACT), Err(GpuError::Lost { .. })));
}

#[test]
fn a_shader_that_the_driver_refuses_is_an_error_and_no_panic() {
    let Some(gpu) = open(&Choice::default()) else { return };
    let baked = baked(&built_in(), SURFACE, 16);
    let broken = |plan: &skinfit::shader::Plan| {
        let mut plan = plan.clone();
        plan.wgsl.push_str("\nfn broken() -> f32 { return vec3f(1.0); }\n");
        plan
    };
    let options = RenderOptions { shading: Shading::Forward, ..EXACT };
    let made = Renderer::with_shader(&gpu, Content::of(&baked), options, broken);
    let Err(error @ GpuError::Refused { .. }) = made.map(|_| ()) else { panic!("it was taken") };
    assert_eq!(error.to_string().lines().count(), 1, "{error}");
}
