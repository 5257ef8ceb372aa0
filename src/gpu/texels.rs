//! Maps and cubes in the formats that shaders read them in.

use exr::prelude::f16;
use rayon::prelude::*;
use wgpu::{TextureFormat, TextureViewDimension};

use crate::model::cube::Cube;
use crate::render::tonemap::srgb_encode;
use crate::scene::maps::{Map, Maps};
use crate::shader::Resource;

/// A texture's content, layer by layer, row by row.
pub(crate) struct Texels {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) layers: u32,
    /// Mip levels; those of a layer follow one another.
    pub(super) levels: u32,
    pub(super) format: TextureFormat,
    pub(super) dimension: TextureViewDimension,
    pub(super) bytes: Vec<u8>,
    /// Texels that were cut at the end of the format's range.
    pub(super) clipped: usize,
}

/// The largest number of 16-bit floats.
pub(super) const LARGEST_HALF: f32 = 65504.0;

/// Six padded faces in 32 bits: the texels that the CPU filters.
pub(crate) fn faces(cube: &Cube<f32>) -> Texels {
    let side = cube.size() as u32 + 2;
    Texels {
        width: side,
        height: side,
        layers: 6,
        levels: 1,
        format: TextureFormat::Rgba32Float,
        dimension: TextureViewDimension::D2Array,
        bytes: bytemuck::cast_slice(cube.padded()).to_vec(),
        clipped: 0,
    }
}

/// Six faces in 16 bits, whose borders the hardware bridges. Radiance beyond their range is cut at it, and counted.
pub(super) fn cube(cube: &Cube<f32>) -> Texels {
    cubes(std::slice::from_ref(cube))
}

/// The same of several, each of half the size of the one before, as levels; of none, one texel a face that is black.
pub(super) fn cubes(levels: &[Cube<f32>]) -> Texels {
    let black = [Cube::from_fn(1, |_, _, _| [0.0; 4])];
    let levels = if levels.is_empty() { &black[..] } else { levels };
    let size = levels[0].size();
    let (mut halves, mut clipped) = (Vec::<[u8; 2]>::new(), 0);
    for face in 0..6 {
        for cube in levels {
            let side = cube.size();
            for (row, column) in (0..side).flat_map(|row| (0..side).map(move |column| (row, column))) {
                let texel = cube.texel(face, column, row);
                clipped += usize::from(texel.iter().any(|x| x.abs() > LARGEST_HALF));
                halves.extend(texel.map(half));
            }
        }
    }
    Texels {
        width: size as u32,
        height: size as u32,
        layers: 6,
        levels: levels.len() as u32,
        format: TextureFormat::Rgba16Float,
        dimension: TextureViewDimension::Cube,
        bytes: halves.as_flattened().to_vec(),
        clipped,
    }
}

/// A picture of a material in 16 bits. glTF's are of numbers up to 1.
pub(crate) fn picture(map: &Map<4>) -> Texels {
    Texels {
        width: map.width as u32,
        height: map.height as u32,
        layers: 1,
        levels: 1,
        format: TextureFormat::Rgba16Float,
        dimension: TextureViewDimension::D2,
        bytes: map.texels.iter().flatten().flat_map(|&x| half(x)).collect(),
        clipped: 0,
    }
}

/// The map that `resource` names, with its coarser levels where there are any; `None` where the scene has none, or it is
/// no map.
pub(super) fn map(resource: Resource, maps: &Maps, coarser: &[Maps]) -> Option<Texels> {
    let mut texels = level(resource, maps)?;
    for next in coarser.iter().map_while(|maps| level(resource, maps)) {
        texels.levels += 1;
        texels.bytes.extend(next.bytes);
    }
    Some(texels)
}

