//! The languages and formats that constants are exported to.

use super::dialect::{self, Dialect};

/// Where constants go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// WebGPU.
    Wgsl,
    /// OpenGL and Vulkan.
    Glsl,
    /// Direct3D.
    Hlsl,
    /// The paper's language.
    Cg,
    /// Metal.
    Msl,
    /// A C header.
    C,
    /// Data.
    Json,
    /// Data.
    Toml,
    /// Godot 4.
    Godot,
    /// Unity.
    Unity,
    /// Unreal 5.
    Unreal,
}

impl Target {
    /// Every target, in the order of documentation.
    pub const ALL: [Self; 11] = [
        Self::Wgsl,
        Self::Glsl,
        Self::Hlsl,
        Self::Cg,
        Self::Msl,
        Self::C,
        Self::Json,
        Self::Toml,
        Self::Godot,
        Self::Unity,
        Self::Unreal,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Cg => "cg",
            Self::Msl => "msl",
            Self::C => "c",
            Self::Json => "json",
            Self::Toml => "toml",
            Self::Godot => "godot",
            Self::Unity => "unity",
            Self::Unreal => "unreal",
        }
    }

    /// The target of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.name() == name)
    }

    /// The shading language; `None` where only constants can be held.
    #[must_use]
    pub const fn dialect(self) -> Option<&'static Dialect> {
        match self {
            Self::Wgsl => Some(&dialect::WGSL),
            Self::Glsl => Some(&dialect::GLSL),
            Self::Hlsl => Some(&dialect::HLSL),
            Self::Cg => Some(&dialect::CG),
            Self::Msl => Some(&dialect::MSL),
            Self::Godot => Some(&dialect::GODOT),
            Self::Unity => Some(&dialect::UNITY),
            Self::Unreal => Some(&dialect::UNREAL),
            Self::C | Self::Json | Self::Toml => None,
        }
    }

    /// What opens a comment's line; JSON has none.
    #[must_use]
    pub const fn comment(self) -> &'static str {
        match self {
            Self::Toml => "#",
            Self::Json => "",
            _ => "//",
        }
    }
}
