//! What the renderer refuses, and what a device can do to it. An error says what happened; what to do depends on the
//! command, which knows what its options can help.

use crate::scene::Scene;

/// The packages of a software Vulkan driver, by system.
pub const SOFTWARE_DRIVER: &str = if cfg!(target_os = "linux") {
    "On Debian and Ubuntu, `apt-get install mesa-vulkan-drivers libvulkan1` brings a software one"
} else {
    "Install the graphics vendor's driver"
};

/// What is too large for an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Oversized {
    /// A map or a cube of the scene.
    Map,
    /// The image that is drawn.
    Image,
    /// The samples of one pixel.
    Pixel,
    /// Vertices, morph targets or bones.
    Mesh,
    /// Samples of views, or what is computed of them.
    Samples,
    /// A shadow map.
    ShadowMap,
}

/// The renderer could not do its work.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GpuError {
    /// There is nothing to render on.
    #[error("no graphics adapter was found: no Vulkan, Metal or DirectX 12 driver answers.")]
    NoAdapter,
    /// There are adapters, but not that one.
    #[error("no graphics adapter's name contains `{wanted}`. There is: {found}.")]
    NoSuchAdapter {
        /// The requested part of a name.
        wanted: String,
        /// Names of the adapters, with commas.
        found: String,
    },
    /// The adapter gives no device.
    #[error("adapter {adapter}: it gives no device: {reason}.")]
    NoDevice {
        /// The adapter.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// A texture's side is beyond the adapter's limit.
    #[error(
        "adapter {adapter}: {what}: {width} x {height} texels, but a side may have {limit} at most there."
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
        /// What is too large.
        of: Oversized,
    },
    /// A scene's lights take more shadow maps than a texture has layers.
    #[error("adapter {adapter}: {layers} shadow maps, but there may be {limit} at most there.")]
    ShadowMaps {
        /// The adapter.
        adapter: String,
        /// Maps of all lights, six for one that shines to all sides.
        layers: usize,
        /// The limit.
        limit: u32,
    },
    /// A buffer is beyond the adapter's limit.
    #[error(
        "adapter {adapter}: the buffer of the {what} takes {bytes} bytes, but one may have {limit} at most there."
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
        /// What is too large.
        of: Oversized,
    },
    /// The device has no memory left.
    #[error("adapter {adapter}: out of memory.")]
    OutOfMemory {
        /// The adapter.
        adapter: String,
    },
    /// The scene has what adapters do not take.
    #[error("{what}.")]
    CpuAlone {
        /// That it has it, and what they do not do with it.
        what: String,
    },
    /// Samples that the adapter makes do not all stay on it.
    #[error(
        "adapter {adapter}: its samples take {bytes} bytes, but {most} may stay there, and those that the adapter makes have to stay."
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
    #[error("adapter {adapter}: the device was lost: {reason}.")]
    Lost {
        /// The adapter.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// The driver refuses what it was given.
    #[error("adapter {adapter}: its driver refuses the work: {reason}.")]
    Refused {
        /// The adapter.
        adapter: String,
        /// What was refused.
        reason: String,
    },
    /// A mesh does not lie in the atlas in whose texels something is computed.
    #[error(
        "the mesh has texture coordinates in the tile ({u}, {v}), but what is computed in texels needs them within the unit square."
    )]
    OutsideAtlas {
        /// The tile's number along u.
        u: f32,
        /// The tile's number along v.
        v: f32,
    },
    /// A plan reads a level of the atlas that none of the passes before leaves.
    #[error("the plan reads the level {level} of the UV atlas, but no pass before leaves it.")]
    MissingLevel {
        /// Its name.
        level: String,
    },
    /// There is nothing to compute.
    #[error("none of the enabled effects shows anything.")]
    NothingShown,
    /// No shader yields the image within the accuracy.
    #[error("{0}")]
    Plan(String),
}

impl GpuError {
    /// Refuse a scene that adapters do not draw.
    ///
    /// # Errors
    /// When it has what the CPU engine alone draws.
    pub fn check_drawn(scene: &Scene) -> Result<(), Self> {
        scene.cpu_alone().map_or(Ok(()), |what| Err(Self::CpuAlone { what }))
    }

    /// Whether adapters make samples of a scene.
    ///
    /// # Errors
    /// When the CPU alone does.
    pub fn check_sampled(scene: &Scene) -> Result<(), Self> {
        scene.cpu_samples().map_or(Ok(()), |what| Err(Self::CpuAlone { what }))
    }
}
