//! One wgpu device for burn's tensors, the engine and the renderer.

use burn::backend::wgpu::WgpuSetup;
use burn::tensor::Device;

use super::TensorError;
use crate::gpu::{Choice, Gpu};

/// A device of wgpu that burn's tensors live on, and that our own passes run on: what one of them leaves in a
/// buffer the other reads there, without a copy.
#[derive(Clone, Debug)]
pub struct SharedDevice {
    gpu: Gpu,
    device: Device,
}

impl SharedDevice {
    /// The adapter of that choice, opened with everything that it has, and registered with burn.
    ///
    /// A process opens one and clones it: burn keeps a thread for each for as long as the process lives.
    ///
    /// # Errors
    /// When there is no such adapter, it gives no device, or burn does not take it.
    pub fn open(choice: &Choice) -> Result<Self, TensorError> {
        let gpu = Gpu::open(&Choice { everything: true, ..choice.clone() })?;
        let setup = WgpuSetup {
            // Burn keeps the handles, and makes nothing of this one.
            instance: wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle()),
            adapter: gpu.adapter.clone(),
            device: gpu.device.clone(),
            queue: gpu.queue.clone(),
            backend: gpu.adapter.get_info().backend,
        };
        let registered = Device::wgpu_options().setup(setup).init();
        let device = registered.map_err(|error| TensorError::NotShared {
            adapter: gpu.name().to_owned(),
            reason: error.to_string(),
        })?;
        // Burn has put listeners that panic in place of ours.
        gpu.listen();
        Ok(Self { gpu, device })
    }

    /// The device as the renderer and the engine see it.
    #[must_use]
    pub const fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The device as burn sees it: `device().autodiff()` is the one on which tensors are tracked.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }
}
