//! Mesh files that the standard allows and that few programs write: they read as what they say.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use serde_json::{Value, json};
use skinfit::scene::mesh::Mesh;

use super::plain::{self, SCENE as PLAIN};
use super::scene_folder::{SceneFolder, base64, glb, quad_parts};

/// The mesh of the usual scene with this mesh file.
fn mesh(file: &[u8]) -> Mesh {
    let folder = SceneFolder::new();
    folder.write("quad.glb", file);
    let (scene, _) = folder.load().unwrap();
    scene.mesh
}

/// Its positions and triangles.
fn shape(file: &[u8]) -> (Vec<glam::Vec3>, Vec<[u32; 3]>) {
    let mesh = mesh(file);
    (mesh.positions, mesh.triangles)
}

/// A chunk of a container.
fn chunk(kind: [u8; 4], bytes: &[u8]) -> Vec<u8> {
    let mut out = (bytes.len() as u32).to_le_bytes().to_vec();
    out.extend(kind);
    out.extend(bytes);
    out
}

/// The container with its length as it is.
fn with_length(mut file: Vec<u8>) -> Vec<u8> {
    let length = file.len() as u32;
    file[8..12].copy_from_slice(&length.to_le_bytes());
    file
}

#[test]
fn containers_may_hold_more_than_the_mesh() {
    let (json, bin) = quad_parts();
    let plain = glb(&json, &bin);
    let expected = shape(&plain);
    // Section 4.4.3: chunks of unknown kinds are ignored.
    let unknown = chunk(*b"NEWS", &[1, 2, 3, 4]);
    let binary_at = plain.len() - bin.len() - 8;
    let between = [&plain[..binary_at], &unknown, &plain[binary_at..]].concat();
    assert_eq!(shape(&with_length(between)), expected);
    assert_eq!(shape(&with_length([plain.as_slice(), &unknown].concat())), expected);
    // A second binary chunk is not the buffer's.
    assert_eq!(shape(&with_length([plain.as_slice(), &chunk(*b"BIN\0", &[255; 8])].concat())), expected);
    // What is behind the container's end is not of it.
    assert_eq!(shape(&[plain.as_slice(), b"more of something"].concat()), expected);
    // Nor is padding before it.
    assert_eq!(shape(&with_length([plain.as_slice(), &[0; 3]].concat())), expected);
    // JSON alone, its buffer elsewhere.
    let mut apart = json;
    apart["buffers"][0]["uri"] = json!(format!("data:;base64,{}", base64(&bin)));
    let alone = glb(&apart, &[]);
    assert_eq!(shape(&with_length(alone[..alone.len() - 8].to_vec())), expected);
    let (start, text) = (plain[..12].to_vec(), plain[12..binary_at].to_vec());
    let refused = |file: Vec<u8>| {
        let folder = SceneFolder::new();
        folder.write("quad.glb", &file);
        folder.load().unwrap_err().to_string()
    };
    let told = refused(with_length([start.as_slice(), &text].concat()));
    assert!(told.contains("has no binary chunk"), "{told}");
    let told = refused(with_length([start.as_slice(), &chunk(*b"BIN\0", &[0; 4])].concat()));
    assert!(told.contains("its first chunk is not of JSON"), "{told}");
    for end in [2, 7, 11, 15, 19, 40, binary_at + 3, binary_at + 20] {
        let told = refused(plain[..end].to_vec());
        assert!(told.contains("cannot be read as glTF 2.0"), "{end}: {told}");
    }
    let with = |at: usize, byte: u8| {
        let mut file = plain.clone();
        file[at..at + 4].copy_from_slice(&[byte, 0, 0, 0]);
        refused(file)
    };
    assert!(with(4, 3).contains("version 3"));
    assert!(with(8, 5).contains("fewer than it has itself"));
}

/// Every whole number of a JSON document as a float.
fn floats(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(floats),
        Value::Object(fields) => fields.values_mut().for_each(floats),
        Value::Number(number) => *value = json!(number.as_f64().unwrap()),
        _ => {}
    }
}