/// One level of it.
fn level(resource: Resource, maps: &Maps) -> Option<Texels> {
    use TextureFormat as F;
    let Maps { color, normal, specular, attenuator, .. } = maps;
    let linear = |x: f32| x;
    match resource {
        Resource::ColorTexels => color.as_ref().map(|map| rgba(map, None, F::Rgba32Float, float)),
        Resource::NormalTexels => normal.as_ref().map(|map| rgba(map, None, F::Rgba32Float, float)),
        Resource::ColorSpecularTexels => {
            color.as_ref().map(|map| rgba(map, specular.as_ref(), F::Rgba32Float, float))
        }
        Resource::NormalAttenuatorTexels => {
            normal.as_ref().map(|map| rgba(map, attenuator.as_ref(), F::Rgba32Float, float))
        }
        Resource::SpecularTexels => specular.as_ref().map(|map| single(map, F::R32Float, float)),
        Resource::AttenuatorTexels => attenuator.as_ref().map(|map| single(map, F::R32Float, float)),
        Resource::ColorMap => color.as_ref().map(|map| rgba8(map, None, F::Rgba8UnormSrgb, srgb_encode)),
        Resource::NormalMap => normal.as_ref().map(|map| rgba8(map, None, F::Rgba8Unorm, linear)),
        Resource::ColorSpecularMap => {
            color.as_ref().map(|map| rgba8(map, specular.as_ref(), F::Rgba8UnormSrgb, srgb_encode))
        }
        Resource::NormalAttenuatorMap => {
            normal.as_ref().map(|map| rgba8(map, attenuator.as_ref(), F::Rgba8Unorm, linear))
        }
        Resource::SpecularMap => specular.as_ref().map(|map| single(map, F::R8Unorm, |x| [byte(x)])),
        Resource::OwnTexels(field) => match field.info().numbers {
            1 => maps.scalar(field).map(|map| single(map, F::R32Float, float)),
            _ => maps.colored(field).map(|map| rgba(map, None, F::Rgba32Float, float)),
        },
        Resource::OwnMap(field) => match field.info().numbers {
            1 => maps.scalar(field).map(|map| single(map, F::R16Float, half)),
            _ => maps.colored(field).map(|map| rgba(map, None, F::Rgba16Float, half)),
        },
        Resource::AttenuatorMap => attenuator.as_ref().map(|map| single(map, F::R8Unorm, |x| [byte(x)])),
        _ => None,
    }
}

/// In 16 bits, cut at the end of their range.
fn half(x: f32) -> [u8; 2] {
    f16::from_f32(x.clamp(-LARGEST_HALF, LARGEST_HALF)).to_bits().to_ne_bytes()
}

fn float(x: f32) -> [u8; 4] {
    x.to_ne_bytes()
}

fn byte(x: f32) -> u8 {
    (x * 255.0 + 0.5) as u8
}

/// Three channels and, in alpha, a map of the same size (or 1), each through `encode`.
fn rgba<const N: usize>(
    map: &Map<3>,
    alpha: Option<&Map<1>>,
    format: TextureFormat,
    encode: fn(f32) -> [u8; N],
) -> Texels {
    let texel = |i: usize| {
        let [r, g, b] = map.texels[i];
        let a = alpha.and_then(|map| map.texels.get(i)).map_or(1.0, |&[a]| a);
        [r, g, b, a].map(encode)
    };
    let texels: Vec<[[u8; N]; 4]> = (0..map.texels.len()).into_par_iter().map(texel).collect();
    plane(map, format, texels.as_flattened().as_flattened().to_vec())
}

/// The same in 8 bits; `encode` takes colour to what is stored, alpha is stored as it is.
fn rgba8(map: &Map<3>, alpha: Option<&Map<1>>, format: TextureFormat, encode: fn(f32) -> f32) -> Texels {
    let texel = |i: usize| {
        let [r, g, b] = map.texels[i].map(|x| byte(encode(x)));
        let a = alpha.and_then(|map| map.texels.get(i)).map_or(255, |&[a]| byte(a));
        [r, g, b, a]
    };
    let bytes: Vec<[u8; 4]> = (0..map.texels.len()).into_par_iter().map(texel).collect();
    plane(map, format, bytemuck::cast_slice(&bytes).to_vec())
}

fn single<const N: usize>(map: &Map<1>, format: TextureFormat, encode: fn(f32) -> [u8; N]) -> Texels {
    plane(map, format, map.texels.iter().flat_map(|&[x]| encode(x)).collect())
}

fn plane<const C: usize>(map: &Map<C>, format: TextureFormat, bytes: Vec<u8>) -> Texels {
    let (width, height) = (map.width as u32, map.height as u32);
    let dimension = TextureViewDimension::D2;
    Texels { width, height, layers: 1, levels: 1, format, dimension, bytes, clipped: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_beyond_16_bits_are_cut_and_counted() {
        let bright = Cube::from_fn(2, |face, column, row| match (face, column, row) {
            (0, 0, 0) => [7e4, 1.0, 1.0, 1.0],
            (3, 1, 0) => [1.0, 65504.0, 1.0, 1e6],
            (5, 1, 1) => [65504.0; 4],
            _ => [0.5; 4],
        });
        let texels = cube(&bright);
        assert_eq!(texels.clipped, 2);
        let first = f16::from_bits(u16::from_ne_bytes([texels.bytes[0], texels.bytes[1]]));
        assert_eq!(first.to_f32(), 65504.0);
        assert_eq!(faces(&bright).clipped, 0);
    }
}
