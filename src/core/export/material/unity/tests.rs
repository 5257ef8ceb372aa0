//! A material's folder against the shader that it is of.

use std::collections::BTreeMap;
use std::path::Path;

use super::{UnityError, UnityFolder, UnitySkin};
use crate::export::{BUDGET, Provenance};
use crate::model::effects::{Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params};
use crate::scene::maps::{Map, Maps};
use crate::shader::Facts;
use crate::shader::facts::MapFacts;

fn facts() -> Facts {
    let maps =
        MapFacts { color: true, normal: true, specular: true, attenuator: true, ..MapFacts::default() };
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, Effects::SURFACE);
    Facts { setup, maps, budget: BUDGET, tessellation: 1.0, ..Facts::default() }
}

fn maps() -> Maps {
    let grey = Map { width: 2, height: 2, texels: vec![[0.5; 3]; 4] };
    let share = Map { width: 2, height: 2, texels: vec![[0.25]; 4] };
    Maps {
        color: Some(grey.clone()),
        normal: Some(grey),
        specular: Some(share.clone()),
        attenuator: Some(share),
        ..Maps::default()
    }
}

fn folder(material: &Path, include: &str, params: &Params) -> Result<UnityFolder, UnityError> {
    let (facts, from, maps) = (facts(), Provenance::default(), maps());
    UnityFolder::new(material, include, UnitySkin { facts: &facts, params, from: &from, maps: &maps })
}

fn params() -> Params {
    let mut params = Params::defaults(Form::Corrected);
    params.set_rgb(Param::Hilite, [0.7, 1.0 / 3.0, 1e-7]);
    params.set(Param::Occlusion, 0.1);
    params
}

/// Texts by their names; pictures have none.
fn texts(folder: &Path) -> BTreeMap<String, String> {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let text = |path: std::path::PathBuf| {
        let name = path.file_name()?.to_str()?.to_owned();
        Some((name, std::fs::read_to_string(&path).unwrap_or_default()))
    };
    files.filter_map(text).collect()
}

fn guid(meta: &str) -> &str {
    meta.lines().find_map(|line| line.strip_prefix("guid: ")).unwrap()
}

/// The entries of a list of the material: name, and what follows on its lines.
fn entries<'a>(saved: &'a str, list: &str) -> BTreeMap<&'a str, &'a str> {
    let (_, rest) = saved.split_once(&format!("    {list}:\n")).unwrap_or_default();
    let end = rest.find("\n    m_").or_else(|| rest.find("\n  m_")).unwrap_or(rest.len());
    rest[..end].split("    - ").skip(1).filter_map(|entry| entry.split_once(':')).collect()
}

/// The properties that the ShaderLab file declares: name and what stands behind.
fn declared(shader: &str) -> BTreeMap<&str, &str> {
    let (_, rest) = shader.split_once("Properties {\n").unwrap();
    let lines = rest.lines().take_while(|line| line.trim() != "}");
    let lines = lines.map(|line| line.trim().trim_start_matches("[NoScaleOffset] "));
    lines.filter_map(|line| line.split_once(" (")).collect()
}

#[test]
fn the_material_has_each_property_of_the_shader_and_no_other() {
    let place = tempfile::tempdir().unwrap();
    let files = folder(&place.path().join("Skin.mat"), "Skin.hlsl", &params()).unwrap();
    files.write().unwrap();
    let texts = texts(place.path());
    let (saved, shader) = (&texts["Skin.mat"], &texts["Skin.shader"]);
    let [textures, floats, vectors] = ["m_TexEnvs", "m_Floats", "m_Colors"].map(|list| entries(saved, list));
    let declared = declared(shader);
    let mut all: Vec<&str> = textures.keys().chain(floats.keys()).chain(vectors.keys()).copied().collect();
    all.sort_unstable();
    assert_eq!(all, declared.keys().copied().collect::<Vec<_>>());
    assert!(textures.len() >= 6 && !floats.is_empty() && !vectors.is_empty(), "{saved}");
    // What the shader starts with is what the material has, and both are the constants.
    let number = |text: &str| text.trim().parse::<f32>().unwrap();
    for (name, value) in &floats {
        let start = declared[name].split_once("Float) = ").unwrap().1;
        assert_eq!(number(start), number(value), "{name}");
    }
    assert_eq!(number(floats["_SKINFIT_OCCLUSION"]), 0.1);
    let hilite = vectors["_SKINFIT_HILITE"].trim();
    assert_eq!(hilite, "{r: 0.7, g: 0.33333334, b: 0.0000001, a: 0}");
    assert!(declared["_SKINFIT_HILITE"].ends_with("Vector) = (0.7, 0.33333334, 0.0000001, 0)"));
    // The include reads every one, and has the same by itself.
    for name in floats.keys().chain(vectors.keys()) {
        let constant = &name[1..];
        assert!(shader.contains(&format!("#define {constant} {name}")), "{constant}");
        assert!(texts["Skin.hlsl"].contains(&format!(" {constant} = ")), "{constant}");
    }
}

