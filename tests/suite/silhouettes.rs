//! Cameras that are wrong are noticed before a fit, and those that are right are not accused.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::path::Path;
use std::sync::LazyLock;

use glam::{DMat4, DVec3};
use skinfit::model::effects::{Effect, Effects};
use skinfit::prepare::{Loaded, PrepareOptions};
use skinfit::scene::Scene;
use skinfit::scene::view::{Camera, Target};

use crate::common;

/// A scene with the effects that its silhouettes depend on, so that nothing is baked.
fn read(path: &Path, effects: &[Effect]) -> Loaded {
    let effects = Some(Effects::of(effects));
    Loaded::read(path, &PrepareOptions { effects, fit: true, ..PrepareOptions::default() }).unwrap()
}

/// What is said of the silhouettes of a scene.
fn said(mut loaded: Loaded) -> Vec<String> {
    loaded.scene.quality.samples_per_axis = 2;
    let observed = loaded.bake().unwrap().sample().unwrap().observe().unwrap();
    let of_silhouettes = |warning: &&String| warning.contains("silhouettes of its target and of the mesh");
    observed.warnings.iter().filter(of_silhouettes).cloned().collect()
}

/// The built-in scene as it is.
static TRUE: LazyLock<(tempfile::TempDir, Loaded)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = skinfit::built_in_scene(folder.path()).unwrap();
    // As it is posed.
    let loaded = read(&path, &[Effect::Morph, Effect::Skin]);
    (folder, loaded)
});

/// What is said of a scene with a mistake in it.
fn said_with(loaded: &Loaded, mistake: impl FnOnce(&mut Scene)) -> Vec<String> {
    let mut loaded = loaded.clone();
    mistake(&mut loaded.scene);
    said(loaded)
}

fn with(mistake: impl FnOnce(&mut Scene)) -> Vec<String> {
    said_with(&TRUE.1, mistake)
}

/// The number behind these words.
fn number_after(text: &str, words: &str) -> f64 {
    let at = text.find(words).unwrap_or_else(|| panic!("{words:?} is not in {text:?}")) + words.len();
    let number: String = text[at..].chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    number.parse().unwrap()
}

/// Move a camera in its own axes; by how many pixels to the right and down the place was seen elsewhere before.
fn moved(camera: &mut Camera, motion: DMat4, place: DVec3) -> [f64; 2] {
    let before = camera.project(place);
    camera.world_to_camera = motion * camera.world_to_camera;
    let after = camera.project(place);
    [before.0 - after.0, before.1 - after.1]
}

/// A target is said to lie elsewhere by `pixels` to the right and down, give or take `some`.
fn check_told(text: &str, pixels: [f64; 2], some: f64) {
    let (_, told) = text.split_once("the target's lies ").unwrap_or_else(|| panic!("{text}"));
    let words: Vec<&str> = told.split([' ', ',', ';']).collect();
    // A number, "pixels" and its side; "and"; the same again.
    let signed = |at: usize| {
        let size: f64 = words[at].parse().unwrap();
        if ["left", "up"].contains(&words[at + 2]) { -size } else { size }
    };
    for (told, pixels) in [signed(0), signed(4)].into_iter().zip(pixels) {
        // Perspective: what lies nearer moves further, by a twentieth here.
        assert!((told - pixels).abs() < 0.05 * pixels.abs() + some, "{text}: {pixels}");
    }
}

/// Rows and pixels of a target in another order.
fn reordered(target: &mut Target, width: usize, order: impl Fn(usize, usize) -> usize) {
    let pixels = target.rgb.len();
    let at = |i: usize| order(i % width, i / width);
    target.rgb = (0..pixels).map(|i| target.rgb[at(i)]).collect();
    target.alpha = target.alpha.as_ref().map(|alpha| (0..pixels).map(|i| alpha[at(i)]).collect());
}

#[test]
fn the_built_in_scene_is_not_accused() {
    assert_eq!(with(|_| ()), Vec::<String>::new());
}

