//! Cameras that are off are moved to where the targets show the mesh.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::path::Path;

use glam::{DMat4, DVec3};
use skinfit::prepare::{Baked, Loaded, PrepareOptions};
use skinfit::scene::view::Camera;

use crate::common;
use crate::graphics::bench::cache;

fn read(path: &Path) -> Loaded {
    // Bakes are kept from run to run, under all that they depend on.
    let cache = Some(Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics"));
    let mut loaded =
        Loaded::read(path, &PrepareOptions { fit: true, cache, ..PrepareOptions::default() }).unwrap();
    loaded.scene.quality.samples_per_axis = 2;
    loaded
}

/// Places of the mesh that both cameras have in their images: by how many pixels these lie apart, median and largest.
fn apart(baked: &Baked, a: &Camera, b: &Camera) -> [f64; 2] {
    let within = |camera: &Camera, (x, y, depth): (f64, f64, f64)| {
        depth > 0.0
            && (0.0..f64::from(camera.width)).contains(&x)
            && (0.0..f64::from(camera.height)).contains(&y)
    };
    let posed = baked.scene.mesh.pose();
    let mut pixels: Vec<f64> = Vec::new();
    for position in &posed.positions {
        let (p, q) = (a.project(position.as_dvec3()), b.project(position.as_dvec3()));
        if within(a, p) && within(b, q) {
            pixels.push((p.0 - q.0).hypot(p.1 - q.1));
        }
    }
    pixels.sort_by(f64::total_cmp);
    [pixels[pixels.len() / 2], pixels[pixels.len() - 1]]
}

/// The camera moved: `right` pixels to the right and `down` down at the mesh, turned about the mesh by degrees, and its
/// tangent of half the field of view multiplied.
fn displaced(
    camera: &Camera,
    middle: DVec3,
    [right, down]: [f64; 2],
    degrees: [f64; 3],
    zoom: f64,
) -> Camera {
    let inside = camera.world_to_camera.transform_point3(middle);
    let pixel = -inside.z * 2.0 * (0.5 * camera.fov_y).tan() / f64::from(camera.height);
    let [x, y, z] = degrees.map(f64::to_radians);
    let turn = DMat4::from_rotation_x(x) * DMat4::from_rotation_y(y) * DMat4::from_rotation_z(z);
    let about = DMat4::from_translation(inside + pixel * DVec3::new(right, -down, 0.0))
        * turn
        * DMat4::from_translation(-inside);
    Camera {
        world_to_camera: about * camera.world_to_camera,
        fov_y: 2.0 * ((0.5 * camera.fov_y).tan() * zoom).atan(),
        ..*camera
    }
}

/// The cameras that views begin with, and where these are moved to.
fn registered(mut loaded: Loaded, mistakes: &[([f64; 2], [f64; 3], f64)]) -> (Baked, Vec<[Camera; 3]>) {
    let positions = loaded.scene.mesh.pose().positions;
    let least = positions.iter().copied().reduce(glam::Vec3::min).unwrap();
    let most = positions.iter().copied().reduce(glam::Vec3::max).unwrap();
    let middle = 0.5 * (least + most).as_dvec3();
    let truth: Vec<Camera> = loaded.scene.views.iter().map(|view| view.camera).collect();
    for (view, &(shift, degrees, zoom)) in loaded.scene.views.iter_mut().zip(mistakes) {
        view.camera = displaced(&view.camera, middle, shift, degrees, zoom);
    }
    loaded.scene.fit.cameras = true;
    let baked = loaded.bake().unwrap();
    let cameras =
        baked.cameras.iter().zip(truth).map(|(moved, truth)| [truth, moved.before, moved.after]).collect();
    (baked, cameras)
}

#[test]
fn cameras_of_the_built_in_scene_are_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = skinfit::built_in_scene(folder.path()).unwrap();
    // Five pixels and more each: of a shift, a turn, and a field of view.
    let mistakes = [
        ([6.0, -3.0], [1.0, 1.0, 0.0], 1.02),
        ([3.0, 3.0], [1.5, -2.0, 1.0], 0.98),
        ([3.5, 3.0], [-1.5, 1.5, 0.8], 1.02),
    ];
    let (baked, cameras) = registered(read(&path), &mistakes);
    assert_eq!(cameras.len(), 3);
    for ([truth, before, after], moved) in cameras.iter().zip(&baked.cameras) {
        let (start, end) = (apart(&baked, truth, before), apart(&baked, truth, after));
        println!("{}: {start:?} -> {end:?}, settled: {}", moved.view, moved.settled);
        crate::figures::measured("registration start", start[0]);
        crate::figures::measured("registration end", end[0]);
        // A tenth of a pixel. A profile is turned about its vertical axis without a change of its silhouette, which shows
        // where it is nearest.
        let most = if moved.view == "profile" { 1.0 } else { 0.3 };
        assert!(start[0] > 5.0 && end[0] < 0.1, "{}: {start:?} -> {end:?}", moved.view);
        assert!(end[1] < most && moved.settled, "{}: {end:?}", moved.view);
        let told = moved.told("scene.toml");
        assert!(baked.warnings.iter().any(|warning| warning.ends_with(&told[10..])), "{told}");
    }
}

