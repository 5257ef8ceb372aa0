//! Extensions of glTF: which are read, and what is told of the others.

use std::collections::BTreeMap;

use gltf::json;

use super::document::Document;
use crate::error::{SceneError, Warnings, warn};
use crate::inspect::UnreadExtension;

/// Extensions whose numbers are read.
const READ: [&str; 4] = [
    "KHR_mesh_quantization",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_materials_emissive_strength",
];
/// Required extensions without which a file can be read: what materials add to metallic and rough, which is told where one
/// is drawn; others of them to choose from; kinds of pictures, told where one is wanted; and what is said about the file.
const DISPENSABLE: [&str; 20] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
    "KHR_texture_basisu",
    "EXT_texture_astc",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "MSFT_texture_dds",
    "KHR_xmp_json_ld",
];

impl Document {
    /// Refuses a file that requires what is neither read nor can be done without.
    pub(super) fn check_extensions(&self) -> Result<(), SceneError> {
        for name in &self.root.extensions_required {
            if !READ.contains(&name.as_str()) && !DISPENSABLE.contains(&name.as_str()) {
                return Err(self.error(
                    format!("requires the extension {name}, which is not read"),
                    "Export it without (uncompressed)",
                ));
            }
        }
        Ok(())
    }

    /// The extensions that the file uses and that are not read, each once.
    pub(crate) fn unread_extensions(&self) -> Vec<UnreadExtension> {
        let required = &self.root.extensions_required;
        let used = self.root.extensions_used.iter().chain(required);
        let names = used.filter(|name| !READ.contains(&name.as_str()));
        let by_name: BTreeMap<&String, bool> =
            names.map(|name| (name, required.iter().any(|other| other == name))).collect();
        by_name.into_iter().map(|(name, required)| UnreadExtension { name: name.clone(), required }).collect()
    }

    /// Tells what a material that is drawn has beside what is read.
    pub(super) fn warn_of_unread(&self, name: &str, material: &json::Material, warnings: &mut Warnings) {
        let others = material.extensions.iter().flat_map(|all| all.others.keys());
        let unread: Vec<&str> = others.map(String::as_str).filter(|name| !READ.contains(name)).collect();
        if !unread.is_empty() {
            let message = format!("material {name:?} is drawn without {}, not read", unread.join(", "));
            warn(warnings, &self.path, message);
        }
    }
}
