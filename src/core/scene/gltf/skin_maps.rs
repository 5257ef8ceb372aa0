//! The maps of the skin's own material, for scenes that name none.

use std::sync::Arc;

use gltf::json;

use super::document::Document;
use super::textures::{Pictures, TextureUse, TextureUv};
use crate::scene::error::{SceneError, Warnings, warn};
use crate::scene::maps::Map;
use crate::scene::plain::{PlainMap, Wrap};

/// What the skin's material says of its maps.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) struct SkinMaps {
    /// Its name.
    material: String,
    /// The picture of its base colour, and the factor on it.
    color: Option<(TextureUse, [f32; 3])>,
    /// Its normal map.
    normal: Option<TextureUse>,
}

impl SkinMaps {
    /// Where both are looked up: one set of texture coordinates serves all maps of a scene.
    pub(in crate::scene) fn uv(&self) -> TextureUv {
        let color = self.color.map(|(color, _)| color);
        color.or(self.normal).map(|texture| texture.uv).unwrap_or_default()
    }
}

impl Document {
    /// The maps of the material that the most triangles of the skin have, of those with pictures; `skin` names materials
    /// and meshes, without it all is skin.
    pub(in crate::scene) fn skin_maps(
        &self,
        skin: Option<&[String]>,
        warnings: &mut Warnings,
    ) -> Result<Option<SkinMaps>, SceneError> {
        let named = |name: &str| skin.is_none_or(|names| names.iter().any(|other| other == name));
        let materials = self.materials()?;
        let mut found: Vec<(usize, usize)> = Vec::new();
        let parts = self.parts()?;
        for (i, material) in materials.iter().enumerate() {
            let of_it = parts.iter().filter(|part| part.material.as_deref() == Some(&material.name));
            let of_skin = of_it.filter(|part| named(&material.name) || named(&part.mesh));
            let triangles: usize = of_skin.map(|part| part.triangles).sum();
            if triangles > 0 && (material.color.is_some() || material.normal.is_some()) {
                found.push((triangles, i));
            }
        }
        // Of equals the first.
        let Some(&(_, i)) = found.iter().rev().max_by_key(|(triangles, _)| *triangles) else {
            return Ok(None);
        };
        let name = materials[i].name.clone();
        if found.len() > 1 {
            let others = found.len() - 1;
            let message = format!(
                "the skin has {others} more materials with pictures than {name:?}, whose maps are taken for all of it: \
                 name maps in [maps], or fewer materials in [mesh] skin"
            );
            warn(warnings, &self.path, message);
        }
        let material = self.get(&self.root.materials, json::Index::new(i as u32), "material")?;
        let surface = &material.pbr_metallic_roughness;
        let [r, g, b, _] = surface.base_color_factor.0;
        let color = surface.base_color_texture.as_ref().map(|info| (TextureUse::of(info), [r, g, b]));
        let mut maps = SkinMaps {
            material: name,
            color: color.filter(|_| materials[i].color.is_some()),
            normal: material
                .normal_texture
                .as_ref()
                .filter(|_| materials[i].normal.is_some())
                .map(TextureUse::of_normals),
        };
        if maps.normal.is_some_and(|normal| normal.uv != maps.uv()) {
            let message = format!(
                "material {:?}: its normal map is looked up elsewhere than its colour, and is not read: all maps share \
                 one set of texture coordinates",
                maps.material
            );
            warn(warnings, &self.path, message);
            maps.normal = None;
        }
        Ok(Some(maps))
    }

    /// The pictures of the skin's material, those that are `wanted`: of its colour, linear, and of its normals.
    pub(in crate::scene) fn read_skin_maps(
        &self,
        maps: &SkinMaps,
        (color, normal): (bool, bool),
        warnings: &mut Warnings,
    ) -> Result<(Option<Map<3>>, Option<Map<3>>), SceneError> {
        let mut pictures = Pictures::default();
        let mut read = |texture: TextureUse, as_color: bool| -> Result<Option<Arc<Map<4>>>, SceneError> {
            let map = self.map_of(texture, as_color, &mut pictures)?;
            Ok(map.map(|PlainMap { map, wrap, nearest }| {
                if wrap != [Wrap::Repeat; 2] || nearest {
                    let message = format!(
                        "material {:?}: skin's maps repeat and are filtered, whatever the file's sampler says",
                        maps.material
                    );
                    warn(warnings, &self.path, message);
                }
                map
            }))
        };
        let colors = match maps.color.filter(|_| color) {
            Some((texture, factor)) => read(texture, true)?.map(|map| (map, factor)),
            None => None,
        };
        let normals = match maps.normal.filter(|_| normal) {
            Some(texture) => read(texture, false)?,
            None => None,
        };
        let sound = |x: f32| if x.is_finite() { x.max(0.0) } else { 1.0 };
        let colors = colors.map(|(map, factor)| without_alpha(&map, factor.map(sound)));
        Ok((colors, normals.map(|map| without_alpha(&map, [1.0; 3]))))
    }
}

/// A picture's channels times a factor.
fn without_alpha(map: &Map<4>, factor: [f32; 3]) -> Map<3> {
    let texels = map.texels.iter().map(|texel| std::array::from_fn(|c| factor[c] * texel[c])).collect();
    Map { width: map.width, height: map.height, texels }
}
