//! Images from the device.

use std::future::poll_fn;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Poll, Waker};

use exr::prelude::f16;
use wgpu::{
    Buffer, BufferDescriptor, BufferSlice, BufferUsages, COPY_BYTES_PER_ROW_ALIGNMENT, CommandEncoder,
    Extent3d, MapMode, PollType, TexelCopyBufferInfo, TexelCopyBufferLayout, TextureView,
};

use super::device::Gpu;
use super::error::GpuError;

/// A texture's copy in a buffer that the CPU can read.
pub(super) struct Copy {
    buffer: Buffer,
    width: usize,
    height: usize,
    /// Bytes of a channel: 2 or 4.
    channel_bytes: usize,
    channels: usize,
    row_bytes: usize,
}

impl Copy {
    /// Copy a texture of floats when the encoder's commands run.
    pub(super) fn new(gpu: &Gpu, encoder: &mut CommandEncoder, view: &TextureView) -> Self {
        let texture = view.texture();
        let (width, height) = (texture.width(), texture.height());
        let texel_bytes = texture.format().block_copy_size(None).unwrap_or(16) as usize;
        let channels = usize::from(texture.format().components());
        let row_bytes =
            (width as usize * texel_bytes).next_multiple_of(COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let buffer = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("readback"),
            size: (row_bytes * height as usize) as u64,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_bytes as u32),
            rows_per_image: Some(height),
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            TexelCopyBufferInfo { buffer: &buffer, layout },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        let (width, height) = (width as usize, height as usize);
        Self { buffer, width, height, channel_bytes: texel_bytes / channels, channels, row_bytes }
    }

    /// The numbers, row by row and texel by texel; waits until they are there.
    pub(super) fn read(&self, gpu: &Gpu) -> Result<Vec<f32>, GpuError> {
        map(gpu, &self.buffer.slice(..))?;
        self.numbers(gpu)
    }

    /// As [`Self::read`], without waiting.
    pub(super) async fn arrived(&self, gpu: &Gpu) -> Result<Vec<f32>, GpuError> {
        mapped(gpu, &self.buffer.slice(..)).await?;
        self.numbers(gpu)
    }

    /// The numbers, once the buffer is mapped.
    fn numbers(&self, gpu: &Gpu) -> Result<Vec<f32>, GpuError> {
        let slice = self.buffer.slice(..);
        let view = slice.get_mapped_range().map_err(|error| gpu.lost(&error.to_string()))?;
        let bytes: &[u8] = &view;
        let row = |y: usize| {
            let start = y * self.row_bytes;
            &bytes[start..start + self.width * self.channels * self.channel_bytes]
        };
        let mut numbers = Vec::with_capacity(self.width * self.height * self.channels);
        for y in 0..self.height {
            if self.channel_bytes == 2 {
                let half = |pair: &[u8]| f16::from_le_bytes([pair[0], pair[1]]).to_f32();
                numbers.extend(row(y).chunks_exact(2).map(half));
            } else {
                let single = |four: &[u8]| f32::from_le_bytes([four[0], four[1], four[2], four[3]]);
                numbers.extend(row(y).chunks_exact(4).map(single));
            }
        }
        Ok(numbers)
    }
}

/// Wait until a buffer's content can be read.
pub(crate) fn map(gpu: &Gpu, slice: &BufferSlice<'_>) -> Result<(), GpuError> {
    let (send, told) = std::sync::mpsc::channel();
    slice.map_async(MapMode::Read, move |result| {
        // The receiver may have given up.
        let _ = send.send(result);
    });
    gpu.until(&told)?.map_err(|error| gpu.lost(&error.to_string()))
}

/// As [`map`], without waiting.
pub(super) async fn mapped(gpu: &Gpu, slice: &BufferSlice<'_>) -> Result<(), GpuError> {
    let answer = Arc::new(Mutex::new((None, None::<Waker>)));
    let told = Arc::clone(&answer);
    slice.map_async(MapMode::Read, move |result| {
        let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
        told.0 = Some(result);
        if let Some(waker) = told.1.take() {
            waker.wake();
        }
    });
    let result = poll_fn(|context| {
        // A browser tells by itself; elsewhere the device tells when it is asked, again and again.
        let polled = gpu.device.poll(PollType::Poll);
        let mut answer = answer.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(result) = answer.0.take() {
            return Poll::Ready(result.map_err(|error| gpu.lost(&error.to_string())));
        }
        if let Err(error) = polled {
            return Poll::Ready(Err(gpu.lost(&error.to_string())));
        }
        answer.1 = Some(context.waker().clone());
        if cfg!(not(target_family = "wasm")) {
            context.waker().wake_by_ref();
        }
        Poll::Pending
    });
    result.await?;
    gpu.check()
}

/// Run the encoder's commands, and read the floats that they leave in `buffer`.
pub(crate) fn read_floats(gpu: &Gpu, encoder: CommandEncoder, buffer: &Buffer) -> Result<Vec<f32>, GpuError> {
    read(gpu, encoder, buffer, f32::from_le_bytes)
}

/// Run the encoder's commands, and read the words that they leave in `buffer`.
pub(super) fn read_words(gpu: &Gpu, encoder: CommandEncoder, buffer: &Buffer) -> Result<Vec<u32>, GpuError> {
    read(gpu, encoder, buffer, u32::from_le_bytes)
}

fn read<T>(
    gpu: &Gpu,
    mut encoder: CommandEncoder,
    buffer: &Buffer,
    number: fn([u8; 4]) -> T,
) -> Result<Vec<T>, GpuError> {
    let copy = gpu.device.create_buffer(&BufferDescriptor {
        label: Some("readback"),
        size: buffer.size(),
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    let slice = copy.slice(..);
    map(gpu, &slice)?;
    let view = slice.get_mapped_range().map_err(|error| gpu.lost(&error.to_string()))?;
    let bytes: &[u8] = &view;
    Ok(bytes.chunks_exact(4).map(|b| number([b[0], b[1], b[2], b[3]])).collect())
}
