//! How many samples a pixel has, and where they lie.

/// The most samples along a pixel's side.
pub const MAX_GRID: u32 = 8;

/// Samples a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Antialias {
    /// n x n shaded samples at the centres of a pixel's strata: the CPU's sample positions.
    Grid(u32),
    /// The hardware's multisampling: coverage at four places, shaded once a pixel and triangle.
    Msaa4,
}

impl Antialias {
    /// The one of that name: `none`, `msaa4` or `2x2` (1x1 to 8x8).
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "none" => Some(Self::Grid(1)),
            "msaa4" => Some(Self::Msaa4),
            _ => {
                let (across, down) = name.split_once('x')?;
                let n: u32 = across.parse().ok()?;
                (across == down && (1..=MAX_GRID).contains(&n)).then_some(Self::Grid(n))
            }
        }
    }

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Grid(n) => format!("{n}x{n}"),
            Self::Msaa4 => "msaa4".to_owned(),
        }
    }

    /// Shaded samples along a pixel's side.
    #[must_use]
    pub const fn grid(self) -> u32 {
        match self {
            Self::Grid(n) => n,
            Self::Msaa4 => 1,
        }
    }

    /// Samples of the hardware's multisampling.
    #[must_use]
    pub const fn multisamples(self) -> u32 {
        match self {
            Self::Grid(_) => 1,
            Self::Msaa4 => 4,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_again_and_others_are_not() {
        for antialias in [Antialias::Grid(1), Antialias::Grid(8), Antialias::Msaa4] {
            assert_eq!(Antialias::from_name(&antialias.name()), Some(antialias));
        }
        assert_eq!(Antialias::from_name("none"), Some(Antialias::Grid(1)));
        for odd in ["0x0", "9x9", "2x3", "2", "msaa8", "x", ""] {
            assert_eq!(Antialias::from_name(odd), None, "{odd}");
        }
    }
}
