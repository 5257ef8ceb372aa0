//! What shaders read: vertex attributes, bound resources and uniform constants. Everything else is a
//! quantity that rules give.

use super::term;
use crate::model::effects::Effects;
use crate::model::fields::Field;
use crate::model::params::Param;

/// A vertex attribute; in WGSL `rest_position` and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Attribute {
    /// Position at rest: `vec3f`.
    Position,
    /// Normal at rest: `vec3f`.
    Normal,
    /// Tangent at rest, handedness in w: `vec4f`.
    Tangent,
    /// Texture coordinates: `vec2f`.
    Uv,
    /// Texture coordinates of the UV atlas' own: `vec2f`.
    AtlasUv,
    /// Open share of the hemisphere at rest: `f32`.
    Occlusion,
    /// Indices of four bones: `vec4u`.
    Joints,
    /// Weights of four bones: `vec4f`.
    Weights,
    /// Which corner of its triangle it is, a unit vector for each of the three: `vec3f`. A mesh has it where triangles
    /// share no vertices.
    Corner,
    /// The chart of the UV atlas that it is of, counted from 1: `f32`.
    Chart,
    /// Numbers that a file of rules has declared, by the name that it gives them.
    Field(Field),
}

impl Attribute {
    /// The built-in attributes.
    pub const BUILT_IN: [Self; 10] = [
        Self::Position,
        Self::Normal,
        Self::Tangent,
        Self::Uv,
        Self::AtlasUv,
        Self::Occlusion,
        Self::Joints,
        Self::Weights,
        Self::Corner,
        Self::Chart,
    ];

    /// The attributes that a vertex may have with these effects.
    pub fn all(effects: Effects) -> impl Iterator<Item = Self> {
        let of_vertices = term::fields(effects).iter().filter(|field| field.map().is_none());
        Self::BUILT_IN.into_iter().chain(of_vertices.map(Self::Field))
    }

    /// The quantity's name in rules.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "rest_position",
            Self::Normal => "rest_normal",
            Self::Tangent => "rest_tangent",
            Self::Uv => "rest_uv",
            Self::AtlasUv => "rest_atlas_uv",
            Self::Occlusion => "rest_occlusion",
            Self::Joints => "joints",
            Self::Weights => "joint_weights",
            Self::Corner => "corner",
            Self::Chart => "rest_chart",
            Self::Field(field) => field.info().attribute,
        }
    }

    /// Its WGSL type.
    #[must_use]
    pub fn wgsl(self) -> &'static str {
        match self {
            Self::Position | Self::Normal | Self::Corner => "vec3f",
            Self::Tangent | Self::Weights => "vec4f",
            Self::Uv | Self::AtlasUv => "vec2f",
            Self::Occlusion | Self::Chart => "f32",
            Self::Joints => "vec4u",
            Self::Field(field) => field.wgsl(),
        }
    }

    /// Bytes a vertex, as they are uploaded (32-bit components).
    #[must_use]
    pub fn bytes(self) -> u64 {
        match self {
            Self::Position | Self::Normal | Self::Corner => 12,
            Self::Tangent | Self::Weights | Self::Joints => 16,
            Self::Uv | Self::AtlasUv => 8,
            Self::Occlusion | Self::Chart => 4,
            Self::Field(field) => 4 * field.info().numbers as u64,
        }
    }
}

