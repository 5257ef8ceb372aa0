//! The scene's maps as pictures that Unity imports: PNG, whatever the scene has them in, as the shader wants them.
//!
//! What lies within a mesh's file, times a factor, with Y down or in another's alpha, is then a file of its own. Eight bits a
//! channel: what has more in the scene is rounded.

use crate::render::files::encode_png;
use crate::render::tonemap::srgb_encode;
use crate::scene::maps::{Map, Maps};
use crate::shader::Resource;

/// A picture's file.
pub(super) struct Png {
    pub(super) bytes: Vec<u8>,
    /// How many of the map's numbers lie beyond what a picture holds.
    pub(super) clamped: usize,
}

/// The picture of what the shader reads; none where the scene has none.
pub(super) fn png(resource: Resource, maps: &Maps) -> Option<Result<Png, String>> {
    let stored = |x: f32| x;
    let found = match resource {
        Resource::ColorMap => encoded(maps.color.as_ref()?, srgb_encode),
        Resource::NormalMap => encoded(maps.normal.as_ref()?, stored),
        Resource::SpecularMap => encoded(maps.specular.as_ref()?, stored),
        Resource::AttenuatorMap => encoded(maps.attenuator.as_ref()?, stored),
        Resource::OwnMap(field) => match (maps.scalar(field), maps.colored(field)) {
            (Some(map), _) => encoded(map, stored),
            (None, map) => encoded(map?, srgb_encode),
        },
        _ => return None,
    };
    Some(found)
}

/// How far beyond 0 and 1 rounding to eight bits takes a number anyway.
const ROUNDED: f32 = 0.5 / 255.0;

/// A map as a picture of three channels, all of them alike where it has one.
fn encoded<const C: usize>(map: &Map<C>, encode: impl Fn(f32) -> f32) -> Result<Png, String> {
    let mut clamped = 0;
    let mut bytes = Vec::with_capacity(3 * map.texels.len());
    for texel in &map.texels {
        clamped += texel.iter().filter(|x| !(-ROUNDED..=1.0 + ROUNDED).contains(*x)).count();
        let byte = |c: usize| (encode(texel[c.min(C - 1)].clamp(0.0, 1.0)) * 255.0 + 0.5) as u8;
        bytes.extend([0, 1, 2].map(byte));
    }
    let bytes = encode_png(map.width, map.height, &bytes)?;
    Ok(Png { bytes, clamped })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::tonemap::srgb_decode;

    fn texels(png: &Png) -> Vec<[u8; 3]> {
        let picture = image::load_from_memory(&png.bytes).unwrap().to_rgb8();
        picture.pixels().map(|pixel| pixel.0).collect()
    }

    #[test]
    fn bytes_come_out_as_they_went_in() {
        let bytes: Vec<[u8; 3]> = (0..=255).map(|b: u8| [b, 255 - b, b / 2]).collect();
        let map = |decode: &dyn Fn(u8) -> f32| Map {
            width: 16,
            height: 16,
            texels: bytes.iter().map(|texel| texel.map(decode)).collect(),
        };
        let maps = Maps {
            color: Some(map(&|b| srgb_decode(f32::from(b) / 255.0))),
            normal: Some(map(&|b| f32::from(b) / 255.0)),
            ..Maps::default()
        };
        for resource in [Resource::ColorMap, Resource::NormalMap] {
            let png = png(resource, &maps).unwrap().unwrap();
            assert_eq!((texels(&png), png.clamped), (bytes.clone(), 0));
        }
        assert!(png(Resource::SpecularMap, &maps).is_none() && png(Resource::HiliteCube, &maps).is_none());
    }

    #[test]
    fn what_a_picture_cannot_hold_is_counted() {
        let specular = Map { width: 2, height: 1, texels: vec![[-0.5], [1.5]] };
        let maps = Maps { specular: Some(specular), ..Maps::default() };
        let png = png(Resource::SpecularMap, &maps).unwrap().unwrap();
        assert_eq!((texels(&png), png.clamped), (vec![[0; 3], [255; 3]], 2));
    }
}
