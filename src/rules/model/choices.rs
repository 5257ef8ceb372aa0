//! Named choices: of several ways to the same quantity, each an approximation with an error and a cost, the one that a
//! scene takes.

use super::diffusion::DiffusionChoices;
use super::transmission::TransmissionChoices;

/// The ways that a scene takes, the same for every fragment of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Choices {
    /// The specular BRDF.
    pub specular_model: SpecularModel,
    /// What of a constant environment the specular lobe gives back.
    pub split_sum: SplitSum,
    /// How much of the specular lobe is open to the sky.
    pub specular_visibility: SpecularVisibility,
    /// Where the environment is looked up for the specular lobe.
    pub lobe_lookup: LobeLookup,
    /// What the specular map scales.
    pub specular_map: SpecularMap,
    /// What becomes of bumps that are smaller than what a sample covers.
    pub normal_filter: NormalFilter,
    /// How the sky that a point sees is found.
    pub visibility: Visibility,
    /// How light counts that the skin throws back.
    pub bounces: Bounces,
    /// What the specular lobe sees where it does not see the sky.
    pub skin_reflection: SkinReflection,
    /// Those of texture-space diffusion.
    pub diffusion: DiffusionChoices,
    /// Those of light that comes through the skin.
    pub transmission: TransmissionChoices,
    /// Whether the specular map lowers the roughness, or will: `gloss` is not 0.
    pub glossy: bool,
    /// Whether a fit turns the environment: what vertices found of it has to know how it moves.
    pub turning: bool,
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

/// By which Fresnel factor the environment is reflected (the scene's `split_sum`). With [`SpecularModel::Kelemen`]
/// both are the same: its factor is Schlick's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SplitSum {
    /// By Schlick's: linear in f0.
    #[default]
    Schlick,
    /// By the model's own.
    Exact,
}

impl SplitSum {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::Schlick, Self::Exact];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Schlick => "schlick",
            Self::Exact => "exact",
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
    /// By the overlap of the lobe's cone and that of the open sky about the bent normal (Oat and Sander 2007, Jimenez
    /// et al. 2016).
    Cone,
    /// By rays into the lobe, which tell its open share.
    Lobe,
    /// The light itself is that along rays into the lobe: the reference.
    Rays,
}

impl SpecularVisibility {
    /// Every choice, in the order of documentation.
    pub const ALL: [Self; 5] = [Self::None, Self::Lagarde, Self::Cone, Self::Lobe, Self::Rays];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Lagarde => "lagarde",
            Self::Cone => "cone",
            Self::Lobe => "lobe",
            Self::Rays => "rays",
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

/// What becomes of bumps that are smaller than what a sample covers (the scene's `normal_filter`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NormalFilter {
    /// The specular lobe is as wide as that of one bump: of many only their mean normal is seen.
    #[default]
    None,
    /// It is widened by how far their normals are apart, which how short their mean is tells (Toksvig, *Mipmapping
    /// normal maps*, 2005).
    Toksvig,
}

impl NormalFilter {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::None, Self::Toksvig];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Toksvig => "toksvig",
        }
    }
}

/// How the sky that a point sees is found (the scene's `visibility`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Visibility {
    /// By the open share of the hemisphere, whatever light comes from there.
    Scalar,
    /// As a cone of that share about the bent normal.
    Cone,
    /// By transfer vectors of two bands of spherical harmonics (Sloan, Kautz and Snyder 2002).
    Sh2,
    /// Of three bands.
    Sh3,
    /// Of four bands.
    #[default]
    Sh4,
    /// Of five bands.
    Sh5,
    /// Of six bands.
    Sh6,
    /// By rays from every sample: the reference.
    Rays,
}

impl Visibility {
    /// Every choice, in the order of documentation.
    pub const ALL: [Self; 8] =
        [Self::Scalar, Self::Cone, Self::Sh2, Self::Sh3, Self::Sh4, Self::Sh5, Self::Sh6, Self::Rays];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Cone => "cone",
            Self::Sh2 => "sh2",
            Self::Sh3 => "sh3",
            Self::Sh4 => "sh4",
            Self::Sh5 => "sh5",
            Self::Sh6 => "sh6",
            Self::Rays => "rays",
        }
    }

    /// How many bands of spherical harmonics it is by, where it is by these alone.
    #[must_use]
    pub const fn bands(self) -> Option<usize> {
        match self {
            Self::Scalar | Self::Cone | Self::Rays => None,
            Self::Sh2 => Some(2),
            Self::Sh3 => Some(3),
            Self::Sh4 => Some(4),
            Self::Sh5 => Some(5),
            Self::Sh6 => Some(6),
        }
    }
}

