//! Which adapters there are, and which one is taken.

use wgpu::{Adapter, Backends, DeviceType, Features, Instance, InstanceDescriptor};

use super::error::GpuError;

/// The environment variable that names an adapter.
pub const ADAPTER_VARIABLE: &str = "WGPU_ADAPTER_NAME";

/// Which adapter is wanted, and what of it.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Part of its name, in any case; without: [`ADAPTER_VARIABLE`]'s value, or the fastest kind.
    pub name: Option<String>,
    /// A limit on the sides of textures, below the adapter's own; larger images are drawn in tiles.
    pub max_side: Option<u32>,
    /// Every feature and limit that the adapter has, and not only what rendering uses: what a library of
    /// tensors expects of a device that it shares.
    pub everything: bool,
}

/// Every adapter, the one that is taken by default first.
pub async fn find_adapters() -> Vec<Adapter> {
    // Another crate may have OpenGL compiled in, which cannot draw into 32-bit targets.
    let mut descriptor = InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends &= Backends::PRIMARY;
    let instance = Instance::new(descriptor);
    let mut adapters = instance.enumerate_adapters(Backends::PRIMARY).await;
    adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
    adapters
}

/// As [`find_adapters`]; waits for them, which a browser does not allow.
#[cfg(not(target_family = "wasm"))]
#[must_use]
pub fn adapters() -> Vec<Adapter> {
    pollster::block_on(find_adapters())
}

/// As [`find`]; waits for it, which a browser does not allow.
///
/// # Errors
/// As of [`find`].
#[cfg(not(target_family = "wasm"))]
pub fn choose(choice: &Choice) -> Result<Adapter, GpuError> {
    pollster::block_on(find(choice))
}

/// The adapter of that choice.
///
/// # Errors
/// When there is none at all, or none of that name.
pub async fn find(choice: &Choice) -> Result<Adapter, GpuError> {
    let adapters = find_adapters().await;
    let from_environment = || std::env::var(ADAPTER_VARIABLE).ok().filter(|name| !name.is_empty());
    let Some(wanted) = choice.name.clone().or_else(from_environment) else {
        return adapters.into_iter().next().ok_or(GpuError::NoAdapter);
    };
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter);
    }
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    let matches = |name: &String| name.to_lowercase().contains(&wanted.to_lowercase());
    match names.iter().position(matches) {
        Some(i) => adapters.into_iter().nth(i).ok_or(GpuError::NoAdapter),
        None => Err(GpuError::NoSuchAdapter { wanted, found: names.join(", ") }),
    }
}

/// Where a kind of adapter stands in the order of preference.
const fn rank(kind: DeviceType) -> u8 {
    match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// A kind of adapter in words.
#[must_use]
pub const fn kind_in_words(kind: DeviceType) -> &'static str {
    match kind {
        DeviceType::DiscreteGpu => "discrete GPU",
        DeviceType::IntegratedGpu => "integrated GPU",
        DeviceType::VirtualGpu => "virtual GPU",
        DeviceType::Cpu => "software",
        DeviceType::Other => "unknown kind",
    }
}

/// Features that are used where an adapter has them, with what for.
pub const WELCOME: [(Features, &str, &str); 2] = [
    (Features::TIMESTAMP_QUERY, "timestamps", "GPU time by pass"),
    (Features::SHADER_F16, "16-bit arithmetic", "cheaper rules where the accuracy allows"),
];
