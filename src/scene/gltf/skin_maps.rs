//! The maps of the skin's own material, for scenes that name none.

use std::collections::BTreeMap;

use gltf::json;

use super::document::Document;
use super::plain::alpha_of;
use super::textures::{Pictures, TextureUse, TextureUv};
use crate::error::{SceneError, Warnings, warn};
use crate::map_files::warn_of_other_than_normals;
use crate::map_layout::MapLayout;
use crate::maps::Map;
use crate::plain::{Alpha, PlainMap, Wrap};

/// What the skin's material says of its maps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SkinMaps {
    /// Its name.
    pub(crate) material: String,
    /// The picture of its base colour, and the factor on it.
    color: Option<(TextureUse, [f32; 3])>,
    /// Its normal map.
    normal: Option<TextureUse>,
    /// What its alpha does, and the factor on its picture's.
    alpha: (Alpha, f32),
    /// What it has of these as pictures of formats that are not read.
    unread: Vec<&'static str>,
}

impl SkinMaps {
    /// Whether there is a normal map.
    pub(crate) const fn has_normals(&self) -> bool {
        self.normal.is_some()
    }

    /// Where both are looked up: one set of texture coordinates serves all maps of a scene.
    pub(crate) fn uv(&self) -> TextureUv {
        let color = self.color.map(|(color, _)| color);
        color.or(self.normal).map(|texture| texture.uv).unwrap_or_default()
    }

    /// What an engine has to do, where the colours are this material's or another's, beside showing the file's pictures by the first texture coordinates; `None` where that
    /// is all.
    pub(crate) fn told(&self, colored: bool, layout: Option<MapLayout>) -> Option<String> {
        let mut words = Vec::new();
        let factor = self.color.filter(|(_, factor)| colored && *factor != [1.0; 3]);
        if let Some((_, [r, g, b])) = factor {
            words.push(format!("its colour is the picture times ({r}, {g}, {b})"));
        }
        let uv = self.uv();
        if uv.set != 0 {
            words.push(format!("they are looked up by texture coordinates {}", uv.set));
        }
        if uv.is_moved() {
            words.push("its KHR_texture_transform moves these".to_owned());
        }
        if let Some(layout) = layout {
            let place = layout.told();
            words.push(format!(
                "beyond their borders they are mirrored or end as its samplers say; maps that are written are laid out for that, \
                 and looked up at {place}"
            ));
        }
        let name = &self.material;
        (!words.is_empty())
            .then(|| format!("the maps are those of the mesh's material {name:?}: {}", words.join(", ")))
    }
}

/// What is said of a material that gives no maps after all.
fn without(name: &str, why: impl std::fmt::Display) -> String {
    format!(
        "material {name:?}: {why}: its maps are not taken. `material = false` in [maps] says that they need not be"
    )
}

impl Document {
    /// The maps of the material that the most triangles of the skin have, of those with pictures, as far as they are
    /// `wanted`: of its colour and its normals. `skin` names materials and meshes, without it all is skin. What cannot be
    /// had is a warning: a scene need not have maps.
    pub(crate) fn skin_maps(
        &self,
        skin: Option<&[String]>,
        wanted: (bool, bool),
        warnings: &mut Warnings,
    ) -> Result<Option<SkinMaps>, SceneError> {
        let named = |name: &str| skin.is_none_or(|names| names.iter().any(|other| other == name));
        let mut parts = self.parts()?;
        parts.retain(|part| named(&part.mesh) || part.material.as_deref().is_some_and(named));
        // Triangles by the materials' places in the file.
        let mut triangles: BTreeMap<usize, usize> = BTreeMap::new();
        for part in &parts {
            if let Some(index) = part.material_index {
                *triangles.entry(index).or_default() += part.triangles;
            }
        }
        let mut found: Vec<(usize, SkinMaps)> = Vec::new();
        let unread = |maps: &SkinMaps, warnings: &mut Warnings| {
            for what in &maps.unread {
                let name = &maps.material;
                let message =
                    format!("material {name:?}: its {what} is of a format that is not read, and is left out");
                warn(warnings, &self.path, message);
            }
        };
        for (index, count) in triangles.into_iter().filter(|(_, count)| *count > 0) {
            match self.maps_of_material(index, wanted) {
                Ok(maps) if maps.color.is_some() || maps.normal.is_some() => found.push((count, maps)),
                Ok(maps) => unread(&maps, warnings),
                Err(error) => warn(warnings, &self.path, without(&self.material_name(index), error)),
            }
        }
        let others = found.len().saturating_sub(1);
        // Of equals the first.
        let Some((_, mut maps)) = found.into_iter().rev().max_by_key(|(count, _)| *count) else {
            return Ok(None);
        };
        unread(&maps, warnings);
        if others > 0 {
            let message = format!(
                "the skin has {others} more materials with pictures than {:?}, whose maps are taken for all of it: name \
                 maps in [maps], or fewer materials in [mesh] skin",
                maps.material
            );
            warn(warnings, &self.path, message);
        }
        if maps.normal.is_some_and(|normal| normal.uv != maps.uv()) {
            let message = format!(
                "material {:?}: its normal map is looked up elsewhere than its colour, and is not read: all maps share \
                 one set of texture coordinates",
                maps.material
            );
            warn(warnings, &self.path, message);
            maps.normal = None;
        }
        let set = maps.uv().set;
        if parts.iter().any(|part| part.triangles > 0 && part.uv_sets <= set as usize) {
            let why = format!("not all of the skin has texture coordinates {set}");
            warn(warnings, &self.path, without(&maps.material, why));
            return Ok(None);
        }
        Ok(Some(maps))
    }

