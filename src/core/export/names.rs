//! Names of the shader rules as another engine's source can take them in: nothing of an export may be called as
//! something that is there already.

use std::collections::BTreeMap;

/// What the names of all that an export defines begin with, in whatever capitals its language wants.
pub(super) const PREFIX: &str = "skinfit_";

/// `wgsl` with the prefix before the name of every function and struct that it defines, and before the `constants` and
/// `resources` that it reads. `fields` of structs keep their names.
pub(super) fn prefixed(wgsl: &str, constants: &[String], resources: &[&str], fields: &[&str]) -> String {
    let mut names: BTreeMap<&str, String> = BTreeMap::new();
    for line in wgsl.lines() {
        if let Some(name) = line.strip_prefix("fn ").and_then(|rest| rest.split('(').next()) {
            names.insert(name, function(name));
        } else if let Some(name) = line.strip_prefix("struct ").and_then(|rest| rest.split(' ').next()) {
            names.insert(name, structure(name));
        }
    }
    names.extend(constants.iter().map(|name| (name.as_str(), constant(name))));
    names.extend(resources.iter().map(|name| (*name, function(name))));
    names.retain(|name, _| !fields.contains(name));
    let mut text = String::with_capacity(wgsl.len() + wgsl.len() / 8);
    for line in wgsl.split_inclusive('\n') {
        let (code, comment) = line.split_at(line.find("//").unwrap_or(line.len()));
        rename(&mut text, code, &names);
        text.push_str(comment);
    }
    text
}

/// The words of `code`, those in `names` by their new ones; what follows a full stop is a component.
fn rename(text: &mut String, code: &str, names: &BTreeMap<&str, String>) {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut rest = code;
    while let Some(first) = rest.chars().next() {
        let end = if is_word(first) { rest.find(|c| !is_word(c)) } else { rest.find(is_word) };
        let (part, after) = rest.split_at(end.unwrap_or(rest.len()));
        let component = text.ends_with('.');
        text.push_str(names.get(part).filter(|_| !component).map_or(part, String::as_str));
        rest = after;
    }
}

/// A function's or a resource's name in an export.
pub(super) fn function(name: &str) -> String {
    if name.starts_with(PREFIX) { name.to_owned() } else { format!("{PREFIX}{name}") }
}

/// A struct's.
fn structure(name: &str) -> String {
    format!("Skinfit{name}")
}

/// A constant's.
pub(super) fn constant(name: &str) -> String {
    format!("{PREFIX}{name}").to_uppercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_its_own_has_the_prefix_and_no_other() {
        let rule = "// What open is.\nfn open(occ: f32, OCCLUSION_X: f32) -> f32 {\n    return OCCLUSION * occ.open + open(occ); // open\n}\n\
                    struct Surface {\n    eye: vec3f,\n}\nfn skinfit_shade(at: Surface) -> vec4f {\n    return textureSampleLevel(color_map, at.eye);\n}\n";
        let constants = ["OCCLUSION".to_owned()];
        assert_eq!(
            prefixed(rule, &constants, &["color_map", "eye"], &["eye"]),
            "// What open is.\nfn skinfit_open(occ: f32, OCCLUSION_X: f32) -> f32 {\n    return SKINFIT_OCCLUSION * occ.open + \
             skinfit_open(occ); // open\n}\nstruct SkinfitSurface {\n    eye: vec3f,\n}\nfn skinfit_shade(at: SkinfitSurface) -> vec4f {\n    \
             return textureSampleLevel(skinfit_color_map, at.eye);\n}\n"
        );
    }
}
