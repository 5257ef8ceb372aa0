//! Named choices: of several ways to the same quantity, each an approximation with an error and a cost, the one that a
//! scene takes.

/// The ways that a scene takes, the same for every fragment of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Choices {
    /// The specular BRDF.
    pub specular_model: SpecularModel,
    /// How much of the specular lobe is open to the sky.
    pub specular_visibility: SpecularVisibility,
    /// Where the environment is looked up for the specular lobe.
    pub lobe_lookup: LobeLookup,
    /// What the specular map scales.
    pub specular_map: SpecularMap,
    /// Whether the specular map lowers the roughness, or will: `gloss` is not 0.
    pub glossy: bool,
}

/// A specular BRDF (the scene's `specular_model`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SpecularModel {
    /// Beckmann's distribution over |h|^2 (Kelemen and Szirmay-Kalos 2001; GPU Gems 3, chapter 14).
    #[default]
    Kelemen,
    /// GGX with height-correlated masking (Walter et al. 2007, Heitz 2014), alpha the square of the roughness.
    Ggx,
}

impl SpecularModel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Kelemen, Self::Ggx];

    /// Its name in scenes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kelemen => "kelemen",
            Self::Ggx => "ggx",
        }
    }
}

/// How much of the specular lobe is open to the sky (the scene's `specular_visibility`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SpecularVisibility {
    /// All of it.
    None,
    /// By the open share of the hemisphere (Lagarde and de Rousiers 2014).
    #[default]
    Lagarde,
    /// By the overlap of the lobe's cone and that of the open sky about the bent normal (Oat and Sander 2007, Jimenez et
    /// al. 2016).
    Cone,
    /// By rays into the lobe: the reference.
    Lobe,
}

impl SpecularVisibility {
    /// Every choice, in the order of documentation.
    pub const ALL: [Self; 4] = [Self::None, Self::Lagarde, Self::Cone, Self::Lobe];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Lagarde => "lagarde",
            Self::Cone => "cone",
            Self::Lobe => "lobe",
        }
    }
}

/// Where the environment is looked up for the specular lobe (the scene's `lobe_lookup`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LobeLookup {
    /// Along the mirrored view.
    #[default]
    Mirror,
    /// Off the peak, where a rough lobe's mean lies (Lagarde and de Rousiers 2014).
    OffPeak,
}

impl LobeLookup {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Mirror, Self::OffPeak];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mirror => "mirror",
            Self::OffPeak => "off_peak",
        }
    }
}

/// What the specular map scales (the scene's `specular_map`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SpecularMap {
    /// The weight of specular light.
    #[default]
    Weight,
    /// The reflectance f0, from a share of `f0_floor` on.
    F0,
}

impl SpecularMap {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Weight, Self::F0];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Weight => "weight",
            Self::F0 => "f0",
        }
    }
}

impl Choices {
    /// Whether a condition of a rule holds that names a choice; `None` of any other.
    #[must_use]
    pub fn holds(&self, condition: &str) -> Option<bool> {
        let visibility = |choice| self.specular_visibility == choice;
        Some(match condition {
            "kelemen" => self.specular_model == SpecularModel::Kelemen,
            "ggx" => self.specular_model == SpecularModel::Ggx,
            "unoccluded_lobe" => visibility(SpecularVisibility::None),
            "lagarde_visibility" => visibility(SpecularVisibility::Lagarde),
            "cone_visibility" => visibility(SpecularVisibility::Cone),
            "lobe_visibility" => visibility(SpecularVisibility::Lobe),
            "off_peak" => self.lobe_lookup == LobeLookup::OffPeak,
            "f0_map" => self.specular_map == SpecularMap::F0,
            "glossy" => self.glossy,
            _ => return None,
        })
    }

    /// The conditions that [`Self::holds`] knows.
    pub const CONDITIONS: [&'static str; 9] = [
        "kelemen",
        "ggx",
        "unoccluded_lobe",
        "lagarde_visibility",
        "cone_visibility",
        "lobe_visibility",
        "off_peak",
        "f0_map",
        "glossy",
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_condition_is_known() {
        for condition in Choices::CONDITIONS {
            assert!(Choices::default().holds(condition).is_some(), "{condition}");
        }
        assert_eq!(Choices::default().holds("raster"), None);
    }
}
