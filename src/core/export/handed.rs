//! Textures that are handed from function to function, for a language in which none is global.

use std::collections::BTreeMap;

/// A texture, with its sampler if it has one, that is handed over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handed {
    /// The texture's name.
    pub name: String,
    /// What a function that reads it has among its parameters.
    pub parameters: String,
    /// What a call of such a function has among its arguments.
    pub arguments: String,
}

/// `code`, translated functions in whose text textures are global, with what each function reads handed to it: behind its other
/// parameters, in the order of `handed`.
pub(super) fn handed_over(code: &str, handed: &[Handed]) -> String {
    let read = read(code, handed);
    let mut text = String::with_capacity(2 * code.len());
    for line in code.split_inclusive('\n') {
        let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
        let defines = definition(line).is_some();
        let one = |&i: &usize| if defines { &*handed[i].parameters } else { &*handed[i].arguments };
        extend(&mut text, code, &read, &|indices| indices.iter().map(one).collect::<Vec<_>>().join(", "));
        text.push_str(comment);
    }
    text
}

/// Structs, and functions: blocks between empty lines, with the comments before them.
pub(super) fn parted(code: &str) -> (String, String) {
    let blocks = code.split("\n\n").filter(|block| !block.trim().is_empty());
    let (structs, functions): (Vec<&str>, Vec<&str>) =
        blocks.partition(|block| block.lines().any(|line| line.starts_with("struct ")));
    let joined = |blocks: &[&str]| {
        blocks.iter().map(|block| format!("{}\n", block.trim_matches('\n'))).collect::<Vec<_>>().join("\n")
    };
    (joined(&structs), joined(&functions))
}

/// The name of the function whose definition a line begins.
fn definition(line: &str) -> Option<&str> {
    let code = line.trim_end().strip_suffix(") {")?;
    let inside = code.starts_with(|c: char| !(c.is_ascii_alphabetic() || c == '_'));
    let before = code.split('(').next().filter(|_| !inside)?;
    before.split(' ').next_back()
}

/// Which textures each function reads, by itself or by those that it calls.
fn read(code: &str, handed: &[Handed]) -> BTreeMap<String, Vec<usize>> {
    let mut bodies: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in code.lines() {
        let code = line.split("//").next().unwrap_or_default();
        if let Some(name) = definition(code) {
            bodies.push((name, Vec::new()));
        } else if let Some((_, words)) = bodies.last_mut() {
            words.extend(code.split(|c: char| !is_word(c)).filter(|word| !word.is_empty()));
        }
    }
    let mut read: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    // Calls may go to functions that stand further down: once more as long as that finds something.
    loop {
        let before = read.clone();
        for (name, words) in &bodies {
            let own = |(i, texture): (usize, &Handed)| words.contains(&texture.name.as_str()).then_some(i);
            let called = words.iter().filter_map(|word| before.get(*word)).flatten().copied();
            let mut found: Vec<usize> = handed.iter().enumerate().filter_map(own).chain(called).collect();
            found.sort_unstable();
            found.dedup();
            if !found.is_empty() {
                read.insert((*name).to_owned(), found);
            }
        }
        if read == before {
            return read;
        }
    }
}

/// `code` behind `text`; in the parentheses of what reads textures stands in addition what `list` says of them.
fn extend(
    text: &mut String,
    code: &str,
    read: &BTreeMap<String, Vec<usize>>,
    list: &dyn Fn(&[usize]) -> String,
) {
    // What is to stand before each parenthesis that is open.
    let mut open: Vec<Option<String>> = Vec::new();
    let mut rest = code;
    while let Some(first) = rest.chars().next() {
        let end = if is_word(first) { rest.find(|c| !is_word(c)) } else { Some(first.len_utf8()) };
        let (part, after) = rest.split_at(end.unwrap_or(rest.len()));
        match first {
            '(' => {
                let word = text.rsplit(|c| !is_word(c)).next().unwrap_or_default();
                open.push(read.get(word).map(|indices| list(indices)));
            }
            ')' => {
                if let Some(more) = open.pop().flatten() {
                    let comma = if text.ends_with('(') { "" } else { ", " };
                    text.push_str(comma);
                    text.push_str(&more);
                }
            }
            _ => {}
        }
        text.push_str(part);
        rest = after;
    }
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::dialect::UNREAL;

    #[test]
    fn what_a_function_reads_is_handed_to_it_by_all_that_call_it() {
        let code = "// Of skinfit_color_map.\nfloat3 skinfit_albedo(float2 uv) {\n    return skinfit_color_map.SampleLevel(skinfit_color_mapSampler, uv, 0.0).rgb; // as (it is\n}\n\n\
                    float3 skinfit_ahead() {\n    return skinfit_sky_cube.SampleLevel(skinfit_sky_cubeSampler, float3(0.0, 0.0, 1.0), 0.0).rgb;\n}\n\n\
                    float skinfit_half(float x) {\n    return 0.5 * x;\n}\n\n\
                    struct SkinfitSurface {\n    float2 uv;\n};\n\n\
                    float4 skinfit_shade(SkinfitSurface at) {\n    if (at.uv.x > skinfit_half(1.0)) {\n        return float4(max(skinfit_albedo(at.uv), skinfit_ahead()), 1.0);\n    }\n}\n";
        let handed = [UNREAL.handed("color_map", false, true), UNREAL.handed("sky_cube", true, true)];
        let map = "skinfit_color_map, skinfit_color_mapSampler";
        let cube = "skinfit_sky_cube, skinfit_sky_cubeSampler";
        let map_parameters = "Texture2D skinfit_color_map, SamplerState skinfit_color_mapSampler";
        let cube_parameters = "TextureCube skinfit_sky_cube, SamplerState skinfit_sky_cubeSampler";
        assert_eq!([&handed[0].arguments, &handed[1].parameters], [map, cube_parameters]);
        let want = code
            .replace("skinfit_albedo(float2 uv)", &format!("skinfit_albedo(float2 uv, {map_parameters})"))
            .replace("skinfit_albedo(at.uv)", &format!("skinfit_albedo(at.uv, {map})"))
            .replace("skinfit_ahead() {", &format!("skinfit_ahead({cube_parameters}) {{"))
            .replace("skinfit_ahead()", &format!("skinfit_ahead({cube})"))
            .replace(
                "SkinfitSurface at)",
                &format!("SkinfitSurface at, {map_parameters}, {cube_parameters})"),
            );
        let got = handed_over(code, &handed);
        assert_eq!(got, want);
        let (structs, functions) = parted(&got);
        assert_eq!(structs, "struct SkinfitSurface {\n    float2 uv;\n};\n");
        assert!(
            functions.starts_with("// Of skinfit_color_map.\nfloat3") && functions.ends_with("    }\n}\n")
        );
        assert!(!functions.contains("struct") && functions.contains("}\n\nfloat skinfit_half(float x) {\n"));
        // What is read texel by texel has no sampler.
        let level = UNREAL.handed("light_level", false, false);
        assert_eq!(
            (level.parameters.as_str(), level.arguments.as_str()),
            ("Texture2D skinfit_light_level", "skinfit_light_level")
        );
    }
}
