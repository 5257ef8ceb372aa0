//! Samples that the adapter drew, as tensors without a way through the host.

use std::path::Path;

use skinfit::demo;
use skinfit::engine::gpu::DeviceSamples;
use skinfit::gpu::upload::Content;
use skinfit::gpu::{Choice, Gpu};
use skinfit::model::effects::{Effect, Effects};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::{Baked, Loaded, PrepareOptions};
use skinfit::samples::ViewSamples;
use skinfit::tensor::{Input, Inputs, Scatter, Shade, Shaded, TensorError};

use super::bench::{numbers, shared};

/// Two views of the built-in scene, small, with the scene's own effects or others.
fn small(effects: Option<Effects>) -> Baked {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let scene = demo::kept_scene(&cache, Some(&cache)).unwrap();
    let options = PrepareOptions { effects, cache: Some(cache), ..PrepareOptions::default() };
    let mut loaded = Loaded::read(&scene, &options).unwrap();
    loaded.scene.views.truncate(2);
    for view in &mut loaded.scene.views {
        (view.camera.width, view.camera.height) = (64, 48);
    }
    loaded.bake().unwrap()
}

#[test]
fn drawn_samples_give_the_image_and_the_gradients_of_the_same_samples_uploaded() {
    let Some(shared) = shared() else { return };
    // With all that the scene shows, and with little: records and tensors hold the requested fields alone.
    for effects in [None, Some(Effects::of(&[Effect::Diffuse, Effect::Rim]))] {
        let baked = small(effects);
        let asked = |param: &Param| param.asked_for(baked.setup().effects);
        let free = [Param::BaseWeight, Param::RimExponent, Param::Occlusion].into_iter().filter(asked);
        let columns: Vec<Column> = free.map(Column::tied).collect();
        let (made, groups) = DeviceSamples::new(shared.gpu(), Content::of(&baked)).unwrap();
        let read: Vec<ViewSamples> = groups
            .iter()
            .enumerate()
            .map(|(i, view)| ViewSamples { surface: made.read(i, view).unwrap(), ..view.clone() })
            .collect();
        let (groups, read): (Vec<_>, Vec<_>) = (groups.iter().collect(), read.iter().collect());
        let shaded = Shaded {
            setup: baked.setup(),
            params: &baked.scene.params,
            columns: &columns,
            illumination: &baked.illumination,
        };
        let image_and_gradients = |(shade, mut inputs): (Shade, Inputs)| {
            let track = |tensor: burn::tensor::Tensor<2>| tensor.autodiff().require_grad();
            inputs.columns = inputs.columns.autodiff().require_grad();
            let tracked =
                [inputs.albedo, inputs.specular, inputs.attenuator, inputs.open, inputs.bump].map(track);
            [inputs.albedo, inputs.specular, inputs.attenuator, inputs.open, inputs.bump] = tracked.clone();
            let columns = inputs.columns.clone();
            let image = shade.image(inputs).unwrap();
            let gradients = (image.clone() * image.clone()).sum().backward();
            let mut all = vec![numbers(image)];
            all.push(numbers(columns.grad(&gradients).unwrap()));
            let of_samples = [Input::Albedo, Input::Specular, Input::Attenuator, Input::Open, Input::Bump];
            for (input, tensor) in of_samples.into_iter().zip(tracked) {
                if shade.reads(input) {
                    all.push(numbers(tensor.grad(&gradients).unwrap()));
                }
            }
            all
        };
        let drawn = Shade::over_device_samples(shared, &shaded, &made, &groups, Scatter::Exact).unwrap();
        let uploaded = Shade::new(shared, &shaded, &read, Scatter::Exact).unwrap();
        assert_eq!(
            (drawn.0.slots(), drawn.0.samples()),
            (uploaded.0.slots(), uploaded.0.samples()),
            "{effects:?}"
        );
        let (got, want) = (image_and_gradients(drawn), image_and_gradients(uploaded));
        assert!(want[0].iter().any(|x| *x > 0.0) && want[1].iter().all(|x| *x != 0.0), "{effects:?}");
        // The same numbers, by the same shaders: to the bit.
        assert!(got == want, "{effects:?}");
    }
}

#[test]
fn samples_of_another_device_and_other_views_are_refused_in_words() {
    let Some(shared) = shared() else { return };
    let baked = small(Some(Effects::SURFACE));
    let other = Gpu::open(&Choice::default()).unwrap();
    let (made, groups) = DeviceSamples::new(&other, Content::of(&baked)).unwrap();
    let shaded = Shaded {
        setup: baked.setup(),
        params: &baked.scene.params,
        columns: &[],
        illumination: &baked.illumination,
    };
    let groups: Vec<_> = groups.iter().collect();
    let refused = |refused: Result<(), TensorError>, words: &str| {
        let error = refused.unwrap_err();
        assert!(matches!(error, TensorError::Foreign { what: "the samples", .. }), "{error:?}");
        assert!(error.to_string().contains(words), "{error}");
    };
    let over = |made: &DeviceSamples, groups: &[&ViewSamples]| {
        Shade::over_device_samples(shared, &shaded, made, groups, Scatter::Exact).map(|_| ())
    };
    refused(over(&made, &groups), "another device");
    let (made, _) = DeviceSamples::new(shared.gpu(), Content::of(&baked)).unwrap();
    refused(over(&made, &groups[..1]), "came with them");
    refused(Shade::new(shared, &shaded, &groups, Scatter::Exact).map(|_| ()), "without a surface");
}
