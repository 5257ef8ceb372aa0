//! Samples and targets on the device, view by view, in parts that fit a binding.

use std::ops::Range;

use wgpu::Buffer;

use super::Memory;
use super::cuts::{blocks, cut, records, write};
use super::part::{Part, PartBuffers, Size};
use super::samples::DeviceSamples;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::samples::surface_records::Places;
use crate::{Gpu, GpuError};
use skinfit_core::engine::BLOCK;
use skinfit_core::engine::view::ObservedView;

/// What is the same for all views.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ViewFormat {
    /// Where a sample's numbers stand, and how many rows a record has.
    pub(super) places: Places,
    pub(super) rows: usize,
    /// Rows of a group's target.
    channels: usize,
    /// Whether a pixel has several samples.
    pub(super) several: bool,
    /// Whether pixels count differently.
    pub(super) weighted: bool,
    /// Whether targets are clipped.
    pub(super) clipped: bool,
    /// Rows of what samples look up of the UV atlas.
    pub(super) levels: usize,
}

impl ViewFormat {
    pub(super) fn of(gpu: &Gpu, views: &[ObservedView]) -> Result<Self, GpuError> {
        let single = |view: &ObservedView| view.samples.records() == view.samples.groups();
        let first = views.first();
        let format = Self {
            places: first.map(|view| *view.samples.surface.places()).unwrap_or_default(),
            rows: first.map_or(0, |view| view.samples.surface.rows().stride()),
            channels: first.map_or(0, |view| view.target.stride()),
            several: !views.iter().all(single),
            weighted: views.iter().any(|view| !view.weight.is_empty()),
            clipped: views.iter().any(|view| view.clip.is_some()),
            levels: 0,
        };
        let alike = |view: &ObservedView| {
            *view.samples.surface.places() == format.places && view.target.stride() == format.channels
        };
        if views.iter().all(alike) {
            return Ok(format);
        }
        Err(GpuError::Refused {
            adapter: gpu.name().to_owned(),
            reason: "the views' samples or targets hold different numbers".to_owned(),
        })
    }
}

/// The parts of all views.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) parts: Vec<Part>,
    format: ViewFormat,
    pub(super) stride: usize,
    /// Bytes that a part's samples may take, or their terms.
    limit: u64,
    memory: Memory,
    /// What the samples of each view look up of the UV atlas, record by record; nothing where there is none.
    levels: Vec<Vec<Row>>,
    /// The levels that all samples look up, where these stand in a buffer.
    shared_levels: Option<Buffer>,
}

impl Parts {
    /// The parts of `views`; their samples are `made` on the device, or else uploaded, and may look up `levels` that stand
    /// there.
    pub(super) fn new(
        gpu: &Gpu,
        views: &[ObservedView],
        format: &ViewFormat,
        memory: Memory,
        (made, levels): (Option<&DeviceSamples>, Option<&Buffer>),
    ) -> Result<Self, GpuError> {
        let limits = gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let limit = memory.part.map_or(limit, |part| part.min(limit));
        let mut parts = Self {
            parts: Vec::new(),
            format: *format,
            stride: 1,
            limit,
            memory,
            levels: Vec::new(),
            shared_levels: levels.cloned(),
        };
        if let (Some(_), Some(most)) = (made, memory.resident) {
            let bytes = views.iter().map(|view| parts.size(view, &(0..view.samples.groups())).total()).sum();
            if bytes > most {
                return Err(GpuError::SamplesStay { adapter: gpu.name().to_owned(), bytes, most });
            }
        }
        let (mut used, mut shared) = (0, None);
        for (index, view) in views.iter().enumerate() {
            for groups in cut(view, format.rows.max(format.levels), limit) {
                let size = parts.size(view, &groups);
                let resident = memory.resident.is_none_or(|most| used + size.total() <= most);
                let buffers = if resident {
                    used += size.total();
                    PartBuffers::new(gpu, size, levels)?
                } else {
                    // The largest that any streamed part can be: a cut's limit.
                    let buffers = match shared.take() {
                        Some((buffers, most)) if size.within(most) => (buffers, most),
                        Some((_, most)) => (PartBuffers::new(gpu, size.max(most), levels)?, size.max(most)),
                        None => (PartBuffers::new(gpu, size, levels)?, size),
                    };
                    shared.insert(buffers).0.clone()
                };
                let part = Part {
                    view: index,
                    resident,
                    uploaded: size.total(),
                    buffers,
                    blocks: blocks(view, &groups),
                    read: (groups.len() * LANES) as u32,
                    groups,
                };
                if resident {
                    parts.upload(gpu, view, &part, made.is_none())?;
                }
                parts.parts.push(part);
            }
        }
        // A later streamed part may have needed larger shared buffers: all use the last ones.
        if let Some((buffers, _)) = shared {
            parts
                .parts
                .iter_mut()
                .filter(|part| !part.resident)
                .for_each(|part| part.buffers = buffers.clone());
        }
        if let Some(made) = made {
            made.fill(&parts.parts)?;
        }
        gpu.check()?;
        Ok(parts)
    }

    /// For each part, its view.
    pub(super) fn views(&self) -> Vec<usize> {
        self.parts.iter().map(|part| part.view).collect()
    }

