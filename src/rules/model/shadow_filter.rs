//! How a renderer finds what stands in a light's way.

/// How fragments of the renderer find what reaches them of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ShadowFilter {
    /// Rays from the mesh's vertices, interpolated: no map.
    Vertices,
    /// A shadow map, compared at the four texels around a place and blended: what hardware does in one fetch.
    Hardware,
    /// The mean of several such comparisons within a radius (percentage-closer filtering; Reeves, Salesin and Cook 1987).
    #[default]
    Pcf,
    /// The radius follows from how far away the blockers are and how wide the light is (percentage-closer soft shadows;
    /// Fernando 2005).
    Pcss,
}

impl ShadowFilter {
    /// Every filter, in the order of documentation.
    pub const ALL: [Self; 4] = [Self::Vertices, Self::Hardware, Self::Pcf, Self::Pcss];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertices",
            Self::Hardware => "hardware",
            Self::Pcf => "pcf",
            Self::Pcss => "pcss",
        }
    }
}
