//! What samples look up of the atlas' texels, as a linear map.

use crate::TensorError;
use crate::engine::levels::corners_of;
use crate::model::diffusion::Lookup;
use crate::model::evaluate::Setup;
use crate::samples::{Atlas, LANES, ViewSamples};
use crate::sparse::Entries;

/// From the texels that the mesh covers to the samples of `views`, which share that atlas; with the very shares that the
/// engines look up with.
///
/// # Errors
/// When a view has samples without texture coordinates.
pub(crate) fn lookups(atlas: &Atlas, views: &[&ViewSamples], setup: Setup) -> Result<Entries, TensorError> {
    let dilated = setup.choices.diffusion.lookup == Lookup::Dilated;
    let filled = if dilated { filled(atlas) } else { Vec::new() };
    let mut entries = Entries::new(atlas.covered());
    for view in views {
        let corners = corners_of::<f32>(view, dilated);
        if corners.len() != view.records() {
            return Err(TensorError::no_atlas(setup.effects));
        }
        for corners in &corners {
            for lane in 0..LANES {
                let mut row = Vec::with_capacity(4);
                for (texel, share) in corners.of(lane) {
                    match (texel as usize).checked_sub(atlas.covered()) {
                        Some(empty) => row.extend(filled[empty].iter().map(|(of, part)| (*of, share * part))),
                        None => row.push((texel, share)),
                    }
                }
                entries.push_row(row);
            }
        }
    }
    Ok(entries)
}

/// Of each texel that is filled beyond the charts, in the order of their numbers, the covered ones that it is made of.
fn filled(atlas: &Atlas) -> Vec<Vec<(u32, f32)>> {
    let covered = atlas.covered();
    let mut filled: Vec<Vec<(u32, f32)>> = Vec::new();
    for neighbours in atlas.dilation().filled() {
        let part = 1.0 / neighbours.len() as f32;
        let mut row = Vec::new();
        for &number in neighbours {
            match (number as usize).checked_sub(covered) {
                // Filled in the ring before.
                Some(before) => row.extend(filled[before].iter().map(|(of, share)| (*of, part * share))),
                None => row.push((number, part)),
            }
        }
        filled.push(row);
    }
    filled
}
