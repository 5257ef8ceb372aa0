//! Where the renderer shades.

/// Where the renderer shades. The images are the same but for rounding and the steps that mip maps are chosen by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shading {
    /// In the fragment stage, as each triangle is drawn: what an engine does that takes an export.
    Forward,
    /// In a compute shader, once a sample, after the rasteriser found which triangle each shows. Where a card has more
    /// processors than its rasteriser feeds it is several times as fast. Multisampling, rules that sample
    /// textures by the adapter's own steps and devices that bind too little are forward all the same.
    #[default]
    VisibilityBuffer,
}

impl Shading {
    /// Every way.
    pub const ALL: [Self; 2] = [Self::Forward, Self::VisibilityBuffer];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::VisibilityBuffer => "visibility_buffer",
        }
    }

    /// The one of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|shading| shading.name() == name)
    }
}