/// Something that is bound in group 0; the constants are binding 0, then each resource of the plan in
/// its order.
///
/// *Texels* are read one by one and filtered in the shader, in f32, as the CPU does; *maps* and *cubes*
/// are filtered by the hardware's samplers (8 bits of fraction).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Resource {
    /// E_d: six padded faces, `texture_2d_array<f32>`, 32-bit float RGBA.
    IrradianceFaces,
    /// E_s at the current `specular_lobe`, likewise.
    SpecularFaces,
    /// d E_s / d specular_lobe, likewise; only for fits.
    SpecularSlopeFaces,
    /// E_h, likewise.
    HiliteFaces,
    /// E_r at the current roughness where the specular map is black, likewise.
    ReflectedFaces,
    /// d E_r / d roughness there, likewise; only for fits.
    ReflectedSlopeFaces,
    /// E_r at the current roughness where the specular map is white, likewise.
    GlossyFaces,
    /// d E_r / d roughness there, likewise; only for fits.
    GlossySlopeFaces,
    /// E_d as `texture_cube<f32>`, 16-bit float RGBA.
    IrradianceCube,
    /// E_s at the current `specular_lobe`, likewise.
    SpecularCube,
    /// E_h, likewise.
    HiliteCube,
    /// E_r at the current roughness where the specular map is black, likewise.
    ReflectedCube,
    /// E_r at the current roughness where the specular map is white, likewise.
    GlossyCube,
    /// Colour map, linear, 32-bit float RGBA; `texture_2d<f32>`.
    ColorTexels,
    /// Normal map as stored in [0, 1], 32-bit float RGBA.
    NormalTexels,
    /// Specular map s, 32-bit float R.
    SpecularTexels,
    /// Attenuator map a, 32-bit float R.
    AttenuatorTexels,
    /// Colour map with the specular map in alpha, 32-bit float RGBA; maps of one size only.
    ColorSpecularTexels,
    /// Normal map with the attenuator map in alpha, likewise.
    NormalAttenuatorTexels,
    /// Colour map, 8-bit sRGB RGBA, filterable.
    ColorMap,
    /// Normal map, 8-bit RGBA.
    NormalMap,
    /// Specular map s, 8-bit R.
    SpecularMap,
    /// Attenuator map a, 8-bit R.
    AttenuatorMap,
    /// Colour map (8-bit sRGB) with the specular map in alpha; maps of one size only.
    ColorSpecularMap,
    /// Normal map with the attenuator map in alpha (8-bit RGBA).
    NormalAttenuatorMap,
    /// Repeating, for maps: bilinear, or between their levels as the scene's `texture_filter` says.
    MapSampler,
    /// Bilinear, for cubes.
    CubeSampler,
    /// `array<vec4f>`: for each active target and vertex (target-major), position delta and, in w,
    /// occlusion delta; then normal delta.
    MorphDeltas,
    /// `array<vec4f>`: for each bone three rows of its affine map, then three of what it does to normals.
    Bones,
    /// How deep each light sees: `texture_depth_2d_array`, near / distance or the like: greater is nearer.
    ShadowMaps,
    /// Whether a depth is no further than those, blended over four texels: `sampler_comparison`.
    ShadowSampler,
    /// `array<vec4f>`: for each layer of the maps the rows that `rules/lib/shadow.wgsl` lists.
    ShadowViews,
    /// The map of a field that a file of rules declares, linear, 32-bit float R or RGBA.
    OwnTexels(Field),
    /// The same in 16-bit floats, filterable.
    OwnMap(Field),
}

/// How a resource is declared in WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `texture_2d_array<f32>` of six padded faces; not filterable.
    Faces,
    /// `texture_cube<f32>`, filterable.
    Cube,
    /// `texture_2d<f32>`; not filterable.
    Texels,
    /// `texture_2d<f32>`, filterable.
    Map,
    /// `sampler`, filtering.
    Sampler,
    /// Read-only storage of the vertex stage, `array<vec4f>`.
    Storage,
    /// Read-only storage of the fragment stage, `array<vec4f>`.
    Rows,
    /// `texture_depth_2d_array`, for comparisons and single texels.
    Depth,
    /// `sampler_comparison`.
    Comparison,
}

