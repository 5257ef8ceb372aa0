//! Parts with corners, stacked holes, bakes that are kept, and names.

use serde_json::{Value, json};
use skinfit::prepare::{Baked, PrepareOptions};

use super::{SCENE, edited, image, middle_and_skin, sampled};

/// The eye as an octahedron, whose smooth normals are far from those of its faces, turned so that faces are seen from
/// their edges.
pub(super) fn octahedron(mesh: &mut Value, bin: &mut Vec<u8>) {
    let corners: [[f32; 3]; 6] =
        [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
    let faces: [[u16; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    bin.resize(bin.len().next_multiple_of(4), 0);
    let start = bin.len();
    bin.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bin.extend(faces.as_flattened().iter().flat_map(|i| i.to_le_bytes()));
    mesh["buffers"][0]["byteLength"] = json!(bin.len());
    let views = mesh["bufferViews"].as_array_mut().unwrap();
    views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": 72}));
    views.push(json!({"buffer": 0, "byteOffset": start + 72, "byteLength": 48}));
    let accessors = mesh["accessors"].as_array_mut().unwrap();
    accessors.push(json!({"bufferView": 7, "componentType": 5126, "count": 6, "type": "VEC3"}));
    accessors.push(json!({"bufferView": 8, "componentType": 5123, "count": 24, "type": "SCALAR"}));
    mesh["meshes"][1]["primitives"][0] =
        json!({"attributes": {"POSITION": 7, "NORMAL": 7}, "indices": 8, "material": 1});
    // A turn of 20 degrees about Y.
    mesh["nodes"][1]["rotation"] = json!([0.0, 0.173_648, 0.0, 0.984_808]);
}

#[test]
fn a_coarse_closed_part_is_lit_to_its_silhouette() {
    let chalk = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}});
    let folder = edited(&chalk, SCENE, octahedron);
    let sampled = sampled(&folder);
    let plain = &sampled.samples[0].plain;
    assert!(plain.len() > 20, "{}", plain.len());
    for part in plain {
        let shown = part.rgb[0] / part.share;
        // White under a sky of 1 shows 1; where the smooth normal leans away, up to half of what it faces is the part
        // itself, and skin behind it hides some. A side that is taken for the other shows next to nothing.
        assert!((0.35..1.1).contains(&shown), "pixel {} shows {shown}", part.pixel);
    }
}

/// Forty of the eye, one behind the other: more than the layers that blend at most.
fn stacked(mesh: &mut Value, _: &mut Vec<u8>) {
    let nodes: Vec<Value> = (0..40)
        .map(|i| json!({"mesh": 1, "scale": [0.5, 0.5, 0.5], "translation": [0, 0, 0.1 + 0.01 * f64::from(i)]}))
        .collect();
    mesh["nodes"] = std::iter::once(json!({"mesh": 0})).chain(nodes).collect();
    mesh["scenes"][0]["nodes"] = (0..41).collect();
}

#[test]
fn holes_behind_holes_hide_nothing() {
    let net = json!({"name": "Eye", "alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 0.2]}});
    let middle = image(&sampled(&edited(&net, SCENE, stacked))).rgb[8 * 16 + 8];
    assert!((middle[0] - 1.0).abs() < 1e-3, "{middle:?}");
}

#[test]
fn behind_many_layers_the_skin_is_no_hole() {
    let veil = json!({"name": "Eye", "alphaMode": "BLEND", "pbrMetallicRoughness": {
        "metallicFactor": 1, "roughnessFactor": 0, "baseColorFactor": [0, 0, 0, 0.02]}});
    let image = image(&sampled(&edited(&veil, SCENE, stacked)));
    let (middle, alpha) = (image.rgb[8 * 16 + 8], image.alpha[8 * 16 + 8]);
    // Sixteen layers hold back 28 of 100: one of the four rays ends at them, the others at the white skin.
    assert!((middle[0] - 0.75).abs() < 1e-3 && (alpha - 1.0).abs() < 1e-6, "{middle:?} {alpha}");
}

#[test]
fn bakes_are_kept_apart_by_what_stands_in_the_way() {
    let cache = tempfile::tempdir().unwrap();
    let scene = SCENE.replace("\"diffuse\"", "\"diffuse\", \"occlusion\"");
    let open = |mode: &str, alpha: f64, scene: &str| {
        let eye = json!({"name": "Eye", "alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, alpha]}});
        // As large as the skin.
        let folder = edited(&eye, scene, |mesh, _| mesh["nodes"][1]["scale"] = json!([1, 1, 1]));
        let options = PrepareOptions { cache: Some(cache.path().to_owned()), ..PrepareOptions::default() };
        let baked = Baked::new(&folder.path("scene.toml"), &options).unwrap();
        baked.occlusion.as_ref().unwrap().base[0]
    };
    let all_skin = scene.replace("skin = [\"Skin\"]\n", "");
    // The cutoff is a half where a material names none.
    let (closed, with_holes) = (open("OPAQUE", 0.4, &scene), open("MASK", 0.4, &scene));
    assert!((with_holes - closed).abs() > 0.05, "{with_holes} and {closed}");
    // The same again, from what is kept; alpha alone is another bake; and a mesh without parts has what the closed part has.
    assert_eq!(open("OPAQUE", 0.4, &scene), closed);
    assert_eq!(open("MASK", 0.4, &scene), with_holes);
    assert_eq!(open("MASK", 0.6, &scene), closed);
    assert_eq!(open("MASK", 0.4, &all_skin), closed);
}

#[test]
fn a_mesh_without_a_name_is_called_by_its_node() {
    let black = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 1, "baseColorFactor": [0, 0, 0, 1]}});
    assert!(middle_and_skin(&black).0[0] < 1e-3);
    let both = SCENE.replace("[\"Skin\"]", "[\"Skin\", \"lens\"]");
    let folder = edited(&black, &both, |mesh, _| {
        mesh["meshes"][1].as_object_mut().unwrap().remove("name");
        mesh["nodes"][1]["name"] = json!("lens");
    });
    let sampled = sampled(&folder);
    assert!(sampled.scene.mesh.plain.is_none());
}
