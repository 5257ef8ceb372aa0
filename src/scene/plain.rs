//! The parts of a mesh that are not skin (eyes, lashes, hair, cloth), and what they are drawn by: glTF's own materials.

use std::sync::Arc;

use glam::Vec2;

use super::maps::Map;

/// This file, for caches of what is made of it.
#[doc(hidden)]
pub const SOURCE: &str = include_str!("plain.rs");

/// The parts of a mesh that are not skin.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainParts {
    /// Of each triangle of the mesh the place of its material among `materials`; `None` where it is skin.
    pub of_triangle: Vec<Option<u16>>,
    /// What the others are drawn by.
    pub materials: Vec<PlainMaterial>,
    /// Factors on the base colour at the corners of each triangle, linear, with alpha; empty where all are 1.
    pub corner_colors: Vec<[[f32; 4]; 3]>,
}

/// A metallic-roughness material (glTF 2.0, section 3.9); colours are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainMaterial {
    /// Its name in the file.
    pub name: String,
    /// Colour and alpha.
    pub base_color: [f32; 4],
    /// A factor on them.
    pub color_map: Option<PlainMap>,
    /// How much of a metal it is.
    pub metallic: f32,
    /// The square root of GGX's alpha.
    pub roughness: f32,
    /// Factors: of the roughness in the second channel, of the metal in the third.
    pub roughness_map: Option<PlainMap>,
    /// What its alpha does.
    pub alpha: Alpha,
    /// Radiance of its own.
    pub emission: [f32; 3],
    /// A factor on it.
    pub emission_map: Option<PlainMap>,
}

/// A picture of a material, and how it is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainMap {
    /// The picture; parts of a mesh may share one.
    pub map: Arc<Map<4>>,
    /// What lies beyond its borders along u and v.
    pub wrap: [Wrap; 2],
    /// Whether its texels are seen as squares.
    pub nearest: bool,
}

/// What lies beyond a picture's borders (glTF 2.0, section 5.26).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// The picture again, mirrored each second time.
    Mirror,
    /// Its texels at the border.
    Clamp,
}

/// What a material's alpha does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Nothing.
    Opaque,
    /// Below this there is a hole.
    Mask(f32),
    /// It is the share that is seen of it.
    Blend,
}

/// A material at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlainSurface {
    /// Diffuse albedo.
    pub diffuse: [f64; 3],
    /// Reflectance when facing.
    pub f0: [f64; 3],
    /// GGX's alpha.
    pub alpha: f64,
    /// Radiance of its own.
    pub emission: [f64; 3],
}

/// The reflectance of what is no metal (glTF 2.0, appendix B.2).
const DIELECTRIC_F0: f64 = 0.04;
/// A lobe of less is a mirror's, which rays do not find lamps in.
const LEAST_ALPHA: f64 = 1e-3;

impl PlainSurface {
    /// Schlick's reflectance, by the cosine between view and half vector.
    #[must_use]
    #[inline]
    pub fn fresnel(&self, v_h: f64) -> [f64; 3] {
        let grazing = (1.0 - v_h.clamp(0.0, 1.0)).powi(5);
        self.f0.map(|f0| f0 + (1.0 - f0) * grazing)
    }

    /// The share of light that it throws back as seen from in front: what is reflected, and what enters and leaves again.
    #[must_use]
    #[inline]
    pub fn thrown_back(&self) -> [f64; 3] {
        let diffuse = self.diffuse_towards(1.0);
        std::array::from_fn(|c| (self.f0[c] + diffuse[c]).min(1.0))
    }

    /// The diffuse albedo of what enters by that reflectance (glTF 2.0, appendix B.2: of what is no metal).
    #[must_use]
    #[inline]
    pub fn diffuse_towards(&self, v_h: f64) -> [f64; 3] {
        let grazing = (1.0 - v_h.clamp(0.0, 1.0)).powi(5);
        self.diffuse.map(|c| c * (1.0 - DIELECTRIC_F0) * (1.0 - grazing))
    }
}