/// How light counts that the skin throws back at itself (the scene's `bounces`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Bounces {
    /// Not at all.
    None,
    /// By a polynomial of the open share and the albedo (Jimenez et al. 2016).
    Polynomial,
    /// Gathered over the mesh, in two rounds.
    #[default]
    Gathered,
}

impl Bounces {
    /// Every choice, in the order of documentation.
    pub const ALL: [Self; 3] = [Self::None, Self::Polynomial, Self::Gathered];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Polynomial => "polynomial",
            Self::Gathered => "gathered",
        }
    }
}

/// What the specular lobe sees where it does not see the sky (the scene's `skin_reflection`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SkinReflection {
    /// Nothing: it is black there.
    None,
    /// The skin that the point sees on average, lit by what [`Bounces::Gathered`] gathers.
    #[default]
    Gathered,
}

impl SkinReflection {
    /// Both choices, in the order of documentation.
    pub const ALL: [Self; 2] = [Self::None, Self::Gathered];

    /// The name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Gathered => "gathered",
        }
    }
}

impl Choices {
    /// Those that a scene file names, each by its key.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, &'static str); 18] {
        let [method, taps, ambient_normal, stretch, seams, lookup, unblurred, combined] =
            self.diffusion.named();
        let [through] = self.transmission.named();
        [
            ("specular_model", self.specular_model.name()),
            ("split_sum", self.split_sum.name()),
            ("specular_visibility", self.specular_visibility.name()),
            ("lobe_lookup", self.lobe_lookup.name()),
            ("specular_map", self.specular_map.name()),
            ("normal_filter", self.normal_filter.name()),
            ("visibility", self.visibility.name()),
            ("bounces", self.bounces.name()),
            ("skin_reflection", self.skin_reflection.name()),
            method,
            taps,
            ambient_normal,
            stretch,
            seams,
            lookup,
            unblurred,
            combined,
            through,
        ]
    }

    /// Whether a condition of a rule holds that names a choice; `None` of any other.
    #[must_use]
    pub fn holds(&self, condition: &str) -> Option<bool> {
        let visibility = |choice| self.specular_visibility == choice;
        Some(match condition {
            "kelemen" => self.specular_model == SpecularModel::Kelemen,
            "ggx" => self.specular_model == SpecularModel::Ggx,
            "exact_split_sum" => self.split_sum == SplitSum::Exact,
            "unoccluded_lobe" => visibility(SpecularVisibility::None),
            "lagarde_visibility" => visibility(SpecularVisibility::Lagarde),
            "cone_visibility" => visibility(SpecularVisibility::Cone),
            // With light by rays too a rasteriser wants the share, which has no rays for either.
            "lobe_visibility" => visibility(SpecularVisibility::Lobe) || visibility(SpecularVisibility::Rays),
            "off_peak" => self.lobe_lookup == LobeLookup::OffPeak,
            "f0_map" => self.specular_map == SpecularMap::F0,
            "toksvig" => self.normal_filter == NormalFilter::Toksvig,
            "polynomial_bounces" => self.bounces == Bounces::Polynomial,
            "gathered_bounces" => self.bounces == Bounces::Gathered,
            "glossy" => self.glossy,
            other => return self.diffusion.holds(other),
        })
    }

    /// The conditions that [`Self::holds`] knows.
    pub const CONDITIONS: [&'static str; 18] = [
        "kelemen",
        "ggx",
        "exact_split_sum",
        "unoccluded_lobe",
        "lagarde_visibility",
        "cone_visibility",
        "lobe_visibility",
        "off_peak",
        "f0_map",
        "toksvig",
        "polynomial_bounces",
        "gathered_bounces",
        "glossy",
        "bumped_ambient",
        "surface_levels",
        "unblurred_in_pixel",
        "combined_in_map",
        "exact_stretch",
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
