//! The shader rules' WGSL in another language. The rules use little of WGSL (functions, `let` with a type,
//! `select`, vectors, lookups), so that a translation word by word keeps their text and comments.

use super::dialect::{Dialect, Family};

/// Functions and structs of the rules, in `dialect`.
pub(super) fn translate(dialect: &Dialect, wgsl: &str) -> String {
    if dialect.family == Family::Wgsl {
        return wgsl.to_owned();
    }
    Translation { dialect, rest: wgsl, text: String::new() }.run()
}

struct Translation<'a> {
    dialect: &'a Dialect,
    rest: &'a str,
    text: String,
}

impl<'a> Translation<'a> {
    fn run(mut self) -> String {
        while let Some(first) = self.rest.chars().next() {
            if self.rest.starts_with("//") {
                let end = self.rest.find('\n').unwrap_or(self.rest.len());
                let comment = self.take(end);
                self.text.push_str(comment);
            } else if first.is_ascii_alphabetic() || first == '_' {
                self.word();
            } else if first.is_ascii_digit() {
                // A number is no word, though it may hold letters (0x7f800000u, 1e-37).
                let end = self.rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(self.rest.len());
                let number = self.take(end);
                self.text.push_str(&self.dialect.number(number));
            } else {
                let other = self.take(first.len_utf8());
                self.text.push_str(other);
            }
        }
        self.text
    }

