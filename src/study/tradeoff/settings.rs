//! The settings of a scene that sweeps change, and what its samples depend on of them.

use crate::model::effects::Silhouette;
use crate::model::texture_filter::TextureFilter;
use crate::scene::Quality;

/// The settings that a scene file can have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// `[model] silhouette`
    pub silhouette: Silhouette,
    /// `[quality]`
    pub quality: Quality,
}

/// What of the settings the samples depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Traced {
    silhouette: Silhouette,
    samples_per_axis: u32,
    occlusion_rays: u32,
    texture_filter: TextureFilter,
}

impl From<Settings> for Traced {
    fn from(Settings { silhouette, quality }: Settings) -> Self {
        let Quality { samples_per_axis, occlusion_rays, texture_filter, .. } = quality;
        Self { silhouette, samples_per_axis, occlusion_rays, texture_filter }
    }
}

impl Traced {
    /// Whether what samples show is the same as with `other`, but for their occlusion.
    pub(super) fn is_but_for_occlusion(self, other: Self) -> bool {
        Self { occlusion_rays: other.occlusion_rays, ..self } == other
    }
}
