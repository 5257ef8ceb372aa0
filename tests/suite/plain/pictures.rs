//! Pictures, how they repeat and where they are looked up, colours of vertices; and the skin's own maps.

use serde_json::{Value, json};

use super::{SCENE, close, edited, image, middle_and_skin, sampled};
use crate::scene_folder::encode;
use skinfit::scene::{LoadOptions, Scene};

/// Black to the left, white to the right.
fn black_and_white() -> Vec<u8> {
    let picture = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([255 * x as u8; 3]));
    encode(picture, image::ImageFormat::Png)
}

/// Whether the eye is bright in the middles of four quarters of its width, left to right.
fn quarters(info: &Value, edit: impl FnOnce(&mut Value)) -> [bool; 4] {
    // It is seen from pixel 3.7 to 12.3 of the row.
    bright(info, edit, [5, 7, 9, 11].map(|x| 8 * 16 + x))
}

/// Whether the image is bright at these pixels, where the eye's base colour is a picture.
fn bright<const N: usize>(info: &Value, edit: impl FnOnce(&mut Value), pixels: [usize; N]) -> [bool; N] {
    let material = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0, "baseColorTexture": info}});
    let folder = edited(&material, SCENE, |mesh, _| {
        mesh["textures"] = json!([{"source": 0, "sampler": 0}]);
        mesh["samplers"] = json!([{"magFilter": 9728}]);
        edit(mesh);
    });
    folder.write("picture.png", &black_and_white());
    let image = image(&sampled(&folder));
    pixels.map(|pixel| image.rgb[pixel][0] > 0.5)
}

#[test]
fn samplers_and_transforms_are_gltfs() {
    let info = json!({"index": 0});
    assert_eq!(quarters(&info, |_| {}), [false, false, true, true]);
    let twice = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 1]}}});
    assert_eq!(quarters(&twice, |_| {}), [false, true, false, true]);
    let mirrored = quarters(&twice, |mesh| mesh["samplers"][0]["wrapS"] = json!(33648));
    assert_eq!(mirrored, [false, true, true, false]);
    let clamped = quarters(&twice, |mesh| mesh["samplers"][0]["wrapS"] = json!(33071));
    assert_eq!(clamped, [false, true, true, true]);
    let shifted = json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}});
    assert_eq!(quarters(&shifted, |_| {}), [true, true, false, false]);
    // Half a turn about the corner, brought back.
    let turned = json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [1, 1], "rotation": std::f64::consts::PI}}});
    assert_eq!(quarters(&turned, |_| {}), [true, true, false, false]);
    // A positive angle turns the picture clockwise: what was to the left stands above.
    let quarter = json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2}}});
    assert_eq!(bright(&quarter, |_| {}, [5 * 16 + 8, 11 * 16 + 8]), [false, true]);
}

