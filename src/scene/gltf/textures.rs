//! What a material says of a texture: its picture, how it repeats, and where it is looked up.

use std::path::Path;
use std::sync::Arc;

use glam::{Mat2, Vec2};
use gltf::json;
use json::Index;
use json::extensions;
use json::texture::{MagFilter, WrappingMode};
use json::validation::Checked;
use serde_json::{Map as Object, Value};

use super::document::Document;
use crate::error::SceneError;
use crate::images;
use crate::inspect::FilePicture;
use crate::maps::Map;
use crate::plain::{PlainMap, Wrap};

/// Where a texture is looked up: by which set of texture coordinates, and how they are moved before
/// (`KHR_texture_transform`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TextureUv {
    pub set: u32,
    offset: Vec2,
    /// Radians, counter-clockwise in the picture, whose v runs down.
    rotation: f32,
    scale: Vec2,
}

impl Default for TextureUv {
    fn default() -> Self {
        Self { set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

impl TextureUv {
    /// A set as it stands.
    pub(crate) fn of_set(set: u32) -> Self {
        Self { set, ..Self::default() }
    }

    /// Of a texture's own set and its extensions. What is no finite number is left as it stands without it.
    fn new(set: u32, extensions: Option<&Object<String, Value>>) -> Self {
        let Some(transform) = extensions.and_then(|all| all.get("KHR_texture_transform")) else {
            return Self { set, ..Self::default() };
        };
        let number = |value: &Value| value.as_f64().map(|x| x as f32).filter(|x| x.is_finite());
        let pair = |name: &str, without: Vec2| match transform.get(name).and_then(Value::as_array) {
            Some(values) if values.len() == 2 => {
                Vec2::new(number(&values[0]).unwrap_or(without.x), number(&values[1]).unwrap_or(without.y))
            }
            _ => without,
        };
        let own = transform.get("texCoord").and_then(Value::as_u64).and_then(|set| u32::try_from(set).ok());
        Self {
            set: own.unwrap_or(set),
            offset: pair("offset", Vec2::ZERO),
            rotation: transform.get("rotation").and_then(number).unwrap_or(0.0),
            scale: pair("scale", Vec2::ONE),
        }
    }

    /// Whether it is moved at all.
    pub(super) fn is_moved(&self) -> bool {
        *self != Self { set: self.set, ..Self::default() }
    }

    /// Texture coordinates of the set, as the picture is looked up there.
    pub(super) fn moved(&self, uvs: Vec<Vec2>) -> Vec<Vec2> {
        if !self.is_moved() {
            return uvs;
        }
        let (sine, cosine) = self.rotation.sin_cos();
        let turn = Mat2::from_cols(Vec2::new(cosine, -sine), Vec2::new(sine, cosine));
        uvs.into_iter().map(|uv| self.offset + turn * (self.scale * uv)).collect()
    }
}

/// A texture that a material names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TextureUse {
    pub index: Index<json::Texture>,
    pub uv: TextureUv,
}

impl TextureUse {
    /// Of the fields that glTF's texture infos share.
    pub(super) fn of(info: &json::texture::Info) -> Self {
        let others =
            info.extensions.as_ref().map(|extensions: &extensions::texture::Info| &extensions.others);
        Self { index: info.index, uv: TextureUv::new(info.tex_coord, others) }
    }

    /// Of a normal map.
    pub(super) fn of_normals(info: &json::material::NormalTexture) -> Self {
        let others = info.extensions.as_ref().map(|extensions| &extensions.others);
        Self { index: info.index, uv: TextureUv::new(info.tex_coord, others) }
    }
}

/// Pictures of a file that are decoded, by their places in it and whether they hold colours.
#[derive(Default)]
pub(super) struct Pictures(Vec<(usize, bool, Arc<Map<4>>)>);

impl Document {
    /// How a texture repeats along u and v, and whether it shows its nearest texel alone.
    fn sampler(&self, texture: Index<json::Texture>) -> Result<([Wrap; 2], bool), SceneError> {
        let Some(index) = self.get(&self.root.textures, texture, "texture")?.sampler else {
            return Ok(([Wrap::Repeat; 2], false));
        };
        let sampler = self.get(&self.root.samplers, index, "sampler")?;
        let wrap = |mode: Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let nearest = matches!(sampler.mag_filter, Some(Checked::Valid(MagFilter::Nearest)));
        Ok(([wrap(sampler.wrap_s), wrap(sampler.wrap_t)], nearest))
    }

    /// A texture's picture as a map, decoded once for all materials that have it; none where an extension alone says
    /// what it is of.
    pub(super) fn map_of(
        &self,
        texture: TextureUse,
        color: bool,
        pictures: &mut Pictures,
    ) -> Result<Option<PlainMap>, SceneError> {
        let Some(picture) = self.picture(texture)? else { return Ok(None) };
        let image = self.get(&self.root.textures, texture.index, "texture")?.source.value();
        let (wrap, nearest) = self.sampler(texture.index)?;
        let Pictures(known) = pictures;
        if let Some((.., map)) = known.iter().find(|(of, as_color, _)| (*of, *as_color) == (image, color)) {
            return Ok(Some(PlainMap { map: map.clone(), wrap, nearest }));
        }
        let map = match picture.file {
            FilePicture::Beside(path) => images::picture(&self.folder().join(path), color)?,
            FilePicture::Within { index, .. } => {
                let bytes = self.picture_bytes(index)?;
                images::picture_of(&self.path, &bytes, color)
                    .map_err(|error| error.at(format!("image {index}")))?
            }
        };
        let map = Arc::new(map);
        known.push((image, color, map.clone()));
        Ok(Some(PlainMap { map, wrap, nearest }))
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn transforms_scale_then_turn_then_shift() {
        let transform = json!({"KHR_texture_transform": {
            "offset": [0.25, 0.5], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 3.0], "texCoord": 1
        }});
        let uv = TextureUv::new(0, transform.as_object());
        assert_eq!(uv.set, 1);
        // (0.1, 0.2) scaled is (0.2, 0.6); a quarter turn that raises the u axis takes it to (0.6, -0.2).
        let moved = uv.moved(vec![Vec2::new(0.1, 0.2)])[0];
        assert!((moved - Vec2::new(0.85, 0.3)).length() < 1e-6, "{moved}");
        let odd =
            json!({"KHR_texture_transform": {"offset": ["x", null], "rotation": 1e300, "scale": [1.0]}});
        assert_eq!(TextureUv::new(3, odd.as_object()), TextureUv { set: 3, ..TextureUv::default() });
    }
}