#[test]
fn every_guid_that_is_referred_to_is_a_files() {
    let place = tempfile::tempdir().unwrap();
    std::fs::write(place.path().join("irradiance.dds"), b"").unwrap();
    std::fs::write(place.path().join("hilite.exr"), b"").unwrap();
    std::fs::write(place.path().join("lobe_32.dds"), b"").unwrap();
    let files = folder(&place.path().join("Skin.mat"), "Skin.hlsl", &params()).unwrap();
    // Cubes are the bake's, and what is there is not missed.
    let missing =
        |file: &str| files.warnings().iter().any(|words| words.contains(&format!("{file}: is not there")));
    assert!(!missing("irradiance.dds") && !missing("hilite.dds") && !missing("specular.dds"));
    files.write().unwrap();
    let texts = texts(place.path());
    let of_asset = |(name, text): (&'_ String, &'_ String)| {
        let asset = name.strip_suffix(".meta")?.to_owned();
        Some((guid(text).to_owned(), asset))
    };
    let metas: BTreeMap<String, String> = texts.iter().filter_map(of_asset).collect();
    // They differ.
    assert_eq!(metas.len(), texts.keys().filter(|name| name.ends_with(".meta")).count());
    assert!(metas.keys().all(|guid| guid.len() == 32 && guid.chars().all(|c| c.is_ascii_hexdigit())));
    let named = |text: &str| metas[text.split_once("guid: ").unwrap().1.split(',').next().unwrap()].as_str();
    let saved = &texts["Skin.mat"];
    assert_eq!(named(saved.lines().find(|line| line.contains("m_Shader: ")).unwrap()), "Skin.shader");
    let textures = entries(saved, "m_TexEnvs");
    for (slot, file, object) in [
        ("skinfit_irradiance_cube", "irradiance.dds", "8900000"),
        ("skinfit_hilite_cube", "hilite.exr", "8900000"),
        ("skinfit_specular_cube", "lobe_32.dds", "8900000"),
        ("skinfit_color_map", "Skin_color.png", "2800000"),
        ("skinfit_normal_map", "Skin_normal.png", "2800000"),
    ] {
        assert_eq!(named(textures[slot]), file);
        assert!(textures[slot].contains(&format!("{{fileID: {object}, ")), "{}", textures[slot]);
    }
    let meta = |file: &str| texts[&format!("{file}.meta")].as_str();
    let has = |file: &str, words: &[&str]| {
        words.iter().for_each(|word| assert!(meta(file).contains(word), "{file}: {word}: {}", meta(file)));
    };
    has("Skin_color.png", &["\nTextureImporter:\n", "    sRGBTexture: 1\n", "  textureShape: 1\n"]);
    // As stored: of the default type.
    has("Skin_normal.png", &["    sRGBTexture: 0\n", "  textureType: 0\n", "    wrapU: 0\n"]);
    has("hilite.exr", &["  textureShape: 2\n", "  generateCubemap: 5\n", "    sRGBTexture: 0\n"]);
    has("irradiance.dds", &["\nIHVImageFormatImporter:\n", "  sRGBTexture: 0\n", "    wrapU: 1\n"]);
    has("Skin.shader", &["\nShaderImporter:\n"]);
    has("Skin.mat", &["\nNativeFormatImporter:\n", "  mainObjectFileID: 2100000\n"]);
    // Once more: the same, to the byte.
    let again = folder(&place.path().join("Skin.mat"), "Skin.hlsl", &params()).unwrap();
    again.write().unwrap();
    assert_eq!(self::texts(place.path()), texts);
    assert!(again.files().all(|path| path.extension().is_some_and(|ending| ending != "meta")));
}

