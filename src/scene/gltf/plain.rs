//! Which triangles are skin, and what the others are drawn by.

use std::collections::BTreeMap;

use gltf::json;
use json::Index;
use json::material::{AlphaMode, Material};
use json::mesh::Primitive;
use json::validation::Checked;

use super::document::Document;
use super::primitive::Part;
use super::textures::{Pictures, TextureUse, TextureUv};
use crate::error::{SceneError, Warnings, warn};
use crate::plain::{Alpha, PlainMaterial, PlainParts};
use crate::suggestion;

/// The triangles of a mesh that is being put together, told apart by the names of what is skin.
pub(super) struct Split<'a> {
    /// Materials and meshes that are skin, each with whether it was met.
    names: Vec<(&'a str, bool)>,
    /// Materials by their places in the file, each with its place among `materials`.
    known: BTreeMap<Option<usize>, PlainPart>,
    materials: Vec<PlainMaterial>,
    pictures: Pictures,
    of_triangle: Vec<Option<u16>>,
    /// As [`PlainParts::corner_colors`], of each triangle.
    corner_colors: Vec<[[f32; 4]; 3]>,
}

/// What a primitive is that is not skin.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainPart {
    /// The place of its material.
    material: u16,
    /// Where its pictures are looked up.
    pub(super) uv: TextureUv,
}

impl<'a> Split<'a> {
    pub(super) fn new(names: &'a [String]) -> Self {
        Self {
            names: names.iter().map(|name| (name.as_str(), false)).collect(),
            known: BTreeMap::new(),
            materials: Vec::new(),
            pictures: Pictures::default(),
            of_triangle: Vec::new(),
            corner_colors: Vec::new(),
        }
    }

    /// What a primitive of a mesh of that name is; `None` where it is skin.
    pub(super) fn of(
        &mut self,
        document: &Document,
        mesh: &str,
        primitive: &Primitive,
        warnings: &mut Warnings,
    ) -> Result<Option<PlainPart>, SceneError> {
        let material = primitive.material.map(|index| index.value());
        let of_material = material.map(|index| document.material_name(index));
        let mut skin = false;
        for (name, met) in &mut self.names {
            if of_material.as_deref() == Some(*name) || mesh == *name {
                (*met, skin) = (true, true);
            }
        }
        if skin {
            return Ok(None);
        }
        if let Some(part) = self.known.get(&material) {
            return Ok(Some(*part));
        }
        let place = u16::try_from(self.materials.len())
            .map_err(|_| document.error("has more than 65536 materials", "Join some"))?;
        let (plain, uv) = document.plain_material(material, &mut self.pictures, warnings)?;
        self.materials.push(plain);
        let part = PlainPart { material: place, uv };
        self.known.insert(material, part);
        Ok(Some(part))
    }

    /// The triangles of a primitive more, of a material or of skin.
    pub(super) fn add(&mut self, part: &Part, of: Option<PlainPart>) {
        self.of_triangle.extend(part.triangles.iter().map(|_| of.map(|of| of.material)));
        let colors = part.colors.as_ref();
        let corner = |i: u32| colors.map_or([1.0; 4], |colors| colors[i as usize]);
        self.corner_colors.extend(part.triangles.iter().map(|triangle| triangle.map(corner)));
    }

    /// The parts, of which those triangles are left that are marked; none where all is skin.
    pub(super) fn finish(self, document: &Document, kept: &[bool]) -> Result<Option<PlainParts>, SceneError> {
        if let Some((name, _)) = self.names.iter().find(|(_, met)| !met) {
            let parts = document.parts()?;
            let materials = (0..document.root.materials.len()).map(|index| document.material_name(index));
            let known: Vec<String> = materials.chain(parts.into_iter().map(|part| part.mesh)).collect();
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            return Err(document.error(
                format!("has no material or mesh `{name}` in its scene, which [mesh] skin names"),
                &suggestion(name, &known),
            ));
        }
        let of_triangle = left(self.of_triangle, kept);
        let mut corner_colors = left(self.corner_colors, kept);
        if corner_colors.as_flattened().iter().all(|color| *color == [1.0; 4]) {
            corner_colors.clear();
        }
        if of_triangle.iter().all(Option::is_some) {
            return Err(document.error("has no triangle of what [mesh] skin names", "Name what is skin"));
        }
        let plain = of_triangle.iter().any(Option::is_some);
        Ok(plain.then_some(PlainParts { of_triangle, materials: self.materials, corner_colors }))
    }
}

