//! What effects ask of the stages before the model: maps, cubes, what samples hold.

use super::fields::Fields;

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
    /// The stack of cubes `E_r` over the roughness.
    pub reflected: bool,
    /// Ambient occlusion.
    pub occlusion: bool,
    /// The silhouette term S.z.
    pub rim: bool,
    /// The dapple term S.w.
    pub dapple: bool,
    /// The output's alpha.
    pub haze: bool,
    /// The smooth normal, beside the bumped one.
    pub smooth_normal: bool,
    /// The key light's direction and colour.
    pub key_light: bool,
    /// The texture coordinates of an atlas in whose texels something is computed.
    pub atlas: bool,
    /// Numbers of each vertex beside position and frame.
    pub fields: Fields,
}

impl Needs {
    /// What either asks for.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            color_map: self.color_map || other.color_map,
            normal_map: self.normal_map || other.normal_map,
            specular_map: self.specular_map || other.specular_map,
            attenuator_map: self.attenuator_map || other.attenuator_map,
            tangents: self.tangents || other.tangents,
            irradiance: self.irradiance || other.irradiance,
            lobes: self.lobes || other.lobes,
            hilite: self.hilite || other.hilite,
            reflected: self.reflected || other.reflected,
            occlusion: self.occlusion || other.occlusion,
            rim: self.rim || other.rim,
            dapple: self.dapple || other.dapple,
            haze: self.haze || other.haze,
            smooth_normal: self.smooth_normal || other.smooth_normal,
            key_light: self.key_light || other.key_light,
            atlas: self.atlas || other.atlas,
            fields: self.fields.or(other.fields),
        }
    }

    /// Whether any map is sampled, and so texture coordinates are needed.
    #[must_use]
    pub fn maps(self) -> bool {
        let own = || self.fields.iter().any(|field| field.map().is_some());
        self.color_map || self.normal_map || self.specular_map || self.attenuator_map || own()
    }

    /// Whether any cube map is looked up, and so an environment is needed.
    #[must_use]
    pub const fn environment(self) -> bool {
        self.irradiance || self.lobes || self.hilite || self.reflected
    }
}
