//! Levels of the atlas, and its axes.

use crate::shader::search::components;

/// The ending of levels whose empty texels were filled.
const DILATED: &str = "_dilated";
/// That of what a blur leaves along u, which nobody reads but its second direction.
const HALF: &str = "_along_u";

/// A texture of the atlas: a quantity of its texels, or one that is blurred along u alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// Its name; bound as `NAME_level`.
    pub name: String,
    /// The quantity's WGSL type: an `f32`, `vec2f` or `vec3f`.
    pub kind: &'static str,
}

impl Level {
    pub(super) fn new(name: impl Into<String>, kind: &'static str) -> Self {
        Self { name: name.into(), kind }
    }

    /// Its name as it is bound.
    #[must_use]
    pub fn bound(&self) -> String {
        format!("{}_level", self.name)
    }

    /// The same, its empty texels filled for lookups by one fetch.
    pub(super) fn dilated(&self) -> Self {
        Self::new(format!("{}{DILATED}", self.name), self.kind)
    }

    /// The quantity that a fragment finds there.
    pub(in crate::shader) fn quantity(&self) -> &str {
        self.name.strip_suffix(DILATED).unwrap_or(&self.name)
    }

    /// What a blur of a quantity leaves along u.
    pub(super) fn half_of(quantity: &str, kind: &'static str) -> Self {
        Self::new(format!("{quantity}{HALF}"), kind)
    }

    /// Whether a level of that name is such a half.
    #[must_use]
    pub fn is_half(name: &str) -> bool {
        name.ends_with(HALF)
    }

    /// How it moves where one of its numbers does, as WGSL of its type.
    #[must_use]
    pub fn unit(&self, component: usize) -> String {
        let number = |c| if c == component { "1.0" } else { "0.0" };
        let numbers: Vec<&str> = (0..components(self.kind)).map(number).collect();
        format!("{}({})", self.kind, numbers.join(", "))
    }

    /// The components of a texel that hold it.
    pub(super) fn swizzle(&self) -> &'static str {
        match self.kind {
            "f32" => "x",
            "vec2f" => "xy",
            _ => "xyz",
        }
    }
}

/// Along which axis of the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// From left to right.
    U,
    /// From top to bottom.
    V,
}

impl Axis {
    /// The other one.
    pub(super) const fn across(self) -> Self {
        match self {
            Self::U => Self::V,
            Self::V => Self::U,
        }
    }

    /// From a texel to its neighbour, as WGSL.
    pub(super) const fn step(self) -> &'static str {
        match self {
            Self::U => "vec2i(1, 0)",
            Self::V => "vec2i(0, 1)",
        }
    }
}
