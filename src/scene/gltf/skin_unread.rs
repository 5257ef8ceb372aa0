//! What materials of the skin say and no map holds: colours of vertices, and alpha. Neither is read, and where it would show
//! that is told.

use std::collections::BTreeMap;

use gltf::json;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;

use super::document::Document;
use super::places::is_drawn;
use super::plain::alpha_of;
use crate::error::{SceneError, Warnings, warn};
use crate::maps::Map;
use crate::plain::Alpha;

impl Document {
    /// Tells of each material of the skin whether its vertices have colours, and whether its alpha leaves none of it opaque.
    /// `skin` names materials and meshes, without it all is skin.
    pub(crate) fn warn_of_unread_skin(
        &self,
        skin: Option<&[String]>,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let named = |name: &str| skin.is_none_or(|names| names.iter().any(|other| other == name));
        // By the materials' places in the file, whether there are such colours.
        let mut found: BTreeMap<Option<usize>, bool> = BTreeMap::new();
        for node in self.nodes(None)?.in_scene.into_iter().map(|i| &self.root.nodes[i]) {
            let Some(index) = node.mesh else { continue };
            let mesh = self.get(&self.root.meshes, index, "mesh")?;
            let of_mesh = named(&self.mesh_name(index.value(), node));
            for primitive in mesh.primitives.iter().filter(|primitive| is_drawn(primitive)) {
                let material = primitive.material.map(|index| index.value());
                if of_mesh || material.is_some_and(|index| named(&self.material_name(index))) {
                    let tinted = found.entry(material).or_default();
                    *tinted = *tinted || self.is_tinted(primitive, self.alpha_at(material).0);
                }
            }
        }
        for (material, tinted) in found {
            let name = material.map_or_else(|| "glTF's default".to_owned(), |i| self.material_name(i));
            if tinted {
                let message = format!(
                    "material {name:?}: colours of vertices (COLOR_0) are not read of skin: bake them into the map of its \
                     colour, or leave the material out of `skin` in [mesh]"
                );
                warn(warnings, &self.path, message);
            }
            let (alpha, factor) = self.alpha_at(material);
            if alpha.seen(|| factor) < 1.0 {
                self.warn_of_alpha(&name, "all of it", warnings);
            }
        }
        Ok(())
    }

    /// Tells where the picture of a material of the skin has holes, but for those of its factor alone.
    pub(super) fn warn_of_holes(
        &self,
        name: &str,
        (alpha, factor): (Alpha, f32),
        map: &Map<4>,
        warnings: &mut Warnings,
    ) {
        let holes = map.texels.iter().filter(|texel| alpha.seen(|| factor * texel[3]) < 1.0).count();
        if holes > 0 && alpha.seen(|| factor) == 1.0 {
            let share = format!("{holes} of the {} texels of its picture", map.texels.len());
            self.warn_of_alpha(name, &share, warnings);
        }
    }

    fn warn_of_alpha(&self, name: &str, what: &str, warnings: &mut Warnings) {
        let message = format!(
            "material {name:?}: its alpha, which leaves {what} not opaque, is not read of skin, which has no holes: cut them out \
             of the mesh, or leave the material out of `skin` in [mesh]"
        );
        warn(warnings, &self.path, message);
    }

    /// What the alpha of a material does at that place in the file.
    fn alpha_at(&self, material: Option<usize>) -> (Alpha, f32) {
        let material = material.and_then(|index| self.root.materials.get(index));
        material.map_or((Alpha::Opaque, 1.0), alpha_of)
    }

    /// Whether a primitive's vertices have colours that would show, or such that cannot be read.
    fn is_tinted(&self, primitive: &Primitive, alpha: Alpha) -> bool {
        let colors = primitive.attributes.get(&Checked::Valid(Semantic::Colors(0)));
        // Alpha counts where it does anything.
        let shown = if alpha == Alpha::Opaque { 3 } else { 4 };
        let white = |color: &[f32; 4]| color[..shown].iter().all(|c| *c == 1.0);
        colors.is_some_and(|&index| !self.colors(index, "").is_ok_and(|colors| colors.iter().all(white)))
    }
}
