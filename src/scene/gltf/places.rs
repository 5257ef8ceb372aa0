//! Where each primitive's vertices and morph targets stand in the mesh that is made of a file.

use gltf::json;
use json::mesh::{Mode, Semantic};
use json::validation::Checked;

use super::document::Document;
use crate::error::SceneError;

/// A primitive of a node, and what of the mesh is its.
pub(super) struct Place {
    pub node: usize,
    /// Among its mesh's.
    pub primitive: usize,
    /// Its first vertex; the others follow in the file's order.
    pub first: usize,
    pub count: usize,
    /// Of each of its morph targets, which of the mesh's it is.
    pub targets: Vec<usize>,
}

impl Document {
    /// Every primitive in the order in which the mesh has them. Vertices that were split for their tangents stand behind
    /// all of these, so that a file's own vertices keep their numbers.
    pub(super) fn places(&self) -> Result<Vec<Place>, SceneError> {
        let (mut places, mut known, mut first) = (Vec::new(), Vec::new(), 0);
        for node in self.nodes(None)?.in_scene {
            let Some(index) = self.root.nodes[node].mesh else { continue };
            let mesh = self.get(&self.root.meshes, index, "mesh")?;
            let targets = slots(mesh, &mut known);
            for (i, primitive) in
                mesh.primitives.iter().enumerate().filter(|(_, primitive)| is_drawn(primitive))
            {
                let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
                let count = match positions {
                    Some(&index) => self.get(&self.root.accessors, index, "accessor")?.count.0 as usize,
                    None => 0,
                };
                let own = primitive.targets.as_ref().map_or(0, Vec::len);
                let targets = targets[..own].to_vec();
                places.push(Place { node, primitive: i, first, count, targets });
                first += count;
            }
        }
        Ok(places)
    }
}

/// Whether it is of triangles: points and lines are left out of the mesh.
pub(super) fn is_drawn(primitive: &json::mesh::Primitive) -> bool {
    matches!(primitive.mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan))
}

/// The morph slots of a mesh's targets, `known` being the names of those that there are. Targets of one name share a slot (a
/// face, its lashes and its teeth smile together); a new one is added, by its number where it has no name.
pub(super) fn slots(mesh: &json::Mesh, known: &mut Vec<String>) -> Vec<usize> {
    #[derive(serde::Deserialize)]
    struct Extras {
        #[serde(rename = "targetNames", default)]
        names: Vec<String>,
    }
    let extras = mesh.extras.as_ref().and_then(|raw| serde_json::from_str::<Extras>(raw.get()).ok());
    let names = extras.map(|extras| extras.names).unwrap_or_default();
    let count = mesh.primitives.iter().filter_map(|p| p.targets.as_ref()).map(Vec::len).max().unwrap_or(0);
    let slot = |target: usize| {
        let name = names.get(target).filter(|name| !name.is_empty());
        let shared = name.and_then(|name| known.iter().position(|other| other == name));
        shared.unwrap_or_else(|| {
            known.push(name.cloned().unwrap_or_else(|| known.len().to_string()));
            known.len() - 1
        })
    };
    (0..count).map(slot).collect()
}
