//! The renderer on an adapter shows what the CPU engine shows.
//!
//! Both read the same texels and filter them in 32 bits; the CPU evaluates the rest in f64 at rays through
//! the samples' centres, the adapter in f32 at what its rasteriser interpolates.

use glam::{DMat4, Vec3};
use skinfit::gpu::Gpu;
use skinfit::gpu::RenderOptions;
use skinfit::model::dapple::Dapple;
use skinfit::model::effects::{Effect, Form, Lookups, Silhouette};
use skinfit::model::params::{Column, Param};
use skinfit::prepare::Baked;
use skinfit::render::image::Image;
use skinfit::render::shading::Shading;
use skinfit::scene::Scene;
use std::path::Path;

use super::bench::*;
use crate::common;
use crate::every_effect::{every_effect, shown};

/// Pixels along a side: a software adapter takes some hundredths of a second.
const SIZE: u32 = 128;

/// How far apart the engines may be, relative to the image's mean radiance.
#[derive(Clone, Copy)]
struct Tolerance {
    /// Half of the interior pixels.
    median: f32,
    /// 99 of 100 interior pixels.
    most: f32,
    /// All but the share [`CREASES`] of them, and 95 of 100 edge pixels.
    nearly_all: f32,
}

/// A software adapter interpolates from corners where they are: what is left is f32. A few dozen roundings of
/// 6e-8 each, and texture coordinates that are off by some 1e-7, which maps of a thousand texels a side and
/// normals between them turn into 1e-4.
const SOFTWARE: Tolerance = Tolerance { median: 1e-5, most: 1e-4, nearly_all: 1e-3 };

/// Hardware interpolates from corners snapped to 1/256 of a sample, and so reads surfaces that far from where
/// the ray hits: at two samples a pixel's side 2e-3 of what changes from pixel to pixel, of which skin maps
/// shrunk to 128 pixels change by all of their contrast. (An eighth of that is left at 8 x 8 samples.)
const HARDWARE: Tolerance = Tolerance { median: 2e-4, most: 5e-3, nearly_all: 1e-2 };

/// What rays find at each sample on the processor, and at vertices for an adapter: along the edge of a shadow, and where a thin
/// part ends, the two are as far apart as those are.
const AT_VERTICES: Tolerance = Tolerance { most: 5e-2, nearly_all: 0.2, ..SOFTWARE };

/// The share of interior pixels of which a sample may fall on a neighbouring triangle at a crease.
const CREASES: f64 = 0.003;

/// The share of edge pixels that may be covered by another number of samples, for the same reason.
const UNCOVERED: f64 = 0.03;

/// Fail with both images and a FLIP map on disk where the engines disagree.
fn compare(name: &str, gpu: &Gpu, baked: &Baked) {
    let reference = on_cpu(baked, 2);
    for shading in Shading::ALL {
        let test = on_gpu(gpu, baked, RenderOptions { shading, ..EXACT });
        let name =
            if shading == EXACT.shading { name.to_owned() } else { format!("{name}_{}", shading.name()) };
        agree(&name, tolerance(gpu, &baked.scene), &reference, &test);
    }
}

fn tolerance(gpu: &Gpu, scene: &Scene) -> Tolerance {
    let by_rays = |name: &str| Effect::from_name(name).is_some_and(|effect| scene.effects.has(effect));
    let found = !scene.lights.is_empty() && (by_rays("shadows") || by_rays("transmission"));
    match (gpu.is_software(), found) {
        (true, false) => SOFTWARE,
        (false, false) => HARDWARE,
        (true, true) => AT_VERTICES,
        (false, true) => Tolerance { median: HARDWARE.median, ..AT_VERTICES },
    }
}

fn agree(name: &str, tolerance: Tolerance, reference: &Image, test: &Image) {
    let difference = Difference::new(reference, test, 4);
    let Difference { interior, edge, uncovered, beyond_a_sample } = &difference;
    assert!(interior.len() > 500, "{name}: only {} pixels to compare", interior.len());
    let edges = edge.len() + uncovered;
    let figures = [
        ("median", quantile(interior, 0.5), tolerance.median),
        ("99 %", quantile(interior, 0.99), tolerance.most),
        ("nearly all", quantile(interior, 1.0 - CREASES), tolerance.nearly_all),
        // Pixels with fewer samples average less, and outlines are seen at grazing angles.
        ("edges, median", quantile(edge, 0.5), 10.0 * tolerance.median),
        ("edges, 95 %", quantile(edge, 0.95), tolerance.nearly_all),
        ("other coverage", *uncovered as f32 / edges as f32, UNCOVERED as f32),
        ("beyond a sample", *beyond_a_sample, tolerance.nearly_all),
    ];
    println!("{name}: {figures:?}, greatest {:?}", interior.last());
    crate::figures::measured(&format!("parity {name} median"), quantile(interior, 0.5));
    crate::figures::measured(&format!("parity {name} most"), quantile(interior, 0.99));
    crate::figures::measured(&format!("parity {name} greatest"), interior.last().copied().unwrap_or(0.0));
    for (what, found, most) in figures {
        assert!(found <= most, "{name}: {what}: {found} > {most}; {}", keep(name, reference, test));
    }
}

#[test]
fn every_form_and_silhouette_shows_the_same_on_both_engines() {
    let Some(gpu) = gpu() else { return };
    for form in Form::ALL {
        for silhouette in Silhouette::ALL {
            let baked = read_as(baked(&built_in(), SURFACE, SIZE), form, silhouette);
            compare(&format!("{}_{}", form.name(), silhouette.name()), gpu, &baked);
        }
    }
}