impl Kind {
    /// The WGSL address space and type.
    #[must_use]
    pub const fn wgsl(self) -> (&'static str, &'static str) {
        match self {
            Self::Faces => ("var", "texture_2d_array<f32>"),
            Self::Cube => ("var", "texture_cube<f32>"),
            Self::Texels | Self::Map => ("var", "texture_2d<f32>"),
            Self::Sampler => ("var", "sampler"),
            Self::Storage | Self::Rows => ("var<storage, read>", "array<vec4f>"),
            Self::Depth => ("var", "texture_depth_2d_array"),
            Self::Comparison => ("var", "sampler_comparison"),
        }
    }
}

impl Resource {
    /// Every resource: the built-in ones, and the maps of fields that files of rules have declared.
    pub fn all() -> impl Iterator<Item = Self> {
        let mapped = Field::all().filter(|field| field.map().is_some());
        Self::BUILT_IN
            .into_iter()
            .chain(mapped.flat_map(|field| [Self::OwnTexels(field), Self::OwnMap(field)]))
    }

    /// Faces that have as many texels: all of a stack have, wherever they stand in it, and their slopes.
    #[must_use]
    pub const fn sized_as(self) -> Self {
        match self {
            Self::SpecularSlopeFaces => Self::SpecularFaces,
            Self::ReflectedSlopeFaces | Self::GlossyFaces | Self::GlossySlopeFaces => Self::ReflectedFaces,
            own => own,
        }
    }

    /// Those that every scene may have.
    pub const BUILT_IN: [Self; 32] = [
        Self::IrradianceFaces,
        Self::SpecularFaces,
        Self::SpecularSlopeFaces,
        Self::HiliteFaces,
        Self::ReflectedFaces,
        Self::ReflectedSlopeFaces,
        Self::GlossyFaces,
        Self::GlossySlopeFaces,
        Self::IrradianceCube,
        Self::SpecularCube,
        Self::HiliteCube,
        Self::ReflectedCube,
        Self::GlossyCube,
        Self::ColorTexels,
        Self::NormalTexels,
        Self::SpecularTexels,
        Self::AttenuatorTexels,
        Self::ColorSpecularTexels,
        Self::NormalAttenuatorTexels,
        Self::ColorMap,
        Self::NormalMap,
        Self::SpecularMap,
        Self::AttenuatorMap,
        Self::ColorSpecularMap,
        Self::NormalAttenuatorMap,
        Self::MapSampler,
        Self::CubeSampler,
        Self::MorphDeltas,
        Self::Bones,
        Self::ShadowMaps,
        Self::ShadowSampler,
        Self::ShadowViews,
    ];

