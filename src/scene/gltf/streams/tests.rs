//! Streams that are added to a file come back out of it, and nothing else of it changes.

use std::path::Path;

use glam::vec3;

use super::super::{Ask, Tangents, TextureUv, Uvs};
use super::*;
use crate::mesh::Mesh;
use crate::model::fields::{Field, FieldInfo, Fields, Found};
use crate::streams::StreamKind;

/// A picture's first bytes: nobody looks further.
const PICTURE: &[u8] = b"\x89PNG\r\n\x1A\n";

/// A triangle with a morph target, a line beside it, shown by two nodes; buffer and picture stand beside the file.
fn scattered(folder: &Path) -> Value {
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let moved = [[0.0_f32, 0.0, 0.5]; 3];
    let bytes: Vec<u8> =
        [corners, moved].as_flattened().iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(folder.join("corners.bin"), &bytes[..36]).unwrap();
    std::fs::write(folder.join("moved.bin"), &bytes[36..]).unwrap();
    std::fs::write(folder.join("skin 1.png"), PICTURE).unwrap();
    let view = |buffer: usize| json!({"buffer": buffer, "byteLength": 36});
    let accessor =
        |view: usize| json!({"bufferView": view, "componentType": FLOAT, "count": 3, "type": "VEC3"});
    let triangle = json!({"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}], "material": 0});
    json!({
        "asset": {"version": "2.0", "generator": "a test"},
        "extensionsUsed": ["EXT_own"],
        "extensions": {"EXT_own": {"kept": [1.5, "two"]}},
        "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "left"}, {"mesh": 0, "translation": [2.0, 0.0, 0.0]}],
        "meshes": [{
            "primitives": [{"attributes": {"POSITION": 0}, "mode": 1}, triangle],
            "extras": {"targetNames": ["puff"]},
        }],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "skin%201.png"}],
        "buffers": [{"uri": "corners.bin", "byteLength": 36}, {"uri": "moved.bin", "byteLength": 36}],
        "bufferViews": [view(0), view(1)], "accessors": [accessor(0), accessor(1)],
    })
}

/// A stream that counts on from `first`, and what the one morph target adds.
fn stream(name: &str, kind: StreamKind, first: f32, added: Option<f32>) -> VertexStream {
    let stream = VertexStream { name: name.to_owned(), kind, numbers: Vec::new(), morphs: Vec::new() };
    // Three vertices of each node.
    let counted = |first: f32| (0..6 * stream.width()).map(|i| first + i as f32).collect::<Vec<f32>>();
    VertexStream { numbers: counted(first), morphs: vec![added.map(counted).unwrap_or_default()], ..stream }
}

fn ask(fields: Fields) -> Ask {
    Ask {
        uvs: Uvs::None,
        uv: TextureUv::default(),
        atlas_uv: None,
        colors: false,
        tangents: Tangents::None,
        morphs: true,
        morph_weights: None,
        bones: false,
        fields,
        time: None,
        skin: None,
        clip: false,
    }
}

fn read(path: &Path, fields: Fields) -> Mesh {
    Document::open(path).unwrap().mesh(&ask(fields), &mut Vec::new()).unwrap()
}

/// The file with two streams as a .glb beside it, and its JSON.
fn added(folder: &Path) -> (std::path::PathBuf, Value) {
    let [from, to] = ["head.gltf", "head.glb"].map(|name| folder.join(name));
    std::fs::write(&from, scattered(folder).to_string()).unwrap();
    let streams = [
        stream("STREAM_OPEN", StreamKind::Scalar, 10.0, Some(100.0)),
        stream("STREAM_BENT", StreamKind::Vec3, 20.0, None),
    ];
    let bytes = Document::open(&from).unwrap().with_streams(&streams, 6).unwrap();
    std::fs::write(&to, &bytes).unwrap();
    let glb = gltf::Glb::from_slice(&bytes).unwrap();
    (to, serde_json::from_slice(&glb.json).unwrap())
}

