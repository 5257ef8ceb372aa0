//! The paper's other readings over samples of a mesh: cubes looked up along the smooth normal, a dapple that turns, a
//! rim that is interpolated.

use std::sync::Arc;

use glam::Vec3;
use skinfit::bake::{Illumination, LobeStack};
use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::view::ObservedView;
use skinfit::engine::{Point, Task};
use skinfit::model::cube::Cube;
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use skinfit::model::params::{Column, Param, Params};
use skinfit::samples::surface_records::Unmade;
use skinfit::samples::{LANES, SurfaceBakes, ViewSamples, sample_views};
use skinfit::scene::maps::Map;
use skinfit::scene::{Loss, Scene};

use super::samples::{sheet, sheet_scene};

/// A scene of a bent sheet under a normal map that leans.
fn leaning(effects: Effects) -> Scene {
    let mut scene = sheet_scene(effects);
    scene.maps.normal = Some(Map { width: 1, height: 1, texels: vec![[0.3, 0.6, 0.9]] });
    scene
}

fn sampled(scene: &Scene) -> ViewSamples {
    let mut mesh = sheet();
    // Bent, so that normals differ from corner to corner, and shorten between them.
    for (normal, position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        *normal = Vec3::new(0.7 * position.x, 0.5 * position.y, 0.6).normalize();
    }
    sample_views(scene, &mesh, SurfaceBakes::default()).unwrap().remove(0)
}

/// Light of 1 from everywhere.
fn white() -> Illumination {
    let cube = || Cube::from_fn(4, |_, _, _| [1.0_f32; 4]);
    let lobes = LobeStack { exponents: vec![16.0, 32.0, 64.0], cubes: vec![cube(), cube(), cube()] };
    Illumination { irradiance: Some(cube()), lobes: Some(lobes), hilite: Some(cube()), reflected: None }
}

/// What the rules show of a scene under white light at its parameters; slots that hold a pixel.
fn shown(scene: &Scene) -> Vec<[f32; 3]> {
    let samples = sampled(scene);
    let there: Vec<usize> =
        (0..samples.pixel.len()).filter(|&slot| samples.pixel[slot] != u32::MAX).collect();
    assert!(there.len() > 500);
    let target = skinfit::samples::rows::Rows::new(3, samples.groups());
    let view = ObservedView { samples, target, ..ObservedView::default() };
    let task = Task {
        setup: scene.setup(),
        illumination: Arc::new(white()),
        views: Arc::new([view]),
        loss: Loss::L2,
        unknowns: Vec::new(),
    };
    let engine = CpuEngine::new(task).unwrap();
    let planes = engine.image(0, &Point { params: scene.params.clone(), gains: vec![1.0.into()] });
    there.into_iter().map(|slot| [0, 1, 2].map(|c| planes[c][slot])).collect()
}

/// Parameters that show one term as it is.
fn alone(form: Form, param: Param) -> Params {
    let mut params = Params::defaults(form);
    use Param as P;
    for weight in [P::BaseWeight, P::RimWeight, P::SideSpecular, P::Hilite, P::Reflection, P::KeyColor] {
        params.set(weight, if weight == param { 1.0 } else { 0.0 });
    }
    params
}

#[test]
fn white_light_is_white_along_whichever_normal() {
    for form in Form::ALL {
        for lookups in Lookups::ALL {
            for param in [Param::BaseWeight, Param::SideSpecular] {
                let mut scene = leaning(Effects::SURFACE.with(Effect::KeyLight));
                (scene.form, scene.lookups, scene.params) = (form, lookups, alone(form, param));
                scene.quality.samples_per_axis = 1;
                // Bilinear in texels of 1: exact.
                assert!(
                    shown(&scene).iter().all(|rgb| *rgb == [1.0; 3]),
                    "{form:?} {lookups:?} {}",
                    param.name()
                );
            }
        }
    }
}

