//! The scene as an ordinary folder: its mesh as a binary glTF 2.0 file, a scene file, and what that names.

use std::borrow::Cow;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use gltf::binary::{Glb, Header};
use serde_json::{Value, json};
use skinfit::scene::mesh::{Mesh, Morph};
use toml_edit::{DocumentMut, Item, value};

use crate::rig::{BONES, Rig, influences};

const MESH: &str = "dense.glb";
const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// Nodes: the mesh, then the bones.
const FIRST_BONE: usize = 1;

/// Write the mesh with its bones and clip, and the scene file of `scene` changed to it. Returns the new scene file.
pub(crate) fn write(
    folder: &Path,
    scene: &Path,
    mesh: &Mesh,
    along: &[f32],
    rig: &Rig,
) -> Result<PathBuf, Box<dyn Error>> {
    let file = folder.join("scene.toml");
    if let (Ok(own), Ok(other)) = (fs::canonicalize(&file), fs::canonicalize(scene))
        && own == other
    {
        return Err(
            format!("{}: the scene would be written over: name another folder", scene.display()).into()
        );
    }
    let text = scene_text(folder, scene)?;
    skinfit::output::write(&folder.join(MESH), &encoded(mesh, along, rig)?)?;
    skinfit::output::write(&file, text.as_bytes())?;
    Ok(file)
}

/// The scene file's text; its pictures are copied into the folder.
fn scene_text(folder: &Path, scene: &Path) -> Result<String, Box<dyn Error>> {
    let place = |e: &dyn std::fmt::Display| format!("{}: {e}", scene.display());
    let text = fs::read_to_string(scene).map_err(|e| place(&e))?;
    let mut document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| place(&e))?;
    let pictures = [
        ("maps", "color"),
        ("maps", "normal"),
        ("maps", "specular"),
        ("maps", "attenuator"),
        ("environment", "file"),
    ];
    for (table, key) in pictures {
        let item = document.get_mut(table).and_then(|table| table.get_mut(key));
        let Some((item, source)) =
            item.and_then(|item| item.as_str().map(PathBuf::from).map(|path| (item, path)))
        else {
            continue;
        };
        let name =
            source.file_name().ok_or_else(|| place(&format!("{table}.{key} names no file")))?.to_owned();
        let bytes =
            fs::read(scene.with_file_name(&source)).map_err(|e| place(&format!("{table}.{key}: {e}")))?;
        skinfit::output::write(&folder.join(&name), &bytes)?;
        *item = value(name.to_string_lossy().into_owned());
    }
    let table =
        document.get_mut("mesh").and_then(Item::as_table_mut).ok_or_else(|| place(&"it has no [mesh]"))?;
    table
        .decor_mut()
        .set_prefix("# A mesh as dense as Dawn's, with as many bones: written by experiments/animated.\n");
    table.remove("morph_weights");
    table.insert("file", value(MESH));
    table.insert("time", value(1.0));
    let params = document.get_mut("model").and_then(|model| model.get_mut("params"));
    if let Some(params) = params.and_then(Item::as_table_mut) {
        params.decor_mut().set_prefix("\n");
    }
    // Targets are pictures of another pose, and there is nothing to fit without them.
    if let Some(views) = document.get_mut("view").and_then(Item::as_array_of_tables_mut) {
        for view in views.iter_mut() {
            view.remove("target");
        }
    }
    document.remove("fit");
    Ok(document.to_string())
}

/// The buffer as it grows, with the views and accessors into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn add(&mut self, bytes: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(
        &mut self,
        kind: &str,
        values: impl IntoIterator<Item = [f32; N]>,
        target: Option<u32>,
    ) -> usize {
        let values: Vec<[f32; N]> = values.into_iter().collect();
        let extreme = |pick: fn(f32, f32) -> f32| {
            let found = values.iter().copied().reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i])));
            json!(found.unwrap_or([0.0; N]).as_slice())
        };
        let accessor = json!({
            "componentType": FLOAT, "count": values.len(), "type": kind,
            "min": extreme(f32::min), "max": extreme(f32::max),
        });
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        self.add(&bytes, target, accessor)
    }
}

