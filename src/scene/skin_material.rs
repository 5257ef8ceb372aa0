//! What the skin's own material gives a scene: its maps, where they are looked up, and what lies beyond their borders.

use super::animation::{Pose, own_maps};
use super::error::{SceneError, Warnings, warn};
use super::file::{SceneFile, Source};
use super::gltf::{Document, SkinMaps, TextureUv};
use super::map_files::normal_flip;
use super::map_layout::{MOST_OF_ALL, MOST_TEXELS, MapLayout, TooFar, Wraps};
use super::maps::Maps;
use super::mesh::Mesh;
use super::plain::Wrap;
use crate::model::needs::Needs;

/// The material whose maps a scene has.
pub(super) struct SkinMaterial {
    of: SkinMaps,
    /// Whether the scene's colours are its.
    colored: bool,
    wraps: Wraps,
}

impl SkinMaterial {
    /// Put the material's maps into `maps`, those that the effects ask for and the scene does not name; none where all of
    /// them are the scene's.
    pub(super) fn read(
        (source, file): (&Source, &SceneFile),
        document: &Document,
        (pose, needs): (&Pose, Needs),
        maps: &mut Maps,
        warnings: &mut Warnings,
    ) -> Result<Option<Self>, SceneError> {
        let wanted = (needs.color_map && maps.color.is_none(), needs.normal_map && maps.normal.is_none());
        if wanted.0 && file.maps.takes_material() {
            document.warn_of_unread_skin(pose.skin(), warnings)?;
        }
        let Some(of) = own_maps(file, document, (pose, needs), warnings)? else { return Ok(None) };
        let [color, mut normal] = document.read_skin_maps(&of, wanted, warnings);
        if normal_flip(source, file)? {
            let texels = normal.iter_mut().flat_map(|(map, _)| &mut map.texels);
            texels.for_each(|texel| texel[1] = 1.0 - texel[1]);
        }
        let colored = color.is_some();
        let put = |to: &mut Option<_>, read: Option<(_, [Wrap; 2])>| {
            let (map, wrap) = read?;
            *to = Some(map);
            Some(wrap)
        };
        let repeat = [Wrap::Repeat; 2];
        let wraps = Wraps {
            color: put(&mut maps.color, color).unwrap_or(repeat),
            normal: put(&mut maps.normal, normal).unwrap_or(repeat),
        };
        Ok(Some(Self { of, colored, wraps }))
    }

    /// Where all maps of the scene are looked up.
    pub(super) fn uv(&self) -> TextureUv {
        self.of.uv()
    }

    /// Lay the maps out for the mesh where it comes to borders of the material's pictures that do not repeat, and note what
    /// an engine has to know.
    pub(super) fn finish(
        &self,
        document: &Document,
        (maps, mesh): (&mut Maps, &mut Mesh),
        warnings: &mut Warnings,
    ) {
        match MapLayout::of(maps, &self.wraps, mesh) {
            Ok(Some(layout)) => {
                layout.place(mesh);
                layout.lay_out(maps, &self.wraps);
            }
            Ok(None) => {}
            Err(TooFar) => {
                let name = &self.of.material;
                let message = format!(
                    "material {name:?}: the skin comes to borders of pictures that its material mirrors or clamps, and what lies \
                     beyond cannot be laid out: the maps would have more than {MOST_TEXELS} texels along a side, or {MOST_OF_ALL} \
                     in all. They repeat there instead. Keep the texture coordinates half a texel within the pictures, or take \
                     smaller maps, whose sides divide one another"
                );
                warn(warnings, document.path(), message);
            }
        }
        maps.material = Some(self.of.told(self.colored, maps.layout));
    }
}
