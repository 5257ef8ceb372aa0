//! The linear maps of a scene: how texels become samples, and padded cubes.

use super::sparse::Entries;
use crate::model::cube::{Sources, padding};

/// From the texels of a cube, `(face * size + row) * size + column`, to those with a border of one texel from the
/// neighbouring faces, as lookups read them: rows 6 (size + 2)^2, columns 6 size^2.
#[must_use]
pub fn cube_border(size: usize) -> Entries {
    let mut entries = Entries::new(6 * size * size);
    for sources in padding(size) {
        match sources {
            Sources::One(texel) => entries.push_row([(texel as u32, 1.0)]),
            Sources::Corner(three) => entries.push_row(three.map(|texel| (texel as u32, 1.0 / 3.0))),
        }
    }
    entries
}
