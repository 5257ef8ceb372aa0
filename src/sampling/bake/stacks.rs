//! Which cube of which stack rules look up at given parameters.

use super::Illumination;
use crate::model::cube::Cube;
use crate::model::params::{Param, Params};
use crate::specular::{SMOOTHEST, glossy_paces, roughness_of};

/// A stack of cubes over a lobe's sharpness, and where rules look it up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stack {
    /// E_s at `specular_lobe`.
    Specular,
    /// E_r at the roughness where the specular map is black.
    Reflected,
    /// E_r at the roughness where it is white.
    Glossy,
}

/// What rules read of a stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The light.
    Light,
    /// How it moves with the sharpness' parameter.
    Slope,
}

impl Stack {
    /// Every stack.
    pub const ALL: [Self; 3] = [Self::Specular, Self::Reflected, Self::Glossy];

    /// What a resource's name in rules stands for, where it is of a stack.
    #[must_use]
    pub fn named(resource: &str) -> Option<(Self, Content)> {
        Some(match resource {
            "specular_faces" => (Self::Specular, Content::Light),
            "specular_slope_faces" => (Self::Specular, Content::Slope),
            "reflected_faces" => (Self::Reflected, Content::Light),
            "reflected_slope_faces" => (Self::Reflected, Content::Slope),
            "glossy_faces" => (Self::Glossy, Content::Light),
            "glossy_slope_faces" => (Self::Glossy, Content::Slope),
            _ => return None,
        })
    }

    /// The stacks that resources of these names are of.
    #[must_use]
    pub fn read(resources: &[String]) -> Vec<Self> {
        let of =
            |stack: &Self| resources.iter().any(|name| Self::named(name).is_some_and(|(of, _)| of == *stack));
        Self::ALL.into_iter().filter(of).collect()
    }

    /// The exponent or the roughness that it is looked up at.
    #[must_use]
    pub fn place(self, params: &Params) -> f64 {
        match self {
            Self::Specular => params.scalar(Param::SpecularLobe),
            Self::Reflected => params.scalar_named("roughness").max(SMOOTHEST),
            Self::Glossy => roughness_of(params.scalar_named("roughness"), params.scalar_named("gloss"), 1.0),
        }
    }

    /// How fast that moves with each parameter that moves it, by their names.
    #[must_use]
    pub fn paces(self, params: &Params) -> Vec<(&'static str, f64)> {
        match self {
            Self::Specular => vec![(Param::SpecularLobe.name(), 1.0)],
            Self::Reflected => vec![("roughness", 1.0)],
            Self::Glossy => ["roughness", "gloss"].into_iter().zip(glossy_paces(params)).collect(),
        }
    }

    /// The cube at such a place, and its slope; `None` where it was not baked.
    #[must_use]
    pub fn at(self, light: &Illumination, place: f64) -> Option<(Cube<f32>, Cube<f32>)> {
        match self {
            Self::Specular => light.lobes.as_ref().map(|stack| stack.at(place)),
            Self::Reflected | Self::Glossy => light.reflected.as_ref().map(|stack| stack.at(place)),
        }
    }
}
