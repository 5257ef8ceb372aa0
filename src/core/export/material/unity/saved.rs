//! A material as Unity's editor saves it, in its own kind of YAML (Unity's manual, "Format of text serialized files" and
//! "UnityYAML"). Which object of a file is meant is said by its class and the file's GUID (Unity's manual, "YAML class ID
//! reference": 21 is a material, 28 a texture, 48 a shader, 89 a cube).

use std::fmt::Write as _;

use super::Tuned;
use super::asset::Guid;

/// A texture's place in the material, and the file that fills it.
pub(super) struct Slot {
    /// The property's name.
    pub(super) name: String,
    /// Whether it is a cube.
    pub(super) cube: bool,
    /// The file's identity.
    pub(super) guid: Guid,
}

/// The file of a material: its name, which is the file's, its shader, and its properties.
pub(super) fn text(name: &str, shader: &Guid, slots: &[Slot], tuned: &[Tuned]) -> String {
    let mut text = String::from("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n--- !u!21 &2100000\nMaterial:\n");
    let _ = write!(
        text,
        "  serializedVersion: 8
  m_ObjectHideFlags: 0
  m_CorrespondingSourceObject: {{fileID: 0}}
  m_PrefabInstance: {{fileID: 0}}
  m_PrefabAsset: {{fileID: 0}}
  m_Name: {}
  m_Shader: {{fileID: 4800000, guid: {shader}, type: 3}}
  m_Parent: {{fileID: 0}}
  m_ModifiedSerializedProperties: 0
  m_ValidKeywords: []
  m_InvalidKeywords: []
  m_LightmapFlags: 4
  m_EnableInstancingVariants: 0
  m_DoubleSidedGI: 0
  m_CustomRenderQueue: -1
  stringTagMap: {{}}
  disabledShaderPasses: []
  m_SavedProperties:
    serializedVersion: 3
",
        scalar(name)
    );
    let texture = |Slot { name, cube, guid }: &Slot| {
        let object = if *cube { 8_900_000 } else { 2_800_000 };
        format!(
            "    - {name}:\n        m_Texture: {{fileID: {object}, guid: {guid}, type: 3}}\n        m_Scale: {{x: 1, y: 1}}\n        \
             m_Offset: {{x: 0, y: 0}}\n"
        )
    };
    text += &list("m_TexEnvs", slots.iter().map(texture));
    text += &list("m_Ints", std::iter::empty());
    let single = |constant: &Tuned| match constant.four() {
        None => format!("    - {}: {}\n", constant.property, constant.value[0]),
        Some(_) => String::new(),
    };
    text += &list("m_Floats", tuned.iter().map(single));
    // Vectors stand among the colours.
    let vector = |constant: &Tuned| match constant.four() {
        None => String::new(),
        Some([r, g, b, a]) => format!("    - {}: {{r: {r}, g: {g}, b: {b}, a: {a}}}\n", constant.property),
    };
    text += &list("m_Colors", tuned.iter().map(vector));
    text + "  m_BuildTextureStacks: []\n"
}

fn list(name: &str, entries: impl Iterator<Item = String>) -> String {
    let entries: String = entries.collect();
    if entries.is_empty() { format!("    {name}: []\n") } else { format!("    {name}:\n{entries}") }
}

/// A text as YAML has it: quoted unless it is a plain word.
fn scalar(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let word = text.chars().all(|c| plain(c) || "-. ".contains(c));
    if word && text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.ends_with(plain) {
        return text.to_owned();
    }
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            ' '..='~' => quoted.push(c),
            // In as many digits as UTF-16 needs, as Unity writes it.
            _ => c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| {
                let _ = write!(quoted, "\\u{unit:04X}");
            }),
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::scalar;

    #[test]
    fn a_name_is_quoted_where_yaml_would_take_it_for_something_else() {
        assert_eq!([scalar("Skin"), scalar("Old skin-2.b")], ["Skin", "Old skin-2.b"]);
        assert_eq!(scalar("12"), "\"12\"");
        assert_eq!(scalar("a: b"), "\"a: b\"");
        assert_eq!(scalar("say \"x\""), "\"say \\\"x\\\"\"");
        assert_eq!(scalar("Häut"), "\"H\\u00E4ut\"");
        assert_eq!(scalar("true "), "\"true \"");
    }
}
