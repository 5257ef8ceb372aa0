//! glTF 2.0 files (.glb and .gltf) as one mesh.
//!
//! - [`container`]: the binary container; [`parse`]: the JSON; [`extensions`]: which are read
//! - [`document`]: these, its buffers, and checked lookups of everything by index
//! - [`accessor`]: typed arrays out of the buffers
//! - [`nodes`]: the node tree, posed by an [`animation`] at a time
//! - [`cameras`]: the cameras of its nodes
//! - [`contents`]: what the file holds, for people
//! - [`lights`]: the lights of its nodes (KHR_lights_punctual)
//! - [`primitive`]: one primitive's attributes and triangles
//! - [`plain`]: which triangles are skin, and the materials of the others
//! - [`skins`]: bones and their influences
//! - [`skin_maps`]: the maps of the skin's own material; [`skin_unread`]: what else would show of it
//! - [`places`]: which of the mesh's vertices a primitive's are; [`streams`]: the file with numbers of these added
//! - [`textures`]: what a material says of a texture
//! - [`assemble`]: every primitive of the scene in one [`Mesh`](super::mesh::Mesh)
//!
//! Only the JSON types of the `gltf` crate are used: its wrappers trust indices that files of the
//! wild get wrong.

mod accessor;
mod animation;
mod assemble;
mod cameras;
mod container;
mod contents;
mod document;
mod extensions;
mod lights;
mod nodes;
mod parse;
mod places;
mod plain;
mod primitive;
mod skin_maps;
mod skin_unread;
mod skins;
mod streams;
mod textures;

pub(super) use cameras::FileCamera;
pub use container::container;
pub(super) use document::Document;
pub(super) use skin_maps::SkinMaps;
pub(super) use textures::TextureUv;

use crate::model::fields::Fields;

/// What is to be read of a mesh file; the rest is left alone.
#[derive(Clone, Debug)]
pub(super) struct Ask {
    /// Texture coordinates: a map will be looked up.
    pub uvs: Uvs,
    /// Which ones of the skin.
    pub uv: TextureUv,
    /// By which it lies in the UV atlas, where these are others.
    pub atlas_uv: Option<TextureUv>,
    /// Colours of vertices.
    pub colors: bool,
    /// Tangents, and how good they must be.
    pub tangents: Tangents,
    /// Morph targets.
    pub morphs: bool,
    /// Their weights, in order; without: the file's own.
    pub morph_weights: Option<Vec<f32>>,
    /// Bones.
    pub bones: bool,
    /// Numbers of vertices, of the attributes `_NAME`.
    pub fields: Fields,
    /// Seconds into the animation; without: the nodes as they stand.
    pub time: Option<f64>,
    /// The names of materials and meshes that are skin; without: all of it is.
    pub skin: Option<Vec<String>>,
    /// Whether morph targets are to be marked that the animation moves.
    pub clip: bool,
}

/// How much texture coordinates matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Uvs {
    /// Nothing looks at them.
    None,
    /// Every map has its neutral value: where they are missing, anything will do.
    Optional,
    /// A map is looked up: a mesh without them is refused.
    Required,
}

/// How much tangents matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tangents {
    /// Nothing looks at them.
    None,
    /// The normal map is flat: any unit frame will do.
    AnyFrame,
    /// From the file, or MikkTSpace.
    Exact,
}
