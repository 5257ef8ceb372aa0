//! One part of a view on the device, and its buffers.

use std::ops::Range;

use wgpu::{Buffer, BufferDescriptor, BufferUsages};

use crate::{Gpu, GpuError};

/// One part of a view.
pub(super) struct Part {
    pub(super) view: usize,
    pub(super) groups: Range<usize>,
    /// Whether its buffers are its own.
    pub(super) resident: bool,
    /// Bytes that an upload writes.
    pub(super) uploaded: u64,
    pub(super) buffers: PartBuffers,
    /// Weight and count of each block of pixels.
    pub(super) blocks: Vec<(f64, u64)>,
    /// Pixels that a pass reads.
    pub(super) read: u32,
}

/// The buffers of group 1, the sums apart.
#[derive(Clone)]
pub(super) struct PartBuffers {
    pub(super) samples: Buffer,
    pub(super) group_start: Buffer,
    pub(super) targets: Buffer,
    /// What samples look up of the UV atlas.
    pub(super) levels: Option<Buffer>,
}

/// Bytes of a part's buffers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    pub(super) samples: u64,
    pub(super) starts: u64,
    pub(super) targets: u64,
    pub(super) levels: u64,
}

impl Size {
    pub(super) const fn total(self) -> u64 {
        self.samples + self.starts + self.targets + self.levels
    }

    pub(super) const fn within(self, other: Self) -> bool {
        let of_samples = self.samples <= other.samples && self.levels <= other.levels;
        of_samples && self.starts <= other.starts && self.targets <= other.targets
    }

    pub(super) fn max(self, other: Self) -> Self {
        Self {
            samples: self.samples.max(other.samples),
            starts: self.starts.max(other.starts),
            targets: self.targets.max(other.targets),
            levels: self.levels.max(other.levels),
        }
    }
}

impl PartBuffers {
    /// Of that size; levels that are there already are looked up as they are.
    pub(super) fn new(gpu: &Gpu, size: Size, shared: Option<&Buffer>) -> Result<Self, GpuError> {
        let buffer = |label, bytes: u64, usage| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: bytes.max(16),
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let own = || (size.levels > 0).then(|| buffer("levels", size.levels, BufferUsages::STORAGE));
        let made = Self {
            samples: buffer("samples", size.samples, BufferUsages::STORAGE),
            group_start: buffer("group starts", size.starts, BufferUsages::STORAGE),
            targets: buffer("targets", size.targets, BufferUsages::STORAGE),
            levels: shared.cloned().or_else(own),
        };
        gpu.check()?;
        Ok(made)
    }
}
