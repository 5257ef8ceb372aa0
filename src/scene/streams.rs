//! Numbers of a scene's vertices as attributes of its mesh file, where an engine finds them.

use std::path::Path;

use super::Scene;
use super::animation::mesh_file;
use super::error::SceneError;
use super::file::{SceneFile, Source};

/// How many numbers a vertex has of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamKind {
    /// One.
    Scalar,
    /// Two.
    Vec2,
    /// Three.
    Vec3,
    /// Four.
    Vec4,
}

impl StreamKind {
    /// What has as many numbers; glTF has nothing for 0 and for more than 4.
    #[must_use]
    pub const fn of(numbers: usize) -> Option<Self> {
        match numbers {
            1 => Some(Self::Scalar),
            2 => Some(Self::Vec2),
            3 => Some(Self::Vec3),
            4 => Some(Self::Vec4),
            _ => None,
        }
    }

    /// What glTF calls it (2.0, section 3.6.2.2).
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "SCALAR",
            Self::Vec2 => "VEC2",
            Self::Vec3 => "VEC3",
            Self::Vec4 => "VEC4",
        }
    }
}

/// Numbers of every vertex of a scene's mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexStream {
    /// Its name in capitals; the attribute has an underscore before it.
    pub name: String,
    /// How many numbers a vertex has.
    pub kind: StreamKind,
    /// Vertex after vertex.
    pub numbers: Vec<f32>,
    /// What each of the mesh's morph targets adds at weight 1; empty for one of which nothing is known.
    pub morphs: Vec<Vec<f32>>,
}

impl VertexStream {
    /// How many numbers a vertex has.
    #[must_use]
    pub const fn width(&self) -> usize {
        match self.kind {
            StreamKind::Scalar => 1,
            StreamKind::Vec2 => 2,
            StreamKind::Vec3 => 3,
            StreamKind::Vec4 => 4,
        }
    }
}

/// The mesh file of a scene with `streams` as attributes of its vertices, and of its morph targets, as a .glb: meshes,
/// nodes, materials, skins and animations are the file's own. Pictures that stood beside it are within.
///
/// # Errors
/// When the file has changed since the scene was read, or would be too large.
pub fn mesh_with_streams(scene: &Scene, streams: &[VertexStream]) -> Result<Vec<u8>, SceneError> {
    let source = Source::read(&scene.path)?;
    let file: SceneFile = source.parse()?;
    let folder = scene.path.parent().unwrap_or(Path::new(""));
    mesh_file(&source, &file, folder)?.with_streams(streams, scene.mesh.positions.len())
}