/// Those of a list that are `kept`.
fn left<T>(all: Vec<T>, kept: &[bool]) -> Vec<T> {
    all.into_iter().zip(kept).filter_map(|(one, &kept)| kept.then_some(one)).collect()
}

impl Document {
    /// A material of the file, glTF's default where a primitive has none; and where its pictures are looked up.
    fn plain_material(
        &self,
        index: Option<usize>,
        pictures: &mut Pictures,
        warnings: &mut Warnings,
    ) -> Result<(PlainMaterial, TextureUv), SceneError> {
        let Some(index) = index else { return Ok((gltf_default(), TextureUv::default())) };
        let material = self.get(&self.root.materials, Index::new(index as u32), "material")?;
        let name = self.material_name(index);
        self.warn_of_unread(&name, material, warnings);
        let surface = &material.pbr_metallic_roughness;
        let textures = [
            (&surface.base_color_texture, true),
            (&surface.metallic_roughness_texture, false),
            (&material.emissive_texture, true),
        ];
        let uses = textures.map(|(info, color)| info.as_ref().map(|info| (TextureUse::of(info), color)));
        let uv = uses.iter().flatten().map(|(texture, _)| texture.uv).next().unwrap_or_default();
        if uses.iter().flatten().any(|(texture, _)| texture.uv != uv) {
            let message = format!(
                "material {name:?}: all of its pictures are looked up where the first one is, though they name other \
                 texture coordinates"
            );
            warn(warnings, &self.path, message);
        }
        let mut maps = [None, None, None];
        for (map, texture) in maps.iter_mut().zip(uses) {
            if let Some((texture, color)) = texture {
                *map = self.map_of(texture, color, pictures)?;
                if map.is_none() {
                    let message =
                        format!("material {name:?} is drawn without a picture whose format is not read");
                    warn(warnings, &self.path, message);
                }
            }
        }
        let [color_map, roughness_map, emission_map] = maps;
        let strength = material.extensions.as_ref().and_then(|all| all.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |strength| sound(strength.emissive_strength.0));
        let plain = PlainMaterial {
            base_color: surface.base_color_factor.0.map(sound),
            color_map,
            metallic: sound(surface.metallic_factor.0),
            roughness: sound(surface.roughness_factor.0),
            roughness_map,
            alpha: alpha_of(material).0,
            emission: material.emissive_factor.0.map(|x| sound(strength * sound(x)).max(0.0)),
            emission_map,
            name,
        };
        Ok((plain, uv))
    }
}

/// What a material's alpha does, and the factor on its picture's.
pub(super) fn alpha_of(material: &Material) -> (Alpha, f32) {
    let [.., factor] = material.pbr_metallic_roughness.base_color_factor.0;
    let alpha = match material.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => {
            Alpha::Mask(material.alpha_cutoff.map_or(0.5, |cutoff| sound(cutoff.0)))
        }
        Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
        _ => Alpha::Opaque,
    };
    (alpha, sound(factor))
}

fn sound(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// What a primitive without a material is drawn by (glTF 2.0, section 3.7.2.1).
fn gltf_default() -> PlainMaterial {
    PlainMaterial {
        name: "glTF's default".to_owned(),
        base_color: [1.0; 4],
        color_map: None,
        metallic: 1.0,
        roughness: 1.0,
        roughness_map: None,
        alpha: Alpha::Opaque,
        emission: [0.0; 3],
        emission_map: None,
    }
}
