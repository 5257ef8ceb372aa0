//! Named choices of light that comes through the skin (MODEL 11).

/// How far light comes beyond which nothing is left of it, in millimetres: 80 lengths (MODEL 11) of the longest that a
/// parameter may be, 50 mm.
pub const FARTHEST: f64 = 4000.0;

/// The ways that a scene takes (its `[transmission]` table).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct TransmissionChoices {
    /// How far lights travel inside.
    pub method: Method,
}

/// How the renderer finds how far a light travels inside. Samples have it by rays, and the environment's way is baked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// By rays from the vertices, interpolated.
    #[default]
    Thickness,
    /// From the light's shadow map (Dachsbacher and Stamminger 2003, Translucent Shadow Maps).
    ShadowMaps,
}

impl Method {
    /// Both, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Thickness, Self::ShadowMaps];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Thickness => "thickness",
            Self::ShadowMaps => "shadow_maps",
        }
    }
}

impl TransmissionChoices {
    /// Those that a scene file names, each by its table and key.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, &'static str); 1] {
        [("transmission.method", self.method.name())]
    }
}