#[test]
fn every_single_effect_shows_the_same_on_both_engines() {
    let Some(gpu) = gpu() else { return };
    for effect in every_effect() {
        compare(effect.name(), gpu, &shown(effect, SIZE).with_scene(pose));
    }
}

#[test]
fn all_effects_together_show_the_same_on_both_engines() {
    let Some(gpu) = gpu() else { return };
    for form in Form::ALL {
        for silhouette in Silhouette::ALL {
            let baked = read_as(baked(&built_in(), everything(), SIZE), form, silhouette);
            let baked = baked.with_scene(pose).with_scene(turn);
            compare(&format!("all_{}_{}", form.name(), silhouette.name()), gpu, &baked);
        }
    }
}

#[test]
fn the_papers_other_readings_show_the_same_on_both_engines() {
    let Some(gpu) = gpu() else { return };
    type Change = fn(&mut Scene);
    let readings: [(&str, Change); 4] = [
        ("smooth", |scene| scene.lookups = Lookups::Smooth),
        ("dapple", |scene| scene.dapple = Dapple::new([0.6, 0.0, 0.8], 50.0, false)),
        ("turning_dapple", |scene| {
            scene.dapple = Dapple::new([0.48, -0.36, 0.8], 0.0, false);
            scene.fit.free.push(Column::tied(Param::EnvironmentRotation));
        }),
        ("interpolated_rim", |scene| (scene.form, scene.silhouette) = (Form::Listing, Silhouette::Vertex)),
    ];
    for (name, read) in readings {
        let baked = baked(&built_in(), everything(), SIZE);
        compare(name, gpu, &baked.with_scene(pose).with_scene(turn).with_scene(read));
    }
}

#[test]
fn every_shared_scene_shows_the_same_on_both_engines() {
    let (Some(gpu), Some(folder)) = (gpu(), common::data()) else { return };
    for scene in ["lps_forest", "lps_sunrise"] {
        let path = folder.join(scene).join("scene.toml");
        compare(scene, gpu, &baked(&path, SURFACE, SIZE));
        compare(&format!("{scene}_all"), gpu, &baked(&path, everything(), SIZE));
    }
}

#[test]
fn shared_meshes_that_move_show_the_same_on_both_engines() {
    let (Some(gpu), Some(folder)) = (gpu(), common::data()) else { return };
    let environment = built_in().with_file_name("environment.exr");
    // The meshes have no maps of their own.
    for (mesh, time) in [
        ("mh_head.glb", 0.7),
        ("RiggedSimple.glb", 1.3),
        ("RobotExpressive.glb", 0.4),
        ("AnimatedMorphSphere.gltf", 1.1),
    ] {
        let scene = tempfile::tempdir().unwrap();
        let path = scene.path().join("scene.toml");
        let text = format!(
            "[mesh]\nfile = {:?}\ntime = {time}\n[environment]\nfile = {environment:?}\n[[view]]\n\
             name = \"a\"\nworld_to_camera = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\nfov_y_degrees = 30\n\
             width = 64\nheight = 64\n",
            folder.join("rigged").join(mesh),
        );
        std::fs::write(&path, text).unwrap();
        // Without bloom, which would spread a sample at a crease over its neighbours.
        let baked = baked(&path, everything().without(Effect::Bloom), SIZE).with_scene(stand_back);
        compare(&Path::new(mesh).with_extension("").display().to_string(), gpu, &baked);
    }
}

/// Put the camera where it shows the mesh whole.
pub(super) fn stand_back(scene: &mut Scene) {
    let positions = scene.mesh.pose().positions;
    let low = positions.iter().copied().reduce(Vec3::min).unwrap();
    let high = positions.iter().copied().reduce(Vec3::max).unwrap();
    let eye = 0.5 * (low + high) + 2.0 * Vec3::new(0.3, 0.2, 1.0) * (high - low).max_element();
    let look = DMat4::from_rotation_x(0.19) * DMat4::from_rotation_y(-0.29);
    scene.views[0].camera.world_to_camera = look * DMat4::from_translation(-eye.as_dvec3());
}

/// Morph weights of all signs, and the bones of the middle of the animation.
pub(super) fn pose(scene: &mut Scene) {
    let weights = [0.8, 0.0, -0.3, 0.5, 1.1];
    for (morph, weight) in scene.mesh.morphs.iter_mut().zip(weights) {
        morph.weight = weight;
    }
    if scene.effects.has(Effect::Skin) {
        let animation = skinfit::scene::animation::Animation::open(scene).unwrap().unwrap();
        let (first, last) = animation.seconds;
        scene.mesh.bones = animation.mesh(0.4 * first + 0.6 * last).unwrap().bones;
    }
}

/// Parameters away from their defaults, channels apart.
pub(super) fn turn(scene: &mut Scene) {
    let params = &mut scene.params;
    params.set_rgb(Param::BaseWeight, [0.9, 1.0, 1.1]);
    params.set_rgb(Param::RimWeight, [0.4, -0.1, 0.3]);
    params.set_rgb(Param::KeyColor, [0.3, 0.2, 0.1]);
    for (param, value) in [
        (Param::RimExponent, 3.3),
        (Param::Occlusion, 0.7),
        (Param::NormalStrength, 1.4),
        (Param::EnvironmentRotation, 77.0),
        (Param::HazeWeight, 0.6),
        (Param::Reflection, 0.2),
    ] {
        params.set(param, value);
    }
}
