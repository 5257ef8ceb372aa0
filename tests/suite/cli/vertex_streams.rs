//! What is baked of vertices, as attributes of the mesh's file that other engines take.

use std::f64::consts::PI;

use glam::Vec3;
use serde_json::Value;
use skinfit::prepare::{Baked, PrepareOptions};

use super::engines::word;
use super::sandbox::{Sandbox, mesh};
use crate::fixtures::read_exr;

/// The JSON of a .glb, and its binary chunk.
fn glb(bytes: &[u8]) -> (Value, &[u8]) {
    let json = word(bytes, 12);
    let after = 20 + json + 8;
    (serde_json::from_slice(&bytes[20..20 + json]).unwrap(), &bytes[after..])
}

/// The type of an accessor of floats, and its numbers.
fn stream<'a>(json: &'a Value, binary: &[u8], accessor: &Value) -> (&'a str, Vec<f32>) {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    assert_eq!(accessor["componentType"], 5126);
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [from, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
    let numbers = binary[from..from + length].chunks(4).map(|x| f32::from_le_bytes(x.try_into().unwrap()));
    (accessor["type"].as_str().unwrap(), numbers.collect())
}

#[test]
fn the_open_share_is_an_attribute_of_a_mesh_that_draws_the_same_picture() {
    let sandbox = Sandbox::with_shared_bakes();
    sandbox.run(&["demo", "head"]).done();
    sandbox.run(&["bake", "head/scene.toml", "-o", "baked", "--glb"]).done();
    let file = sandbox.read("baked/vertices.glb");
    let (json, binary) = glb(&file);
    let (kind, numbers) =
        stream(&json, binary, &json["meshes"][0]["primitives"][0]["attributes"]["_OCCLUSION"]);
    assert_eq!(kind, "SCALAR");
    let table = sandbox.text("baked/occlusion.csv");
    let rows: Vec<f32> =
        table.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().parse().unwrap()).collect();
    // The mesh has more where vertices were split for their tangents; the file's own come first.
    assert!(numbers.len() <= rows.len() && rows.iter().any(|open| *open < 0.9));
    // The table's numbers are printed so that they read back to the bit.
    assert_eq!(numbers, rows[..numbers.len()]);
    let draw = |scene: &str, to: &str| {
        let small = ["--view", "front", "--size", "64x64"];
        sandbox.run(&[&["render", scene, "--engine", "cpu", "-o", to][..], &small].concat()).done();
        read_exr(&sandbox.path(to)).rgb(["R", "G", "B"])
    };
    let scene = sandbox.text("head/scene.toml").replace("head.glb", "../baked/vertices.glb");
    assert!(scene.contains("../baked/vertices.glb"), "{scene}");
    sandbox.write("head/other.toml", scene.as_bytes());
    assert!(draw("head/scene.toml", "a.exr") == draw("head/other.toml", "b.exr"), "the pictures differ");
    // Of a scene that bakes nothing at vertices there is nothing to add.
    let ran = sandbox.run(&["bake", "scene.toml", "-o", "less", "--glb", "--effects", "diffuse"]);
    assert!(ran.code == Some(0) && ran.err.contains("nothing is baked of vertices"), "{ran:?}");
    assert!(!sandbox.path("less/vertices.glb").exists());
}

/// What streams of four functions, or of a colour each, hold of a vertex: function by function, `width` numbers each.
fn functions(json: &Value, binary: &[u8], attributes: &Value, name: &str, width: usize) -> Vec<Vec<f32>> {
    let mut of_vertex: Vec<Vec<f32>> = Vec::new();
    for k in 0.. {
        let accessor = &attributes[format!("_{name}_{k}")];
        if accessor.is_null() {
            break;
        }
        let (kind, numbers) = stream(json, binary, accessor);
        let components = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => panic!("{name}_{k} is a {other}"),
        };
        assert_eq!(components % width, 0, "{name}_{k}");
        of_vertex.resize(numbers.len() / components, Vec::new());
        of_vertex.iter_mut().zip(numbers.chunks(components)).for_each(|(all, some)| all.extend(some));
    }
    of_vertex
}

