//! GPU time by pass, from the adapter's timestamps, or the host's clock where those say nothing.

use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, ComputePassTimestampWrites, QUERY_SIZE, QuerySet,
    QuerySetDescriptor, QueryType, RenderPassTimestampWrites,
};

use web_time::Instant;

use super::device::Gpu;
use super::error::GpuError;
use super::readback::map;

/// The passes of one tile: an image's own few, those over the atlas, two for each blur, and one for each layer of shadow
/// maps.
const MOST_PASSES: u32 = 320;

/// GPU time of a pass, over all tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// The pass.
    pub pass: &'static str,
    /// Milliseconds.
    pub milliseconds: f64,
}

/// Timestamps around the passes that are submitted at once.
pub(crate) struct Timer {
    /// Absent where the adapter has no timestamps.
    queries: Option<(QuerySet, Buffer, Buffer)>,
    passes: Vec<&'static str>,
    /// Whether the adapter is a program on the CPU. It stamps a compute pass before its threads have run it: then the
    /// host's clock counts, from the submission to its end.
    software: bool,
    computes: bool,
    since: Option<Instant>,
    /// Sums over submissions.
    pub(crate) times: Vec<PassTime>,
}

impl Timer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let queries = gpu.timestamps().then(|| {
            let set = gpu.device.create_query_set(&QuerySetDescriptor {
                label: Some("times"),
                ty: QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            });
            let buffer = |label, usage| {
                let size = u64::from(2 * MOST_PASSES) * u64::from(QUERY_SIZE);
                let label = Some(label);
                gpu.device.create_buffer(&BufferDescriptor { label, size, usage, mapped_at_creation: false })
            };
            let resolved = buffer("times", BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC);
            let read = buffer("times, readable", BufferUsages::MAP_READ | BufferUsages::COPY_DST);
            (set, resolved, read)
        });
        let (passes, times) = (Vec::new(), Vec::new());
        Self { queries, passes, software: gpu.is_software(), computes: false, since: None, times }
    }

    /// What a pass is to write; none where passes cannot be timed.
    pub(super) fn around(&mut self, pass: &'static str) -> Option<RenderPassTimestampWrites<'_>> {
        let (query_set, first) = self.next(pass)?;
        Some(RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// What a compute pass is to write, likewise.
    pub(crate) fn around_compute(&mut self, pass: &'static str) -> Option<ComputePassTimestampWrites<'_>> {
        self.computes = true;
        let (query_set, first) = self.next(pass)?;
        Some(ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// The queries, and the first of the two that are a pass's.
    fn next(&mut self, pass: &'static str) -> Option<(&QuerySet, u32)> {
        let (set, ..) = self.queries.as_ref()?;
        let first = 2 * self.passes.len() as u32;
        if first >= 2 * MOST_PASSES {
            return None;
        }
        self.passes.push(pass);
        Some((set, first))
    }

    /// After the last pass, before the submission: have the times copied.
    pub(crate) fn finish(&mut self, encoder: &mut CommandEncoder) {
        self.since = (self.software && self.computes).then(Instant::now);
        if let Some((set, resolved, read)) = &self.queries {
            let count = 2 * self.passes.len() as u32;
            encoder.resolve_query_set(set, 0..count, resolved, 0);
            encoder.copy_buffer_to_buffer(resolved, 0, read, 0, u64::from(count * QUERY_SIZE));
        }
    }

    /// After the submission: wait for the times, and add them up.
    pub(crate) fn collect(&mut self, gpu: &Gpu) -> Result<(), GpuError> {
        let passes = std::mem::take(&mut self.passes);
        if let Some(since) = self.since.take() {
            gpu.wait()?;
            self.add("all passes", 1e3 * since.elapsed().as_secs_f64());
            return Ok(());
        }
        let Some((_, _, read)) = &self.queries else { return Ok(()) };
        let read = read.clone();
        let slice = read.slice(..u64::from(2 * passes.len() as u32 * QUERY_SIZE));
        map(gpu, &slice)?;
        {
            let view = slice.get_mapped_range().map_err(|error| gpu.lost(&error.to_string()))?;
            let period = f64::from(gpu.queue.get_timestamp_period());
            for (pass, ticks) in passes.into_iter().zip(view.chunks_exact(16)) {
                let tick =
                    |bytes: &[u8]| bytes.iter().rev().fold(0_u64, |sum, &byte| sum << 8 | u64::from(byte));
                let length = tick(&ticks[8..]).saturating_sub(tick(&ticks[..8]));
                let milliseconds = length as f64 * period * 1e-6;
                self.add(pass, milliseconds);
            }
        }
        read.unmap();
        Ok(())
    }

    fn add(&mut self, pass: &'static str, milliseconds: f64) {
        match self.times.iter_mut().find(|time| time.pass == pass) {
            Some(time) => time.milliseconds += milliseconds,
            None => self.times.push(PassTime { pass, milliseconds }),
        }
    }
}
