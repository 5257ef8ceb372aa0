//! Named choices of texture-space diffusion (MODEL 6), each an approximation with an error and a cost.

/// The ways that a scene takes (its `[diffusion]` table).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DiffusionChoices {
    /// How levels are made.
    pub method: Method,
    /// Places that a blur counts along each axis.
    pub taps: Taps,
    /// Along which normal ambient light arrives.
    pub ambient_normal: AmbientNormal,
    /// How far texels lie apart on the surface.
    pub stretch: Stretch,
    /// What blurs find beyond a chart's border.
    pub seams: Seams,
    /// How fragments look levels up.
    pub lookup: Lookup,
    /// Where light is taken that no blur has moved.
    pub unblurred: Unblurred,
    /// Where levels are weighed and added up.
    pub combined: Combined,
}

impl DiffusionChoices {
    /// The article's, but for the stretch, which is exact.
    pub const DEFAULT: Self = Self {
        method: Method::Separable,
        taps: Taps::Five,
        ambient_normal: AmbientNormal::Smooth,
        stretch: Stretch::Exact,
        seams: Seams::Cut,
        lookup: Lookup::Chart,
        unblurred: Unblurred::Map,
        combined: Combined::Pixel,
    };
}

impl Default for DiffusionChoices {
    fn default() -> Self {
        Self::DEFAULT
    }
}

macro_rules! choice {
    ($(#[$about:meta])* $name:ident { $($(#[$of:meta])* $variant:ident = $word:literal),* $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$of])* $variant),*
        }

        impl $name {
            /// Every choice, in the order of documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The name in scene files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word),*
                }
            }
        }
    };
}

choice! {
    /// How levels are made of the light map.
    Method {
        /// Each a blur of the one before, along u and then along v.
        Separable = "separable",
        /// Each by distance over the surface, of the light map at once: the reference.
        Surface = "surface",
    }
}

choice! {
    /// Places that a Gaussian blur counts along each axis.
    Taps {
        /// Five, a standard deviation apart: the article's. Their variance is 0.924 of the Gaussian's.
        Five = "5",
        /// Seven: 0.996 of the variance.
        Seven = "7",
        /// Nine: 0.9999 of the variance.
        Nine = "9",
        /// Every texel within six standard deviations.
        Full = "full",
    }
}

impl Taps {
    /// How many there are; `None` where that depends on the standard deviation.
    #[must_use]
    pub const fn count(self) -> Option<u32> {
        match self {
            Self::Five => Some(5),
            Self::Seven => Some(7),
            Self::Nine => Some(9),
            Self::Full => None,
        }
    }
}

choice! {
    /// Along which normal the light map looks ambient light up.
    AmbientNormal {
        /// The smooth one: the article's, as the map is blurred anyway.
        Smooth = "smooth",
        /// The bumped one.
        Bumped = "bumped",
    }
}

choice! {
    /// How the stretch of the atlas is found.
    Stretch {
        /// By the triangle's own Jacobian.
        Exact = "exact",
        /// By the distance from neighbour to neighbour: the article's.
        Derivative = "derivative",
    }
}

choice! {
    /// What blurs find beyond a chart's border.
    Seams {
        /// Nothing: light does not cross it.
        Cut = "cut",
        /// What lies across it on the surface, where the border of another chart is the same edge.
        Joined = "joined",
    }
}

choice! {
    /// How fragments look levels up.
    Lookup {
        /// Bilinearly among the texels of their own chart.
        Chart = "chart",
        /// By one fetch of a map whose empty texels were filled from their neighbours, two rings deep.
        Dilated = "dilated",
    }
}

choice! {
    /// Where the share of the light is taken that no blur has moved, which has all of what bumps and shadows draw.
    Unblurred {
        /// In the light map, as wide as its texels: the article's.
        Map = "map",
        /// In the pixel, as a scene without diffusion has it.
        Pixel = "pixel",
    }
}

choice! {
    /// Where levels are weighed and added up: lookups are linear, so that either shows the same but
    /// for rounding.
    Combined {
        /// In the pixel, which looks each of them up: the article's. While nothing but weights is fitted, what was found stays.
        Pixel = "pixel",
        /// In texels: the sum is looked up, and with it how that moves, fewer numbers than of all levels.
        Map = "map",
    }
}

impl DiffusionChoices {
    /// Those that a scene file names, each by its table and key.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, &'static str); 8] {
        [
            ("diffusion.method", self.method.name()),
            ("diffusion.taps", self.taps.name()),
            ("diffusion.ambient_normal", self.ambient_normal.name()),
            ("diffusion.stretch", self.stretch.name()),
            ("diffusion.seams", self.seams.name()),
            ("diffusion.lookup", self.lookup.name()),
            ("diffusion.unblurred", self.unblurred.name()),
            ("diffusion.combined", self.combined.name()),
        ]
    }

    /// Whether a condition of a rule holds that names a choice; `None` of any other.
    #[must_use]
    pub fn holds(&self, condition: &str) -> Option<bool> {
        Some(match condition {
            "bumped_ambient" => self.ambient_normal == AmbientNormal::Bumped,
            "surface_levels" => self.method == Method::Surface,
            "unblurred_in_pixel" => self.unblurred == Unblurred::Pixel,
            "combined_in_map" => self.combined == Combined::Map,
            "exact_stretch" => self.stretch == Stretch::Exact,
            _ => return None,
        })
    }
}
