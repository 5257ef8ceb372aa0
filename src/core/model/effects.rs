//! What can be switched on, and what each effect asks for: nothing else is loaded or baked.

use std::fmt;

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

/// One switchable part of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Effect {
    /// Albedo times irradiance.
    Diffuse,
    /// Tangent-space normal map; without it n is the smooth normal.
    NormalMap,
    /// Ambient occlusion; without it everything is open.
    Occlusion,
    /// The diffuse rim weight; without it only `base_weight` is left of the diffuse factor.
    Rim,
    /// Specular map times the specular cube along the normal.
    SideSpecular,
    /// Back light seen through the rim: the hilite cube along the view vector.
    Hilite,
    /// The specular cube along the reflection vector, dappled.
    Reflection,
    /// The reflection's alpha to the output alpha.
    Haze,
    /// A blur pass over alpha-weighted colour, driven by the haze.
    Bloom,
    /// The paper's second version: one key light gives the bump map's contribution.
    KeyLight,
    /// Morph targets.
    Morph,
    /// Skinning by bones.
    Skin,
}

impl Effect {
    /// Every effect, in the order of documentation.
    pub const ALL: [Self; 12] = [
        Self::Diffuse,
        Self::NormalMap,
        Self::Occlusion,
        Self::Rim,
        Self::SideSpecular,
        Self::Hilite,
        Self::Reflection,
        Self::Haze,
        Self::Bloom,
        Self::KeyLight,
        Self::Morph,
        Self::Skin,
    ];

    /// The name in scene files and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::NormalMap => "normal_map",
            Self::Occlusion => "occlusion",
            Self::Rim => "rim",
            Self::SideSpecular => "side_specular",
            Self::Hilite => "hilite",
            Self::Reflection => "reflection",
            Self::Haze => "haze",
            Self::Bloom => "bloom",
            Self::KeyLight => "key_light",
            Self::Morph => "morph",
            Self::Skin => "skin",
        }
    }

    /// The effect of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.name() == name)
    }
}

/// A set of enabled effects.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Effects(u16);

impl Effects {
    /// What a scene gets when it names no effects: the paper's fragment program.
    pub const SURFACE: Self = Self::of(&[
        Effect::Diffuse,
        Effect::NormalMap,
        Effect::Occlusion,
        Effect::Rim,
        Effect::SideSpecular,
        Effect::Hilite,
        Effect::Reflection,
    ]);

    /// The set of the listed effects.
    #[must_use]
    pub const fn of(effects: &[Effect]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < effects.len() {
            bits |= 1 << effects[i] as u16;
            i += 1;
        }
        Self(bits)
    }

    /// Whether `effect` is enabled.
    #[must_use]
    pub const fn has(self, effect: Effect) -> bool {
        self.0 & (1 << effect as u16) != 0
    }

    /// Whether any of `effects` is enabled.
    #[must_use]
    pub fn has_any(self, effects: &[Effect]) -> bool {
        effects.iter().any(|&effect| self.has(effect))
    }

    /// This set and `effect`.
    #[must_use]
    pub const fn with(self, effect: Effect) -> Self {
        Self(self.0 | 1 << effect as u16)
    }

    /// This set without `effect`.
    #[must_use]
    pub const fn without(self, effect: Effect) -> Self {
        Self(self.0 & !(1 << effect as u16))
    }

    /// The enabled effects in the order of documentation.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |&e| self.has(e))
    }

    /// What the enabled effects ask for, with the silhouette evaluated as `silhouette` says.
    #[must_use]
    pub fn needs(self, silhouette: Silhouette) -> Needs {
        use Effect as E;
        let reflection = self.has_any(&[E::Reflection, E::Haze, E::Bloom]);
        // The silhouette S.z is only asked for by what it multiplies.
        let rim = self.has(E::Hilite) || (self.has(E::Diffuse) && self.has(E::Rim));
        let shaded_by_n = self.has_any(&[E::Diffuse, E::SideSpecular, E::KeyLight])
            || reflection
            || (rim && silhouette == Silhouette::Bumped);
        let normal_map = self.has(E::NormalMap) && shaded_by_n;
        let albedo = self.has_any(&[E::Diffuse, E::KeyLight]);
        let attenuator = self.has_any(&[E::Hilite, E::Haze, E::Bloom]);
        Needs {
            color_map: albedo,
            normal_map,
            specular_map: self.has(E::SideSpecular),
            attenuator_map: attenuator,
            tangents: normal_map,
            irradiance: self.has(E::Diffuse),
            lobes: self.has(E::SideSpecular) || reflection,
            hilite: self.has(E::Hilite),
            occlusion: self.has(E::Occlusion) && self.has_any(&[E::Diffuse, E::Hilite]),
            rim,
            dapple: reflection,
            haze: self.has_any(&[E::Haze, E::Bloom]),
            key_light: self.has(E::KeyLight),
        }
    }
}

impl fmt::Debug for Effects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter().map(Effect::name)).finish()
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(iter: I) -> Self {
        iter.into_iter().fold(Self::default(), Self::with)
    }
}

/// What a set of effects asks of the stages before the model (MODEL section "Effects").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Needs {
    /// The colour map (sRGB).
    pub color_map: bool,
    /// The tangent-space normal map.
    pub normal_map: bool,
    /// The side-specular intensity map.
    pub specular_map: bool,
    /// The hilite attenuator map.
    pub attenuator_map: bool,
    /// Vertex tangents.
    pub tangents: bool,
    /// The irradiance cube `E_d`.
    pub irradiance: bool,
    /// The stack of Phong-lobe cubes `E_s`.
    pub lobes: bool,
    /// The hilite cube `E_h`.
    pub hilite: bool,
    /// Ambient occlusion.
    pub occlusion: bool,
    /// The silhouette term S.z.
    pub rim: bool,
    /// The dapple term S.w.
    pub dapple: bool,
    /// The output's alpha.
    pub haze: bool,
    /// The key light's direction and colour.
    pub key_light: bool,
}

impl Needs {
    /// Whether any map is sampled, and so texture coordinates are needed.
    #[must_use]
    pub const fn maps(self) -> bool {
        self.color_map || self.normal_map || self.specular_map || self.attenuator_map
    }

    /// Whether any cube map is looked up, and so an environment is needed.
    #[must_use]
    pub const fn environment(self) -> bool {
        self.irradiance || self.lobes || self.hilite
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_an_effect_off_never_asks_for_more() {
        let count = |needs: Needs| format!("{needs:?}").matches("true").count();
        for bits in 0..(1_u16 << Effect::ALL.len()) {
            let set = Effects(bits);
            for silhouette in Silhouette::ALL {
                let all = count(set.needs(silhouette));
                for effect in set.iter() {
                    assert!(count(set.without(effect).needs(silhouette)) <= all);
                }
            }
        }
    }

    #[test]
    fn names_are_unique_and_found_again() {
        for effect in Effect::ALL {
            assert_eq!(Effect::from_name(effect.name()), Some(effect));
        }
    }
}
