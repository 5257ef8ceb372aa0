//! Meshes that move, with their buffers beside them, and masks, damaged.

use proptest::prelude::*;
use serde_json::{Value, json};
use skinfit::scene::animation::Animation;
use skinfit::scene::{Scene, SceneError, Warning};

use super::tree::{json_text, tree_damage};
use super::{check_outcome, damage, throw};
use crate::scene_folder::{SCENE, SceneFolder, exr, quad_parts};

/// A quad with two bones, two morph targets (one of sparse normals), an animation of all three kinds of interpolation, and
/// cameras, one of which stands on a bone; its buffer is a file of its own.
fn moving() -> (Value, Vec<u8>) {
    let (mut json, mut bin) = quad_parts();
    json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"translation": [0, 3, 0]}, {"scale": [1, 2, 1]}]);
    let nodes = json["nodes"].as_array_mut().unwrap();
    nodes.push(json!({"name": "Still", "camera": 0, "translation": [0, 0, 2]}));
    nodes.push(json!({"name": "Moved", "camera": 1, "rotation": [0, 1, 0, 0]}));
    json["nodes"][1]["children"] = json!([4]);
    json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.0}},
        {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 9.0}},
    ]);
    json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    json["skins"] = json!([{"joints": [1, 2]}]);
    let attributes = json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
    attributes.insert("WEIGHTS_0".into(), json!(3));
    attributes.insert("JOINTS_0".into(), json!(6));
    let mut put = |numbers: &[f32]| {
        let (offset, views) = (bin.len(), json["bufferViews"].as_array_mut().unwrap());
        numbers.iter().for_each(|x| bin.extend(x.to_le_bytes()));
        views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": 4 * numbers.len()}));
        views.len() - 1
    };
    let times = put(&[0.0, 1.0]);
    let turns = put(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.707, 0.0, 0.707]);
    let weights = put(&[0.0, 0.25, 1.0, 0.75]);
    // In-tangent, value and out-tangent of each key.
    let spline = put(&[0.0; 18]);
    let places = put(&[f32::from_bits(2)]);
    let normal = put(&[0.5, 0.0, 0.5]);
    let floats = |view: usize, kind: &str, count: usize| json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind});
    let accessors = json["accessors"].as_array_mut().unwrap();
    accessors.extend([
        floats(times, "SCALAR", 2),
        floats(turns, "VEC4", 2),
        floats(weights, "SCALAR", 4),
        floats(spline, "VEC3", 6),
        json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
            "count": 1,
            "indices": {"bufferView": places, "componentType": 5125},
            "values": {"bufferView": normal},
        }}),
    ]);
    json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 4, "NORMAL": 11}, {"POSITION": 4}]);
    json["meshes"][0]["weights"] = json!([0.5, 0.0]);
    json["animations"] = json!([{
        "samplers": [
            {"input": 7, "output": 8},
            {"input": 7, "output": 9, "interpolation": "STEP"},
            {"input": 7, "output": 10, "interpolation": "CUBICSPLINE"},
        ],
        "channels": [
            {"sampler": 0, "target": {"node": 1, "path": "rotation"}},
            {"sampler": 1, "target": {"node": 0, "path": "weights"}},
            {"sampler": 2, "target": {"node": 2, "path": "translation"}},
        ],
    }]);
    json["buffers"] = json!([{"uri": "quad.bin", "byteLength": bin.len()}]);
    (json, bin)
}

/// The scene with that mesh at half a second, and its target masked.
fn folder() -> SceneFolder {
    let folder = SceneFolder::new();
    let (json, bin) = moving();
    folder.write("quad.glb", json.to_string().as_bytes());
    folder.write("quad.bin", &bin);
    let text = SCENE.replacen("file = \"quad.glb\"", "file = \"quad.glb\"\ntime = 0.5", 1);
    let text = text.replacen("target = \"target.exr\"", "target = \"target.exr\"\nmask = \"mask.png\"", 1);
    let view =
        |name: &str| format!("[[view]]\nname = \"{name}\"\ncamera = \"{name}\"\nwidth = 4\nheight = 4\n");
    let text = text.replacen("[fit]", &format!("{}{}[fit]", view("Still"), view("Moved")), 1);
    folder.write("scene.toml", text.as_bytes());
    folder
}

