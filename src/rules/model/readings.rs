//! The paper's readings: which form of its listings, where the silhouette is evaluated, along which normal cubes are
//! looked up.

/// Which of the two readings of the paper's listings is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Form {
    /// Listing 3-4 as printed, oddities kept.
    Listing,
    /// The oddities mended: decoded and normalised normals, a mirror reflection, a base weight.
    #[default]
    Corrected,
}

impl Form {
    /// Every form, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Listing, Self::Corrected];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Listing => "listing",
            Self::Corrected => "corrected",
        }
    }

    /// The silhouette that a scene gets when it names none.
    #[must_use]
    pub const fn default_silhouette(self) -> Silhouette {
        match self {
            Self::Listing => Silhouette::Vertex,
            Self::Corrected => Silhouette::Fragment,
        }
    }
}

/// Where `S.z = 1 - |N.V|` is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Silhouette {
    /// Per vertex, then interpolated (the paper: cheap, and wrong inside large triangles).
    Vertex,
    /// Per fragment, from the interpolated and re-normalised smooth normal.
    Fragment,
    /// Per fragment, from the bumped normal, so that pores catch the rim.
    Bumped,
}

impl Silhouette {
    /// Every choice, in the order of documentation.
    pub const ALL: [Self; 3] = [Self::Vertex, Self::Fragment, Self::Bumped];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Fragment => "fragment",
            Self::Bumped => "bumped",
        }
    }
}

/// Along which normal the cubes are looked up, and what is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Lookups {
    /// The normal-mapped n (the paper's listings).
    #[default]
    Bumped,
    /// The smooth N, of unit length: bumps show under the key light alone (the paper's second version).
    Smooth,
}

impl Lookups {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Bumped, Self::Smooth];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bumped => "bumped",
            Self::Smooth => "smooth",
        }
    }
}