#[test]
fn transfer_vectors_of_a_ball_are_those_of_open_surfaces() {
    let sandbox = Sandbox::new();
    let round = |json: &mut Value, bytes: &mut Vec<u8>| {
        let count = json["accessors"][0]["count"].as_u64().unwrap() as usize;
        for bytes in bytes[..12 * count].chunks_exact_mut(12) {
            let position = Vec3::from_array(bytemuck::pod_read_unaligned(bytes)).normalize();
            bytes.copy_from_slice(bytemuck::bytes_of(&position.to_array()));
        }
    };
    sandbox.write("mesh.glb", &mesh(round));
    sandbox.edit("[model.params]", "visibility = \"sh3\"\n[model.params]");
    let effects = "diffuse,directional_occlusion";
    sandbox.run(&["bake", "scene.toml", "-o", "baked", "--glb", "--effects", effects]).done();
    let file = sandbox.read("baked/vertices.glb");
    let (json, binary) = glb(&file);
    let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
    let found = functions(&json, binary, attributes, "TRANSFER", 1);
    let options = PrepareOptions { cache: Some(sandbox.cache().to_owned()), ..PrepareOptions::default() };
    let baked = Baked::new(&sandbox.path("scene.toml"), &options).unwrap();
    let normals = baked.scene.mesh.pose().normals;
    assert!(!found.is_empty() && found.len() <= normals.len());
    for (found, n) in found.iter().zip(&normals) {
        let [x, y, z] = n.as_dvec3().to_array();
        // A_l / pi times the harmonics about +Y, azimuth from +Z towards +X, by index l^2 + l + m; A_0 = pi, A_1 = 2 pi / 3,
        // A_2 = pi / 4 (Ramamoorthi and Hanrahan 2001, equation 8).
        let [constant, linear] = [0.25, 0.75].map(|k: f64| (k / PI).sqrt());
        let [product, square] = [3.75, 0.3125].map(|k: f64| (k / PI).sqrt());
        let wanted = [
            constant,
            linear * x * 2.0 / 3.0,
            linear * y * 2.0 / 3.0,
            linear * z * 2.0 / 3.0,
            product * x * z / 4.0,
            product * x * y / 4.0,
            square * (3.0 * y * y - 1.0) / 4.0,
            product * y * z / 4.0,
            0.5 * product * (z * z - x * x) / 4.0,
        ];
        assert_eq!(found.len(), wanted.len());
        for (got, want) in found.iter().zip(wanted) {
            // Polynomials of normals in f32, of numbers up to 1.
            assert!((f64::from(*got) - want).abs() < 1e-6, "{n}: {found:?} {wanted:?}");
        }
    }
    // What is convex sees nothing of itself.
    let bounced = functions(&json, binary, attributes, "BOUNCED", 3);
    assert!(!bounced.is_empty() && bounced.iter().flatten().all(|&x| x == 0.0), "{bounced:?}");
}

#[test]
fn transfer_vectors_and_their_morphs_are_what_was_baked() {
    let sandbox = Sandbox::with_shared_bakes();
    sandbox.run(&["demo", "head"]).done();
    let scene = sandbox.text("head/scene.toml");
    let asked = scene.replace("\"occlusion\", \"rim\"", "\"occlusion\", \"directional_occlusion\", \"rim\"");
    assert_ne!(scene, asked);
    sandbox.write("head/scene.toml", asked.as_bytes());
    sandbox.run(&["bake", "head/scene.toml", "-o", "baked", "--glb"]).done();
    let file = sandbox.read("baked/vertices.glb");
    let (json, binary) = glb(&file);
    let primitive = &json["meshes"][0]["primitives"][0];
    let options = PrepareOptions { cache: Some(sandbox.cache().to_owned()), ..PrepareOptions::default() };
    let baked = Baked::new(&sandbox.path("head/scene.toml"), &options).unwrap();
    let transfer = &baked.surface_bakes().sky.unwrap().transfer;
    let width = transfer.order.functions();
    // Of five targets the scene gives two a weight.
    let targets = primitive["targets"].as_array().unwrap().iter();
    let targets: Vec<&Value> = targets.filter(|target| target.get("_TRANSFER_0").is_some()).collect();
    let morphs: Vec<_> = transfer.morphs.iter().filter(|set| !set.direct.is_empty()).collect();
    assert_eq!((targets.len(), morphs.len()), (2, 2));
    let sets = [&transfer.base].into_iter().chain(morphs);
    let places = [&primitive["attributes"]].into_iter().chain(targets);
    for (set, attributes) in sets.zip(places) {
        let direct = functions(&json, binary, attributes, "TRANSFER", 1).concat();
        assert!(!direct.is_empty() && direct[..] == set.direct[..direct.len()]);
        assert_eq!(direct.len() % width, 0);
        let bounced = functions(&json, binary, attributes, "BOUNCED", 3).concat();
        assert!(bounced[..] == set.bounced.as_flattened()[..bounced.len()]);
        assert_eq!(bounced.is_empty(), set.bounced.is_empty());
    }
    assert!(transfer.base.bounced.iter().flatten().any(|&x| x > 0.0));
}
