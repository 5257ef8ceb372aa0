//! What the renderer refuses, and what a device can do to it.

/// The packages of a software Vulkan driver, by system.
pub const SOFTWARE_DRIVER: &str = if cfg!(target_os = "linux") {
    "On Debian and Ubuntu, `apt-get install mesa-vulkan-drivers libvulkan1` brings a software one"
} else {
    "Install the graphics vendor's driver"
};

/// The renderer could not do its work.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GpuError {
    /// There is nothing to render on.
    #[error(
        "no graphics adapter was found: no Vulkan, Metal or DirectX 12 driver answers. {SOFTWARE_DRIVER}; \
         or take --engine cpu."
    )]
    NoAdapter,
    /// There are adapters, but not that one.
    #[error(
        "no graphics adapter's name contains `{wanted}`. There is: {found}. Name one of them with --adapter (or WGPU_ADAPTER_NAME), or leave it out."
    )]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// Names of the adapters, with commas.
        found: String,
    },
    /// The adapter gives no device.
    #[error(
        "adapter {adapter}: it gives no device: {reason}. Update its driver, choose another adapter with --adapter, or take --engine cpu."
    )]
    NoDevice {
        /// The adapter.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// A texture's side is beyond the adapter's limit.
    #[error(
        "adapter {adapter}: the {what} has {width} x {height} texels, but a side may have {limit} at most there. {remedy}, or take --engine cpu."
    )]
    TextureSize {
        /// The adapter.
        adapter: String,
        /// What the texture holds.
        what: String,
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// The limit.
        limit: u32,
        /// What to do.
        remedy: &'static str,
    },
    /// A buffer is beyond the adapter's limit.
    #[error(
        "adapter {adapter}: the buffer of the {what} takes {bytes} bytes, but one may have {limit} at most there. Use a smaller mesh or fewer morph targets, choose another adapter with --adapter, or take --engine cpu."
    )]
    BufferSize {
        /// The adapter.
        adapter: String,
        /// What the buffer holds.
        what: String,
        /// Its bytes.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// The device has no memory left.
    #[error(
        "adapter {adapter}: out of memory. Use a smaller image (--size), fewer samples (--antialias) or smaller maps, or take --engine cpu."
    )]
    OutOfMemory {
        /// The adapter.
        adapter: String,
    },
    /// Samples that the adapter makes do not all stay on it.
    #[error(
        "adapter {adapter}: its samples take {bytes} bytes, but {most} may stay there. Those that the adapter makes have to stay: allow more (--device-memory), or have them made by the CPU (--samples cpu)."
    )]
    SamplesStay {
        /// The adapter.
        adapter: String,
        /// Bytes of samples and targets.
        bytes: u64,
        /// The most that may stay.
        most: u64,
    },
    /// The device is gone.
    #[error(
        "adapter {adapter}: the device was lost: {reason}. Its driver was reset or taken away: try again, choose another adapter with --adapter, or take --engine cpu."
    )]
    Lost {
        /// The adapter.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// The driver refuses what it was given.
    #[error(
        "adapter {adapter}: its driver refuses the work: {reason}. This is a fault of skinfit or of the driver: please report it, and take --engine cpu meanwhile."
    )]
    Refused {
        /// The adapter.
        adapter: String,
        /// What was refused.
        reason: String,
    },
    /// No shader yields the image within the accuracy.
    #[error("{0} Give a larger --accuracy, or leave it out.")]
    Plan(String),
}
