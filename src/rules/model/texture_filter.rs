//! How texture maps are filtered.

/// How a sample or fragment looks a texture map up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum TextureFilter {
    /// Between the four nearest texels of the finest level, however many the sample covers.
    #[default]
    Bilinear,
    /// Between two levels of a mip pyramid, whose texels are as large as the sample is long (Williams 1983).
    Trilinear,
    /// As `Trilinear` at up to sixteen places along the sample, whose levels are as fine as it is narrow.
    Anisotropic,
}

impl TextureFilter {
    /// Every filter, in the order of documentation.
    pub const ALL: [Self; 3] = [Self::Bilinear, Self::Trilinear, Self::Anisotropic];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bilinear => "bilinear",
            Self::Trilinear => "trilinear",
            Self::Anisotropic => "anisotropic",
        }
    }

    /// The most places along a sample at which it looks a map up.
    #[must_use]
    pub const fn most_taps(self) -> u16 {
        match self {
            Self::Bilinear | Self::Trilinear => 1,
            Self::Anisotropic => 16,
        }
    }

    /// Whether it reads coarser levels than the finest.
    #[must_use]
    pub const fn reads_levels(self) -> bool {
        !matches!(self, Self::Bilinear)
    }
}
