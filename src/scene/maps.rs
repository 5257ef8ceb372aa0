//! Texture maps and the panorama, as linear numbers.

use glam::DVec3;
use rayon::prelude::*;

use super::map_layout::MapLayout;
use crate::model::fields::Field;

/// This file, for caches of what is made of it.
#[doc(hidden)]
pub const SOURCE: &str = include_str!("maps.rs");

/// An image of `C` linear channels, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Map<const C: usize> {
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// `height x width` texels.
    pub texels: Vec<[f32; C]>,
}

impl<const C: usize> Map<C> {
    /// The bilinear value at texture coordinates (u, v); the image repeats in both directions.
    #[must_use]
    pub fn sample(&self, u: f32, v: f32) -> [f32; C] {
        let ([a, b, c, d], [fx, fy]) = corners(self.width, self.height, u, v);
        let [a, b, c, d] = [a, b, c, d].map(|i| self.texels[i]);
        std::array::from_fn(|i| {
            let top = a[i] * (1.0 - fx) + b[i] * fx;
            let bottom = c[i] * (1.0 - fx) + d[i] * fx;
            top * (1.0 - fy) + bottom * fy
        })
    }
}

/// The four texels around texture coordinates (u, v) of an image that repeats in both directions (left and right
/// above, then below; by `row * width + column`), and the place among them, in [0, 1] to the right and down.
#[must_use]
#[inline]
pub fn corners(width: usize, height: usize, u: f32, v: f32) -> ([usize; 4], [f32; 2]) {
    // In f64, as 24 bits leave too few for the fraction in a map of thousands of texels.
    let at = |u: f32, size: usize| {
        let x = f64::from(u - u.floor()) * size as f64 - 0.5;
        let low = x.floor();
        let wrap = |i: f64| (i as i64).rem_euclid(size as i64) as usize;
        (wrap(low), wrap(low + 1.0), (x - low) as f32)
    };
    let (x0, x1, fx) = at(u, width);
    let (y0, y1, fy) = at(v, height);
    let texel = |x: usize, y: usize| y * width + x;
    ([texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1)], [fx, fy])
}

/// The maps that the enabled effects ask for; a map that the scene leaves out has its neutral value.
#[derive(Clone, Debug, Default)]
pub struct Maps {
    /// Albedo, linear Rec.709 (neutral: 1).
    pub color: Option<Map<3>>,
    /// Tangent-space normals as stored, in [0, 1], +Y up (neutral: (1/2, 1/2, 1)).
    pub normal: Option<Map<3>>,
    /// Side-specular intensity s (neutral: 1).
    pub specular: Option<Map<1>>,
    /// Hilite attenuator a (neutral: 1).
    pub attenuator: Option<Map<1>>,
    /// Those of fields that files of rules declare.
    pub own: Vec<(Field, OwnMap)>,
    /// Where they are looked up as the mesh's own material says: what an engine has to do beside showing its pictures by
    /// the first texture coordinates, if anything.
    pub material: Option<Option<String>>,
    /// How they are laid out where the material's pictures are mirrored or end: the skin's texture coordinates are moved with
    /// them.
    pub layout: Option<MapLayout>,
}

/// The map of a field.
#[derive(Clone, Debug, PartialEq)]
pub enum OwnMap {
    /// Of one number: an image's first channel as it is stored.
    Scalar(Map<1>),
    /// Of three: an image's colour, linear Rec.709.
    Color(Map<3>),
}

impl Maps {
    /// Whether nothing is looked up.
    #[must_use]
    pub fn are_none(&self) -> bool {
        let Self { color, normal, specular, attenuator, own, .. } = self;
        let built_in = color.is_some() || normal.is_some() || specular.is_some() || attenuator.is_some();
        !built_in && own.is_empty()
    }

    /// The map of a field of one number.
    #[must_use]
    pub fn scalar(&self, field: Field) -> Option<&Map<1>> {
        match self.of(field)? {
            OwnMap::Scalar(map) => Some(map),
            OwnMap::Color(_) => None,
        }
    }

    /// The map of a field of three.
    #[must_use]
    pub fn colored(&self, field: Field) -> Option<&Map<3>> {
        match self.of(field)? {
            OwnMap::Color(map) => Some(map),
            OwnMap::Scalar(_) => None,
        }
    }

    /// Have every texel of the normal map a unit normal, so that only what lies between texels shortens a mean of them.
    /// The direction stays; a texel without one stays as it is.
    pub fn normalise_normals(&mut self) {
        let Some(map) = &mut self.normal else { return };
        map.texels.par_iter_mut().for_each(|texel| {
            let normal = DVec3::from(texel.map(|x| 2.0 * f64::from(x) - 1.0));
            if let Some(unit) = normal.try_normalize() {
                *texel = unit.to_array().map(|x| (0.5 * x + 0.5) as f32);
            }
        });
    }

    fn of(&self, field: Field) -> Option<&OwnMap> {
        self.own.iter().find(|(of, _)| *of == field).map(|(_, map)| map)
    }
}

/// The environment of a scene.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Lat-long radiance: the centre is -Z, the right quarter +X, the top row +Y.
    pub panorama: Map<3>,
    /// Turn about +Y by the right-hand rule, degrees.
    pub rotation_degrees: f64,
    /// Factor on the radiance.
    pub intensity: f64,
    /// What of it becomes lights of their own.
    pub spots: Spots,
}

/// The brightest spots of a panorama, to be taken out as directional lights
/// ([`sky_lights`](super::sky_lights)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spots {
    /// How many, at most.
    pub count: u32,
    /// The angle around its middle, degrees, within which all light is a spot's.
    pub degrees: f64,
}

impl Default for Spots {
    fn default() -> Self {
        Self { count: 0, degrees: 4.0 }
    }
}

/// Rec.709 luminance.
#[must_use]
pub fn luminance(rgb: [f32; 3]) -> f32 {
    let [r, g, b] = rgb.map(f64::from);
    // In f64 and with weights that sum to exactly 1, so that grey 1 has luminance 1.
    (0.2126 * r + 0.7152 * g + 0.0722 * b) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_become_units_along_their_direction_where_they_have_one() {
        let encoded = |normal: [f32; 3]| normal.map(|x| 0.5 * x + 0.5);
        let texels = vec![encoded([0.3, 0.0, 0.4]), [0.5; 3], [f32::NAN; 3], encoded([0.0, 0.0, 1.0])];
        let mut maps =
            Maps { normal: Some(Map { width: 2, height: 2, texels: texels.clone() }), ..Maps::default() };
        maps.normalise_normals();
        let made = maps.normal.unwrap().texels;
        let off =
            made[0].iter().zip(encoded([0.6, 0.0, 0.8])).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // Roundings of f32.
        assert!(off < 1e-6, "{:?}", made[0]);
        assert_eq!([made[1], made[3]], [texels[1], texels[3]]);
        assert!(made[2].iter().all(|x| x.is_nan()));
        Maps::default().normalise_normals();
    }
}
