//! What a tensor may stand for.

use crate::shader::quantity::Resource;

/// What a tensor may stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Input {
    /// The free columns of the model's parameters.
    Columns,
    /// Albedo at each sample, three numbers.
    Albedo,
    /// Specular map at each sample.
    Specular,
    /// Attenuator map at each sample.
    Attenuator,
    /// Open share of the hemisphere at each sample.
    Open,
    /// The normal map's part along T and B at each sample, three numbers.
    Bump,
    /// E_d's texels with their border, RGBA.
    Irradiance,
    /// E_s's texels with their border, RGBA.
    Lobe,
    /// E_h's texels with their border, RGBA.
    Hilite,
    /// E_r's texels with their border where the specular map is black, RGBA.
    Reflected,
    /// E_r's texels with their border where it is white, RGBA.
    Glossy,
    /// What each sample looks up of the UV atlas, level by level.
    Levels,
}

/// How many inputs there are.
pub const INPUTS: usize = Input::ALL.len();

impl Input {
    /// Every input.
    pub const ALL: [Self; 12] = [
        Self::Columns,
        Self::Albedo,
        Self::Specular,
        Self::Attenuator,
        Self::Open,
        Self::Bump,
        Self::Irradiance,
        Self::Lobe,
        Self::Hilite,
        Self::Reflected,
        Self::Glossy,
        Self::Levels,
    ];

    /// The name in messages; of a sample's field, that of the quantity too.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Columns => "columns",
            Self::Albedo => "albedo",
            Self::Specular => "specular",
            Self::Attenuator => "attenuator",
            Self::Open => "open",
            Self::Bump => "bump",
            Self::Irradiance => "irradiance",
            Self::Lobe => "lobe",
            Self::Hilite => "hilite",
            Self::Reflected => "reflected",
            Self::Glossy => "glossy",
            Self::Levels => "levels",
        }
    }

    /// The cube's faces, for those that are cubes.
    #[must_use]
    pub const fn faces(self) -> Option<Resource> {
        match self {
            Self::Irradiance => Some(Resource::IrradianceFaces),
            Self::Lobe => Some(Resource::SpecularFaces),
            Self::Hilite => Some(Resource::HiliteFaces),
            Self::Reflected => Some(Resource::ReflectedFaces),
            Self::Glossy => Some(Resource::GlossyFaces),
            _ => None,
        }
    }

    /// How many numbers a sample has of it, for those that are a sample's fields.
    #[must_use]
    pub const fn width(self) -> Option<usize> {
        match self {
            Self::Albedo | Self::Bump => Some(3),
            Self::Specular | Self::Attenuator | Self::Open => Some(1),
            _ => None,
        }
    }

    pub(super) fn of_field(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|input| input.width().is_some() && input.name() == name)
    }
}
