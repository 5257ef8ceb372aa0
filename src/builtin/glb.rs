//! The mesh, its expressions, bones and nod as a binary glTF 2.0 file.

use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::atlas::Atlas;
use super::expressions::EXPRESSIONS;
use super::rig::{BONES, nod, weights};
use crate::scene::container;

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// Nodes: the mesh, then the bones.
const FIRST_BONE: usize = 1;

/// The buffer as it grows, with the views and accessors into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]], target: Option<u32>) -> usize {
        let view = self.view(&bytes(values), target);
        self.accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind,
            "min": extreme(values.iter().copied(), f32::min), "max": extreme(values.iter().copied(), f32::max),
        }))
    }

    /// Vectors that are zero but at `places`.
    fn sparse(&mut self, count: usize, places: usize, at: usize, values: &[[f32; 3]]) -> usize {
        let view = self.view(&bytes(values), None);
        let with_zero = || values.iter().copied().chain([[0.0; 3]]);
        self.accessor(json!({
            "componentType": FLOAT, "count": count, "type": "VEC3",
            "min": extreme(with_zero(), f32::min), "max": extreme(with_zero(), f32::max),
            "sparse": {
                "count": places,
                "indices": {"bufferView": at, "componentType": UNSIGNED_INT},
                "values": {"bufferView": view},
            },
        }))
    }
}

fn bytes<const N: usize>(values: &[[f32; N]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

fn extreme<const N: usize>(values: impl Iterator<Item = [f32; N]>, pick: fn(f32, f32) -> f32) -> Value {
    let found = values.reduce(|a, b| std::array::from_fn(|i| pick(a[i], b[i]))).unwrap_or([0.0; N]);
    json!(found.as_slice())
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

/// The file's bytes.
pub(super) fn encode(atlas: &Atlas) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let primitive = primitive(&mut buffer, atlas);
    let inverse_binds: Vec<[f32; 16]> = BONES
        .iter()
        .map(|bone| glam::Mat4::from_translation(-bone.pivot.as_vec3()).to_cols_array())
        .collect();
    let inverse_binds = buffer.floats("MAT4", &inverse_binds, None);
    let animation = animation(&mut buffer);
    let joints: Vec<usize> = (0..BONES.len()).map(|i| FIRST_BONE + i).collect();
    let names: Vec<&str> = EXPRESSIONS.iter().map(|e| e.name).collect();
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("skinfit ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0, FIRST_BONE]}],
        "nodes": nodes(),
        "meshes": [{
            "name": "head", "primitives": [primitive],
            "weights": vec![0.0; EXPRESSIONS.len()], "extras": {"targetNames": names},
        }],
        "skins": [{"joints": joints, "inverseBindMatrices": inverse_binds, "skeleton": FIRST_BONE}],
        "materials": [{
            "name": "skin",
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0}, "metallicFactor": 0.0, "roughnessFactor": 0.5,
            },
            "normalTexture": {"index": 1},
        }],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"uri": "color.png"}, {"uri": "normal.png"}],
        "animations": [animation],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.bytes.len()}],
    });
    container(document.to_string().into_bytes(), buffer.bytes)
}

