//! The parts of a mesh that are not skin (eyes, lashes, hair, cloth), and what they are drawn by: glTF's own materials.

use glam::Vec2;

use super::maps::Map;

/// The parts of a mesh that are not skin.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainParts {
    /// Of each triangle of the mesh the place of its material among `materials`; `None` where it is skin.
    pub of_triangle: Vec<Option<u16>>,
    /// What the others are drawn by.
    pub materials: Vec<PlainMaterial>,
}

/// A metallic-roughness material (glTF 2.0, section 3.9); colours are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainMaterial {
    /// Its name in the file.
    pub name: String,
    /// Colour and alpha.
    pub base_color: [f32; 4],
    /// A factor on them.
    pub color_map: Option<Map<4>>,
    /// How much of a metal it is.
    pub metallic: f32,
    /// The square root of GGX's alpha.
    pub roughness: f32,
    /// Factors: of the roughness in the second channel, of the metal in the third.
    pub roughness_map: Option<Map<4>>,
    /// What its alpha does.
    pub alpha: Alpha,
    /// Radiance of its own.
    pub emission: [f32; 3],
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
}

/// The reflectance of what is no metal (glTF 2.0, appendix B.2).
const DIELECTRIC_F0: f64 = 0.04;
/// A lobe of less is a mirror's, which rays do not find lamps in.
const LEAST_ALPHA: f64 = 1e-3;

impl PlainParts {
    /// The material of a triangle that is not skin.
    #[must_use]
    pub fn material(&self, triangle: u32) -> Option<&PlainMaterial> {
        let place = (*self.of_triangle.get(triangle as usize)?)?;
        self.materials.get(usize::from(place))
    }
}

impl PlainMaterial {
    /// The share of it that is seen at a place of its map: 0 or 1 but where it blends.
    #[must_use]
    pub fn seen(&self, uv: Vec2) -> f32 {
        let alpha = || self.color(uv)[3].clamp(0.0, 1.0);
        match self.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Mask(cutoff) => f32::from(u8::from(alpha() >= cutoff)),
            Alpha::Blend => alpha(),
        }
    }

    /// What it is at a place of its maps.
    #[must_use]
    pub fn at(&self, uv: Vec2) -> PlainSurface {
        let [r, g, b, _] = self.color(uv);
        let base = [r, g, b].map(|c| f64::from(c).clamp(0.0, 1.0));
        let [_, rough, metal, _] = self.roughness_map.as_ref().map_or([1.0; 4], |map| map.sample(uv.x, uv.y));
        let metal = f64::from(self.metallic * metal).clamp(0.0, 1.0);
        let roughness = f64::from(self.roughness * rough).clamp(0.0, 1.0);
        PlainSurface {
            diffuse: base.map(|c| c * (1.0 - metal)),
            f0: base.map(|c| DIELECTRIC_F0 + (c - DIELECTRIC_F0) * metal),
            alpha: (roughness * roughness).max(LEAST_ALPHA),
        }
    }

    fn color(&self, uv: Vec2) -> [f32; 4] {
        let map = self.color_map.as_ref().map_or([1.0; 4], |map| map.sample(uv.x, uv.y));
        std::array::from_fn(|c| self.base_color[c] * map[c])
    }
}