/// The mesh file's bytes.
fn encoded(mesh: &Mesh, along: &[f32], rig: &Rig) -> Result<Vec<u8>, gltf::Error> {
    let mut buffer = Buffer::default();
    let primitive = primitive(&mut buffer, mesh, along);
    let inverse_binds = rig.pivots.iter().map(|&pivot| glam::Mat4::from_translation(-pivot).to_cols_array());
    let inverse_binds = buffer.floats("MAT4", inverse_binds, None);
    let animation = animation(&mut buffer, rig);
    let names: Vec<&str> = mesh.morphs.iter().map(|morph| morph.name.as_str()).collect();
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("skinfit ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0, FIRST_BONE]}],
        "nodes": nodes(rig),
        "meshes": [{
            "name": "head", "primitives": [primitive],
            "weights": vec![0.0; names.len()], "extras": {"targetNames": names},
        }],
        "skins": [{
            "joints": (FIRST_BONE..FIRST_BONE + BONES).collect::<Vec<_>>(),
            "inverseBindMatrices": inverse_binds, "skeleton": FIRST_BONE,
        }],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5}}],
        "animations": [animation],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.bytes.len()}],
    });
    let header = Header { magic: *b"glTF", version: 2, length: 0 };
    let json = Cow::Owned(document.to_string().into_bytes());
    Glb { header, json, bin: Some(Cow::Owned(buffer.bytes)) }.to_vec()
}

fn primitive(buffer: &mut Buffer, mesh: &Mesh, along: &[f32]) -> Value {
    let (joints, weights): (Vec<[u8; 4]>, Vec<[f32; 4]>) =
        along.iter().map(|&along| influences(along)).unzip();
    let indices: Vec<u8> = mesh.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
    let vectors = |of: &[glam::Vec3]| of.iter().map(glam::Vec3::to_array).collect::<Vec<_>>();
    let position = buffer.floats("VEC3", vectors(&mesh.positions), Some(VERTICES));
    let normal = buffer.floats("VEC3", vectors(&mesh.normals), Some(VERTICES));
    let tangent = buffer.floats("VEC4", mesh.tangents.iter().map(glam::Vec4::to_array), Some(VERTICES));
    let uv = buffer.floats("VEC2", mesh.uvs.iter().map(glam::Vec2::to_array), Some(VERTICES));
    let weights = buffer.floats("VEC4", weights, Some(VERTICES));
    let accessor = json!({"componentType": UNSIGNED_BYTE, "count": joints.len(), "type": "VEC4"});
    let joints = buffer.add(joints.as_flattened(), Some(VERTICES), accessor);
    let accessor =
        json!({"componentType": UNSIGNED_INT, "count": 3 * mesh.triangles.len(), "type": "SCALAR"});
    let indices = buffer.add(&indices, Some(INDICES), accessor);
    let mut target = |morph: &Morph| {
        let position = buffer.floats("VEC3", vectors(&morph.positions), None);
        let normal = buffer.floats("VEC3", vectors(&morph.normals), None);
        json!({"POSITION": position, "NORMAL": normal})
    };
    let targets: Vec<Value> = mesh.morphs.iter().map(&mut target).collect();
    json!({
        "attributes": {
            "POSITION": position, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": uv,
            "JOINTS_0": joints, "WEIGHTS_0": weights,
        },
        "indices": indices, "material": 0, "mode": 4, "targets": targets,
    })
}

fn nodes(rig: &Rig) -> Vec<Value> {
    let bone = |i: usize| {
        let mut node = json!({"name": format!("bone {i}"), "translation": rig.step(i).to_array()});
        if i + 1 < BONES {
            node["children"] = json!([FIRST_BONE + i + 1]);
        }
        node
    };
    std::iter::once(json!({"name": "head", "mesh": 0, "skin": 0})).chain((0..BONES).map(bone)).collect()
}

fn animation(buffer: &mut Buffer, rig: &Rig) -> Value {
    let times = buffer.floats("SCALAR", rig.keys.iter().map(|key| [key.time]), None);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut channel = |node: usize, path: &str, output: usize| {
        samplers.push(json!({"input": times, "output": output, "interpolation": "LINEAR"}));
        channels.push(json!({"sampler": samplers.len() - 1, "target": {"node": node, "path": path}}));
    };
    for bone in 0..BONES {
        let turns = rig.keys.iter().map(|key| key.turns[bone].to_array());
        channel(FIRST_BONE + bone, "rotation", buffer.floats("VEC4", turns, None));
    }
    let weights = rig.keys.iter().flat_map(|key| key.weights).map(|weight| [weight]);
    channel(0, "weights", buffer.floats("SCALAR", weights, None));
    json!({"name": "clip", "samplers": samplers, "channels": channels})
}
