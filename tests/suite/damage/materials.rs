//! Materials, textures and samplers of a mesh, damaged: the parts that are not skin, and the skin's own maps.

use proptest::prelude::*;
use serde_json::{Value, json};
use skinfit::scene::{Scene, SceneError, Warning};

use super::tree::{json_text, tree_damage};
use super::{check_outcome, throw};
use crate::plain::{SCENE, edited};
use crate::scene_folder::{SceneFolder, base64, png};

/// A mesh with skin that has maps of its own, and an eye whose material has everything that is read of one.
fn rich() -> (SceneFolder, Value) {
    let info = |index: usize| {
        json!({"index": index, "texCoord": 1, "extensions": {"KHR_texture_transform": {
            "offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 1], "texCoord": 0,
        }}})
    };
    let eye = json!({
        "name": "Eye", "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 0.25, 0],
        "emissiveTexture": info(0),
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_ior": {"ior": 1.4}},
        "pbrMetallicRoughness": {
            "baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0.5, "roughnessFactor": 0.25,
            "baseColorTexture": info(0), "metallicRoughnessTexture": info(1),
        },
    });
    let mut whole = json!(null);
    let scene = SCENE.replace("[\"diffuse\"]", "[\"diffuse\", \"normal_map\"]");
    let folder = edited(&eye, &scene, |mesh, bin| {
        mesh["materials"][0] = json!({
            "name": "Skin", "normalTexture": {"index": 1, "scale": 0.5},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
        });
        mesh["textures"] = json!([{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}]);
        mesh["samplers"] = json!([
            {"magFilter": 9728, "minFilter": 9987, "wrapS": 33648, "wrapT": 33071},
            {"magFilter": 9729, "wrapS": 10497},
        ]);
        let encoded = base64(&png(2, 2, [128, 128, 255]));
        let within = format!("data:image/png;base64,{encoded}");
        mesh["images"].as_array_mut().unwrap().push(json!({"uri": within, "mimeType": "image/png"}));
        // Colours of vertices, and a second set of texture coordinates: numbers that are there already.
        let attributes = mesh["meshes"][1]["primitives"][0]["attributes"].as_object_mut().unwrap();
        attributes.insert("COLOR_0".into(), json!(3));
        attributes.insert("TEXCOORD_1".into(), json!(2));
        mesh["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_materials_ior"]);
        let uri = format!("data:application/octet-stream;base64,{}", base64(bin));
        whole = mesh.clone();
        whole["buffers"][0]["uri"] = json!(uri);
    });
    folder.write("quad.glb", whole.to_string().as_bytes());
    (folder, whole)
}

/// As [`check_outcome`], and what parts that are not skin are drawn by, at some place of their maps.
fn check_all(outcome: Result<(Scene, Vec<Warning>), SceneError>) -> Result<(), TestCaseError> {
    if let Ok((scene, _)) = &outcome
        && let Some(parts) = &scene.mesh.plain
    {
        prop_assert_eq!(parts.of_triangle.len(), scene.mesh.triangles.len());
        for (triangle, _) in (0_u32..).zip(&parts.of_triangle) {
            let Some(material) = parts.material(triangle) else { continue };
            for uv in [[0.25, 0.75], [-3.5, 1e6], [0.0, 1.0]].map(glam::Vec2::from) {
                let tint = parts.tint(triangle, [0.5, 0.25, 0.25]);
                let seen = material.seen(uv, tint);
                prop_assert!((0.0..=1.0).contains(&seen), "{seen}: {material:?}");
                let surface = material.at(uv, tint);
                let numbers = surface.diffuse.into_iter().chain(surface.f0).chain(surface.emission);
                prop_assert!(numbers.into_iter().all(|x| x.is_finite() && x >= 0.0), "{surface:?}");
                prop_assert!((1e-3..=1.0).contains(&surface.alpha), "{surface:?}");
            }
        }
    }
    check_outcome(outcome)
}

#[test]
fn the_rich_mesh_is_read_when_it_is_whole() {
    let (folder, _) = rich();
    let (scene, warnings) = folder.load().unwrap();
    let parts = scene.mesh.plain.as_ref().unwrap();
    assert!(scene.maps.color.is_some() && scene.maps.normal.is_some(), "{warnings:?}");
    assert!(parts.materials[0].color_map.is_some() && !parts.corner_colors.is_empty(), "{warnings:?}");
    check_all(Ok((scene, warnings))).unwrap();
}

#[test]
fn no_damage_to_materials_makes_the_reader_panic_or_pass_what_is_not_finite() {
    let (folder, whole) = rich();
    // Of what materials say, and of the file as a whole.
    let of_materials = ["materials", "textures", "samplers", "images"];
    let which = prop::option::weighted(0.75, prop::sample::select(of_materials.to_vec()));
    throw(2000, &(which, prop::collection::vec(tree_damage(), 1..3)), |(which, damages)| {
        let mut tree = whole.clone();
        for damage in &damages {
            match which {
                Some(list) => tree[list] = damage.apply(tree[list].take()),
                None => tree = damage.apply(tree),
            }
        }
        folder.write("quad.glb", json_text(&tree).as_bytes());
        check_all(folder.load())
    });
}
