//! What is refused, with which words, and what is mended with a warning.

#![allow(clippy::unwrap_used, reason = "helpers of tests may stop where the tests themselves would")]

use std::fmt::Write as _;

use image::{ImageFormat, Rgb, RgbImage};
use serde_json::{Value, json};
use skinfit::model::params::{Column, Param};

use super::scene_folder::{SCENE, SceneFolder, encode, exr, png, quad, skinned, tampered};

#[test]
fn refusals_of_scene_files_say_where_what_and_what_to_do() {
    let scene_folder = SceneFolder::new();
    let view = &SCENE[SCENE.find("[[view]]").unwrap()..SCENE.find("[fit]").unwrap()];
    let camera = |row: &str| ("1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1", row.to_owned());
    let cases: Vec<(&str, String, &[&str])> = vec![
        ("[mesh]", "[mesh]\nfiel = 1".into(), &["line 3", "unknown key `fiel`", "Did you mean `file`"]),
        ("[mesh]", "[mash]".into(), &["unknown key `mash`", "`mesh`"]),
        ("file = \"quad.glb\"", String::new(), &["`file`", "missing"]),
        ("width = 4", "width = 4.5".into(), &["line 17", "a whole number"]),
        ("width = 4", "width = 0".into(), &["line 17", "width = 0", "[1, 16384]"]),
        ("width = 4", "width = 100000".into(), &["width = 100000"]),
        ("width = 4", "width = \"four\"".into(), &["line 17", "invalid type"]),
        ("width = 4", "width = 5".into(), &["target.exr", "4 x 4 pixels", "5 x 4"]),
        ("[fit]", "response = 0.0\n[fit]".into(), &["response = 0 is no power", "such as 2.2"]),
        ("[fit]", "response = true\n[fit]".into(), &["expected a number", "path of a table"]),
        (
            "[fit]",
            "response = 2.2\n[fit]".into(),
            &["target.exr", "holds light itself", "Leave `response` out"],
        ),
        ("[fit]", "response = \"none.csv\"\n[fit]".into(), &["none.csv", "there is no such file"]),
        ("fov_y_degrees = 30", "fov_y_degrees = 180".into(), &["fov_y_degrees = 180", "below 180"]),
        ("fov_y_degrees = 30", "fov_y_degrees = 1e-30".into(), &["fov_y_degrees = 1e-30", "from 0.001"]),
        ("fov_y_degrees = 30", "fov_y_degrees = nan".into(), &["fov_y_degrees = NaN"]),
        (camera("").0, camera("1,0,0,0, 0,1,0,0, 0,0,1,nan, 0,0,0,1").1, &["NaN", "row 2, column 3"]),
        (camera("").0, camera("1,0,0,0, 0,1,0,0, 0,0,1").1, &["11 numbers instead of 16"]),
        (camera("").0, camera("2,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1").1, &["not orthonormal"]),
        (camera("").0, camera("-1,0,0,0, 0,1,0,0, 0,0,1,-2, 0,0,0,1").1, &["mirrors"]),
        (camera("").0, camera("1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,-2,1").1, &["last row", "by columns"]),
        ("\"front\"", "\"../front\"".into(), &["../front", "file name"]),
        ("\"front\"", "\"\"".into(), &["file name"]),
        ("[fit]", view.replace("front", "FRONT") + "[fit]", &["two views are named `FRONT`"]),
        (view, String::new(), &["no view"]),
        ("[model]", "[model]\nform = \"corected\"".into(), &["unknown form", "Did you mean `corrected`"]),
        ("[model]", "[model]\nsilhouette = \"pixel\"".into(), &["unknown silhouette `pixel`", "bumped"]),
        (
            "[model]",
            "[model]\nlookups = \"smoth\"".into(),
            &["unknown lookups `smoth`", "Did you mean `smooth`"],
        ),
        (
            "\"env.exr\"",
            "\"env.exr\"\ndapple = [1, 0, 0, 0, 1, 0, 0, 0]".into(),
            &["line 11", "dapple has 8 numbers instead of 9 or 16", "Give a rotation"],
        ),
        (
            "\"env.exr\"",
            "\"env.exr\"\ndapple = [1, 0, 0, 0, 1, 0, 0, nan, 1]".into(),
            &["dapple holds NaN at row 2, column 1"],
        ),
        (
            "\"env.exr\"",
            "\"env.exr\"\ndapple = [1,0,0, 0,1,0, 0,0,2]".into(),
            &["dapple scales", "orthonormal"],
        ),
        ("\"env.exr\"", "\"env.exr\"\ndapple = [1,0,0, 0,1,0, 0,0,-1]".into(), &["dapple mirrors"]),
        (
            "\"env.exr\"",
            "\"env.exr\"\ndapple = [1,0,0,0, 0,1,0,0, 0,0,1,3, 0,0,0,1]".into(),
            &["dapple moves or projects", "last row and column"],
        ),
        ("[model]", "[model]\neffects = [\"difuse\"]".into(), &["unknown effect `difuse`", "`diffuse`"]),
        ("[model]", "[model]\neffects = [\"rim\", \"rim\"]".into(), &["rim is listed twice", "Take one"]),
        ("[maps]", "[maps]\nnormal_y = \"left\"".into(), &["unknown direction", "up, down"]),
        ("[model.params]", "[model.params]\nhilight = 1".into(), &["line 13", "`hilight`", "`hilite`"]),
        (
            "[model.params]",
            "[model.params]\nocclusion = 1.5".into(),
            &["line 13", "occlusion = 1.5", "[0, 1]"],
        ),
        ("[model.params]", "[model.params]\nhilite = inf".into(), &["hilite = inf"]),
        ("[model.params]", "[model.params]\nhilite = 1e300".into(), &["hilite = 1e300", "[0, 1000000000]"]),
        ("[model.params]", "[model.params]\nrim_exponent = [1, 2, 3]".into(), &["rim_exponent", "one value"]),
        ("[model.params]", "[model.params]\nhilite = [1, 2]".into(), &["line 13", "a number or [r, g, b]"]),
        ("[fit]", "[fit]\nfree = [\"hilite\", \"hilite\"]".into(), &["hilite is listed twice"]),
        ("[fit]", "[fit]\nfree = [\"shine\"]".into(), &["unknown parameter `shine`"]),
        ("[fit]", "[fit]\nper_channel = [\"occlusion\"]".into(), &["occlusion", "one value"]),
        ("[fit]", "[fit]\nfree=[]\nper_channel = [\"hilite\"]".into(), &["hilite", "not free"]),
        (
            "[fit]",
            "[fit.maps.color]\nlower = 1.5\n[fit]".into(),
            &["lower = 1.5 is not below upper, which is 1 by default"],
        ),
        (
            "[fit]",
            "[fit]\nbounds = { hilite = [0.8, 0.2] }".into(),
            &["hilite stays within [0.8, 0.2]", "no such interval", "the lesser first"],
        ),
        (
            "[fit]",
            "[fit]\nbounds = { rim_exponent = [0.1, 4] }".into(),
            &["rim_exponent stays within [0.1, 4]", "[0.25, 16]"],
        ),
        ("[fit]", "[fit]\nbounds = { hilite = [0, nan] }".into(), &["hilite stays within [0, NaN]"]),
        ("[fit]", "[fit]\nbounds = { shine = [0, 1] }".into(), &["unknown parameter `shine`"]),
        ("[fit]", "[fit]\nloss = \"l1\"".into(), &["unknown loss `l1`", "`l2`"]),
        ("[quality]", "[quality]\nlobe_size = 1".into(), &["lobe_size = 1", "[4, 1024]"]),
        ("[environment]\nfile = \"env.exr\"", String::new(), &["no [environment]"]),
        ("\"env.exr\"", "\"env.exr\"\nintensity = -1".into(), &["intensity = -1"]),
        ("\"env.exr\"", "\"env.exr\"\nrotation_degrees = inf".into(), &["rotation_degrees = inf"]),
        ("\"env.exr\"", "\"missing.exr\"".into(), &["missing.exr", "no such file"]),
        ("\"env.exr\"", "\".\"".into(), &["not a file"]),
        ("\"quad.glb\"", "\"missing.glb\"".into(), &["missing.glb", "no such file"]),
        (
            "\"env.exr\"",
            "\"env.exr\"\nrotation_degrees = 1e300".into(),
            &["rotation_degrees = 1e300", "[-36000, 36000]"],
        ),
        ("\"quad.glb\"", "\"quad.glb\"\ntime = 1e300".into(), &["time = 1e300", "[-1000000000, 1000000000]"]),
        (
            "\"quad.glb\"",
            "\"quad.glb\"\nmorph_weights = [1e300]".into(),
            &["morph_weights holds 1e300. Give weights in [-1000000"],
        ),
        ("\"quad.glb\"", "\"quad.glb\"\nmorph_weights = [1]".into(), &["0 morph targets", "1 weights"]),
        ("\"quad.glb\"", "\"quad.glb\"\nmorph_weights = [nan]".into(), &["morph_weights holds NaN"]),
        ("\"quad.glb\"", "\"quad.glb\"\nmetres_per_unit = 0".into(), &["metres_per_unit = 0"]),
        ("\"quad.glb\"", "\"quad.glb\"\ntime = nan".into(), &["time = NaN"]),
        ("[fit]", "[fit\n".into(), &["line 20"]),
        (
            "[fit]",
            "background = \"sky\"\n[fit]".into(),
            &["line 20", "unknown background `sky`", "none, environment"],
        ),
        ("[fit]", "background = 1\n[fit]".into(), &["line 20", "\"none\", \"environment\" or [r, g, b]"]),
        ("[fit]", "background = [1, 2]\n[fit]".into(), &["line 20", "[r, g, b]"]),
        (
            "[fit]",
            "background = [0, -1, 0]\n[fit]".into(),
            &["line 20", "background holds -1", "[0, 1000000000]"],
        ),
        ("[fit]", "background = [0, nan, 0]\n[fit]".into(), &["background holds NaN"]),
        ("\"env.exr\"", "\"env.exr\"\nlights = 65".into(), &["line 11", "lights = 65", "[0, 64]"]),
        (
            "\"env.exr\"",
            "\"env.exr\"\nlight_spot_degrees = 0".into(),
            &["line 11", "light_spot_degrees = 0", "[0.05, 45]"],
        ),
        (
            "[quality]",
            "[quality]\nshadow_filter = \"pfc\"".into(),
            &[
                "line 22",
                "unknown shadow_filter `pfc`",
                "Did you mean `pcf`? Known: vertices, hardware, pcf, pcss",
            ],
        ),
        (
            "[quality]",
            "[quality]\ntexture_filter = \"trilinaer\"".into(),
            &[
                "line 22",
                "unknown texture_filter `trilinaer`",
                "Did you mean `trilinear`? Known: bilinear, trilinear, anisotropic",
            ],
        ),
        (
            "[quality]",
            "[quality]\nshadow_map_size = 15".into(),
            &["line 22", "shadow_map_size = 15", "[16, 8192]"],
        ),
        (
            "[quality]",
            "[quality]\nshadow_bias = -1.0".into(),
            &["line 22", "shadow_bias = -1", "texels in [0, 64]"],
        ),
        ("[quality]", "[quality]\nshadow_radius = nan".into(), &["shadow_radius = NaN", "texels in [0, 64]"]),
        ("[quality]", "[quality]\nshadow_taps = 0".into(), &["shadow_taps = 0", "[1, 256]"]),
        ("[fit]", "[bloom]\nsigma = 0.3\n[fit]".into(), &["line 21", "sigma = 0.3", "[0, 0.25]"]),
        (
            "[fit]",
            "[diffusion]\nlight_map_size = 32\n[fit]".into(),
            &["line 21", "light_map_size = 32", "[64, 8192]"],
        ),
        ("[fit]", "[bloom]\nwidth = 0.3\n[fit]".into(), &["line 21", "unknown key `width`", "sigma"]),
        (
            "[fit]",
            view.replace("front", "left").replace("[[view]]", "haze = \"haze.exr\"\n[[view]]") + "[fit]",
            &["line 22", "`left` has a target but names no haze", "`front` does", "Give every view"],
        ),
    ];
    let mut failures = String::new();
    for (from, to, words) in &cases {
        let message = match scene_folder.edited(from, to) {
            Ok(_) => "(it was read)".to_owned(),
            Err(error) => error.to_string(),
        };
        if words.iter().any(|word| !message.contains(word)) || message.contains('\n') {
            writeln!(failures, "{to:?}: {message}\n   lacks one of {words:?}").unwrap();
        }
    }
    assert!(failures.is_empty(), "{failures}");
    scene_folder.write("scene.toml", &[0xff, 0xfe, 0x00]);
    assert!(scene_folder.load().unwrap_err().to_string().contains("UTF-8"));
}

