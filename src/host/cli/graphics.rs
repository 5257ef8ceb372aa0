//! What to do about a graphics adapter that cannot: an error says what happened, and each command has remedies of
//! its own.

use super::Refusal;
use crate::gpu::error::SOFTWARE_DRIVER;
use crate::gpu::{GpuError, Oversized};

/// What an adapter is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// `render`.
    Render,
    /// The passes and samples of `fit`.
    Fit,
    /// `fit --maps`, which runs on an adapter alone.
    #[cfg_attr(not(feature = "burn"), allow(dead_code, reason = "maps are fitted with it alone"))]
    Maps,
    /// `stability` and `info`, which go on without.
    Study,
}

impl Task {
    /// The error and what to do about it, as the end of the command.
    pub(super) fn refusal(self, error: &GpuError) -> Refusal {
        Refusal::new(self.words(error))
    }

    /// The error and what to do about it.
    pub(super) fn words(self, error: &GpuError) -> String {
        format!("{error} {}.", self.remedy(error))
    }

    fn remedy(self, error: &GpuError) -> String {
        match error {
            GpuError::NoAdapter => match self.without() {
                Some(without) => format!("{SOFTWARE_DRIVER}; or {without}"),
                None => SOFTWARE_DRIVER.to_owned(),
            },
            GpuError::NoSuchAdapter { .. } => {
                "Name one of them with --adapter (or WGPU_ADAPTER_NAME), or leave it out".to_owned()
            }
            GpuError::NoDevice { .. } => self.or_another("Update its driver"),
            GpuError::TextureSize { of, .. } | GpuError::BufferSize { of, .. } => {
                self.or_another(self.smaller(*of))
            }
            GpuError::ShadowMaps { .. } => self.or_another(
                "Use fewer lights, or spots in the place of lights to all sides, or shadow_filter = \"vertices\" in [quality]",
            ),
            GpuError::OutOfMemory { .. } => match self {
                Self::Render => self
                    .or_another("Use a smaller image (--size), fewer samples (--antialias) or smaller maps"),
                _ => self.or_another(
                    "Use smaller views, fewer samples (samples_per_axis in [quality]) or smaller maps",
                ),
            },
            GpuError::CpuAlone { .. } => match self {
                Self::Render => "Take --engine cpu".to_owned(),
                _ => "Have samples made by the CPU".to_owned(),
            },
            GpuError::SamplesStay { .. } => {
                "Allow more (--device-memory), or have them made by the CPU (--samples cpu)".to_owned()
            }
            GpuError::Lost { .. } => self.or_another("Its driver was reset or taken away: try again"),
            GpuError::Refused { .. } | GpuError::MissingLevel { .. } => {
                let without =
                    self.without().map_or(String::new(), |without| format!(", and {without} meanwhile"));
                format!("This is a fault of skinfit or of the driver: please report it{without}")
            }
            GpuError::OutsideAtlas { .. } => {
                "Unwrap the mesh into the unit square, name another set of texture coordinates (`uv_set` in [diffusion]), or leave \
                 the effect out"
                    .to_owned()
            }
            GpuError::NothingShown => {
                let without = self.without().map_or(String::new(), |without| format!(", or {without}"));
                format!("Add one that does to the scene's effects, such as diffuse{without}")
            }
            GpuError::Plan(_) => match self {
                Self::Render => "Give a larger --accuracy, or leave it out".to_owned(),
                _ => self.or_another("Choose other effects"),
            },
        }
    }

    /// How the command does without an adapter.
    const fn without(self) -> Option<&'static str> {
        match self {
            Self::Render | Self::Fit => Some("take --engine cpu"),
            Self::Maps => Some("leave --maps out"),
            Self::Study => None,
        }
    }

    fn or_another(self, first: &str) -> String {
        match self.without() {
            Some(without) => format!("{first}, choose another adapter with --adapter, or {without}"),
            None => format!("{first}, or choose another adapter with --adapter"),
        }
    }

    const fn smaller(self, what: Oversized) -> &'static str {
        match (what, self) {
            (Oversized::Map, _) => "Scale the map down",
            (Oversized::ShadowMap, _) => "Give a smaller shadow_map_size in [quality]",
            (Oversized::Image, Self::Render) => "Give a smaller --size",
            (Oversized::Pixel, _) => "Give a smaller samples_per_axis in [quality]",
            (Oversized::Mesh, _) => "Use a smaller mesh or fewer morph targets",
            (Oversized::Image | Oversized::Samples, _) => {
                "Use smaller views or fewer samples (samples_per_axis in [quality])"
            }
        }
    }
}

/// What a fit of maps says of its adapter, and what to do about it.
#[cfg(feature = "burn")]
#[must_use]
pub fn tensor_words(error: &crate::tensor::TensorError) -> String {
    match error {
        crate::tensor::TensorError::Gpu(error) => Task::Maps.words(error),
        error => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_error() -> Vec<GpuError> {
        let (adapter, reason) = (|| "Card".to_owned(), || "why".to_owned());
        let of = [Oversized::Map, Oversized::Image, Oversized::Pixel, Oversized::Mesh, Oversized::Samples];
        let sizes = of.into_iter().flat_map(|of| {
            let what = "samples".to_owned();
            let texture = GpuError::TextureSize {
                adapter: adapter(),
                what: what.clone(),
                width: 9,
                height: 9,
                limit: 8,
                of,
            };
            [texture, GpuError::BufferSize { adapter: adapter(), what, bytes: 9, limit: 8, of }]
        });
        let others = [
            GpuError::NoAdapter,
            GpuError::NoSuchAdapter { wanted: "A".to_owned(), found: adapter() },
            GpuError::NoDevice { adapter: adapter(), reason: reason() },
            GpuError::OutOfMemory { adapter: adapter() },
            GpuError::SamplesStay { adapter: adapter(), bytes: 9, most: 8 },
            GpuError::CpuAlone { what: "it has eyes".to_owned() },
            GpuError::Lost { adapter: adapter(), reason: reason() },
            GpuError::Refused { adapter: adapter(), reason: reason() },
            GpuError::NothingShown,
            GpuError::MissingLevel { level: "a".to_owned() },
            GpuError::OutsideAtlas { u: 1.0, v: -2.0 },
            GpuError::Plan("no rule.".to_owned()),
        ];
        sizes.chain(others).collect()
    }

    #[test]
    fn remedies_name_only_what_their_command_has() {
        for error in every_error() {
            for task in [Task::Render, Task::Fit, Task::Maps, Task::Study] {
                let words = task.words(&error);
                let foreign: &[&str] = match task {
                    Task::Render => &["--device-memory", "--maps"],
                    Task::Fit => &["--accuracy", "--size", "--antialias", "--maps"],
                    Task::Maps => &["--accuracy", "--size", "--antialias", "--engine"],
                    Task::Study => &["--accuracy", "--size", "--antialias", "--engine", "--maps"],
                };
                let stays = matches!(error, GpuError::SamplesStay { .. });
                for option in foreign.iter().filter(|_| !stays) {
                    assert!(!words.contains(option), "{task:?}: {words}");
                }
                assert!(words.ends_with('.') && !words.contains(".."), "{words}");
                assert!(!words.contains("  "), "{words}");
            }
        }
    }
}
