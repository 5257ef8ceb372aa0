//! What other programs say of cameras, and tables of responses, damaged: each reader says what is wrong in one paragraph, or
//! what it passes is a camera that a scene may have.

use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;
use serde_json::{Value, json};
use skinfit::scene::SceneError;
use skinfit::scene::import::{ImportedView, colmap, metashape, opencv, transforms};
use skinfit::scene::view::Camera;

use super::tree::{json_text, tree_damage};
use super::{check_outcome, damage, throw};
use crate::cameras::{write_binary, write_text};
use crate::imported::metashape::metashape_file;
use crate::imported::opencv::{ROS, STORED, XML};
use crate::scene_folder::{SCENE, SceneFolder, png};

/// A camera that stands somewhere, with an image of which every corner is lit.
fn check_camera(camera: &Camera) -> Result<(), TestCaseError> {
    prop_assert!(camera.world_to_camera.is_finite(), "{camera:?}");
    prop_assert!((1..=16384).contains(&camera.width) && (1..=16384).contains(&camera.height), "{camera:?}");
    prop_assert!(camera.fov_y > 0.0 && camera.fov_y < std::f64::consts::PI, "{camera:?}");
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    for (x, y) in [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)] {
        prop_assert!(camera.image_plane(x, y).is_ok(), "{camera:?}");
    }
    prop_assert!(camera.project(DVec3::new(0.1, 0.2, 0.3)).2.is_finite(), "{camera:?}");
    Ok(())
}

fn check_paragraph(error: &SceneError) -> Result<(), TestCaseError> {
    let words = error.to_string();
    prop_assert!(!words.contains(['\n', '\u{1b}']), "{words:?}");
    Ok(())
}

fn check_views(outcome: Result<Vec<ImportedView>, SceneError>) -> Result<(), TestCaseError> {
    match outcome {
        Err(error) => check_paragraph(&error),
        Ok(views) => views.iter().try_for_each(|view| check_camera(&view.camera)),
    }
}

/// Damage the files of a folder that `names` lists, one at a time, and read what is left.
fn throw_at(
    cases: u32,
    folder: &Path,
    names: &[&str],
    read: impl Fn() -> Result<Vec<ImportedView>, SceneError>,
) {
    assert!(read().is_ok());
    let files: Vec<_> = names
        .iter()
        .map(|name| {
            let path = folder.join(name);
            let whole = std::fs::read(&path).unwrap();
            (path, whole)
        })
        .collect();
    let which = any::<prop::sample::Index>();
    throw(cases, &(which, prop::collection::vec(damage(), 1..3)), |(which, damages)| {
        let (path, whole) = which.get(&files);
        std::fs::write(path, damages.iter().fold(whole.clone(), |bytes, damage| damage.apply(bytes)))
            .unwrap();
        let outcome = read();
        std::fs::write(path, whole).unwrap();
        check_views(outcome)
    });
}

#[test]
fn no_damage_to_a_model_of_colmaps_makes_its_reader_panic() {
    let folder = tempfile::tempdir().unwrap();
    write_text(folder.path());
    throw_at(200, folder.path(), &["cameras.txt", "images.txt"], || colmap::read(folder.path()));
    write_binary(folder.path());
    throw_at(200, folder.path(), &["cameras.bin", "images.bin"], || colmap::read(folder.path()));
}

#[test]
fn no_damage_to_metashapes_cameras_makes_their_reader_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.xml");
    std::fs::write(&path, metashape_file()).unwrap();
    throw_at(300, folder.path(), &["cameras.xml"], || metashape::read(&path));
}

/// Of two frames, the second of which has a lens of its own and no size.
fn transforms_tree() -> Value {
    let matrix = json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]);
    json!({
        "fl_x": 500.0, "fl_y": 505.0, "cx": 321.0, "cy": 239.0, "k1": -0.1, "k2": 0.02, "p1": 0.001, "p2": -0.002,
        "frames": [
            {"file_path": "a.png", "w": 640, "h": 480, "transform_matrix": matrix},
            {"file_path": "./a", "transform_matrix": matrix, "camera_model": "OPENCV_FISHEYE", "k1": -0.02},
        ],
    })
}

#[test]
fn no_damage_to_a_file_of_transforms_makes_its_reader_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("transforms.json");
    std::fs::write(folder.path().join("a.png"), png(640, 480, [0; 3])).unwrap();
    let whole = transforms_tree();
    std::fs::write(&path, json_text(&whole)).unwrap();
    throw_at(150, folder.path(), &["transforms.json", "a.png"], || transforms::read(&path, None));
    throw(250, &prop::collection::vec(tree_damage(), 1..3), |damages| {
        let tree = damages.iter().fold(whole.clone(), |tree, damage| damage.apply(tree));
        std::fs::write(&path, json_text(&tree)).unwrap();
        check_views(transforms::read(&path, None))
    });
}

#[test]
fn no_damage_to_a_calibration_makes_its_reader_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera");
    let which = any::<prop::sample::Index>();
    throw(400, &(which, prop::collection::vec(damage(), 0..3)), |(which, damages)| {
        let whole = which.get(&[STORED, ROS, XML]).as_bytes().to_vec();
        std::fs::write(&path, damages.iter().fold(whole, |bytes, damage| damage.apply(bytes))).unwrap();
        match opencv::read(&path) {
            Err(error) => check_paragraph(&error),
            Ok(camera) => check_camera(&camera),
        }
    });
}

#[test]
fn no_damage_to_a_response_makes_its_reader_panic_or_pass_what_is_no_light() {
    let folder = SceneFolder::new();
    // The reader goes by what a file holds: these are codes, which have a response.
    folder.write("target.exr", &png(4, 4, [200, 100, 50]));
    let text = SCENE.replacen("[fit]", "response = \"camera.csv\"\n[fit]", 1);
    folder.write("scene.toml", text.as_bytes());
    let whole: String = (0..16).map(|i| format!("{i},{}.5,{}e-1\n", 2 * i, i * i)).collect();
    folder.write("camera.csv", whole.as_bytes());
    folder.load().unwrap();
    throw(300, &prop::collection::vec(damage(), 0..3), |damages| {
        let bytes = whole.clone().into_bytes();
        folder.write("camera.csv", &damages.iter().fold(bytes, |bytes, damage| damage.apply(bytes)));
        let outcome = folder.load();
        if let Ok((scene, _)) = &outcome {
            let targets = scene.views.iter().filter_map(|view| view.target.as_ref());
            prop_assert!(
                targets.flat_map(|target| target.rgb.as_flattened()).all(|x| x.is_finite() && *x >= 0.0)
            );
        }
        check_outcome(outcome)
    });
}