    /// The maps of a material that are wanted.
    fn maps_of_material(&self, index: usize, (color, normal): (bool, bool)) -> Result<SkinMaps, SceneError> {
        let material = self.get(&self.root.materials, json::Index::new(index as u32), "material")?;
        let surface = &material.pbr_metallic_roughness;
        let [r, g, b, _] = surface.base_color_factor.0;
        let sound = |x: f32| if x.is_finite() { x.max(0.0) } else { 1.0 };
        let mut unread = Vec::new();
        let mut shown = |texture: Option<TextureUse>, what: &'static str| {
            let Some(texture) = texture else { return Ok(None) };
            let picture = self.picture(texture)?;
            if picture.is_none() {
                unread.push(what);
            }
            Ok::<_, SceneError>(picture.map(|_| texture))
        };
        let color = surface.base_color_texture.as_ref().filter(|_| color).map(TextureUse::of);
        let normal = material.normal_texture.as_ref().filter(|_| normal).map(TextureUse::of_normals);
        let (color, normal) = (shown(color, "base colour")?, shown(normal, "normal map")?);
        Ok(SkinMaps {
            material: self.material_name(index),
            color: color.map(|color| (color, [r, g, b].map(sound))),
            normal,
            alpha: alpha_of(material),
            unread,
        })
    }

    /// The pictures of the skin's material, those that are `wanted`: of its colour, linear, and of its normals; each with what
    /// lies beyond its borders. One that cannot be read is a warning.
    pub(crate) fn read_skin_maps(
        &self,
        maps: &SkinMaps,
        (color, normal): (bool, bool),
        warnings: &mut Warnings,
    ) -> [Option<(Map<3>, [Wrap; 2])>; 2] {
        let mut pictures = Pictures::default();
        let mut read = |texture: TextureUse, as_color: bool, factor: [f32; 3]| {
            let PlainMap { map, wrap, nearest } = match self.map_of(texture, as_color, &mut pictures) {
                Ok(map) => map?,
                Err(error) => {
                    warn(warnings, &self.path, without(&maps.material, error));
                    return None;
                }
            };
            if nearest {
                let message = format!(
                    "material {:?}: skin's maps are filtered, though the file's sampler shows texels as squares",
                    maps.material
                );
                warn(warnings, &self.path, message);
            }
            if as_color {
                self.warn_of_holes(&maps.material, maps.alpha, &map, warnings);
            }
            Some((without_alpha(&map, factor), wrap))
        };
        let colors = maps.color.filter(|_| color).and_then(|(texture, factor)| read(texture, true, factor));
        let normals = maps.normal.filter(|_| normal).and_then(|texture| read(texture, false, [1.0; 3]));
        if let Some((map, _)) = &normals {
            warn_of_other_than_normals(&self.path, map, warnings);
        }
        [colors, normals]
    }
}

/// A picture's channels times a factor.
fn without_alpha(map: &Map<4>, factor: [f32; 3]) -> Map<3> {
    let texels = map.texels.iter().map(|texel| std::array::from_fn(|c| factor[c] * texel[c])).collect();
    Map { width: map.width, height: map.height, texels }
}