#[test]
fn seen_from_the_side_every_corner_is_at_the_rim() {
    let mut scene = sheet_scene(Effects::of(&[Effect::Diffuse, Effect::Rim]));
    (scene.form, scene.silhouette) = (Form::Listing, Silhouette::Vertex);
    assert!(scene.setup().rim_of_corners());
    let eye = scene.views[0].camera.eye().as_vec3();
    let mut mesh = sheet();
    for (normal, position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        *normal = (*position - eye).cross(Vec3::Y).normalize();
    }
    let samples = sample_views(&scene, &mesh, SurfaceBakes::default()).unwrap().remove(0);
    assert!(samples.surface.places().silhouette.is_none());
    for slot in 0..samples.surface.slots() {
        let Unmade { corner_silhouettes, corner_shares, .. } = samples.surface.unmade(slot);
        // Of unit vectors in f32, and of three shares.
        assert!(corner_silhouettes.iter().all(|z| (1.0 - z).abs() < 1e-6), "{corner_silhouettes:?}");
        assert!((corner_shares.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{corner_shares:?}");
        assert!((samples.surface.fragment(slot).silhouette - 1.0).abs() < 2e-6);
    }
}

#[test]
fn without_a_key_light_smooth_lookups_are_those_of_a_scene_without_a_normal_map() {
    let mut smooth = leaning(Effects::SURFACE);
    smooth.lookups = Lookups::Smooth;
    let plain = sheet_scene(Effects::SURFACE.without(Effect::NormalMap));
    assert_eq!(sampled(&smooth).surface, sampled(&plain).surface);
    // Beside a key light the bumped normal is there as well.
    smooth.effects = smooth.effects.with(Effect::KeyLight);
    let places = *sampled(&smooth).surface.places();
    assert!(places.bump.is_some() && places.normal.is_some());
}

#[test]
fn a_dapple_that_is_held_is_what_one_that_turns_is_made_of() {
    let axis = [0.48, -0.36, 0.8];
    for form in Form::ALL {
        let mut scene = sheet_scene(Effects::of(&[Effect::Reflection]));
        (scene.form, scene.dapple) = (form, Dapple::new(axis, 25.0, false));
        scene.params.set(Param::EnvironmentRotation, 40.0);
        let held = sampled(&scene);
        scene.fit.free = vec![Column::tied(Param::EnvironmentRotation)];
        let turning = sampled(&scene);
        assert!(turning.surface.places().dapple.is_none() && held.surface.places().dapple_normal.is_none());
        let mut seen = 0;
        // Both turns are about +Y, and so one of their sum.
        let towards = Dapple::new(axis, 65.0, false).axis();
        for slot in 0..held.records() * LANES {
            let n = turning.surface.unmade(slot).dapple_normal;
            let cosine: f32 = n.iter().zip(towards).map(|(n, a)| n * a).sum();
            let want = if form == Form::Corrected { cosine.max(0.0) } else { cosine };
            // A few roundings of f32.
            assert!((held.surface.fragment(slot).dapple - want).abs() < 1e-6);
            seen += usize::from(cosine < 0.0);
        }
        assert!(seen > 0, "no sample is turned away");
    }
}

#[test]
fn a_dapple_along_an_axis_shows_its_cosine() {
    // White light mirrored: what is left is S.w.
    let mut scene = sheet_scene(Effects::of(&[Effect::Reflection]));
    scene.quality.samples_per_axis = 1;
    scene.params = alone(Form::Corrected, Param::Reflection);
    scene.params.set(Param::EnvironmentRotation, -35.0);
    scene.dapple = Dapple::new([0.6, 0.0, 0.8], 10.0, false);
    let held = shown(&scene);
    scene.fit.free = vec![Column::tied(Param::EnvironmentRotation)];
    let turning = shown(&scene);
    assert!(held.iter().any(|rgb| rgb[0] > 0.2) && held.len() == turning.len());
    for (a, b) in held.iter().zip(&turning) {
        // A few roundings of f32.
        assert!((a[0] - b[0]).abs() < 1e-6, "{a:?} {b:?}");
    }
}

#[test]
fn corners_make_the_rim_of_the_listing() {
    let mut scene = sheet_scene(Effects::of(&[Effect::Diffuse, Effect::Rim]));
    scene.quality.samples_per_axis = 1;
    (scene.form, scene.silhouette) = (Form::Listing, Silhouette::Vertex);
    scene.params = alone(Form::Listing, Param::RimWeight);
    let samples = sampled(&scene);
    let rim = |slot: usize, power: f32| -> f32 {
        let Unmade { corner_silhouettes, corner_shares, .. } = samples.surface.unmade(slot);
        corner_silhouettes.iter().zip(corner_shares).map(|(z, share)| share * z.powf(power)).sum()
    };
    let there: Vec<usize> = (0..samples.pixel.len()).filter(|&i| samples.pixel[i] != u32::MAX).collect();
    let mut apart = 0.0_f32;
    for power in [2.0, 0.5, 3.7] {
        scene.params.set(Param::RimExponent, power.into());
        for (&slot, rgb) in there.iter().zip(shown(&scene)) {
            // One sample a pixel: a pixel's slot is its sample's. Powers of f32 on either side.
            assert!((rgb[0] - rim(slot, power)).abs() < 2e-6, "{power}: {rgb:?}");
            let squared = samples.surface.fragment(slot).silhouette.powf(power);
            apart = apart.max((rgb[0] - squared).abs());
        }
    }
    // A power of what is interpolated is another number.
    assert!(apart > 1e-3, "{apart}");
}
