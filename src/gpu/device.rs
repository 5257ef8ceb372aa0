//! The device, and what went wrong there.

use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use web_time::Instant;
use wgpu::{
    Adapter, AdapterInfo, Buffer, BufferDescriptor, BufferUsages, Device, DeviceDescriptor, DeviceType,
    Features, Limits, MemoryHints, PollType, Queue,
};

use super::adapter::{Choice, WELCOME, find};
use super::error::GpuError;

/// How long a card is asked without a pause.
const EAGER: Duration = Duration::from_millis(2);
/// Pauses between questions: a sixteenth of the wait so far, within these.
const SHORTEST_SLEEP: Duration = Duration::from_micros(20);
const LONGEST_SLEEP: Duration = Duration::from_millis(2);

/// An adapter's device, open for work: a handle, whose clones are of the same device.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The device, for passes of other libraries of the project.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    /// The adapter that it is of.
    pub adapter: Adapter,
    info: Arc<AdapterInfo>,
    /// The first thing that went wrong; errors after it are its consequences.
    fault: Arc<Mutex<Option<GpuError>>>,
}

impl Gpu {
    /// A device of the chosen adapter, with the features and limits that rendering uses.
    ///
    /// # Errors
    /// When there is no such adapter, or it gives no device.
    pub async fn request(choice: &Choice) -> Result<Self, GpuError> {
        let adapter = find(choice).await?;
        let info = adapter.get_info();
        let descriptor = DeviceDescriptor {
            label: Some("skinfit"),
            required_features: features(&adapter, choice.everything),
            required_limits: limits(&adapter.limits(), choice),
            // One scene and its targets: blocks for many small resources would stay empty.
            memory_hints: MemoryHints::MemoryUsage,
            ..DeviceDescriptor::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await.map_err(|error| {
            GpuError::NoDevice { adapter: info.name.clone(), reason: sentence(&error.to_string()) }
        })?;
        Ok(Self::adopt(adapter, device, queue))
    }

    /// As [`Self::request`]; waits for it, which a browser does not allow.
    ///
    /// # Errors
    /// As of [`Self::request`].
    #[cfg(not(target_family = "wasm"))]
    pub fn open(choice: &Choice) -> Result<Self, GpuError> {
        pollster::block_on(Self::request(choice))
    }

    /// A device that the program has already, as of a window. Errors of all that is done on it are told by
    /// [`Self::check`] from now on.
    #[must_use]
    pub fn adopt(adapter: Adapter, device: Device, queue: Queue) -> Self {
        let info = Arc::new(adapter.get_info());
        let gpu = Self { device, queue, adapter, info, fault: Arc::default() };
        gpu.listen();
        gpu
    }

    /// Whether two handles are of one device. (wgpu compares numbers that devices of two instances may share.)
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.fault, &other.fault)
    }

    /// Keep the first error, instead of wgpu's panic. A library that shares the device may have put its own
    /// listeners in their place.
    pub fn listen(&self) {
        let (fault, adapter) = (self.fault.clone(), self.info.name.clone());
        self.device.on_uncaptured_error(Arc::new(move |error| {
            let adapter = adapter.clone();
            keep(
                &fault,
                match error {
                    wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory { adapter },
                    other => GpuError::Refused { adapter, reason: sentence(&other.to_string()) },
                },
            );
        }));
        let (fault, adapter) = (self.fault.clone(), self.info.name.clone());
        self.device.set_device_lost_callback(move |_, reason| {
            let lost = GpuError::Lost { adapter: adapter.clone(), reason: sentence(&reason) };
            // What a lost device refuses says less than that it is lost.
            *fault.lock().unwrap_or_else(PoisonError::into_inner) = Some(lost);
        });
    }

    /// Whether all went well so far.
    ///
    /// # Errors
    /// The first thing that did not.
    pub fn check(&self) -> Result<(), GpuError> {
        let fault = || self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if fault().is_some() {
            // The refusals of a lost device come before the word that it is lost, which a poll brings.
            let _ = self.device.poll(PollType::Poll);
        }
        fault().map_or(Ok(()), Err)
    }

    /// A buffer that holds `contents`. (wgpu's own helper panics where the device is lost.)
    pub fn buffer(&self, label: &str, contents: &[u8], usage: BufferUsages) -> Buffer {
        let buffer = self.device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// A buffer that shaders read `contents` from.
    ///
    /// # Errors
    /// When it is larger than a binding may be, or the device does not take it.
    pub fn storage(&self, what: &str, contents: &[u8]) -> Result<Buffer, GpuError> {
        self.check_binding(what, contents.len() as u64)?;
        let made = self.buffer(what, contents, BufferUsages::STORAGE);
        self.check()?;
        Ok(made)
    }

    /// A buffer of `bytes` bytes for shaders to write and read; they are 0 at first.
    ///
    /// # Errors
    /// When it is larger than a binding may be, or the device has no room for it.
    pub fn scratch(&self, what: &str, bytes: u64) -> Result<Buffer, GpuError> {
        self.check_binding(what, bytes)?;
        let made = self.device.create_buffer(&BufferDescriptor {
            label: Some(what),
            size: bytes,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.check()?;
        Ok(made)
    }

    /// Refuse what a binding cannot hold.
    pub fn check_binding(&self, what: &str, bytes: u64) -> Result<(), GpuError> {
        let limits = self.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes <= limit {
            return Ok(());
        }
        let (adapter, what) = (self.name().to_owned(), what.to_owned());
        Err(GpuError::BufferSize { adapter, what, bytes, limit, of: super::Oversized::Samples })
    }

    /// Keep what went wrong where nothing can be returned, for [`check`](Self::check) to tell.
    pub fn fail(&self, error: GpuError) {
        keep(&self.fault, error);
    }

    /// Wait until all submitted work is done.
    pub fn wait(&self) -> Result<(), GpuError> {
        let (send, told) = std::sync::mpsc::channel();
        self.queue.on_submitted_work_done(move || {
            // The receiver may have given up.
            let _ = send.send(());
        });
        self.until(&told)
    }

    /// Wait for the word of something that the device does. The device is asked again and again: a card answers
    /// sooner than the system would wake a thread that sleeps in the driver, and threads that share a device take
    /// one another's word.
    pub fn until<T>(&self, told: &Receiver<T>) -> Result<T, GpuError> {
        if cfg!(target_family = "wasm") {
            return Err(self.lost("a browser does not let a program wait for it: read it asynchronously"));
        }
        let start = Instant::now();
        loop {
            let polled = self.device.poll(PollType::Poll);
            match told.try_recv() {
                Ok(word) => {
                    self.check()?;
                    return Ok(word);
                }
                Err(TryRecvError::Disconnected) => return Err(self.lost("what was computed never came back")),
                Err(TryRecvError::Empty) => self.check()?,
            }
            polled.map_err(|error| self.lost(&error.to_string()))?;
            let waited = start.elapsed();
            // A program on the CPU needs the core.
            if self.is_software() || waited > EAGER {
                std::thread::sleep((waited / 16).clamp(SHORTEST_SLEEP, LONGEST_SLEEP));
            }
        }
    }

    /// That the device does not answer, in the driver's words.
    pub fn lost(&self, reason: &str) -> GpuError {
        match self.check() {
            Err(error) => error,
            Ok(()) => GpuError::Lost { adapter: self.info.name.clone(), reason: sentence(reason) },
        }
    }

    /// Give the device back; whatever is asked of it afterwards is answered by [`GpuError::Lost`].
    pub fn close(&self) {
        self.device.destroy();
    }

    /// The adapter's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.info.name
    }

    /// Whether the adapter is a program on the CPU.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.info.device_type == DeviceType::Cpu
    }

    /// Whether shaders may compute in 16 bits.
    #[must_use]
    pub fn f16(&self) -> bool {
        self.device.features().contains(Features::SHADER_F16)
    }

    /// Whether passes can be timed.
    #[must_use]
    pub fn timestamps(&self) -> bool {
        self.device.features().contains(Features::TIMESTAMP_QUERY)
    }

    /// How many storage buffers a shader may have.
    #[must_use]
    pub fn storage_buffers(&self) -> u32 {
        self.device.limits().max_storage_buffers_per_shader_stage
    }

    /// Write into a buffer, before whatever is submitted next.
    pub fn write(&self, buffer: &Buffer, offset: u64, contents: &[u8]) {
        self.queue.write_buffer(buffer, offset, contents);
        self.queue.submit([]);
    }

    /// The longest side of a texture.
    #[must_use]
    pub fn max_side(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }
}