#[test]
fn refusals_of_haze_name_the_file_and_the_remedy() {
    let scene_folder = SceneFolder::new();
    let scene = SCENE
        .replace("[model]\n", "[model]\neffects = [\"reflection\", \"bloom\"]\n")
        .replace("[fit]", "haze = \"haze.exr\"\n[fit]");
    scene_folder.write("scene.toml", scene.as_bytes());
    let cases: Vec<(Vec<u8>, &[&str])> = vec![
        (
            exr(4, 4, &["R", "G", "B"], |_, _| 1.0),
            &["haze.exr", "no channel haze.Y", "it has B, G, R", "under the name haze.Y"],
        ),
        (exr(5, 4, &["haze.Y"], |_, _| 1.0), &["haze.exr", "5 x 4", "its view is 4 x 4"]),
        (exr(4, 4, &["haze.Y"], |_, i| if i == 5 { f32::NAN } else { 0.0 }), &["x = 1, y = 1", "NaN"]),
        (exr(4, 4, &["Y"], |_, i| if i == 5 { 1e20 } else { 0.0 }), &["pixel (1, 1)", "no square"]),
        (png(4, 4, [1, 1, 1]), &["no EXR file", "haze.Y"]),
        (b"nothing".to_vec(), &["no EXR file"]),
    ];
    for (bytes, words) in cases {
        scene_folder.write("haze.exr", &bytes);
        let message = scene_folder.load().map(drop).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message} lacks one of {words:?}");
    }
    scene_folder.write("haze.exr", &exr(4, 4, &["haze.Y"], |_, _| 1.0));
    assert!(scene_folder.load().is_ok());
    scene_folder.write("target.exr", &png(4, 4, [1, 1, 1]));
    let message = scene_folder.load().map(drop).unwrap_err().to_string();
    assert!(message.contains("haze.exr") && message.contains("8 or 16 bits"), "{message}");
}

