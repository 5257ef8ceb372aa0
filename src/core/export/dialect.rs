//! How each shading language spells what the shader rules say in WGSL.

use super::function::is_color;
use super::handed::Handed;
use super::names::{PREFIX, function};
use crate::model::texture_filter::TextureFilter;
use crate::shader::quantity::{Kind, Resource};

/// Families that share most of their grammar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The rules' own language.
    Wgsl,
    /// `vec3`, `mix`, combined samplers.
    Glsl,
    /// `float3`, `lerp`.
    Hlsl,
    /// `float3`, `mix`, textures as arguments.
    Msl,
}

/// A shading language.
#[derive(Clone, Copy, Debug)]
pub struct Dialect {
    /// Its grammar.
    pub family: Family,
    /// What stands before a constant's type.
    pub constant: &'static str,
    /// A bilinear lookup of a 2D map: `{t}` texture, `{s}` sampler, `{c}` coordinates.
    pub map_lookup: &'static str,
    /// One filtered to the fragment, by its mip levels.
    pub mip_map_lookup: &'static str,
    /// A lookup of a cube.
    pub cube_lookup: &'static str,
    /// A texel of a 2D texture at whole coordinates.
    pub texel_load: &'static str,
    /// Declarations of a 2D map, a cube and a sampler: `{n}` name, `{b}` binding, `{h}` what a map of
    /// colours is marked with. Empty: none.
    pub declarations: [&'static str; 3],
    /// The same as parameters of functions, where nothing is global: `{n}` the texture's name. Empty: nothing is handed over.
    pub parameters: [&'static str; 3],
    /// What has the engine decode a map from sRGB.
    pub colour_hint: &'static str,
    /// The names of the samplers of maps and cubes.
    pub samplers: [&'static str; 2],
    /// What says in declarations and samplers' names how maps are filtered, in the order of [`TextureFilter::ALL`]; empty
    /// where what is bound says so.
    pub filters: [&'static str; 3],
    /// The bits of a vector's floats; empty where the language has none, but `isfinite`.
    pub bits: &'static str,
    /// An unsigned number in hexadecimal, `{x}` its digits in capitals; empty: as WGSL has it.
    pub hexadecimal: &'static str,
    /// What stands before the constants and behind them, where a material may have them in place of the text.
    pub around_constants: [&'static str; 2],
    /// Lines that come first.
    pub prologue: &'static str,
    /// Lines that come last.
    pub epilogue: &'static str,
}

/// What most of them share.
const BASE: Dialect = Dialect {
    family: Family::Glsl,
    constant: "const",
    map_lookup: "textureLod({t}, {c}, 0.0)",
    mip_map_lookup: "texture({t}, {c})",
    cube_lookup: "textureLod({t}, {c}, 0.0)",
    texel_load: "texelFetch({t}, {c}, 0)",
    declarations: [""; 3],
    parameters: [""; 3],
    colour_hint: "",
    samplers: ["skinfit_map_sampler", "skinfit_cube_sampler"],
    filters: [""; 3],
    bits: "",
    hexadecimal: "",
    around_constants: [""; 2],
    prologue: "",
    epilogue: "",
};

/// WebGPU's language.
pub const WGSL: Dialect = Dialect {
    family: Family::Wgsl,
    map_lookup: "textureSampleLevel({t}, {s}, {c}, 0.0)",
    mip_map_lookup: "textureSample({t}, {s}, {c})",
    cube_lookup: "textureSampleLevel({t}, {s}, {c}, 0.0)",
    declarations: [
        "@group(0) @binding({b}) var {n}: texture_2d<f32>;",
        "@group(0) @binding({b}) var {n}: texture_cube<f32>;",
        "@group(0) @binding({b}) var {n}: sampler;",
    ],
    bits: "bitcast<vec3u>",
    ..BASE
};

/// OpenGL 4.3, OpenGL ES 3.1 and up.
pub const GLSL: Dialect = Dialect {
    declarations: [
        "layout(binding = {b}) uniform sampler2D {n};",
        "layout(binding = {b}) uniform samplerCube {n};",
        "",
    ],
    bits: "floatBitsToUint",
    ..BASE
};

/// Godot 4, as an include of a spatial shader.
pub const GODOT: Dialect = Dialect {
    declarations: [
        "uniform sampler2D {n} : {h}filter_linear, repeat_enable;",
        "uniform samplerCube {n} : filter_linear;",
        "",
    ],
    colour_hint: "source_color, ",
    filters: [
        "filter_linear, repeat",
        "filter_linear_mipmap, repeat",
        "filter_linear_mipmap_anisotropic, repeat",
    ],
    // Godot 4.0 takes no suffix behind such digits, Godot 3 none in lower case (Godot's issues 78800 and 46507).
    hexadecimal: "uint(0x{x})",
    ..GLSL
};

/// Direct3D 11 and up.
pub const HLSL: Dialect = Dialect {
    family: Family::Hlsl,
    constant: "static const",
    map_lookup: "{t}.SampleLevel({s}, {c}, 0.0)",
    mip_map_lookup: "{t}.Sample({s}, {c})",
    cube_lookup: "{t}.SampleLevel({s}, {c}, 0.0)",
    texel_load: "{t}.Load(int3({c}, 0))",
    declarations: [
        "Texture2D<float4> {n} : register(t{b});",
        "TextureCube<float4> {n} : register(t{b});",
        "SamplerState {n} : register(s{b});",
    ],
    bits: "asuint",
    ..BASE
};

/// Unity, as an include of an HLSLPROGRAM.
pub const UNITY: Dialect = Dialect {
    declarations: ["Texture2D<float4> {n};", "TextureCube<float4> {n};", "SamplerState {n};"],
    samplers: ["skinfit_linear_repeat_sampler", "skinfit_linear_clamp_sampler"],
    filters: ["_linear_repeat", "_trilinear_repeat", "_trilinear_repeat_aniso16"],
    around_constants: ["#ifndef SKINFIT_MATERIAL\n", "#endif\n"],
    prologue: "#ifndef SKINFIT_INCLUDED\n#define SKINFIT_INCLUDED\n",
    epilogue: "\n#endif\n",
    ..HLSL
};

/// Unreal 5, for the *Custom* node of a material (Epic's documentation, "Custom Material Expressions"). Its code is the body of
/// a function, whose arguments the textures are, each with a sampler `NAMESampler`; where nothing can be declared but
/// structs, functions are a struct's, and constants are macros. The same text holds in an include file, too.
pub const UNREAL: Dialect = Dialect {
    constant: "#define",
    map_lookup: "{t}.SampleLevel({t}Sampler, {c}, 0.0)",
    // Unreal's own, which takes a level where a material is compiled for rays and has no derivatives.
    mip_map_lookup: "Texture2DSample({t}, {t}Sampler, {c})",
    cube_lookup: "{t}.SampleLevel({t}Sampler, {c}, 0.0)",
    declarations: [""; 3],
    parameters: ["Texture2D {n}", "TextureCube {n}", "SamplerState {n}Sampler"],
    prologue: "#ifndef SKINFIT_INCLUDED\n#define SKINFIT_INCLUDED\n",
    epilogue: "\n#endif\n",
    ..HLSL
};

/// The paper's language (profiles with `texCUBElod`: fp40, gp4 and up).
pub const CG: Dialect = Dialect {
    map_lookup: "tex2Dlod({t}, float4({c}, 0.0, 0.0))",
    mip_map_lookup: "tex2D({t}, {c})",
    cube_lookup: "texCUBElod({t}, float4({c}, 0.0))",
    texel_load: "tex2Dfetch({t}, int4({c}, 0, 0))",
    declarations: ["uniform sampler2D {n};", "uniform samplerCUBE {n};", ""],
    bits: "",
    ..HLSL
};

/// Metal 2 and up. Textures are arguments of a shader there: a struct holds them and has the functions.
pub const MSL: Dialect = Dialect {
    family: Family::Msl,
    constant: "constant",
    map_lookup: "{t}.sample({s}, {c}, level(0.0))",
    mip_map_lookup: "{t}.sample({s}, {c})",
    cube_lookup: "{t}.sample({s}, {c}, level(0.0))",
    texel_load: "{t}.read(uint2({c}), 0)",
    declarations: ["texture2d<float> {n};", "texturecube<float> {n};", "sampler {n};"],
    bits: "as_type<uint3>",
    prologue: "#include <metal_stdlib>\nusing namespace metal;\n",
    ..BASE
};

impl Dialect {
    /// A type of the rules.
    #[must_use]
    pub fn kind(&self, wgsl: &str) -> String {
        let words = match self.family {
            Family::Wgsl => return wgsl.to_owned(),
            Family::Glsl => ["vec2", "vec3", "vec4", "uvec3", "ivec2"],
            Family::Hlsl | Family::Msl => ["float2", "float3", "float4", "uint3", "int2"],
        };
        match wgsl {
            "f32" => "float".to_owned(),
            "i32" => "int".to_owned(),
            "vec2i" => words[4].to_owned(),
            "vec2f" => words[0].to_owned(),
            "vec3f" => words[1].to_owned(),
            "vec4f" => words[2].to_owned(),
            "vec3u" => words[3].to_owned(),
            other => other.to_owned(),
        }
    }

    /// A built-in function of the rules.
    #[must_use]
    pub fn builtin<'a>(&self, wgsl: &'a str) -> &'a str {
        match (self.family, wgsl) {
            (Family::Hlsl, "mix") => "lerp",
            (Family::Hlsl, "fract") => "frac",
            (Family::Glsl, "dpdx") => "dFdx",
            (Family::Glsl, "dpdy") => "dFdy",
            (Family::Hlsl, "dpdx") => "ddx",
            (Family::Hlsl, "dpdy") => "ddy",
            (Family::Msl, "dpdx") => "dfdx",
            (Family::Msl, "dpdy") => "dfdy",
            _ => wgsl,
        }
    }

    /// A number of the rules.
    #[must_use]
    pub fn number(&self, wgsl: &str) -> String {
        match wgsl.strip_prefix("0x").and_then(|digits| digits.strip_suffix('u')) {
            Some(digits) if !self.hexadecimal.is_empty() => {
                self.hexadecimal.replace("{x}", &digits.to_uppercase())
            }
            _ => wgsl.to_owned(),
        }
    }

    /// A constant's definition.
    #[must_use]
    pub fn definition(&self, name: &str, wgsl: &str, value: &[f64]) -> String {
        let kind = self.kind(wgsl);
        let numbers: Vec<String> = value.iter().map(|x| format!("{x:?}")).collect();
        let value =
            if value.len() == 1 { numbers[0].clone() } else { format!("{kind}({})", numbers.join(", ")) };
        match self.family {
            Family::Wgsl => format!("{} {name}: {kind} = {value};", self.constant),
            _ if self.constant == "#define" => format!("#define {name} {value}"),
            _ => format!("{} {kind} {name} = {value};", self.constant),
        }
    }

    /// A resource's name, by that which it has with the prefix. Unity finds a sampler's filter and wrapping in its name.
    #[must_use]
    pub fn resource<'a>(&self, name: &'a str) -> &'a str {
        match name.strip_prefix(PREFIX) {
            Some("map_sampler") => self.samplers[0],
            Some("cube_sampler") => self.samplers[1],
            _ => name,
        }
    }

    /// Declarations and functions whose maps are filtered that way, of those whose maps are filtered bilinearly.
    #[must_use]
    pub fn filtering(&self, text: &str, filter: TextureFilter) -> String {
        let own = TextureFilter::ALL.into_iter().zip(self.filters).find(|(known, _)| *known == filter);
        match own {
            Some((_, word)) if !word.is_empty() => text.replace(self.filters[0], word),
            _ => text.to_owned(),
        }
    }

    /// The declaration of a level of the UV atlas: a texture that is read texel by texel.
    #[must_use]
    pub fn level(&self, bound: &str, binding: usize) -> String {
        let text = self.declarations[0].replace("{b}", &binding.to_string());
        text.replace("{n}", &function(bound)).replace("{h}filter_linear, repeat_enable", "filter_nearest")
    }

    /// A resource's declaration; empty where it needs none.
    #[must_use]
    pub fn declaration(&self, resource: Resource, binding: usize) -> String {
        let text = match resource.kind() {
            Kind::Cube => self.declarations[1],
            Kind::Sampler => self.declarations[2],
            _ => self.declarations[0],
        };
        let hint = if is_color(resource) { self.colour_hint } else { "" };
        let name = function(resource.name());
        text.replace("{n}", self.resource(&name)).replace("{b}", &binding.to_string()).replace("{h}", hint)
    }

    /// Whether functions take the textures that they read.
    #[must_use]
    pub fn hands_over(&self) -> bool {
        !self.parameters[0].is_empty()
    }

    /// A cube or map, by its name, as functions take it and pass it on.
    #[must_use]
    pub fn handed(&self, name: &str, cube: bool, sampled: bool) -> Handed {
        let name = function(name);
        let [map, of_cube, sampler] = self.parameters.map(|text| text.replace("{n}", &name));
        let texture = if cube { of_cube } else { map };
        if !sampled {
            return Handed { parameters: texture, arguments: name.clone(), name };
        }
        // A sampler's name stands behind its type.
        let own = sampler.split(' ').next_back().unwrap_or_default();
        Handed { arguments: format!("{name}, {own}"), parameters: format!("{texture}, {sampler}"), name }
    }
}