fn primitive(buffer: &mut Buffer, atlas: &Atlas) -> Value {
    let vertices = |of: &[DVec3]| of.iter().map(|&v| single(v)).collect::<Vec<_>>();
    let uvs: Vec<[f32; 2]> = atlas.uvs.iter().map(|uv| uv.as_vec2().to_array()).collect();
    let weights: Vec<[f32; 4]> = atlas.positions.iter().map(|&p| weights(p)).collect();
    let joints: Vec<u8> =
        weights.iter().flat_map(|w| [0, 1, 2, 3].map(|j| if w[j as usize] > 0.0 { j } else { 0 })).collect();
    let indices: Vec<u8> = atlas.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let position = buffer.floats("VEC3", &vertices(&atlas.positions), Some(VERTICES));
    let normal = buffer.floats("VEC3", &vertices(&atlas.normals), Some(VERTICES));
    let tangent = buffer.floats("VEC4", &atlas.tangents, Some(VERTICES));
    let uv = buffer.floats("VEC2", &uvs, Some(VERTICES));
    let weights = buffer.floats("VEC4", &weights, Some(VERTICES));
    let view = buffer.view(&joints, Some(VERTICES));
    let joints = buffer.accessor(json!({
        "bufferView": view, "componentType": UNSIGNED_BYTE, "count": atlas.positions.len(), "type": "VEC4",
    }));
    let view = buffer.view(&indices, Some(INDICES));
    let indices = buffer.accessor(json!({
        "bufferView": view, "componentType": UNSIGNED_INT, "count": 3 * atlas.triangles.len(), "type": "SCALAR",
    }));
    json!({
        "attributes": {
            "POSITION": position, "NORMAL": normal, "TANGENT": tangent, "TEXCOORD_0": uv,
            "JOINTS_0": joints, "WEIGHTS_0": weights,
        },
        "indices": indices, "material": 0, "mode": 4, "targets": targets(buffer, atlas),
    })
}

/// The expressions, as sparse accessors: each moves but a part of the face.
fn targets(buffer: &mut Buffer, atlas: &Atlas) -> Vec<Value> {
    let count = atlas.positions.len();
    EXPRESSIONS
        .iter()
        .map(|expression| {
            let moved: Vec<(u32, [f32; 3], [f32; 3])> = (0..count)
                .into_par_iter()
                .filter_map(|i| {
                    let (position, normal) = expression.deltas(atlas.positions[i], atlas.normals[i])?;
                    Some((i as u32, single(position), single(normal)))
                })
                .collect();
            let at: Vec<u8> = moved.iter().flat_map(|m| m.0.to_le_bytes()).collect();
            let at = buffer.view(&at, None);
            let positions: Vec<[f32; 3]> = moved.iter().map(|m| m.1).collect();
            let normals: Vec<[f32; 3]> = moved.iter().map(|m| m.2).collect();
            let position = buffer.sparse(count, moved.len(), at, &positions);
            let normal = buffer.sparse(count, moved.len(), at, &normals);
            json!({"POSITION": position, "NORMAL": normal})
        })
        .collect()
}

fn nodes() -> Vec<Value> {
    let mut nodes = vec![json!({"name": "head", "mesh": 0, "skin": 0})];
    let mut parent = DVec3::ZERO;
    for (i, bone) in BONES.iter().enumerate() {
        let mut node = json!({"name": bone.name, "translation": single(bone.pivot - parent)});
        if i + 1 < BONES.len() {
            node["children"] = json!([FIRST_BONE + i + 1]);
        }
        parent = bone.pivot;
        nodes.push(node);
    }
    nodes
}

fn animation(buffer: &mut Buffer) -> Value {
    let keys = nod();
    let times: Vec<[f32; 1]> = keys.iter().map(|key| [key.time]).collect();
    let times = buffer.floats("SCALAR", &times, None);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut channel = |node: usize, path: &str, output: usize| {
        samplers.push(json!({"input": times, "output": output, "interpolation": "LINEAR"}));
        channels.push(json!({"sampler": samplers.len() - 1, "target": {"node": node, "path": path}}));
    };
    for turning in 0..2 {
        let turns: Vec<[f32; 4]> = keys.iter().map(|key| key.turns[turning].as_quat().to_array()).collect();
        // The root stays; neck and skull turn.
        channel(FIRST_BONE + 1 + turning, "rotation", buffer.floats("VEC4", &turns, None));
    }
    let weights: Vec<[f32; 1]> = keys.iter().flat_map(|key| key.expressions).map(|w| [w]).collect();
    channel(0, "weights", buffer.floats("SCALAR", &weights, None));
    json!({"name": "nod", "samplers": samplers, "channels": channels})
}