#[test]
fn refusals_of_images_name_the_file_and_the_pixel() {
    let mut whole = SceneFolder::new();
    whole.write("whole.jpg", &encode(RgbImage::from_pixel(64, 64, Rgb([9, 200, 3])), ImageFormat::Jpeg));
    let jpeg = std::fs::read(whole.path("whole.jpg")).unwrap();
    let bomb = {
        // A PNG header of 65535 x 65535 pixels.
        let mut bytes = png(4, 4, [0, 0, 0]);
        bytes[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        bytes
    };
    let nan =
        |x: usize| exr(4, 4, &["R", "G", "B"], move |c, i| if c == 1 && i == x { f32::NAN } else { 1.0 });
    let tail = |bytes: &[u8]| bytes[..bytes.len() * 2 / 3].to_vec();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("target.exr", nan(6), &["target.exr", "x = 2, y = 1", "channel G", "NaN"]),
        (
            "env.exr",
            exr(8, 4, &["R", "G", "B"], |_, i| if i == 9 { f32::INFINITY } else { 0.0 }),
            &["x = 1, y = 1", "channel R", "inf"],
        ),
        ("env.exr", exr(8, 4, &["P.X", "P.Y", "P.Z"], |_, _| 0.0), &["no channels R, G and B", "P.X"]),
        ("env.exr", exr(8, 4, &["RY", "BY"], |_, _| 0.0), &["no channels R, G and B, nor Y", "RY"]),
        ("env.exr", b"not an exr".to_vec(), &["env.exr", "not an EXR"]),
        ("env.exr", tail(&exr(8, 4, &["R", "G", "B"], |_, i| i as f32)), &["cannot be read as an EXR"]),
        ("color.png", b"\x89PNG\r\n\x1a\nrest".to_vec(), &["color.png", "cannot be read as a PNG"]),
        ("color.png", tail(&png(40, 40, [1, 2, 3])), &["cannot be read as a PNG"]),
        ("color.png", tail(&jpeg), &["cannot be read as a JPEG", "ends before"]),
        ("color.png", bomb, &["65535 x 65535"]),
        (
            "color.png",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4000 +X 4000\n\x02\x02".to_vec(),
            &["4000 x 4000", "so short a file"],
        ),
        ("color.png", Vec::new(), &["not a PNG"]),
        ("mask.png", png(4, 4, [0, 9, 9]), &["mask.png", "empty mask"]),
        ("mask.png", png(4, 5, [255; 3]), &["mask.png", "4 x 5", "4 x 4"]),
        ("target.exr", exr(4, 3, &["R", "G", "B"], |_, _| 1.0), &["4 x 3 pixels", "4 x 4"]),
    ];
    let mut failures = String::new();
    for (name, bytes, words) in cases {
        whole = SceneFolder::new();
        whole.write(name, &bytes);
        let message = match whole.edited("[fit]", "mask = \"mask.png\"\n[fit]") {
            Ok(_) => "(it was read)".to_owned(),
            Err(error) => error.to_string(),
        };
        if words.iter().any(|word| !message.contains(word)) || message.contains('\n') {
            writeln!(failures, "{name}: {message}\n   lacks one of {words:?}").unwrap();
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// The checksum of PNG chunks (ISO 3309), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[test]
fn refusals_of_meshes_name_the_place() {
    let scene_folder = SceneFolder::new();
    let primitive =
        |json: &mut Value, key: &str, value: Value| json["meshes"][0]["primitives"][0][key] = value;
    let nan = f32::NAN.to_le_bytes();
    let mut cases: Vec<(Vec<u8>, &[&str])> = vec![
        (quad()[..quad().len() - 40].to_vec(), &["quad.glb", "cannot be read as glTF"]),
        (b"glTF".to_vec(), &["cannot be read as glTF"]),
        (b"{\"asset\": ".to_vec(), &["cannot be read as glTF"]),
        (
            tampered(|json, _| {
                json["meshes"][0]["primitives"][0]["attributes"]
                    .as_object_mut()
                    .unwrap()
                    .remove("TEXCOORD_0");
            }),
            &["mesh `quad`", "no texture coordinates", "Unwrap"],
        ),
        (tampered(|json, _| json["accessors"][5]["count"] = json!(0)), &["no triangles", "empty"]),
        (tampered(|json, _| json["nodes"][0] = json!({})), &["no triangles"]),
        (tampered(|_, bin| bin[240..242].copy_from_slice(&[9, 0])), &["vertex 9", "there are 4", "index 0"]),
        (tampered(move |_, bin| bin[12..16].copy_from_slice(&nan)), &["vertex 1", "NaN"]),
        (tampered(move |_, bin| bin[96..100].copy_from_slice(&nan)), &["texture coordinate", "vertex 0"]),
        (tampered(|json, _| json["accessors"][0]["count"] = json!(400)), &["accessor 0", "beyond"]),
        (tampered(|json, _| json["accessors"][0]["count"] = json!(1_u64 << 40)), &["accessor 0", "elements"]),
        (tampered(|json, _| json["accessors"][1]["count"] = json!(3)), &["4 positions but 3 normals"]),
        (tampered(|json, _| json["accessors"][0]["bufferView"] = json!(77)), &["buffer view 77"]),
        (
            tampered(|json, _| json["bufferViews"][0]["byteLength"] = json!(1 << 20)),
            &["buffer view 0", "beyond"],
        ),
        (tampered(|json, _| json["buffers"][0]["byteLength"] = json!(1 << 20)), &["buffer 0", "cut short"]),
        (tampered(|json, _| json["accessors"][0]["type"] = json!("VEC2")), &["accessor 0", "3 components"]),
        (tampered(|json, _| json["nodes"][0]["mesh"] = json!(5)), &["mesh 5"]),
        (tampered(|json, _| json["nodes"][0]["children"] = json!([0])), &["node 0", "own ancestor"]),
        (tampered(|json, _| json["scenes"][0]["nodes"] = json!([3])), &["node 3"]),
        (tampered(|json, _| json["nodes"][0]["scale"] = json!([1e300, 1, 1])), &["quad.glb", "out of range"]),
        (
            tampered(|json, _| json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])),
            &["KHR_draco_mesh_compression", "uncompressed"],
        ),
        (tampered(|json, _| json["buffers"][0]["uri"] = json!("http://a/b.bin")), &["not fetched"]),
        (tampered(|json, _| json["buffers"][0]["uri"] = json!("gone.bin")), &["gone.bin", "no such file"]),
        (tampered(|json, _| json["buffers"][0]["uri"] = json!("data:a;base64,!!")), &["data URI"]),
        (skinned(|_, bin| bin[252] = 7), &["bone 7", "the skin has 2", "vertex 0"]),
        (skinned(move |_, bin| bin[128..132].copy_from_slice(&nan)), &["bone weight NaN"]),
        (skinned(|json, _| json["skins"][0]["joints"] = json!([1, 9])), &["node 9"]),
        (skinned(|json, _| json["skins"][0]["inverseBindMatrices"] = json!(0)), &["16 components"]),
    ];
    let targets = json!([{"POSITION": 4}]);
    cases.push((
        tampered(move |json, bin| {
            primitive(json, "targets", targets.clone());
            bin[192..196].copy_from_slice(&nan);
        }),
        &["morph target 0", "vertex 0", "not finite"],
    ));
    let mut failures = String::new();
    for (bytes, words) in cases {
        scene_folder.write("quad.glb", &bytes);
        let message = match scene_folder.load() {
            Ok(_) => "(it was read)".to_owned(),
            Err(error) => error.to_string(),
        };
        if words.iter().any(|word| !message.contains(word)) || message.contains('\n') {
            writeln!(failures, "{message}\n   lacks one of {words:?}").unwrap();
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn what_can_be_mended_is_mended_with_a_warning() {
    let scene_folder = SceneFolder::new();
    let warned = |words: &str| {
        let (scene, warnings) = scene_folder.load().unwrap();
        assert!(warnings.iter().any(|w| w.to_string().contains(words)), "{warnings:?} lacks {words}");
        scene
    };
    scene_folder.write("quad.glb", &skinned(|_, _| ()));
    let scene = warned("4 vertices have bone weights that do not sum to 1");
    assert_eq!(scene.mesh.weights[0], [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(scene.mesh.pose().positions[0].to_array(), [-1.0, 2.0, 0.0]);
    scene_folder.write("quad.glb", &tampered(|_, bin| bin[244..246].copy_from_slice(&[1, 0])));
    assert_eq!(warned("1 degenerate triangles").mesh.triangles.len(), 1);
    scene_folder.write("quad.glb", &tampered(|_, bin| bin[48..60].fill(0)));
    assert_eq!(warned("1 vertices have normals without").mesh.normals[0].to_array(), [0.0, 0.0, 1.0]);
    scene_folder.write(
        "quad.glb",
        &tampered(|json, _| {
            let points = json!({"attributes": {"POSITION": 0}, "mode": 0});
            json["meshes"][0]["primitives"].as_array_mut().unwrap().push(points);
        }),
    );
    warned("1 primitives are points or lines");
    scene_folder.write("quad.glb", &quad());
    scene_folder.write("env.exr", &exr(6, 4, &["R", "G", "B"], |_, i| if i == 3 { -1.0 } else { 65504.0 }));
    let panorama = warned("1 texels have negative radiance").environment.unwrap().panorama;
    assert_eq!((panorama.texels[3], panorama.texels[4]), ([0.0; 3], [65504.0; 3]));
    warned("twice as wide as high");
    scene_folder.write("env.exr", &exr(8, 4, &["R", "G", "B"], |_, _| 1.0));
    let (scene, warnings) = scene_folder.edited("[fit]", "[fit]\nfree = [\"key_color\"]").unwrap();
    assert!(warnings[0].message.contains("key_color is free, but no enabled effect asks for it"));
    assert_eq!(scene.fit.free, [Column::tied(Param::KeyColor)]);
}
