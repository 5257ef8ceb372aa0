//! Why texels cannot be had.

use crate::program::shading::ShadingError;

/// Texels that cannot be had.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum AtlasError {
    /// Nothing tells where the mesh lies.
    #[error(
        "the mesh has no texture coordinates, but the enabled effects are computed in texels of its UV atlas. Give a \
         mesh with TEXCOORD_0, or leave the effects out."
    )]
    NoUvs,
    /// A tiled mesh: several places would share a texel.
    #[error(
        "texture coordinates lie in the tile ({u}, {v}){}, but effects that are computed in the UV atlas need all of \
         them in the unit square: UDIMs are not read. Lay the mesh out there, name another set of them (`uv_set` in \
         [diffusion]), or leave those effects out.",
        udim(*u, *v)
    )]
    Outside {
        /// The tile's column.
        u: f32,
        /// The tile's row.
        v: f32,
    },
    /// Texels that are of two places of the surface.
    #[error(
        "{:.1}% of the texels that the mesh covers of its UV atlas are of two or more places of the surface (mirrored or \
         overlapping charts), and a texel cannot hold two lights. Name a set of texture coordinates whose charts lie apart \
         (`uv_set` in [diffusion]), unwrap the mesh so, or leave the effects out that are computed there.",
        100.0 * share
    )]
    Overlap {
        /// Their share of the covered texels.
        share: f64,
    },
    /// A quantity that texels do not hold, or whose step to the next texel is not known.
    #[error("`{quantity}` is not stored with texels: dpdx and dpdy are there for what vertices hold.")]
    NotStored {
        /// The quantity.
        quantity: String,
    },
    /// The effects cannot be computed.
    #[error(transparent)]
    Shading(#[from] ShadingError),
}

/// A tile's number among UDIMs, of which ten stand in a row, where it has one. Rows are counted upwards, glTF's v downwards.
fn udim(u: f32, v: f32) -> String {
    let row = -v;
    let named = (0.0..10.0).contains(&u) && (0.0..900.0).contains(&row);
    if named { format!(", which is UDIM {}", 1001.0 + u + 10.0 * row) } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_named_as_udims() {
        let told = |u: f32, v: f32| AtlasError::Outside { u, v }.to_string();
        // Mari's numbers: 1002 lies to the right of 1001, 1011 above it.
        assert!(told(1.0, 0.0).contains("tile (1, 0), which is UDIM 1002, but"), "{}", told(1.0, 0.0));
        assert!(told(0.0, -1.0).contains("UDIM 1011,") && told(9.0, -2.0).contains("UDIM 1030,"));
        for (u, v) in [(0.0, 1.0), (10.0, 0.0), (-1.0, 0.0), (0.0, -900.0)] {
            assert!(!told(u, v).contains("which is UDIM"), "{}", told(u, v));
        }
    }
}