/// What rendering uses of the adapter's features, or everything but what is experimental (it may not be asked
/// for without `unsafe`) and mapped device memory (wgpu warns of its cost).
fn features(adapter: &Adapter, everything: bool) -> Features {
    if everything {
        return adapter.features() - Features::all_experimental_mask() - Features::MAPPABLE_PRIMARY_BUFFERS;
    }
    adapter.features() & WELCOME.iter().fold(Features::empty(), |all, (feature, ..)| all | *feature)
}

/// WebGPU's defaults, but sizes as large as the adapter has them; or all as large.
fn limits(adapter: &Limits, choice: &Choice) -> Limits {
    let side = adapter.max_texture_dimension_2d;
    let side = choice.max_side.unwrap_or(side).min(side);
    if choice.everything {
        return Limits { max_texture_dimension_2d: side, ..adapter.clone() };
    }
    Limits {
        max_texture_dimension_2d: side,
        max_buffer_size: adapter.max_buffer_size,
        max_storage_buffer_binding_size: adapter.max_storage_buffer_binding_size,
        // Each light has fields of its own.
        max_vertex_buffers: adapter.max_vertex_buffers,
        max_vertex_attributes: adapter.max_vertex_attributes,
        max_inter_stage_shader_variables: adapter.max_inter_stage_shader_variables,
        ..Limits::default().or_worse_values_from(adapter)
    }
}

fn keep(fault: &Mutex<Option<GpuError>>, error: GpuError) {
    fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

/// A driver's words on one line, without the full stop.
fn sentence(words: &str) -> String {
    let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
    let line = line.trim_end_matches('.');
    if line.is_empty() { "the driver gives no reason".to_owned() } else { line.to_owned() }
}