#[test]
fn whole_numbers_may_be_written_as_floats() {
    let (mut json, bin) = quad_parts();
    let expected = shape(&glb(&json, &bin));
    floats(&mut json);
    assert!(json.to_string().contains("\"byteLength\":") && json.to_string().contains(".0"), "{json}");
    assert_eq!(shape(&glb(&json, &bin)), expected);
    // What is refused is told by where it stands in the file, and a key that is there twice is refused as ever.
    let refused = |file: &str| {
        let folder = SceneFolder::new();
        folder.write("quad.glb", file.as_bytes());
        folder.load().unwrap_err().to_string()
    };
    let told = refused("{\n\n  \"asset\": {\"version\": \"2.0\"},\n  \"nodes\": [{\"mesh\": \"x\"}]\n}");
    assert!(told.contains("line 4"), "{told}");
    let told = refused("{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scene\": 1}");
    assert!(told.contains("duplicate field"), "{told}");
    // Not whole is not an index.
    json["nodes"][0]["mesh"] = json!(0.5);
    let folder = SceneFolder::new();
    folder.write("quad.glb", &glb(&json, &bin));
    let told = folder.load().unwrap_err().to_string();
    assert!(told.contains("0.5"), "{told}");
}

#[test]
fn data_uris_may_be_percent_encoded() {
    let (mut json, bin) = quad_parts();
    let expected = shape(&glb(&json, &bin));
    let encoded: String = bin.iter().map(|byte| format!("%{byte:02X}")).collect();
    json["buffers"] =
        json!([{"byteLength": bin.len(), "uri": format!("data:application/octet-stream,{encoded}")}]);
    assert_eq!(shape(json.to_string().as_bytes()), expected);
    // Base64 in any letters is base64.
    json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream; BASE64,{}", base64(&bin)));
    assert_eq!(shape(json.to_string().as_bytes()), expected);
    // Cut short, it holds less than was promised; and what has no data.
    for (uri, words) in [("data:,%00%01", "holds 2 bytes of"), ("data:base64", "without a comma")] {
        json["buffers"][0]["uri"] = json!(uri);
        let folder = SceneFolder::new();
        folder.write("quad.glb", json.to_string().as_bytes());
        let told = folder.load().unwrap_err().to_string();
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn extensions_are_read_told_or_refused() {
    let eye = json!({
        "name": "Eye",
        "emissiveFactor": [0.5, 0.25, 0],
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4},
            "KHR_materials_transmission": {"transmissionFactor": 1},
        },
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
    });
    let load = |required: &[&str]| {
        let folder = plain::edited(&eye, PLAIN, |mesh, _| {
            mesh["extensionsRequired"] = json!(required);
            // A texture whose picture is of a format that is not read.
            mesh["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
        });
        skinfit::scene::Scene::load(&folder.path("scene.toml"), &skinfit::scene::LoadOptions::default())
    };
    let (scene, warnings) = load(&["KHR_materials_transmission", "KHR_texture_basisu"]).unwrap();
    let material = &scene.mesh.plain.as_ref().unwrap().materials[0];
    assert_eq!(material.emission, [2.0, 1.0, 0.0]);
    let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    for words in ["is drawn without KHR_materials_transmission", "a picture whose format is not read"] {
        assert!(told.iter().any(|line| line.contains(words)), "{words}: {told:?}");
    }
    // As a prefix of known ones this would pass.
    for name in ["KHR_materials_unheard_of", "KHR_texture_of_the_future", "KHR_draco_mesh_compression"] {
        let told = load(&[name]).unwrap_err().to_string();
        assert!(told.contains(name), "{told}");
    }
}

#[test]
fn a_photograph_as_a_normal_map_is_told() {
    let normals = |pixel: fn(u32, u32) -> [u8; 3]| {
        let folder = SceneFolder::new();
        let picture = image::RgbImage::from_fn(8, 8, |x, y| image::Rgb(pixel(x, y)));
        folder.write("normal.png", &super::scene_folder::encode(picture, image::ImageFormat::Png));
        let (_, warnings) = folder.load().unwrap();
        warnings.iter().any(|warning| warning.to_string().contains("does not look like a normal map"))
    };
    assert!(!normals(|x, y| [100 + 8 * x as u8, 100 + 8 * y as u8, 250]));
    // Nothing around a chart.
    assert!(!normals(|x, _| if x < 4 { [0; 3] } else { [128, 128, 255] }));
    // Skin in daylight, bright skin, whose colours are unit vectors; grey.
    assert!(normals(|x, y| [200 + 5 * x as u8, 150 + 5 * y as u8, 120]));
    assert!(normals(|x, y| [226 + x as u8, 186 + y as u8, 170]));
    assert!(normals(|_, _| [128; 3]));
}