#[test]
fn cameras_of_path_traced_heads_end_at_the_same_place_from_anywhere_near() {
    let Some(data) = common::data() else { return };
    let path = data.join("lps_forest/scene.toml");
    // The profile, which is the hardest.
    let profile = || {
        let mut loaded = read(&path);
        loaded.scene.views.drain(..2);
        loaded
    };
    let (baked, from_truth) = registered(profile(), &[([0.0; 2], [0.0; 3], 1.0)]);
    let (_, from_aside) = registered(profile(), &[([4.0, 3.5], [0.8, -1.0, 0.7], 0.985)]);
    let (here, there) = (&from_truth[0], &from_aside[0]);
    let start = apart(&baked, &there[0], &there[1]);
    let bias = apart(&baked, &here[0], &here[2]);
    let end = apart(&baked, &here[2], &there[2]);
    println!(
        "{start:?} -> {end:?} of one another, {:?} of the truth, which is {bias:?} off",
        apart(&baked, &there[0], &there[2])
    );
    // Nearly the same optimum from both, a tenth of a pixel from the truth, though the paper's model at its default constants
    // does not light the head as the path tracer does: what is finer than its light tells where it is.
    let found = apart(&baked, &there[0], &there[2]);
    crate::figures::measured("registration traced start", start[0]);
    crate::figures::measured("registration traced end", found[0]);
    assert!(start[0] > 5.0 && end[0] < 0.1, "{start:?} -> {end:?}");
    assert!(bias[0] < 0.1 && found[0] < 0.1, "{bias:?} {found:?}");
    // Focal length and distance are told apart by perspective alone, to a percent or two: at the image's border, 192 pixels
    // from its middle, what stands a fifth of the distance nearer is off by 192 x 0.2 x 1% = 0.4 pixels then. From either start
    // that is the same, but for what is left of the built-in scene's cameras.
    assert!(bias[1] < 1.0 && found[1] < 1.0 && end[1] < 0.3, "{bias:?} {found:?} {end:?}");
}

#[test]
fn what_a_scene_file_asks_for_is_done_and_other_views_stay() {
    let folder = tempfile::tempdir().unwrap();
    let path = skinfit::built_in_scene(folder.path()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(read(&path).bake().unwrap().cameras.is_empty());
    let asked = text.replace("[fit]\n", "[fit]\ncameras = true\n");
    assert_ne!(text, asked);
    std::fs::write(&path, asked).unwrap();
    let mut loaded = read(&path);
    assert!(loaded.scene.fit.cameras);
    // A view that nothing is compared with has nothing to move by.
    loaded.scene.views[1].target = None;
    loaded.scene.views[2].target = None;
    let (before, name) = (loaded.scene.views[1].camera, loaded.scene.views[1].name.clone());
    let baked = loaded.bake().unwrap();
    assert_eq!(baked.cameras.len(), 1);
    assert_eq!(baked.scene.views.iter().find(|view| view.name == name).unwrap().camera, before);
    // One that is right stays where it is, to a tenth of a pixel: what coverage of four samples a pixel, and constants
    // that are not those of the target, make of it.
    for moved in &baked.cameras {
        let [median, _] = apart(&baked, &moved.before, &moved.after);
        assert!(median < 0.1, "{}: {median}", moved.view);
        assert_eq!(moved.pixels, apart(&baked, &moved.before, &moved.after));
    }
    // A picture of it has the cameras of its file.
    let drawn =
        Baked::new(&path, &PrepareOptions { cache: Some(cache()), ..PrepareOptions::default() }).unwrap();
    assert!(drawn.cameras.is_empty());
}
