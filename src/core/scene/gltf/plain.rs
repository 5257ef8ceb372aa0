//! Which triangles are skin, and what the others are drawn by.

use std::collections::BTreeMap;

use gltf::json;
use json::Index;
use json::material::AlphaMode;
use json::mesh::Primitive;
use json::validation::Checked;

use super::document::Document;
use crate::scene::error::{SceneError, Warnings, warn};
use crate::scene::images;
use crate::scene::maps::Map;
use crate::scene::plain::{Alpha, PlainMaterial, PlainParts};
use crate::scene::suggestion;

/// The triangles of a mesh that is being put together, told apart by the names of what is skin.
pub(super) struct Split<'a> {
    /// Materials and meshes that are skin, each with whether it was met.
    names: Vec<(&'a str, bool)>,
    /// Materials by their places in the file, each with its place among `materials`.
    known: BTreeMap<Option<usize>, u16>,
    materials: Vec<PlainMaterial>,
    of_triangle: Vec<Option<u16>>,
}

impl<'a> Split<'a> {
    pub(super) fn new(names: &'a [String]) -> Self {
        Self {
            names: names.iter().map(|name| (name.as_str(), false)).collect(),
            known: BTreeMap::new(),
            materials: Vec::new(),
            of_triangle: Vec::new(),
        }
    }

    /// The place of a primitive's material; `None` where it is skin.
    pub(super) fn of(
        &mut self,
        document: &Document,
        mesh: &json::Mesh,
        primitive: &Primitive,
        warnings: &mut Warnings,
    ) -> Result<Option<u16>, SceneError> {
        let material = primitive.material.map(|index| index.value());
        let of_material = material.map(|index| document.material_name(index));
        let mut skin = false;
        for (name, met) in &mut self.names {
            if of_material.as_deref() == Some(*name) || mesh.name.as_deref() == Some(*name) {
                (*met, skin) = (true, true);
            }
        }
        if skin {
            return Ok(None);
        }
        if let Some(place) = self.known.get(&material) {
            return Ok(Some(*place));
        }
        let place = u16::try_from(self.materials.len())
            .map_err(|_| document.error("has more than 65536 materials", "Join some"))?;
        self.materials.push(document.plain_material(material, warnings)?);
        self.known.insert(material, place);
        Ok(Some(place))
    }

    /// So many triangles more, of a material or of skin.
    pub(super) fn add(&mut self, triangles: usize, of: Option<u16>) {
        self.of_triangle.extend(std::iter::repeat_n(of, triangles));
    }

    /// The parts, of which those triangles are left that are marked; none where all is skin.
    pub(super) fn finish(self, document: &Document, kept: &[bool]) -> Result<Option<PlainParts>, SceneError> {
        if let Some((name, _)) = self.names.iter().find(|(_, met)| !met) {
            let meshes = document.root.meshes.iter().filter_map(|mesh| mesh.name.clone());
            let materials = (0..document.root.materials.len()).map(|index| document.material_name(index));
            let known: Vec<String> = materials.chain(meshes).collect();
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            return Err(document.error(
                format!("has no material or mesh `{name}` in its scene, which [mesh] skin names"),
                &suggestion(name, &known),
            ));
        }
        let all = self.of_triangle.into_iter().zip(kept);
        let of_triangle: Vec<Option<u16>> = all.filter_map(|(of, &kept)| kept.then_some(of)).collect();
        if of_triangle.iter().all(Option::is_some) {
            return Err(document.error("has no triangle of what [mesh] skin names", "Name what is skin"));
        }
        let plain = of_triangle.iter().any(Option::is_some);
        Ok(plain.then_some(PlainParts { of_triangle, materials: self.materials }))
    }
}

impl Document {
    /// A material of the file; glTF's default where a primitive has none.
    fn plain_material(
        &self,
        index: Option<usize>,
        warnings: &mut Warnings,
    ) -> Result<PlainMaterial, SceneError> {
        let Some(index) = index else {
            return Ok(PlainMaterial {
                name: "glTF's default".to_owned(),
                base_color: [1.0; 4],
                color_map: None,
                metallic: 1.0,
                roughness: 1.0,
                roughness_map: None,
                alpha: Alpha::Opaque,
                emission: [0.0; 3],
            });
        };
        let material = self.get(&self.root.materials, Index::new(index as u32), "material")?;
        let name = self.material_name(index);
        let surface = &material.pbr_metallic_roughness;
        let mut map = |texture: &Option<json::texture::Info>, color: bool| match texture {
            None => Ok(None),
            Some(info) if info.tex_coord != 0 => {
                let message =
                    format!("material {name:?}: texture coordinates but the first set are not read");
                warn(warnings, &self.path, message);
                Ok(None)
            }
            Some(info) => self.map_of(info.index, color),
        };
        let color_map = map(&surface.base_color_texture, true)?;
        let roughness_map = map(&surface.metallic_roughness_texture, false)?;
        let sound = |x: f32| if x.is_finite() { x } else { 0.0 };
        Ok(PlainMaterial {
            base_color: surface.base_color_factor.0.map(sound),
            color_map,
            metallic: sound(surface.metallic_factor.0),
            roughness: sound(surface.roughness_factor.0),
            roughness_map,
            alpha: match material.alpha_mode {
                Checked::Valid(AlphaMode::Mask) => {
                    Alpha::Mask(material.alpha_cutoff.map_or(0.5, |cutoff| sound(cutoff.0)))
                }
                Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
                _ => Alpha::Opaque,
            },
            emission: material.emissive_factor.0.map(|x| sound(x).max(0.0)),
            name,
        })
    }

    /// A texture's picture as a map.
    fn map_of(&self, texture: Index<json::Texture>, color: bool) -> Result<Option<Map<4>>, SceneError> {
        use crate::scene::inspect::FilePicture;
        let Some(picture) = self.picture(texture, 0)? else { return Ok(None) };
        match picture.file {
            FilePicture::Beside(path) => {
                let folder = self.path.parent().unwrap_or(std::path::Path::new(""));
                images::picture(&folder.join(path), color).map(Some)
            }
            FilePicture::Within { index, .. } => {
                let bytes = self.picture_bytes(index)?;
                images::picture_of(&self.path, &bytes, color)
                    .map_err(|error| error.at(format!("image {index}")))
                    .map(Some)
            }
        }
    }
}
