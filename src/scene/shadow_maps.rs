//! How the renderer finds what stands in a light's way: choices of the `[quality]` table.

use super::error::SceneError;
use super::file::{QualityTable, Source};
use super::numbers::{interval, number, whole};
use crate::model::shadow_filter::ShadowFilter;

/// Shadow maps: what the `[quality]` table says of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowMaps {
    /// `shadow_filter`
    pub filter: ShadowFilter,
    /// `shadow_map_size`: texels along a side of a map.
    pub size: u32,
    /// `shadow_bias`: how far a place is moved towards its light before it is compared: 1 is off all that the texels around
    /// it show of its own plane, were the surface flat.
    pub bias: f64,
    /// `shadow_radius`: how far from a place the filter `pcf` looks, in texels; `pcss` looks no less far.
    pub radius: f64,
    /// `shadow_taps`: comparisons a fragment and light of `pcf`; `pcss`, by default with twice as many, takes as many again
    /// in search of blockers.
    pub taps: u32,
}

impl Default for ShadowMaps {
    fn default() -> Self {
        Self { filter: ShadowFilter::default(), size: 2048, bias: 2.0, radius: 1.0, taps: TAPS }
    }
}

/// Of `pcf`: a disc of one texel's radius, blended between texels, has no use for more. Penumbras are wider.
const TAPS: u32 = 8;
const SOFT_TAPS: u32 = 16;
/// The smallest and the largest map along a side.
const SIZES: [i64; 2] = [16, 8192];
/// Further than that a place is lifted off its own shadow.
const MOST_BIAS: f64 = 64.0;
/// Wider ones leave no edge.
const WIDEST_RADIUS: f64 = 64.0;
/// More taps than texels within a usual radius.
const MOST_TAPS: i64 = 256;

/// The keys of the `[quality]` table over the defaults.
pub(super) fn shadow_maps(source: &Source, table: &QualityTable) -> Result<ShadowMaps, SceneError> {
    let default = ShadowMaps::default();
    let filter = match &table.shadow_filter {
        Some(name) => {
            source.choose("shadow_filter", name, &ShadowFilter::ALL.map(|filter| (filter.name(), filter)))?
        }
        None => default.filter,
    };
    let taps = if filter == ShadowFilter::Pcss { SOFT_TAPS } else { TAPS };
    let texels = |value, default, name, most| {
        let wanted = format!("a number of texels in {}", interval(0.0, most));
        number(source, value, default, name, &wanted, |texels| (0.0..=most).contains(&texels))
    };
    Ok(ShadowMaps {
        filter,
        size: whole(source, table.shadow_map_size.as_ref(), "shadow_map_size", SIZES, default.size)?,
        bias: texels(table.shadow_bias.as_ref(), default.bias, "shadow_bias", MOST_BIAS)?,
        radius: texels(table.shadow_radius.as_ref(), default.radius, "shadow_radius", WIDEST_RADIUS)?,
        taps: whole(source, table.shadow_taps.as_ref(), "shadow_taps", [1, MOST_TAPS], taps)?,
    })
}