#[test]
fn streams_are_read_as_fields_and_the_mesh_is_as_it_was() {
    let row = |name, numbers| FieldInfo {
        name,
        attribute: name,
        of: Found::Vertices,
        numbers,
        neutral: -1.0,
        meaning: "a test's own",
    };
    let [open, bent] =
        [("stream_open", 1), ("stream_bent", 3)].map(|(name, n)| Field::register(row(name, n)).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = added(folder.path());
    let before = read(&folder.path().join("head.gltf"), Fields::NONE);
    // What stood beside it is within.
    for name in ["corners.bin", "moved.bin", "skin 1.png", "head.gltf"] {
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
    let after = read(&path, Fields::of([open, bent]));
    assert_eq!(after.positions[3], vec3(2.0, 0.0, 0.0));
    let numbers = |field: Field| after.fields.iter().find(|of| of.field == field).unwrap().numbers.clone();
    assert_eq!(numbers(open), (10..16).map(|x| x as f32).collect::<Vec<_>>());
    assert_eq!(numbers(bent), (20..38).map(|x| x as f32).collect::<Vec<_>>());
    assert_eq!(Mesh { fields: Vec::new(), ..after }, before);
}

#[test]
fn what_a_target_adds_is_an_attribute_of_the_target() {
    let folder = tempfile::tempdir().unwrap();
    let (path, json) = added(folder.path());
    let document = Document::open(&path).unwrap();
    let meshes = [0, 1].map(|node| json["nodes"][node]["mesh"].as_u64().unwrap() as usize);
    assert_ne!(meshes[0], meshes[1], "two nodes share a mesh, whose vertices see one thing");
    for (node, mesh) in meshes.into_iter().enumerate() {
        let [line, triangle] = [0, 1].map(|i| json["meshes"][mesh]["primitives"][i].clone());
        assert_eq!(line["attributes"].as_object().unwrap().len(), 1, "a line is not in the mesh: {line}");
        let target = &triangle["targets"][0];
        let index = target["_STREAM_OPEN"].as_u64().unwrap() as u32;
        let first = 100.0 + 3.0 * node as f32;
        assert_eq!(
            document.scalars(gltf::json::Index::new(index)).unwrap(),
            [first, first + 1.0, first + 2.0]
        );
        // Nothing is known of what it does to the other.
        assert!(target.get("_STREAM_BENT").is_none() && target["POSITION"] == json!(1), "{target}");
        let accessor = &json["accessors"][triangle["attributes"]["_STREAM_BENT"].as_u64().unwrap() as usize];
        assert_eq!((&accessor["type"], &accessor["componentType"]), (&json!("VEC3"), &json!(FLOAT)));
    }
}

#[test]
fn pictures_and_what_nobody_here_reads_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (path, json) = added(folder.path());
    let before = scattered(folder.path());
    for kept in ["asset", "scenes", "materials", "textures", "extensions", "extensionsUsed"] {
        assert_eq!(json[kept], before[kept], "{kept}");
    }
    let image = &json["images"][0];
    assert_eq!((image.get("uri"), &image["mimeType"]), (None, &json!("image/png")));
    let view = image["bufferView"].as_u64().unwrap() as u32;
    assert_eq!(Document::open(&path).unwrap().view(gltf::json::Index::new(view)).unwrap(), PICTURE);
}

#[test]
fn what_packs_the_vertices_once_more_goes() {
    let mut edit = Edit {
        root: json!({
            "extensionsUsed": ["EXT_meshopt_compression"],
            "bufferViews": [{"buffer": 0, "byteLength": 4, "extensions": {"EXT_meshopt_compression": {"buffer": 1}}}],
            "meshes": [{"primitives": [{"attributes": {}, "extensions": {
                "KHR_draco_mesh_compression": {"bufferView": 0}, "EXT_own": {},
            }}]}],
        }),
        binary: Vec::new(),
    };
    edit.unpack();
    let wanted = json!({
        "bufferViews": [{"buffer": 0, "byteLength": 4}],
        "meshes": [{"primitives": [{"attributes": {}, "extensions": {"EXT_own": {}}}]}],
    });
    assert_eq!(edit.root, wanted);
}

#[test]
fn a_file_that_is_not_the_scenes_is_refused_and_damage_does_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.gltf");
    let refused = |json: &Value, vertices: usize| {
        std::fs::write(&path, json.to_string()).unwrap();
        let streams = [stream("STREAM_OPEN", StreamKind::Scalar, 0.0, None)];
        Document::open(&path)
            .and_then(|document| document.with_streams(&streams, vertices))
            .unwrap_err()
            .to_string()
    };
    let good = scattered(folder.path());
    assert!(refused(&good, 5).contains("head.gltf: is not what the scene was read from"));
    // Lists pass for objects where the file is read.
    let mut lists = good.clone();
    lists["bufferViews"][0] = json!([0, 36, 0, null, null, null, null, null]);
    let said = refused(&lists, 6);
    assert!(said.contains("head.gltf"), "{said}");
}