    /// Its name in WGSL.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OwnTexels(field) => field.map().map_or("", |names| names.texels),
            Self::OwnMap(field) => field.map().map_or("", |names| names.filtered),
            Self::IrradianceFaces => "irradiance_faces",
            Self::SpecularFaces => "specular_faces",
            Self::SpecularSlopeFaces => "specular_slope_faces",
            Self::HiliteFaces => "hilite_faces",
            Self::ReflectedFaces => "reflected_faces",
            Self::ReflectedSlopeFaces => "reflected_slope_faces",
            Self::GlossyFaces => "glossy_faces",
            Self::GlossySlopeFaces => "glossy_slope_faces",
            Self::IrradianceCube => "irradiance_cube",
            Self::SpecularCube => "specular_cube",
            Self::HiliteCube => "hilite_cube",
            Self::ReflectedCube => "reflected_cube",
            Self::GlossyCube => "glossy_cube",
            Self::ColorTexels => "color_texels",
            Self::NormalTexels => "normal_texels",
            Self::SpecularTexels => "specular_texels",
            Self::AttenuatorTexels => "attenuator_texels",
            Self::ColorSpecularTexels => "color_specular_texels",
            Self::NormalAttenuatorTexels => "normal_attenuator_texels",
            Self::ColorMap => "color_map",
            Self::NormalMap => "normal_map",
            Self::SpecularMap => "specular_map",
            Self::AttenuatorMap => "attenuator_map",
            Self::ColorSpecularMap => "color_specular_map",
            Self::NormalAttenuatorMap => "normal_attenuator_map",
            Self::MapSampler => "map_sampler",
            Self::CubeSampler => "cube_sampler",
            Self::MorphDeltas => "morph_deltas",
            Self::Bones => "bones",
            Self::ShadowMaps => "shadow_maps",
            Self::ShadowSampler => "shadow_sampler",
            Self::ShadowViews => "shadow_views",
        }
    }

    /// How it is declared.
    #[must_use]
    pub const fn kind(self) -> Kind {
        match self {
            Self::IrradianceFaces
            | Self::SpecularFaces
            | Self::SpecularSlopeFaces
            | Self::HiliteFaces
            | Self::ReflectedFaces
            | Self::ReflectedSlopeFaces
            | Self::GlossyFaces
            | Self::GlossySlopeFaces => Kind::Faces,
            Self::IrradianceCube
            | Self::SpecularCube
            | Self::HiliteCube
            | Self::ReflectedCube
            | Self::GlossyCube => Kind::Cube,
            Self::ColorTexels
            | Self::NormalTexels
            | Self::SpecularTexels
            | Self::AttenuatorTexels
            | Self::ColorSpecularTexels
            | Self::NormalAttenuatorTexels
            | Self::OwnTexels(_) => Kind::Texels,
            Self::ColorMap
            | Self::NormalMap
            | Self::SpecularMap
            | Self::AttenuatorMap
            | Self::ColorSpecularMap
            | Self::NormalAttenuatorMap
            | Self::OwnMap(_) => Kind::Map,
            Self::MapSampler | Self::CubeSampler => Kind::Sampler,
            Self::MorphDeltas | Self::Bones => Kind::Storage,
            Self::ShadowMaps => Kind::Depth,
            Self::ShadowSampler => Kind::Comparison,
            Self::ShadowViews => Kind::Rows,
        }
    }
}

/// A member of the uniform block, binding 0 of group 0; in WGSL `constants.NAME`.
///
/// Every constant but a matrix or an array takes one `vec4f` (16 bytes), so that the block's layout is a
/// plain sum of sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Constant {
    /// A parameter of the model: rgb in xyz, or the scalar in x.
    Param(Param),
    /// World position of the eye, in xyz.
    Eye,
    /// World to clip space: `mat4x4f`, column by column.
    ViewProjection,
    /// Cosine and sine of `environment_rotation`, in xy.
    Turn,
    /// Unit vector towards the key light, in xyz.
    KeyDirection,
    /// Its derivative by `key_azimuth`, a degree, in xyz; only for fits.
    KeyByAzimuth,
    /// Its derivative by `key_elevation`, a degree, in xyz; only for fits.
    KeyByElevation,
    /// How fast the roughness where the specular map is white moves with `roughness` and with `gloss`, in xy; only for
    /// fits.
    GlossyPaces,
    /// A weight for each active morph target, in x of `array<vec4f, N>`.
    MorphWeights,
}

impl Constant {
    /// Those that are not parameters of the model.
    pub const OWN: [Self; 8] = [
        Self::Eye,
        Self::ViewProjection,
        Self::Turn,
        Self::KeyDirection,
        Self::KeyByAzimuth,
        Self::KeyByElevation,
        Self::GlossyPaces,
        Self::MorphWeights,
    ];

    /// The constant of that name in rules.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::OWN
            .into_iter()
            .find(|c| c.name() == name)
            .or_else(|| Param::from_identifier(name).map(Self::Param))
    }

    /// Its name in rules and in WGSL.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Param(param) => param.identifier(),
            Self::Eye => "eye",
            Self::ViewProjection => "view_projection",
            Self::Turn => "turn",
            Self::KeyDirection => "key_direction",
            Self::KeyByAzimuth => "key_by_azimuth",
            Self::KeyByElevation => "key_by_elevation",
            Self::GlossyPaces => "glossy_paces",
            Self::MorphWeights => "morph_weights",
        }
    }
}
