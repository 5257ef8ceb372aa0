//! What a mesh file holds, before there is a scene of it.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::{SceneError, Warning, Warnings};
use super::gltf::{Ask, Document, Tangents, TextureUv, Uvs};
use crate::model::fields::Fields;

/// What a glTF file holds, by its own names. Lengths and places are in the file's unit, in the world.
#[derive(Clone, Debug, serde::Serialize)]
pub struct MeshContents {
    /// The file.
    pub file: PathBuf,
    /// The program that wrote it, where it says.
    pub generator: Option<String>,
    /// The smallest and largest coordinates as it stands: morph targets at the file's weights, bones at rest.
    pub bounds: [[f64; 3]; 2],
    /// Its primitives, in the order of the scene's nodes.
    pub parts: Vec<MeshPart>,
    /// Its materials.
    pub materials: Vec<Material>,
    /// Its morph targets, in the order of `[mesh] morph_weights`.
    pub morph_targets: Vec<String>,
    /// How many bones.
    pub bones: usize,
    /// Its animations.
    pub animations: Vec<Animation>,
    /// Its perspective cameras.
    pub cameras: Vec<CameraOfFile>,
    /// Its lights, as parameters name them.
    pub lights: Vec<String>,
    /// The extensions that it uses and that are not read.
    pub unread_extensions: Vec<UnreadExtension>,
    /// Where its vertices stand.
    #[serde(skip)]
    pub positions: Vec<DVec3>,
}

/// A primitive: triangles of one material.
#[derive(Clone, Debug, serde::Serialize)]
pub struct MeshPart {
    /// Its mesh's name.
    pub mesh: String,
    /// Its material's name.
    pub material: Option<String>,
    /// And that material's place in the file.
    #[serde(skip)]
    pub material_index: Option<usize>,
    /// How many vertices.
    pub vertices: usize,
    /// How many triangles; 0 of points and lines.
    pub triangles: usize,
    /// Sets of texture coordinates.
    pub uv_sets: usize,
    /// Whether it has tangents of its own.
    pub tangents: bool,
    /// Whether it has colours at its vertices, which are not read of skin.
    pub vertex_colors: bool,
    /// How many morph targets.
    pub morph_targets: usize,
    /// Whether bones move it.
    pub skinned: bool,
}

/// A material. Its pictures are read where a scene names them as maps.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// `opaque`, `mask` or `blend`.
    pub alpha: &'static str,
    /// The picture of its base colour.
    pub color: Option<Picture>,
    /// Its normal map.
    pub normal: Option<Picture>,
    /// Whether it has a picture of ambient occlusion, which nothing reads.
    pub occlusion: bool,
}

/// A picture that a material names.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Picture {
    /// Its name in the file.
    pub name: Option<String>,
    /// Where its bytes are.
    pub file: FilePicture,
    /// The set of texture coordinates that it is looked up by.
    pub uv_set: usize,
    /// Whether these are moved before (KHR_texture_transform).
    pub moved: bool,
}

/// Where a picture's bytes are.
#[derive(Clone, Debug, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FilePicture {
    /// In a file of its own; the path is from the mesh file's folder.
    Beside(PathBuf),
    /// Within the mesh file.
    Within {
        /// Which of its images.
        index: usize,
        /// What a file of it would end with.
        ending: &'static str,
    },
}

/// An animation.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Animation {
    /// Its name.
    pub name: String,
    /// How long it is.
    pub seconds: f64,
    /// Whether it moves nodes, bones among them.
    pub moves_nodes: bool,
    /// Whether it moves morph targets.
    pub moves_morph_targets: bool,
}

/// A camera of the file.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CameraOfFile {
    /// What `[[view]] camera` calls it.
    pub name: String,
    /// Where it stands.
    pub eye: [f64; 3],
    /// Whether a view may name it: not at a node that mirrors, shears or has no size.
    pub usable: bool,
    /// Vertical field of view.
    pub fov_y_degrees: f64,
    /// Width over height, where the file says.
    pub aspect: Option<f64>,
}

/// An extension that is not read.
#[derive(Clone, Debug, serde::Serialize)]
pub struct UnreadExtension {
    /// Its name.
    pub name: String,
    /// Whether the file says that it cannot be shown without.
    pub required: bool,
}

impl MeshContents {
    /// Read the glTF file at `path`, all of its geometry included, so that what a scene would refuse is refused here.
    ///
    /// # Errors
    /// When it is no glTF file, is damaged, or has no triangle.
    pub fn read(path: &Path) -> Result<(Self, Vec<Warning>), SceneError> {
        let document = Document::open(path)?;
        let mut warnings = Warnings::new();
        let ask = Ask {
            uvs: Uvs::None,
            uv: TextureUv::default(),
            atlas_uv: None,
            colors: false,
            tangents: Tangents::None,
            morphs: true,
            morph_weights: None,
            bones: true,
            fields: Fields::default(),
            time: None,
            skin: None,
            clip: false,
        };
        let mesh = document.mesh(&ask, &mut warnings)?;
        let positions: Vec<DVec3> = mesh.pose().positions.iter().map(|p| p.as_dvec3()).collect();
        let least = positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let most = positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
        let cameras = document.cameras(None)?.into_iter().map(|camera| CameraOfFile {
            eye: camera.eye.to_array(),
            usable: camera.world_to_camera.is_some(),
            fov_y_degrees: camera.fov_y.to_degrees(),
            name: camera.name,
            aspect: camera.aspect,
        });
        let mut lights = Vec::new();
        // That there are none is no matter here.
        document.lights(None, &mut lights, &mut Warnings::new())?;
        let contents = Self {
            file: path.to_owned(),
            generator: document.generator(),
            bounds: [least.to_array(), most.to_array()],
            parts: document.parts()?,
            materials: document.materials()?,
            morph_targets: mesh.morphs.into_iter().map(|morph| morph.name).collect(),
            bones: document.bones_count(),
            animations: document.animations()?,
            cameras: cameras.collect(),
            lights: lights.into_iter().map(|light| light.name).collect(),
            unread_extensions: document.unread_extensions(),
            positions,
        };
        Ok((contents, warnings))
    }

    /// The bytes of one of its pictures that lie within the file, as they are encoded.
    ///
    /// # Errors
    /// When the file cannot be read any more, or the picture reaches beyond it.
    pub fn picture_bytes(&self, index: usize) -> Result<Vec<u8>, SceneError> {
        Document::open(&self.file)?.picture_bytes(index)
    }

    /// How many triangles have a material.
    #[must_use]
    pub fn triangles_of(&self, material: &str) -> usize {
        let of_it = |part: &&MeshPart| part.material.as_deref() == Some(material);
        self.parts.iter().filter(of_it).map(|part| part.triangles).sum()
    }

    /// The opaque material of the most triangles: of a character mostly its skin.
    #[must_use]
    pub fn largest_material(&self) -> Option<&Material> {
        let triangles = |material: &&Material| self.triangles_of(&material.name);
        let opaque = self.materials.iter().filter(|material| material.alpha == "opaque");
        // Of equals the first.
        opaque.filter(|material| triangles(material) > 0).rev().max_by_key(triangles)
    }
}
