//! The whole effect `diffusion` with its three blurs, beside lights, the sky and Fresnel: images of both ways of shading on an
//! adapter beside the processor's, slopes beside finite differences on every engine, and what is extreme.

use skinfit::engine::Unknown;
use skinfit::gpu::RenderOptions;
use skinfit::model::effects::Effect;
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;
use skinfit::render::shading::Shading;
use skinfit::scene::Scene;

use crate::graphics::bench::{Difference, EXACT, gpu, keep, on_gpu, quantile};
use crate::lit::param;
use crate::sky::{brighter, effect, head_changed, on_cpu};
use crate::slopes::{self, Nearness};

/// The built-in head in scattered light: blurs some texels wide, half of the colour before them.
pub(crate) fn head(more: &[Effect], change: impl FnOnce(&mut Scene)) -> Baked {
    let diffusion = ["directional_occlusion", "diffusion"].map(effect);
    let effects = [&[Effect::NormalMap, Effect::Lights][..], &diffusion, more].concat();
    head_changed(&effects, |scene| {
        scene.diffusion.light_map_size = 96;
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (48, 48);
        for (name, value) in [
            ("diffusion_radius_1", 3.0),
            ("diffusion_radius_2", 6.0),
            ("diffusion_radius_3", 14.0),
            ("colour_mix", 0.4),
            ("occlusion", 0.8),
            ("light.side.azimuth", 40.0),
        ] {
            scene.params.set(param(name), value);
        }
        change(scene);
    })
}

/// The share of its mean that the image moves by.
fn moved(a: &Baked, b: &Baked) -> f32 {
    quantile(&Difference::new(&on_cpu(a), &on_cpu(b), 4).interior, 0.9)
}

#[test]
fn the_renderer_shows_scattered_light_as_the_processor_does_in_both_ways_of_shading() {
    let Some(gpu) = gpu() else { return };
    let baked = head(&["light_specular", "fresnel"].map(effect), |_| ());
    let want = on_cpu(&baked);
    for shading in Shading::ALL {
        let got = on_gpu(gpu, &baked, RenderOptions { shading, ..EXACT });
        let Difference { interior, uncovered, .. } = Difference::new(&want, &got, 4);
        assert!(interior.len() > 500 && uncovered < 40, "{} {uncovered}", interior.len());
        let shares = [0.5, 0.9, 0.99].map(|share| quantile(&interior, share));
        println!("{}: {shares:?}, greatest {:?}", shading.name(), interior.last());
        // Texels of outlines that one of the two covers alone, one in five hundred, are weighed in the blurs around them; maps,
        // cubes and frames of texels are read to a thousandth at the worst.
        let near = shares.iter().zip([2e-4, 1e-3, 1e-2]).all(|(found, most)| *found < most);
        assert!(near, "{}: {shares:?}; {}", shading.name(), keep("diffusion", &want, &got));
    }
    // Each part of the effect shows far more than that.
    let narrow = |name: &'static str| {
        baked.clone().with_scene(move |scene| scene.params.set(param(name), param(name).info().lower))
    };
    for name in ["diffusion_radius_1", "diffusion_radius_2", "diffusion_radius_3", "colour_mix"] {
        assert!(moved(&baked, &narrow(name)) > 1e-2, "{name}");
    }
}

const RADII: [&str; 3] = ["diffusion_radius_1", "diffusion_radius_2", "diffusion_radius_3"];
const WEIGHTS: [&str; 3] = ["diffusion_weight_1", "diffusion_weight_2", "diffusion_weight_3"];

/// All that moves the effect; a column that is tied moves all channels together, a weight has one each.
pub(crate) fn columns() -> Vec<Column> {
    let tied = ["colour_mix", "base_weight", "rim_weight", "occlusion", "normal_strength"];
    let light = ["environment_rotation", "light.side.color", "light.side.azimuth", "light.side.elevation"];
    let tied = RADII.into_iter().chain(tied).chain(light).map(|name| Column::tied(param(name)));
    let each = WEIGHTS.into_iter().flat_map(|name| Column::per_channel(param(name)));
    tied.chain(each).collect()
}

/// As of engines elsewhere, but that levels and what is looked up of them round some tens of times more.
const NEAR: Nearness = Nearness { step: 1e-5, difference: 1e-6, loss: 1e-5, slope: [1e-3, 1e-5] };

#[test]
fn slopes_are_finite_differences_on_every_engine() {
    // A light's parameters are known once a scene was read.
    let _known = effect("diffusion");
    let baked = head(&[], |scene| {
        let camera = &mut scene.views[0].camera;
        (camera.width, camera.height) = (16, 16);
        scene.diffusion.light_map_size = 64;
        scene.fit.free = columns();
    });
    let target = brighter(on_cpu(&baked));
    let baked = baked.with_scene(|scene| scene.views[0].target = Some(target));
    let observed = baked.sample().unwrap().observe().unwrap();
    let unknowns: Vec<Unknown> = columns().into_iter().map(Unknown::Param).collect();
    assert!(
        unknowns.iter().all(|unknown| matches!(unknown, Unknown::Param(c) if c.param != Param::SpecularLobe))
    );
    slopes::assert_slopes(&observed, &unknowns, &NEAR, "diffusion");
}