    /// Bytes of the buffers on the device, and bytes that are uploaded to visit each part once.
    pub(super) fn bytes(&self) -> (u64, u64) {
        let bytes = |part: &Part| {
            let PartBuffers { samples, group_start, targets, levels } = &part.buffers;
            let levels = levels.as_ref().filter(|_| self.shared_levels.is_none());
            let own = [Some(samples), Some(group_start), Some(targets), levels];
            own.into_iter().flatten().map(Buffer::size).sum::<u64>()
        };
        let own: u64 = self.parts.iter().filter(|part| part.resident).map(bytes).sum();
        let mut streamed = self.parts.iter().filter(|part| !part.resident);
        let uploaded = streamed.clone().map(|part| part.uploaded).sum();
        // All that are streamed take turns in the same buffers.
        let shared = self.shared_levels.as_ref().map_or(0, Buffer::size);
        (own + shared + streamed.next().map_or(0, bytes), uploaded)
    }

    /// Read every `stride`-th block; returns the weight of the pixels that are read, and how many count.
    pub(super) fn set_stride(&mut self, stride: usize) -> (f64, u64) {
        self.stride = stride;
        let mut total = (0.0, 0);
        for part in &mut self.parts {
            let read = part.blocks.iter().step_by(stride);
            // Whole blocks, but for the last, which may be a part's short one.
            let whole = read.len().saturating_sub(1);
            let last = part.groups.len().saturating_sub(whole * stride * BLOCK).min(BLOCK);
            part.read = ((whole * BLOCK + last) * LANES) as u32;
            for &(weight, count) in read {
                total.0 += weight;
                total.1 += count;
            }
        }
        total
    }

    /// Whether every part stays on the device, and there is room for records of `rows` rows of each. Longer ones than
    /// the samples' stand beside these while they are made: not where memory is limited.
    pub(super) fn all_hold(&self, rows: usize, views: &[ObservedView]) -> bool {
        let bytes = |part: &Part| (4 * rows * Self::samples(part, views)) as u64;
        let room = |part: &Part| self.memory.resident.is_none() && bytes(part) <= self.limit;
        self.parts.iter().all(|part| part.resident && (rows <= self.format.rows || room(part)))
    }

    /// Upload every part's samples anew, or have them made anew, where their terms stand.
    pub(super) fn reload(
        &mut self,
        gpu: &Gpu,
        views: &[ObservedView],
        made: Option<&DeviceSamples>,
    ) -> Result<(), GpuError> {
        for index in 0..self.parts.len() {
            let part = &self.parts[index];
            let size = self.size(&views[part.view], &part.groups);
            // Longer records than the samples' had a buffer of their own.
            if part.buffers.samples.size() > size.samples.max(16) {
                self.parts[index].buffers = PartBuffers::new(gpu, size, self.shared_levels.as_ref())?;
            }
            let part = &self.parts[index];
            self.upload(gpu, &views[part.view], part, made.is_none())?;
        }
        made.map_or(Ok(()), |made| made.fill(&self.parts))
    }

    /// Whether samples look something up of the UV atlas.
    pub(super) const fn have_levels(&self) -> bool {
        self.format.levels > 0 || self.shared_levels.is_some()
    }

    /// Have what the samples of each view look up beside them.
    pub(super) fn set_levels(
        &mut self,
        gpu: &Gpu,
        views: &[ObservedView],
        levels: Vec<Vec<Row>>,
    ) -> Result<(), GpuError> {
        self.levels = levels;
        for part in self.parts.iter().filter(|part| part.resident) {
            self.upload_levels(gpu, &views[part.view], part);
        }
        gpu.check()
    }

    fn upload_levels(&self, gpu: &Gpu, view: &ObservedView, part: &Part) {
        let (Some(buffer), Some(rows)) = (&part.buffers.levels, self.levels.get(part.view)) else { return };
        write(gpu, buffer, (rows, self.format.levels), &records(view, &part.groups));
    }

    /// Upload a part that does not stay on the device.
    pub(super) fn stream(&self, gpu: &Gpu, views: &[ObservedView], part: &Part) -> Result<(), GpuError> {
        self.upload(gpu, &views[part.view], part, true)
    }

    /// Whether each pass uploads the part.
    pub(super) const fn is_streamed(part: &Part) -> bool {
        !part.resident
    }

    fn size(&self, view: &ObservedView, groups: &Range<usize>) -> Size {
        let rows = |count: usize| (count * size_of::<Row>()) as u64;
        Size {
            samples: rows(records(view, groups).len() * self.format.rows),
            starts: (4 * (groups.len() + 1)) as u64,
            targets: rows(groups.len() * (self.format.channels + usize::from(self.format.weighted))),
            levels: rows(records(view, groups).len() * self.format.levels),
        }
    }

    /// Upload what a part's buffers hold, with or without its samples.
    fn upload(
        &self,
        gpu: &Gpu,
        view: &ObservedView,
        part: &Part,
        with_samples: bool,
    ) -> Result<(), GpuError> {
        let PartBuffers { samples, group_start, targets, .. } = &part.buffers;
        let records = records(view, &part.groups);
        if with_samples {
            let rows = view.samples.surface.rows();
            write(gpu, samples, (rows.all(), rows.stride()), &records);
        }
        let starts: Vec<u32> = view.samples.group_start[part.groups.start..=part.groups.end]
            .iter()
            .map(|&start| start - records.start as u32)
            .collect();
        gpu.queue.write_buffer(group_start, 0, bytemuck::cast_slice(&starts));
        self.upload_levels(gpu, view, part);
        let observed = write(gpu, targets, (view.target.all(), view.target.stride()), &part.groups);
        if self.format.weighted {
            let ones;
            let weights = match view.weight.get(part.groups.clone()) {
                Some(weights) => weights,
                None => {
                    ones = vec![Row::of([1.0; LANES]); part.groups.len()];
                    &ones
                }
            };
            gpu.queue.write_buffer(targets, observed, bytemuck::cast_slice(weights));
        }
        gpu.check()
    }
}