#[test]
fn swapped_targets_are_noticed() {
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        let told = with(|scene| {
            let first = scene.views[a].target.take();
            let second = scene.views[b].target.take();
            (scene.views[a].target, scene.views[b].target) = (second, first);
        });
        assert_eq!(told.len(), 2, "{told:#?}");
        let names = [a, b].map(|i| TRUE.1.scene.views[i].name.clone());
        for (told, [view, other]) in told.iter().zip([[&names[0], &names[1]], [&names[1], &names[0]]]) {
            assert!(told.contains(&format!("view \"{view}\"")), "{told}");
            assert!(told.contains(&format!("fits view \"{other}\"")) && told.contains("swapped"), "{told}");
        }
    }
}

#[test]
fn turned_targets_are_noticed() {
    // The front view is nearly its own mirror image, so that is a mistake of the others.
    for (i, flip, words) in [
        (1, [true, false], "mirrored"),
        (2, [true, false], "mirrored"),
        (0, [false, true], "upside down"),
        (1, [true, true], "by 180 degrees"),
    ] {
        let told = with(|scene| {
            let (width, height) =
                (scene.views[i].camera.width as usize, scene.views[i].camera.height as usize);
            let target = scene.views[i].target.as_mut().unwrap();
            reordered(target, width, |x, y| {
                let x = if flip[0] { width - 1 - x } else { x };
                let y = if flip[1] { height - 1 - y } else { y };
                y * width + x
            });
        });
        assert_eq!(told.len(), 1, "{told:#?}");
        assert!(told[0].contains(words), "{}", told[0]);
    }
}

#[test]
fn wrong_fields_of_view_are_noticed_and_the_right_one_is_named() {
    for i in 0..3 {
        for factor in [0.95, 1.05] {
            let fov = TRUE.1.scene.views[i].camera.fov_y;
            let told = with(|scene| scene.views[i].camera.fov_y *= factor);
            assert_eq!(told.len(), 1, "{told:#?}");
            let named = number_after(&told[0], "with fov_y_degrees = ");
            crate::figures::measured("silhouettes field of view", (named / fov.to_degrees() - 1.0).abs());
            // A tenth of a pixel at a silhouette some hundred pixels from the centre is 0.1%; twice that.
            assert!((named / fov.to_degrees() - 1.0).abs() < 2e-3, "{named}, not {}", fov.to_degrees());
        }
    }
}

#[test]
fn displaced_cameras_are_noticed_and_by_how_much() {
    for (i, right, up) in [(0, 0.1, 0.0), (1, 0.0, 0.12), (2, -0.08, 0.05), (1, -0.1, 0.0)] {
        let aside = DMat4::from_translation(DVec3::new(right, up, 0.0));
        let mut pixels = [0.0; 2];
        let told = with(|scene| {
            // Of a point at the head's distance.
            pixels = moved(&mut scene.views[i].camera, aside, DVec3::new(0.0, -0.034, 0.0));
        });
        assert_eq!(told.len(), 1, "{told:#?}");
        check_told(&told[0], pixels, 1.5);
    }
}

#[test]
fn other_poses_are_noticed() {
    for (i, angle) in [(0, 25.0_f64), (1, -30.0), (2, 20.0)] {
        let told = with(|scene| {
            let camera = &mut scene.views[i].camera;
            camera.world_to_camera *= DMat4::from_rotation_y(angle.to_radians());
        });
        assert_eq!(told.len(), 1, "{told:#?}");
    }
}

#[test]
fn mistakes_are_noticed_on_path_traced_heads() {
    let Some(data) = common::data() else { return };
    let loaded = read(&data.join("lps_forest/scene.toml"), &[]);
    let forest = |mistake: &dyn Fn(&mut Scene)| said_with(&loaded, mistake);
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        let told = forest(&|scene| {
            let [first, second] = [a, b].map(|i: usize| scene.views[i].target.take());
            (scene.views[a].target, scene.views[b].target) = (second, first);
        });
        assert_eq!(told.len(), 2, "{told:#?}");
        assert!(told.iter().all(|told| told.contains("swapped")), "{told:#?}");
    }
    for i in 0..3 {
        for factor in [0.95, 1.05] {
            let fov = loaded.scene.views[i].camera.fov_y.to_degrees();
            let told = forest(&|scene| scene.views[i].camera.fov_y *= factor);
            assert_eq!(told.len(), 1, "{i} {factor}: {told:#?}");
            let named = number_after(&told[0], "with fov_y_degrees = ");
            crate::figures::measured("silhouettes traced field of view", (named / fov - 1.0).abs());
            // As of the built-in scene; edges of path-traced targets are of some tens of samples a pixel.
            assert!((named / fov - 1.0).abs() < 5e-3, "{named}, not {fov}");
        }
    }
    // A scanned head has no symmetry: its mirror image fits nowhere, its front's neither.
    for i in 0..3 {
        let told = forest(&|scene| {
            let width = scene.views[i].camera.width as usize;
            reordered(scene.views[i].target.as_mut().unwrap(), width, |x, y| y * width + width - 1 - x);
        });
        assert_eq!(told.len(), 1, "{i}: {told:#?}");
    }
    // From another side.
    for (i, angle) in [(0, 25.0_f64), (1, -30.0), (2, -25.0)] {
        let turn = DMat4::from_rotation_y(angle.to_radians());
        let told = forest(&|scene| scene.views[i].camera.world_to_camera *= turn);
        assert_eq!(told.len(), 1, "{i} {angle}: {told:#?}");
    }
}