#[test]
fn what_is_written_is_yaml_as_unity_writes_it() {
    let place = tempfile::tempdir().unwrap();
    folder(&place.path().join("Skin.mat"), "Skin.hlsl", &params()).unwrap().write().unwrap();
    for (name, text) in texts(place.path()) {
        if !(name.ends_with(".meta") || name.ends_with(".mat")) {
            continue;
        }
        let mut before = 0;
        let mut opens = true;
        for line in text.lines().filter(|line| !line.starts_with(['%', '-'])) {
            let entry = line.trim_start();
            let depth = line.len() - entry.len();
            let (entry, inside) = entry.strip_prefix("- ").map_or((entry, depth), |entry| (entry, depth + 2));
            let (key, value) = entry.split_once(':').unwrap_or_else(|| panic!("{name}: {line}"));
            let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
            assert!(!key.is_empty() && key.chars().all(word), "{name}: {line}");
            assert!(value.is_empty() || value.starts_with(' '), "{name}: {line}");
            // Deeper only behind a key without a value; a list may stand as deep as its key.
            assert!(depth % 2 == 0 && (inside <= before || opens), "{name}: {line}");
            let count = |c: char| value.matches(c).count();
            assert_eq!((count('{'), count('[')), (count('}'), count(']')), "{name}: {line}");
            (before, opens) = (inside, value.is_empty());
        }
        assert!(!text.contains('\t') && text.ends_with('\n'), "{name}");
    }
}

#[test]
fn what_unity_keeps_beside_a_file_stays_and_is_referred_to() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name);
    let own = "0123456789abcdef0123456789ABCDEF";
    let kept = format!("fileFormatVersion: 2\nguid: {own}\nTextureImporter:\n  sRGBTexture: 1\n");
    std::fs::write(path("Skin_normal.png.meta"), &kept).unwrap();
    let files = folder(&path("Skin.mat"), "Skin.hlsl", &params()).unwrap();
    let told = |words: &str| files.warnings().iter().any(|warning| warning.contains(words));
    assert!(
        told("Skin_normal.png.meta: is kept, but the shader wants sRGBTexture: 0, textureType: 0"),
        "{:?}",
        files.warnings()
    );
    files.write().unwrap();
    assert_eq!(std::fs::read_to_string(path("Skin_normal.png.meta")).unwrap(), kept);
    let saved = std::fs::read_to_string(path("Skin.mat")).unwrap();
    let textures = entries(&saved, "m_TexEnvs");
    assert!(textures["skinfit_normal_map"].contains(&own.to_lowercase()), "{saved}");
    // One without an identity is no one's to replace.
    std::fs::write(path("Skin.shader.meta"), "guid: 12\n").unwrap();
    let error = folder(&path("Skin.mat"), "Skin.hlsl", &params()).unwrap_err().to_string();
    assert!(error.contains("Skin.shader.meta: has no line `guid:`"), "{error}");
}

#[test]
fn skins_of_other_names_are_other_assets() {
    let places = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let guids = ["Skin", "Other"].map(|name| super::asset::Guid::of(name, "irradiance.dds"));
    assert_ne!(guids[0], guids[1]);
    for (place, name) in places.iter().zip(["Skin", "Other"]) {
        let path = place.path().join(format!("{name}.mat"));
        folder(&path, "shared/Skin.hlsl", &params()).unwrap().write().unwrap();
        let texts = texts(place.path());
        assert!(texts[&format!("{name}.shader")].contains(&format!("Shader \"Skinfit/{name}\"")));
        // A path is of a file that is elsewhere.
        assert!(texts[&format!("{name}.shader")].contains("#include \"shared/Skin.hlsl\""));
        assert!(!texts.keys().any(|file| file.ends_with(".hlsl")));
        assert_eq!(guid(&texts["irradiance.dds.meta"]).len(), 32);
    }
}

#[test]
fn nothing_is_written_where_one_file_cannot_be() {
    let place = tempfile::tempdir().unwrap();
    std::fs::create_dir(place.path().join("Skin.shader")).unwrap();
    let files = folder(&place.path().join("Skin.mat"), "Skin.hlsl", &params()).unwrap();
    assert!(files.write().unwrap_err().to_string().contains("a folder stands there"));
    assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
    let twice = folder(&place.path().join("Skin.mat"), "skin.MAT", &params()).unwrap_err().to_string();
    assert!(twice.contains("another file of that name") && twice.contains("Skin.hlsl"), "{twice}");
    let nameless = folder(Path::new(""), "Skin.hlsl", &params()).unwrap_err().to_string();
    assert!(nameless.contains("no name that a material could have"), "{nameless}");
}
