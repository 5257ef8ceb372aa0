//! From a mesh file to a scene: `inspect`, `import`.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::json;

use super::sandbox::{Sandbox, mesh};
use crate::fixtures::read_exr;

/// The extent of what an image covers, in shares of its width and height: left, right, top, bottom.
fn covered(sandbox: &Sandbox, image: &str) -> [f64; 4] {
    let planes = read_exr(&sandbox.path(image));
    let alpha = &planes.planes["A"];
    let (mut left, mut right, mut top, mut bottom) = (1.0_f64, 0.0_f64, 1.0_f64, 0.0_f64);
    for (i, _) in alpha.iter().enumerate().filter(|(_, a)| **a > 0.5) {
        let (x, y) = (i % planes.width, i / planes.width);
        (left, right) =
            (left.min(x as f64 / planes.width as f64), right.max((x + 1) as f64 / planes.width as f64));
        (top, bottom) =
            (top.min(y as f64 / planes.height as f64), bottom.max((y + 1) as f64 / planes.height as f64));
    }
    [left, right, top, bottom]
}

#[test]
fn a_mesh_is_told_and_framed() {
    let sandbox = Sandbox::new();
    let told = sandbox.run(&["inspect", "mesh.glb"]).done().out;
    for words in [
        "1.6 high (y), 1.69 deep (z); its middle is at [0, 0, 0.15",
        "ball  -",
        "texture coordinates",
        "morph targets: none",
        "cameras: none",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let written = sandbox
        .run(&["inspect", "mesh.glb", "-o", "made.toml", "--environment", "env.exr", "--size", "64"])
        .done();
    assert!(written.out.ends_with("\nwrote made.toml\n"), "{}", written.out);
    for view in ["front", "three_quarter", "profile"] {
        let image = format!("{view}.exr");
        sandbox.run(&["render", "made.toml", "--engine", "cpu", "--view", view, "-o", &image]).done();
        let [left, right, top, bottom] = covered(&sandbox, &image);
        // The mesh reaches nine tenths of the way from the middle to one of the borders, to a pixel of 64.
        let reach = [0.5 - left, right - 0.5, 0.5 - top, bottom - 0.5].into_iter().fold(0.0, f64::max);
        assert!((reach - 0.45).abs() < 1.5 / 64.0, "{view}: {left} {right} {top} {bottom}");
    }
    // What is there is not written over.
    sandbox.run(&["inspect", "mesh.glb", "-o", "made.toml"]).refused(&["made.toml: is there already"]);
    let json: serde_json::Value =
        serde_json::from_str(&sandbox.run(&["inspect", "mesh.glb", "--json"]).done().out).unwrap();
    assert_eq!(json["parts"][0]["mesh"], "ball");
    assert!((json["bounds"][1][1].as_f64().unwrap() - 0.8).abs() < 1e-6);
}

#[test]
fn without_a_panorama_two_lamps_light_the_mesh() {
    let sandbox = Sandbox::new();
    sandbox.run(&["inspect", "mesh.glb", "-o", "made.toml", "--size", "32"]).done();
    sandbox.run(&["render", "made.toml", "--engine", "cpu", "--view", "front", "-o", "front.exr"]).done();
    let planes = read_exr(&sandbox.path("front.exr"));
    let mean = planes.planes["R"].iter().sum::<f32>() / planes.planes["A"].iter().sum::<f32>();
    // Neither black nor blown out.
    assert!((0.05..1.0).contains(&mean), "{mean}");
}

#[test]
fn what_the_file_says_of_itself_is_taken_over_and_the_rest_is_named() {
    let sandbox = Sandbox::new();
    let picture = sandbox.read("color.png");
    let rich = mesh(|json, bin| {
        let at = bin.len();
        bin.extend(&picture);
        bin.resize(bin.len().next_multiple_of(4), 0);
        json["buffers"][0]["byteLength"] = json!(bin.len());
        let views = json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": at, "byteLength": picture.len()}));
        let view = views.len() - 1;
        json["images"] =
            json!([{"bufferView": view, "mimeType": "image/png", "name": "face"}, {"uri": "normal.png"}]);
        json["textures"] = json!([{"source": 0}, {"source": 1}]);
        json["materials"] = json!([
            {"name": "Skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 1}},
            {"name": "Lashes", "alphaMode": "BLEND", "normalTexture": {"index": 1}, "occlusionTexture": {"index": 0}, "extensions": {"KHR_materials_sheen": {}}},
        ]);
        json["meshes"][0]["primitives"][0]["material"] = json!(0);
        json["extensionsUsed"] = json!(["KHR_materials_sheen", "KHR_lights_punctual"]);
        json["cameras"] =
            json!([{"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1, "aspectRatio": 1.5}}]);
        json["nodes"] = json!([{"mesh": 0}, {"name": "Cam", "camera": 0, "translation": [0, 0, 5]}]);
        json["scenes"][0]["nodes"] = json!([0, 1]);
    });
    sandbox.write("rich.glb", &rich);
    let told = sandbox
        .run(&["inspect", "rich.glb", "-o", "rich.toml", "--environment", "env.exr", "--size", "48"])
        .done()
        .out;
    for words in [
        "face (png, within the file)",
        "normal.png",
        "Lashes    0          blend",
        "cameras: Cam (34.4 degrees from top to bottom, at [0, 0, 5])",
        "not read:\n  materials, unless the scene names which are skin",
        "alpha of materials",
        "normal maps of materials that are not skin",
        "occlusion pictures of materials",
        "KHR_materials_sheen",
    ] {
        assert!(told.contains(words), "{words:?}: {told}");
    }
    assert!(!told.contains("KHR_lights_punctual"), "{told}");
    assert_eq!(sandbox.read("rich_color.png"), picture);
    let scene = sandbox.text("rich.toml");
    for words in
        ["color = \"rich_color.png\"", "normal = \"normal.png\"", "camera = \"Cam\"\nwidth = 72\nheight = 48"]
    {
        assert!(scene.contains(words), "{words}: {scene}");
    }
    sandbox.run(&["render", "rich.toml", "--engine", "cpu", "--view", "camera_Cam", "-o", "cam.exr"]).done();
    assert!(covered(&sandbox, "cam.exr")[1] > 0.6);
}

#[test]
fn meshes_that_cannot_be_read_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.run(&["inspect", "none.glb"]).refused(&["none.glb: there is no such file"]);
    sandbox.run(&["inspect", "env.exr"]).refused(&["env.exr: cannot be read as glTF 2.0"]);
    sandbox
        .run(&["inspect", "mesh.glb", "-o", "made.toml", "--environment", "none.exr"])
        .refused(&["none.exr: is not there. Name a panorama."]);
    sandbox.write("f.json", b"{}");
    sandbox
        .run(&["inspect", "mesh.glb", "-o", "made.toml", "--environment", "f.json"])
        .refused(&["f.json: is not an image that can be read. Use OpenEXR"]);
    assert!(!sandbox.path("made.toml").exists());
}

/// A COLMAP model of the scene's own front view.
fn write_model(sandbox: &Sandbox, name: &str) {
    // 32 pixels under 35 degrees; 4 in front, COLMAP's axes.
    let focal = 16.0 / 17.5_f64.to_radians().tan();
    sandbox.write("sparse/cameras.txt", format!("7 SIMPLE_PINHOLE 32 32 {focal} 16 16\n").as_bytes());
    sandbox.write("sparse/images.txt", format!("1 0 1 0 0 0 0 4 7 {name}\n\n").as_bytes());
}

#[test]
fn cameras_of_another_program_become_views_with_their_targets() {
    let sandbox = Sandbox::new();
    write_model(&sandbox, "front.exr");
    let import =
        ["import", "colmap", "sparse", "--mesh", "mesh.glb", "--environment", "env.exr", "-o", "made.toml"];
    let written = sandbox.run(&[&import[..], &["--images", "targets"]].concat()).done();
    assert_eq!(written.out, "wrote made.toml: 1 view\n");
    let scene = sandbox.text("made.toml");
    assert!(scene.contains("target = \"targets/front.exr\""), "{scene}");
    // The silhouettes lie on one another, so nothing is said of them.
    let fit = sandbox.run(&["fit", "made.toml", "-o", "run"]);
    assert!(!fit.err.contains("silhouettes"), "{}", fit.err);
    let report = sandbox.json("run/report.json");
    assert!(report["views"]["front"]["psnr"].as_f64().unwrap() > 15.0, "{report}");
    // A picture that is not there, and one of another size.
    write_model(&sandbox, "lost.exr");
    sandbox.remove("made.toml");
    sandbox
        .run(&[&import[..], &["--images", "targets"]].concat())
        .refused(&["targets/lost.exr: is not there"]);
    sandbox.write("sparse/cameras.txt", b"7 SIMPLE_RADIAL 32 32 40 16 16 -5\n");
    sandbox.run(&import).refused(&[
        "cameras.txt: line 1: has a lens that folds its image over, or sees 89 degrees from its axis, at pixel (0, 0)",
    ]);
    sandbox
        .run(&["import", "colmap", "targets", "--mesh", "mesh.glb", "-o", "made.toml"])
        .refused(&["has neither cameras.bin nor cameras.txt"]);
    sandbox
        .run(&["import", "transforms", "env.exr", "--mesh", "mesh.glb", "-o", "made.toml"])
        .refused(&["env.exr", "is no transforms.json"]);
    assert!(!sandbox.path("made.toml").exists());
}

#[test]
fn metashapes_cameras_become_views_with_their_targets() {
    let sandbox = Sandbox::new();
    // The scene's own front view: 32 pixels under 35 degrees, 4 in front, in a chunk of half the size.
    let focal = 16.0 / 17.5_f64.to_radians().tan();
    let file = format!(
        "<document version=\"2.0.0\"><chunk><sensors><sensor id=\"0\" type=\"frame\">\
         <calibration type=\"frame\" class=\"adjusted\"><resolution width=\"32\" height=\"32\"/><f>{focal}</f></calibration>\
         </sensor></sensors><components><component id=\"0\"><transform><scale>2</scale></transform></component></components>\
         <cameras><camera id=\"0\" sensor_id=\"0\" component_id=\"0\" label=\"front\">\
         <transform>1 0 0 0 0 -1 0 0 0 0 -1 2 0 0 0 1</transform></camera></cameras></chunk></document>"
    );
    sandbox.write("cameras.xml", file.as_bytes());
    let import = ["import", "metashape", "cameras.xml", "--mesh", "mesh.glb", "--environment", "env.exr"];
    let written = sandbox.run(&[&import[..], &["--images", "targets", "-o", "made.toml"]].concat()).done();
    assert_eq!(written.out, "wrote made.toml: 1 view\n");
    assert!(sandbox.text("made.toml").contains("target = \"targets/front.exr\""));
    sandbox.run(&["render", "made.toml", "--engine", "cpu", "--view", "front", "-o", "made.exr"]).done();
    sandbox.run(&["render", "scene.toml", "--engine", "cpu", "--view", "front", "-o", "own.exr"]).done();
    let [made, own] = ["made.exr", "own.exr"].map(|image| covered(&sandbox, image));
    // A pixel at the border may fall to either side.
    assert!(made.iter().zip(own).all(|(a, b)| (a - b).abs() < 1.5 / 32.0), "{made:?} {own:?}");
    sandbox.write("cameras.xml", file.replace("sensor_id=\"0\"", "sensor_id=\"1\"").as_bytes());
    sandbox
        .run(&[&import[..], &["-o", "other.toml"]].concat())
        .refused(&["cameras.xml: line 1, camera: refers to a sensor that is not there"]);
}

#[test]
fn a_calibration_becomes_a_view_that_frames_the_mesh() {
    let sandbox = Sandbox::new();
    let calibration = "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   \
                       cols: 3\n   dt: d\n   data: [ 120., 0., 31.5, 0., 118., 23.5, 0., 0., 1. ]\n\
                       distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   \
                       data: [ -0.1, 0.01, 0., 0. ]\n";
    sandbox.write("camera.yml", calibration.as_bytes());
    let import = ["import", "opencv", "camera.yml", "--mesh", "mesh.glb", "--environment", "env.exr"];
    let written = sandbox.run(&[&import[..], &["-o", "made.toml"]].concat()).done();
    assert_eq!(written.out, "wrote made.toml: 1 view\n");
    let scene = sandbox.text("made.toml");
    assert!(scene.contains("width = 64\nheight = 48\nlens = { cx = 32, cy = 24, fx = 1"), "{scene}");
    assert!(scene.contains("k1 = -0.1, k2 = 0.01"), "{scene}");
    assert!(scene.contains("# A calibration does not say where the camera stood"), "{scene}");
    sandbox.run(&["render", "made.toml", "--engine", "cpu", "--view", "front", "-o", "made.exr"]).done();
    let [left, right, top, bottom] = covered(&sandbox, "made.exr");
    // Nine tenths of the way to a border, but for what the lens draws in, and a pixel.
    let reach = [0.5 - left, right - 0.5, 0.5 - top, bottom - 0.5].into_iter().fold(0.0, f64::max);
    assert!((0.40..0.48).contains(&reach), "{left} {right} {top} {bottom}");
    sandbox
        .run(&[&import[..], &["--images", "targets", "-o", "other.toml"]].concat())
        .refused(&["camera.yml: a calibration names no pictures. Leave --images out."]);
}

#[test]
fn a_displaced_camera_is_told_before_the_fit() {
    let sandbox = Sandbox::new();
    sandbox.edit("1,0,0,0, 0,1,0,0, 0,0,1,-4", "1,0,0,0.3, 0,1,0,0, 0,0,1,-4");
    let fit = sandbox.fit("run", &[]);
    assert!(
        fit.err.contains("view \"front\": the silhouettes of its target and of the mesh overlap by"),
        "{}",
        fit.err
    );
    assert!(fit.err.contains("pixels left"), "{}", fit.err);
    let report = sandbox.text("run/report.html");
    assert!(report.contains("silhouettes of its target"), "the report does not say it");
}