/// As [`check_outcome`], and whatever is there of the animation at any time, of the cameras and of the mask.
fn check_all(outcome: Result<(Scene, Vec<Warning>), SceneError>) -> Result<(), TestCaseError> {
    if let Ok((scene, _)) = &outcome {
        let masks = scene.views.iter().filter_map(|view| view.target.as_ref()?.mask.as_ref());
        prop_assert!(masks.flatten().all(|weight| (0.0..=1.0).contains(weight)));
        for camera in scene.views.iter().map(|view| view.camera) {
            prop_assert!(camera.world_to_camera.is_finite(), "{camera:?}");
            prop_assert!(camera.fov_y > 0.0 && camera.fov_y < std::f64::consts::PI, "{camera:?}");
        }
        let paragraph = |error: SceneError| prop_assert_one_paragraph(&error);
        match Animation::open(scene) {
            Err(error) => paragraph(error)?,
            Ok(animation) => {
                for time in animation.iter().flat_map(|a| [-1.0, 0.0, 0.3, a.seconds.0, a.seconds.1, 1e9]) {
                    match animation.as_ref().unwrap().mesh(time) {
                        Err(error) => paragraph(error)?,
                        Ok(mesh) => {
                            let posed = mesh.pose();
                            prop_assert!(posed.positions.iter().all(|p| p.is_finite()), "{time}");
                            prop_assert!(
                                posed.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5),
                                "{time}"
                            );
                        }
                    }
                }
            }
        }
    }
    check_outcome(outcome)
}

fn prop_assert_one_paragraph(error: &SceneError) -> Result<(), TestCaseError> {
    let words = error.to_string();
    prop_assert!(!words.contains('\n'), "{words}");
    Ok(())
}

#[test]
fn the_moving_mesh_is_read_when_it_is_whole() {
    let folder = folder();
    let (scene, warnings) = folder.load().unwrap();
    assert_eq!((scene.mesh.morphs.len(), scene.mesh.bones.len()), (2, 2), "{warnings:?}");
    assert_eq!(scene.views.len(), 3);
    let animation = Animation::open(&scene).unwrap().unwrap();
    assert_eq!(animation.seconds, (0.0, 1.0));
    assert!(scene.views[0].target.as_ref().unwrap().mask.is_some());
    check_all(Ok((scene, warnings))).unwrap();
}

#[test]
fn no_damage_to_a_buffer_beside_its_mesh_makes_the_reader_panic_or_pass_what_is_not_finite() {
    let folder = folder();
    let (_, whole) = moving();
    // Sums and products of numbers near f32's end are beyond it: those are not asked for.
    let number = prop::sample::select(vec![f32::NAN, f32::INFINITY, -1e9, 1e-40, 0.0, -1.0]);
    // Numbers are put where numbers stand, too: bytes rarely make one that is not finite.
    let numbers = prop::collection::vec((0..whole.len() / 4, number), 0..3);
    throw(1200, &(numbers, prop::collection::vec(damage(), 0..2)), |(numbers, damages)| {
        let mut bytes = whole.clone();
        for (at, x) in numbers {
            bytes[4 * at..4 * at + 4].copy_from_slice(&x.to_le_bytes());
        }
        folder.write("quad.bin", &damages.iter().fold(bytes, |bytes, damage| damage.apply(bytes)));
        check_all(folder.load())
    });
    // What a morph target adds, near f32's end: twice it is beyond.
    let mut bytes = whole.clone();
    bytes[208..212].copy_from_slice(&1.95e38_f32.to_le_bytes());
    folder.write("quad.bin", &bytes);
    let error = folder.load().unwrap_err().to_string();
    assert!(error.contains("morph target 0, vertex 1") && error.contains("beyond 1e15"), "{error}");
    folder.write("quad.bin", &whole);
    assert!(folder.load().is_ok());
    std::fs::remove_file(folder.path("quad.bin")).unwrap();
    let error = folder.load().unwrap_err().to_string();
    assert!(error.contains("quad.bin: there is no such file"), "{error}");
}

#[test]
fn no_damage_to_what_a_moving_mesh_says_of_itself_makes_the_reader_panic() {
    let folder = folder();
    let (whole, _) = moving();
    throw(2000, &prop::collection::vec(tree_damage(), 1..3), |damages| {
        let tree = damages.iter().fold(whole.clone(), |tree, damage| damage.apply(tree));
        folder.write("quad.glb", json_text(&tree).as_bytes());
        check_all(folder.load())
    });
}

#[test]
fn no_damage_to_a_mask_makes_its_reader_panic_or_pass_what_is_no_weight() {
    let folder = folder();
    // The reader goes by what a file holds, not by its name.
    let odd = [f32::NAN, f32::INFINITY, -1.0, 2.0, 0.5];
    let masks = [
        std::fs::read(folder.path("mask.png")).unwrap(),
        exr(4, 4, &["Y"], |_, i| 0.1 * i as f32),
        exr(4, 4, &["R", "G", "B"], move |_, i| odd[i % 5]),
        exr(4, 4, &["R", "G", "B"], |_, _| 0.25),
    ];
    let which = any::<prop::sample::Index>();
    throw(600, &(which, prop::collection::vec(damage(), 0..3)), |(which, damages)| {
        let whole = which.get(&masks).clone();
        folder.write("mask.png", &damages.iter().fold(whole, |bytes, damage| damage.apply(bytes)));
        check_all(folder.load())
    });
}