#[test]
fn displaced_and_turned_cameras_are_noticed_on_path_traced_heads() {
    let Some(data) = common::data() else { return };
    // A place in each head, and about half of its width.
    let heads: [(&str, &[Effect], DVec3, f64); 2] = [
        ("lps_forest/scene.toml", &[], DVec3::new(0.0, 1.2, 0.0), 1.5),
        ("mh_portrait/scene.toml", &[Effect::Skin], DVec3::new(0.0, 0.125, 0.0), 0.08),
    ];
    for (scene, effects, place, half) in heads {
        let loaded = read(&data.join(scene), effects);
        let aside = |right: f64, up: f64| DMat4::from_translation(half * DVec3::new(right, up, 0.0));
        let turn = 2_f64.to_radians();
        let motions = [
            aside(1.0, 0.0),
            aside(0.0, 1.0),
            aside(-0.7, -0.7),
            DMat4::from_rotation_y(turn),
            DMat4::from_rotation_x(-turn),
        ];
        for i in 0..loaded.scene.views.len() {
            // Alone: the others would be drawn again each time.
            let mut loaded = loaded.clone();
            loaded.scene.views = vec![loaded.scene.views.swap_remove(i)];
            for motion in motions {
                let mut pixels = [0.0; 2];
                let told = said_with(&loaded, |scene| {
                    pixels = moved(&mut scene.views[0].camera, motion, place);
                });
                assert_eq!(told.len(), 1, "{scene}, view {i}, {motion}: {told:#?}");
                // From aside by half a head the head is seen turned by 4 degrees, of which no shift is.
                check_told(&told[0], pixels, 3.0);
            }
            let rolled = DMat4::from_rotation_z(5_f64.to_radians());
            let told = said_with(&loaded, |scene| {
                moved(&mut scene.views[0].camera, rolled, place);
            });
            assert!(told.len() == 1 && told[0].contains("no shift and no scale"), "{scene}, {i}: {told:#?}");
        }
    }
}

#[test]
fn other_moments_of_an_animation_are_noticed() {
    let Some(data) = common::data() else { return };
    for time in [0.0, 1.0, 1.5] {
        let options = PrepareOptions {
            effects: Some(Effects::of(&[Effect::Skin, Effect::Morph])),
            fit: true,
            time: Some(time),
            ..PrepareOptions::default()
        };
        let told = said(Loaded::read(&data.join("mh_portrait/scene.toml"), &options).unwrap());
        assert!(!told.is_empty(), "at {time} s");
    }
}

#[test]
fn path_traced_scenes_are_not_accused() {
    let Some(data) = common::data() else { return };
    let scenes: [(&str, &[Effect]); 10] = [
        ("lps_forest/scene.toml", &[]),
        ("lps_sunrise/scene.toml", &[]),
        ("lps_studio/scene.toml", &[]),
        ("lps_studio_dry/scene.toml", &[]),
        ("mh_portrait/scene.toml", &[Effect::Skin]),
        ("calib_lights/directional.toml", &[]),
        ("calib_lights/directional_soft.toml", &[]),
        ("calib_lights/point.toml", &[]),
        ("calib_lights/point_soft.toml", &[]),
        ("calib_lights/spot.toml", &[]),
    ];
    for (scene, effects) in scenes {
        assert_eq!(said(read(&data.join(scene), effects)), Vec::<String>::new(), "{scene}");
    }
}
