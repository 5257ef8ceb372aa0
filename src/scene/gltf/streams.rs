//! A mesh file with numbers of its vertices added, as attributes of their own (glTF 2.0, section 3.7.2.1: names that begin
//! with an underscore are an application's). All else stays as it is (nodes, materials, skins, animations), but for whole
//! numbers that were written as floats.
//!
//! The file is written as one .glb: buffers and pictures that stood beside it go into its binary chunk.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::container::{container, contents};
use super::document::{Document, MOST_BYTES};
use super::parse;
use super::places::Place;
use crate::error::{SceneError, guarded, read_bytes};
use crate::streams::VertexStream;

const FLOAT: u32 = 5126;
const VERTICES: u32 = 34962;
/// What packs an attribute or a view once more. A reader that unpacks it would see the vertices in another order, and the
/// bytes that it points to move; what is read here stands beside it anyway.
const PACKED: [&str; 2] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];

impl Document {
    /// The file's bytes with the streams added, whose numbers are those of `vertices` vertices of the mesh.
    pub(crate) fn with_streams(
        &self,
        streams: &[VertexStream],
        vertices: usize,
    ) -> Result<Vec<u8>, SceneError> {
        let changed =
            || self.error("is not what the scene was read from", "Leave it alone until the command is done");
        let places = self.places()?;
        if places.last().is_some_and(|last| last.first + last.count > vertices) {
            return Err(changed());
        }
        let mut edit = Edit { root: self.raw()?, binary: Vec::new() };
        // JSON that is a list where an object is meant passes for one when it is read.
        guarded(&self.path, || {
            edit.gather(self);
            edit.unpack();
            edit.embed_pictures(self);
            edit.part_instances(&places);
            for place in &places {
                edit.add(place, streams).ok_or_else(changed)?;
            }
            edit.finish().ok_or_else(|| {
                let what = "would be beyond the 4 GiB of a .glb with all of its pictures";
                self.error(what, "Make these smaller")
            })
        })
    }

    /// The file's JSON, whatever else than what is read here it may hold.
    fn raw(&self) -> Result<Value, SceneError> {
        let bytes = read_bytes(&self.path, MOST_BYTES)?;
        let damaged =
            |reason: String| self.error(format!("cannot be read: {reason}"), "Export it anew as .glb");
        let (text, _) = contents(&bytes).map_err(damaged)?;
        parse::value(text).map_err(|e| damaged(e.to_string()))
    }
}

/// A file as it is edited: what is not where it has to be is left alone, as it was read and checked before.
struct Edit {
    root: Value,
    binary: Vec<u8>,
}

/// The list of that name.
fn list<'a>(root: &'a mut Value, name: &str) -> &'a mut Vec<Value> {
    if !root[name].is_array() {
        root[name] = json!([]);
    }
    match &mut root[name] {
        Value::Array(list) => list,
        _ => unreachable!("it was made one"),
    }
}

impl Edit {
    /// All buffers one after the other in the binary chunk.
    fn gather(&mut self, document: &Document) {
        let mut starts = Vec::new();
        for (bytes, buffer) in document.buffers.iter().zip(&document.root.buffers) {
            starts.push(self.place(&bytes[..buffer.byte_length.0 as usize]));
        }
        for view in list(&mut self.root, "bufferViews") {
            let buffer = view["buffer"].as_u64().unwrap_or(0) as usize;
            let within = view["byteOffset"].as_u64().unwrap_or(0) as usize;
            view["buffer"] = json!(0);
            view["byteOffset"] = json!(within + starts.get(buffer).copied().unwrap_or(0));
        }
    }

    /// Bytes at the binary chunk's end, where numbers of four bytes may begin.
    fn place(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let start = self.binary.len();
        self.binary.extend(bytes);
        start
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let start = self.place(bytes);
        let mut view = json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        let views = list(&mut self.root, "bufferViews");
        views.push(view);
        views.len() - 1
    }

    /// Without what is packed once more.
    fn unpack(&mut self) {
        let unpacked = |of: &mut Value| {
            if let Some(extensions) = of.get_mut("extensions").and_then(Value::as_object_mut) {
                PACKED.iter().for_each(|name| drop_key(extensions, name));
                if extensions.is_empty()
                    && let Some(of) = of.as_object_mut()
                {
                    drop_key(of, "extensions");
                }
            }
        };
        list(&mut self.root, "bufferViews").iter_mut().for_each(unpacked);
        for mesh in list(&mut self.root, "meshes") {
            list(mesh, "primitives").iter_mut().for_each(unpacked);
        }
        if let Some(used) = self.root.get_mut("extensionsUsed").and_then(Value::as_array_mut) {
            used.retain(|name| !PACKED.iter().any(|packed| name == packed));
        }
        self.drop_if_empty("extensionsUsed");
    }