impl Alpha {
    /// The share that is seen where it is this: 0 or 1 but where it blends.
    #[must_use]
    #[inline]
    pub fn seen(self, alpha: impl FnOnce() -> f32) -> f32 {
        match self {
            Self::Opaque => 1.0,
            Self::Mask(cutoff) => f32::from(u8::from(alpha().clamp(0.0, 1.0) >= cutoff)),
            Self::Blend => alpha().clamp(0.0, 1.0),
        }
    }
}

impl PlainParts {
    /// The material of a triangle that is not skin.
    #[must_use]
    #[inline]
    pub fn material(&self, triangle: u32) -> Option<&PlainMaterial> {
        let place = (*self.of_triangle.get(triangle as usize)?)?;
        self.materials.get(usize::from(place))
    }

    /// Whether a triangle has holes or blends.
    #[must_use]
    pub fn is_open(&self, triangle: u32) -> bool {
        self.material(triangle).is_some_and(PlainMaterial::is_open)
    }

    /// The factor on a material's base colour at a place of a triangle, by the weights of its corners.
    #[must_use]
    #[inline]
    pub fn tint(&self, triangle: u32, weights: [f32; 3]) -> [f32; 4] {
        self.corner_colors.get(triangle as usize).map_or([1.0; 4], |corners| {
            std::array::from_fn(|c| (0..3).map(|i| weights[i] * corners[i][c]).sum())
        })
    }
}

impl PlainMap {
    /// The picture at texture coordinates.
    #[must_use]
    #[inline]
    pub fn sample(&self, uv: Vec2) -> [f32; 4] {
        let at = |i: usize, size: usize| {
            // Half a texel from the border the filter reads no other.
            let texel = 1.0 / size as f32;
            let place = match self.wrap[i] {
                Wrap::Repeat => uv[i] - uv[i].floor(),
                Wrap::Mirror => 1.0 - (uv[i].rem_euclid(2.0) - 1.0).abs(),
                Wrap::Clamp => uv[i],
            };
            let place = if self.nearest { ((place * size as f32).floor() + 0.5) * texel } else { place };
            match self.wrap[i] {
                Wrap::Repeat => place,
                Wrap::Mirror | Wrap::Clamp => place.clamp(0.5 * texel, 1.0 - 0.5 * texel),
            }
        };
        self.map.sample(at(0, self.map.width), at(1, self.map.height))
    }
}

impl PlainMaterial {
    /// Whether it has holes or blends.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.alpha != Alpha::Opaque
    }

    /// The share of it that is seen at a place of its map, where the mesh has that `tint`: 0 or 1 but where it blends.
    #[must_use]
    #[inline]
    pub fn seen(&self, uv: Vec2, tint: [f32; 4]) -> f32 {
        self.alpha.seen(|| self.color((uv, tint))[3])
    }

    /// What it is at a place of its maps, where the mesh has that `tint`.
    #[must_use]
    #[inline]
    pub fn at(&self, uv: Vec2, tint: [f32; 4]) -> PlainSurface {
        let [r, g, b, _] = self.color((uv, tint));
        let base = [r, g, b].map(|c| f64::from(c).clamp(0.0, 1.0));
        let [_, rough, metal, _] = self.roughness_map.as_ref().map_or([1.0; 4], |map| map.sample(uv));
        let metal = f64::from(self.metallic * metal).clamp(0.0, 1.0);
        let roughness = f64::from(self.roughness * rough).clamp(0.0, 1.0);
        let glow = self.emission_map.as_ref().map_or([1.0; 4], |map| map.sample(uv));
        PlainSurface {
            diffuse: base.map(|c| c * (1.0 - metal)),
            f0: base.map(|c| DIELECTRIC_F0 + (c - DIELECTRIC_F0) * metal),
            alpha: (roughness * roughness).max(LEAST_ALPHA),
            emission: std::array::from_fn(|c| f64::from(self.emission[c] * glow[c]).max(0.0)),
        }
    }

    #[inline]
    fn color(&self, (uv, tint): (Vec2, [f32; 4])) -> [f32; 4] {
        let map = self.color_map.as_ref().map_or([1.0; 4], |map| map.sample(uv));
        std::array::from_fn(|c| self.base_color[c] * map[c] * tint[c])
    }
}
