//! What a file holds, by its own names: for people who have not seen it yet.

use gltf::json;
use json::animation::Property;
use json::material::AlphaMode;
use json::mesh::Semantic;
use json::validation::Checked;

use super::document::Document;
use super::textures::TextureUse;
use crate::error::SceneError;
use crate::inspect::{Animation, FilePicture, Material, MeshPart, Picture};

impl Document {
    /// The program that wrote the file, where it says.
    pub(crate) fn generator(&self) -> Option<String> {
        self.root.asset.generator.clone()
    }

    /// The primitives of the scene's nodes, in their order.
    pub(crate) fn parts(&self) -> Result<Vec<MeshPart>, SceneError> {
        let nodes = self.nodes(None)?;
        let mut parts = Vec::new();
        for &i in &nodes.in_scene {
            let node = &self.root.nodes[i];
            let Some(index) = node.mesh else { continue };
            let mesh = self.get(&self.root.meshes, index, "mesh")?;
            let name = self.mesh_name(index.value(), node);
            for primitive in &mesh.primitives {
                let count = |accessor: Option<json::Index<json::Accessor>>| match accessor {
                    Some(index) => Ok(self.get(&self.root.accessors, index, "accessor")?.count.0 as usize),
                    None => Ok(0),
                };
                let attribute =
                    |semantic: Semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
                let vertices = count(attribute(Semantic::Positions))?;
                let corners = if primitive.indices.is_some() { count(primitive.indices)? } else { vertices };
                let sets = (0..).take_while(|&set| attribute(Semantic::TexCoords(set)).is_some()).count();
                parts.push(MeshPart {
                    mesh: name.clone(),
                    material: primitive.material.map(|index| self.material_name(index.value())),
                    material_index: primitive.material.map(|index| index.value()),
                    vertices,
                    triangles: match primitive.mode {
                        Checked::Valid(json::mesh::Mode::Triangles) => corners / 3,
                        Checked::Valid(json::mesh::Mode::TriangleStrip | json::mesh::Mode::TriangleFan) => {
                            corners.saturating_sub(2)
                        }
                        _ => 0,
                    },
                    uv_sets: sets,
                    tangents: attribute(Semantic::Tangents).is_some(),
                    vertex_colors: attribute(Semantic::Colors(0)).is_some(),
                    morph_targets: primitive.targets.as_ref().map_or(0, Vec::len),
                    skinned: node.skin.is_some(),
                });
            }
        }
        Ok(parts)
    }

    /// The name of a mesh, else of the node that has it, or its place.
    pub(super) fn mesh_name(&self, index: usize, node: &json::Node) -> String {
        let named = self.root.meshes.get(index).and_then(|mesh| mesh.name.clone());
        named.or_else(|| node.name.clone()).unwrap_or_else(|| format!("mesh {index}"))
    }

    /// The name of a material, or its place.
    pub(super) fn material_name(&self, index: usize) -> String {
        let named = self.root.materials.get(index).and_then(|material| material.name.clone());
        named.unwrap_or_else(|| format!("material {index}"))
    }

    /// The file's materials, with the pictures that they name.
    pub(crate) fn materials(&self) -> Result<Vec<Material>, SceneError> {
        let mut materials = Vec::new();
        for (i, material) in self.root.materials.iter().enumerate() {
            let surface = &material.pbr_metallic_roughness;
            let color = surface.base_color_texture.as_ref().map(TextureUse::of);
            let normal = material.normal_texture.as_ref().map(TextureUse::of_normals);
            let picture = |found: Option<TextureUse>| match found {
                Some(texture) => self.picture(texture),
                None => Ok(None),
            };
            materials.push(Material {
                name: self.material_name(i),
                alpha: match material.alpha_mode {
                    Checked::Valid(AlphaMode::Mask) => "mask",
                    Checked::Valid(AlphaMode::Blend) => "blend",
                    _ => "opaque",
                },
                color: picture(color)?,
                normal: picture(normal)?,
                occlusion: material.occlusion_texture.is_some(),
            });
        }
        Ok(materials)
    }

    /// The picture of a texture; none where an extension alone says what it is of.
    pub(super) fn picture(
        &self,
        TextureUse { index, uv }: TextureUse,
    ) -> Result<Option<Picture>, SceneError> {
        let texture = self.get(&self.root.textures, index, "texture")?;
        // The crate's own mark for a texture without a source.
        if texture.source.value() == u32::MAX as usize {
            return Ok(None);
        }
        let index = texture.source.value();
        let image = self.get(&self.root.images, texture.source, "image")?;
        let of_kind = |kind: Option<&str>| if kind == Some("image/jpeg") { "jpg" } else { "png" };
        let file = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if !uri.starts_with("data:") => {
                let decoded = percent_encoding::percent_decode_str(uri).decode_utf8_lossy();
                FilePicture::Beside(decoded.into_owned().into())
            }
            (Some(_), _) | (None, Some(_)) => {
                let kind = image.mime_type.as_ref().map(|kind| kind.0.as_str());
                let of_uri = image.uri.as_ref().and_then(|uri| uri.strip_prefix("data:")?.split(';').next());
                FilePicture::Within { index, ending: of_kind(kind.or(of_uri)) }
            }
            (None, None) => return Ok(None),
        };
        let name = image.name.clone().filter(|name| !name.is_empty());
        Ok(Some(Picture { name, file, uv_set: uv.set as usize, moved: uv.is_moved() }))
    }

    /// The bytes of a picture within the file, as they are encoded.
    pub(crate) fn picture_bytes(&self, index: usize) -> Result<Vec<u8>, SceneError> {
        let image = self.get(&self.root.images, json::Index::new(index as u32), "image")?;
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.resolve(uri, &format!("image {index}")),
            (None, Some(view)) => Ok(self.view(view)?.to_vec()),
            (None, None) => Err(self.error("has an image without bytes", "Export it anew")),
        }
    }

    /// How many bones the file has, over all of its skins.
    pub(crate) fn bones_count(&self) -> usize {
        self.root.skins.iter().map(|skin| skin.joints.len()).sum()
    }

    /// The file's animations, and how long each is.
    pub(crate) fn animations(&self) -> Result<Vec<Animation>, SceneError> {
        let mut animations = Vec::new();
        for (animation, name) in self.root.animations.iter().zip(self.animation_names()) {
            let seconds = self.seconds_of(animation)?.map_or(0.0, |(first, last)| last - first);
            let moves = |property: Property| {
                animation.channels.iter().any(|channel| channel.target.path == Checked::Valid(property))
            };
            let nodes = [Property::Translation, Property::Rotation, Property::Scale].into_iter().any(moves);
            animations.push(Animation {
                name,
                seconds,
                moves_nodes: nodes,
                moves_morph_targets: moves(Property::MorphTargetWeights),
            });
        }
        Ok(animations)
    }
}