    fn take(&mut self, end: usize) -> &'a str {
        let (taken, rest) = self.rest.split_at(end);
        self.rest = rest;
        taken
    }

    fn take_to(&mut self, end: &str) -> &'a str {
        let at = self.rest.find(end).unwrap_or(self.rest.len());
        let taken = self.take(at);
        self.rest = self.rest.strip_prefix(end).unwrap_or(self.rest);
        taken
    }

    fn word(&mut self) {
        let word =
            self.rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(self.rest.len());
        let word = self.take(word);
        match word {
            "fn" => self.signature(),
            "struct" => self.fields(),
            "let" | "var" => {
                let name = self.take_to(": ").trim();
                let kind = self.take_to(" = ");
                self.text.push_str(&format!("{} {name} = ", self.dialect.kind(kind)));
            }
            "bitcast" => {
                self.take_to(">");
                let [bits] = self.arguments().try_into().unwrap_or_default();
                self.text.push_str(&format!("{}({bits})", self.dialect.bits));
            }
            _ if self.rest.starts_with('(') => self.call(word),
            _ => self.text.push_str(&self.dialect.kind(word)),
        }
    }

    /// `fn name(a: A, b: B) -> C` as `C name(A a, B b)`.
    fn signature(&mut self) {
        let name = self.take_to("(").trim();
        let parameters = self.take_to(")");
        self.take_to("-> ");
        let kind = self.dialect.kind(self.take_to(" {"));
        let parameters: Vec<String> = parameters
            .split(',')
            .filter_map(|parameter| parameter.trim().split_once(": "))
            .map(|(name, kind)| format!("{} {name}", self.dialect.kind(kind)))
            .collect();
        // Of one line each, as WGSL's long ones are broken with a comma at their end.
        self.text.push_str(&format!("{kind} {name}({}) {{", parameters.join(", ")));
        if name.ends_with("is_finite") && self.dialect.bits.is_empty() {
            self.take_to("\n}");
            self.text.push_str("\n    return all(isfinite(v));\n}");
        }
    }

    /// The fields of a struct: `a: A,` as `A a;`.
    fn fields(&mut self) {
        let head = self.take_to("{\n");
        self.text.push_str(&format!("struct{head}{{\n"));
        for field in self.take_to("}").lines() {
            if let Some((name, kind)) = field.trim().trim_end_matches(',').split_once(": ") {
                self.text.push_str(&format!("    {} {name};\n", self.dialect.kind(kind)));
            }
        }
        self.text.push_str("};");
    }

    fn call(&mut self, function: &str) {
        let arguments = self.arguments();
        let text = match (function, arguments.as_slice()) {
            ("select", [no, yes, condition]) => format!("({condition} ? {yes} : {no})"),
            ("textureSampleLevel", [texture, sampler, at, _]) => {
                let cube = texture.ends_with("_cube");
                let lookup = if cube { self.dialect.cube_lookup } else { self.dialect.map_lookup };
                let sampler = self.dialect.resource(sampler);
                lookup.replace("{t}", texture).replace("{s}", sampler).replace("{c}", at)
            }
            ("textureSample", [texture, sampler, at]) => {
                let sampler = self.dialect.resource(sampler);
                let lookup = self.dialect.mip_map_lookup;
                lookup.replace("{t}", texture).replace("{s}", sampler).replace("{c}", at)
            }
            ("textureLoad", [texture, at, _]) => {
                self.dialect.texel_load.replace("{t}", texture).replace("{c}", at)
            }
            // HLSL has no vector of one number repeated.
            ("vec3f" | "vec3u", [one]) if self.dialect.family == Family::Hlsl => {
                format!("{}({one}, {one}, {one})", self.dialect.kind(function))
            }
            _ => {
                let name = self.dialect.kind(function);
                format!("{}({})", self.dialect.builtin(&name), arguments.join(", "))
            }
        };
        self.text.push_str(&text);
    }

    /// What stands in the parentheses that follow, translated, argument by argument.
    fn arguments(&mut self) -> Vec<String> {
        let mut depth = 0_usize;
        let mut arguments = Vec::new();
        let mut start = 1;
        for (at, c) in self.rest.char_indices() {
            match c {
                '(' => depth += 1,
                ')' => depth -= 1,
                _ => {}
            }
            if depth == 0 || (depth == 1 && c == ',') {
                let argument = self.rest[start..at].trim();
                if !argument.is_empty() {
                    let part = Translation { dialect: self.dialect, rest: argument, text: String::new() };
                    arguments.push(part.run());
                }
                start = at + 1;
            }
            if depth == 0 {
                break;
            }
        }
        self.take(start);
        arguments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::dialect::{CG, GLSL, GODOT, HLSL, MSL, WGSL};

    const RULE: &str = "// Of S.z.\nfn rim_power(\n    z: f32,\n    e: vec3f,\n) -> f32 {\n    let ok: bool = z >= 1.2e-38;\n    return select(select(1.0, 0.0, e.x > 0.0), exp2(z), ok);\n}\n";

    #[test]
    fn functions_keep_their_comments_and_gain_types() {
        let glsl = translate(&GLSL, RULE);
        let want = "// Of S.z.\nfloat rim_power(float z, vec3 e) {\n    bool ok = z >= 1.2e-38;\n    return (ok ? exp2(z) : (e.x > 0.0 ? 0.0 : 1.0));\n}\n";
        assert_eq!(glsl, want);
        assert_eq!(translate(&HLSL, RULE), want.replace("vec3", "float3"));
        assert_eq!(translate(&WGSL, RULE), RULE);
    }

    #[test]
    fn lookups_bits_and_repeated_numbers_are_spelled_as_each_language_does() {
        let lookup = "textureSampleLevel(hilite_cube, cube_sampler, d, 0.0).rgb";
        assert_eq!(translate(&GLSL, lookup), "textureLod(hilite_cube, d, 0.0).rgb");
        assert_eq!(translate(&MSL, lookup), "hilite_cube.sample(cube_sampler, d, level(0.0)).rgb");
        assert_eq!(translate(&CG, lookup), "texCUBElod(hilite_cube, float4(d, 0.0)).rgb");
        let filtered = "textureSample(color_map, map_sampler, vertex_uv).rgb";
        assert_eq!(translate(&GLSL, filtered), "texture(color_map, vertex_uv).rgb");
        assert_eq!(translate(&CG, filtered), "tex2D(color_map, vertex_uv).rgb");
        let bits = "bitcast<vec3u>(v) & vec3u(0x7f800000u)";
        assert_eq!(translate(&GLSL, bits), "floatBitsToUint(v) & uvec3(0x7f800000u)");
        assert_eq!(translate(&GODOT, bits), "floatBitsToUint(v) & uvec3(uint(0x7F800000))");
        assert_eq!(translate(&HLSL, bits), "asuint(v) & uint3(0x7f800000u, 0x7f800000u, 0x7f800000u)");
        assert_eq!(
            translate(&CG, "fn is_finite(v: vec3f) -> bool {\n    let b: f32 = 1.0;\n}\n"),
            "bool is_finite(float3 v) {\n    return all(isfinite(v));\n}\n"
        );
        assert_eq!(
            translate(&HLSL, "struct Surface {\n    uv: vec2f,\n}\n"),
            "struct Surface {\n    float2 uv;\n};\n"
        );
    }
}