    /// Pictures beside the file into it; one that is not there or of another kind stays a name.
    fn embed_pictures(&mut self, document: &Document) {
        for i in 0..list(&mut self.root, "images").len() {
            let Some(uri) = self.root["images"][i]["uri"].as_str().map(str::to_owned) else { continue };
            let bytes = match uri.starts_with("data:") {
                true => continue,
                false => document.resolve(&uri, &format!("image {i}")),
            };
            let Some((bytes, kind)) =
                bytes.ok().and_then(|bytes| kind_of_picture(&bytes).map(|kind| (bytes, kind)))
            else {
                continue;
            };
            let view = self.view(&bytes, None);
            let image = &mut self.root["images"][i];
            image["bufferView"] = json!(view);
            image["mimeType"] = json!(kind);
            if let Some(image) = image.as_object_mut() {
                drop_key(image, "uri");
            }
        }
        self.drop_if_empty("images");
    }

    /// Nodes that show one mesh get one each: what their vertices see differs.
    fn part_instances(&mut self, places: &[Place]) {
        let mut owners: BTreeMap<usize, usize> = BTreeMap::new();
        for place in places {
            let Some(mesh) = self.root["nodes"][place.node]["mesh"].as_u64().map(|mesh| mesh as usize) else {
                continue;
            };
            if *owners.entry(mesh).or_insert(place.node) != place.node {
                let copy = self.root["meshes"][mesh].clone();
                let meshes = list(&mut self.root, "meshes");
                meshes.push(copy);
                let own = meshes.len() - 1;
                owners.insert(own, place.node);
                self.root["nodes"][place.node]["mesh"] = json!(own);
            }
        }
    }

    /// The streams of a primitive's vertices; none where it is not where the mesh has it.
    fn add(&mut self, place: &Place, streams: &[VertexStream]) -> Option<()> {
        let mesh = self.root["nodes"].get(place.node)?["mesh"].as_u64()? as usize;
        self.root["meshes"].get(mesh)?["primitives"].get(place.primitive)?;
        for stream in streams {
            let attribute = format!("_{}", stream.name);
            let own = self.accessor(place, stream, &stream.numbers)?;
            let at = |root: &mut Value, index: usize, target: Option<usize>| {
                let primitive = &mut root["meshes"][mesh]["primitives"][place.primitive];
                match target {
                    None => primitive["attributes"][&attribute] = json!(index),
                    Some(target) => primitive["targets"][target][&attribute] = json!(index),
                }
            };
            at(&mut self.root, own, None);
            // Of an earlier bake.
            let targets = self.root["meshes"][mesh]["primitives"][place.primitive]["targets"].as_array_mut();
            targets.into_iter().flatten().filter_map(Value::as_object_mut).for_each(|target| {
                target.remove(&attribute);
            });
            for (target, &slot) in place.targets.iter().enumerate() {
                // What is not baked of a target, it does not move.
                if let Some(added) = stream.morphs.get(slot).filter(|added| !added.is_empty()) {
                    let added = self.accessor(place, stream, added)?;
                    at(&mut self.root, added, Some(target));
                }
            }
        }
        Some(())
    }

    /// A stream's numbers of a primitive's vertices.
    fn accessor(&mut self, place: &Place, stream: &VertexStream, numbers: &[f32]) -> Option<usize> {
        let width = stream.width();
        let own = numbers.get(width * place.first..width * (place.first + place.count))?;
        let bytes: Vec<u8> = own.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(VERTICES));
        let kind = stream.kind.name();
        let accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": place.count, "type": kind});
        let accessors = list(&mut self.root, "accessors");
        accessors.push(accessor);
        Some(accessors.len() - 1)
    }

    /// A list of the file may not be empty.
    fn drop_if_empty(&mut self, name: &str) {
        if self.root[name].as_array().is_none_or(Vec::is_empty)
            && let Some(root) = self.root.as_object_mut()
        {
            drop_key(root, name);
        }
    }

    /// The file's bytes; none beyond what a .glb may have.
    fn finish(mut self) -> Option<Vec<u8>> {
        self.root["buffers"] = json!([{"byteLength": self.binary.len()}]);
        let text = self.root.to_string().into_bytes();
        // Headers and padding take less than 64 bytes.
        u32::try_from(text.len() + self.binary.len() + 64).ok()?;
        Some(container(text, self.binary))
    }
}

fn drop_key(of: &mut Map<String, Value>, key: &str) {
    of.remove(key);
}

/// What a picture's first bytes say that it is.
fn kind_of_picture(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        [0xFF, 0xD8, 0xFF, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', ..] => Some("image/ktx2"),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