#[test]
fn the_set_of_texture_coordinates_is_the_textures_own() {
    // The first set is all zero: the white normals' (0, 0) of the quad.
    let second = |mesh: &mut Value| {
        mesh["accessors"]
            .as_array_mut()
            .unwrap()
            .push(json!({"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}));
        let attributes = &mut mesh["meshes"][1]["primitives"][0]["attributes"];
        attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"].clone();
        attributes["TEXCOORD_0"] = json!(7);
    };
    assert_eq!(quarters(&json!({"index": 0, "texCoord": 1}), second), [false, false, true, true]);
    let moved = json!({"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}});
    assert_eq!(quarters(&moved, second), [false, false, true, true]);
    assert_ne!(quarters(&json!({"index": 0}), second), [false, false, true, true]);
}

#[test]
fn what_glows_glows_by_its_picture() {
    let glowing = json!({"name": "Eye", "emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0}, "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0, 0, 0, 1], "roughnessFactor": 1}});
    let (middle, _) = middle_and_skin(&glowing);
    // sRGB 188 is 0.5029 of linear light; the 4% that it reflects are the same in all channels.
    let glow = [middle[0] - middle[2], middle[1] - middle[2], 0.0];
    assert!(close(glow, [0.5029, 0.2515, 0.0], 1e-3), "{middle:?}");
}

#[test]
fn colours_of_vertices_are_factors() {
    let metal = json!({"name": "Eye", "pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0}});
    let folder = edited(&metal, SCENE, |mesh, _| {
        // Half red at each vertex, and no alpha, which an opaque material does not look at.
        mesh["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(3);
    });
    let middle = image(&sampled(&folder)).rgb[8 * 16 + 8];
    assert!(close(middle, [0.5, 0.0, 0.0], 2e-3), "{middle:?}");
    let folder = edited(&metal, SCENE, |mesh, bin| {
        mesh["meshes"][1]["primitives"][0]["attributes"]["COLOR_0"] = json!(3);
        bin[128..132].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    let told = folder.load().unwrap_err().to_string();
    assert!(told.contains("has a colour that is not finite"), "{told}");
}

/// The scene of a folder, with its warnings as one text.
fn loaded(skin: &Value, scene: &str) -> (Scene, String) {
    let folder = edited(&json!({"name": "Eye"}), scene, |mesh, _| mesh["materials"][0] = skin.clone());
    let (scene, warnings) = Scene::load(&folder.path("scene.toml"), &LoadOptions::default()).unwrap();
    (scene, warnings.iter().map(|warning| format!("{warning}\n")).collect())
}

#[test]
fn a_scene_without_maps_takes_those_of_its_skins_material() {
    let transform = json!({"KHR_texture_transform": {"offset": [0.25, 0], "scale": [0.5, 1]}});
    let skin = json!({"name": "Skin", "normalTexture": {"index": 0, "extensions": transform}, "pbrMetallicRoughness": {
        "baseColorFactor": [1, 0.5, 0.25, 1], "baseColorTexture": {"index": 0, "extensions": transform}}});
    let (scene, told) = loaded(&skin, SCENE);
    let color = scene.maps.color.as_ref().unwrap().texels[0];
    assert!(close(color, [0.5029, 0.2515, 0.1257], 1e-4), "{color:?}");
    // No effect of the scene looks at normals.
    assert!(scene.maps.normal.is_none() && told.is_empty(), "{told}");
    let (least, most) =
        scene.mesh.uvs[..4].iter().fold((1.0_f32, 0.0_f32), |(l, m), uv| (l.min(uv.x), m.max(uv.x)));
    assert_eq!((least, most), (0.25, 0.75));
    let bumped = SCENE.replace("\"diffuse\"", "\"diffuse\", \"normal_map\"");
    let (scene, _) = loaded(&skin, &bumped);
    assert!(close(scene.maps.normal.as_ref().unwrap().texels[0], [188.0 / 255.0; 3], 1e-6));

    // A map that is named is the only one; and they may be left alone.
    let named = SCENE.replace("[environment]", "[maps]\nspecular = \"picture.png\"\n[environment]");
    assert!(loaded(&skin, &named).0.maps.color.is_none());
    let without = SCENE.replace("[environment]", "[maps]\nmaterial = false\n[environment]");
    let (scene, _) = loaded(&skin, &without);
    assert!(scene.maps.color.is_none() && scene.mesh.uvs[..4].iter().any(|uv| uv.x == 0.0));
    // A factor alone is no map: `base_weight` is that.
    let plain = json!({"name": "Skin", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1]}});
    assert!(loaded(&plain, SCENE).0.maps.color.is_none());
    // All maps share one set of texture coordinates.
    let apart = json!({"name": "Skin", "normalTexture": {"index": 0}, "pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0, "extensions": transform}}});
    let (scene, told) = loaded(&apart, &bumped);
    assert!(scene.maps.normal.is_none() && told.contains("its normal map is looked up elsewhere"), "{told}");
    // Of one that is named, the others may be the material's all the same, and all are looked up as its are.
    let both =
        bumped.replace("[environment]", "[maps]\nspecular = \"picture.png\"\nmaterial = true\n[environment]");
    let (scene, _) = loaded(&skin, &both);
    assert!(scene.maps.color.is_some() && scene.maps.normal.is_some());
    assert!(scene.mesh.uvs[..4].iter().all(|uv| (0.25..=0.75).contains(&uv.x)));
    let told = scene.maps.material.flatten().unwrap();
    assert!(
        told.contains("the picture times (1, 0.5, 0.25)") && told.contains("KHR_texture_transform"),
        "{told}"
    );
}

#[test]
fn maps_that_cannot_be_had_are_a_warning() {
    let of = |info: Value| json!({"name": "Skin", "pbrMetallicRoughness": {"baseColorTexture": info}});
    for (skin, words) in [
        (of(json!({"index": 7})), "refers to texture 7"),
        (of(json!({"index": 0, "texCoord": 1})), "not all of the skin has texture coordinates 1"),
    ] {
        let (scene, told) = loaded(&skin, SCENE);
        assert!(scene.maps.color.is_none(), "{told}");
        assert!(told.contains(words) && told.contains("`material = false` in [maps]"), "{told}");
    }
}
