//! Both ways of shading with lights, their shadows, Fresnel and the sky on, and what happens where there is no visibility
//! buffer: multisampling, and devices that bind too little, shade forward, and the image is that.

use std::pin::pin;
use std::task::{Context, Poll, Waker};

use skinfit::gpu::{Gpu, RenderOptions};
use skinfit::model::effects::Effect;
use skinfit::model::transmission::Method;
use skinfit::prepare::Baked;
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use wgpu::{DeviceDescriptor, Limits};

use super::bench::{Difference, EXACT, gpu, keep, on_gpu, quantile};
use crate::sky::{effect, head_changed};

/// The head with every effect of light that needs no texels.
fn head(shadow_maps: bool) -> Baked {
    let more = ["light_specular", "fresnel", "directional_occlusion", "transmission"].map(effect);
    let more = [&[Effect::NormalMap, Effect::Lights, Effect::Shadows][..], &more].concat();
    head_changed(&more, |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (48, 48);
        scene.metres_per_unit = 0.004;
        if shadow_maps {
            scene.choices.transmission.method = Method::ShadowMaps;
        }
        for (name, value) in [("transmission_unit", 4.0), ("transmission_weight", 0.7), ("gloss", 0.4)] {
            scene.params.set(crate::lit::param(name), value);
        }
    })
}

fn forward(options: RenderOptions) -> RenderOptions {
    RenderOptions { shading: Shading::Forward, ..options }
}

#[test]
fn both_ways_of_shading_show_lights_alike() {
    let Some(gpu) = gpu() else { return };
    for shadow_maps in [false, true] {
        let baked = head(shadow_maps);
        let [computed, drawn] = [EXACT, forward(EXACT)].map(|options| on_gpu(gpu, &baked, options));
        let Difference { interior, uncovered, .. } = Difference::new(&drawn, &computed, 4);
        assert!(interior.len() > 500 && uncovered == 0, "{} {uncovered}", interior.len());
        let shares = [0.5, 0.99].map(|share| quantile(&interior, share));
        println!("{shadow_maps}: {shares:?}, greatest {:?}", interior.last());
        // Both interpolate the same corners in f32, in another order; a comparison with a shadow map, or the peak of a lobe, takes
        // what that leaves many times over. Hardware snaps corners to a 256th of a sample for one of them.
        let near = if gpu.is_software() { [1e-5, 1e-2] } else { [1e-3, 5e-2] };
        assert!(
            shares[0] < near[0] && shares[1] < near[1],
            "{shares:?}; {}",
            keep("ways", &drawn, &computed)
        );
    }
}

/// A device of the same adapter with other limits.
fn limited(gpu: &Gpu, change: impl FnOnce(&mut Limits)) -> Gpu {
    let mut required_limits = gpu.device.limits();
    change(&mut required_limits);
    let descriptor = DeviceDescriptor { required_limits, ..DeviceDescriptor::default() };
    let mut request = pin!(gpu.adapter.request_device(&descriptor));
    let Poll::Ready(device) = request.as_mut().poll(&mut Context::from_waker(Waker::noop())) else {
        panic!("the device is not there at once")
    };
    let (device, queue) = device.unwrap();
    Gpu::adopt(gpu.adapter.clone(), device, queue)
}

#[test]
fn without_a_visibility_buffer_images_are_those_of_shading_forward() {
    let Some(gpu) = gpu() else { return };
    let baked = head(false);
    let drawn = on_gpu(gpu, &baked, forward(EXACT));
    let computed = on_gpu(gpu, &baked, EXACT);
    // To the bit the two ways differ, so that which one was taken shows.
    assert!(drawn.rgb != computed.rgb);
    let multisampled = RenderOptions { antialias: Antialias::Msaa4, ..EXACT };
    let shown = on_gpu(gpu, &baked, multisampled);
    // Pixels' centres lie outside of some triangles that they show: what vertices hold is extrapolated there.
    assert!(shown.rgb.iter().flatten().all(|x| x.is_finite()));
    assert!(shown == on_gpu(gpu, &baked, forward(multisampled)));
    // What vertices hold is bound in two storage buffers; a visibility buffer binds two more.
    let few = limited(gpu, |limits| limits.max_storage_buffers_per_shader_stage = 3);
    assert!(on_gpu(&few, &baked, EXACT) == drawn, "few bindings");
    assert!(on_gpu(&limited(gpu, |_| ()), &baked, EXACT) == computed, "the same limits");
}
