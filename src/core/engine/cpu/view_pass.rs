//! A view's blocks of records: from what tapes yield to the sums of loss, gradient and normal equations.

use std::cell::RefCell;
use std::ops::Range;

use super::file::File;
use super::machine;
use super::pass::ChannelColumns;
use super::program::Bound;
use super::streams::{BATCH, Column, FileColumns, Stream, StreamOf, load, store};
use super::sums::{Sums, fold};
use crate::engine::gram::add_gram;
use crate::engine::lanes::Lanes;
use crate::engine::levels::{Corners, Finder};
use crate::engine::part::RowCell;
use crate::engine::residual::Residuals;
use crate::engine::view::ObservedView;
use crate::engine::{BLOCK, PassOutputs};
use crate::model::real::Real;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::scene::Loss;
use crate::simd::Simd;

/// Columns whose slopes are summed up side by side: each addition waits for the one before it.
const TILE: usize = 4;

/// What the blocks of a view read in one pass.
pub(super) struct ViewPass<'a> {
    pub(super) view: &'a ObservedView,
    pub(super) streams: Streams<'a>,
    pub(super) lookup: Option<Lookup<'a>>,
    pub(super) bound: Bound<'a>,
    /// The tape's outputs that are wanted.
    pub(super) read: &'a [usize],
    pub(super) loss: Loss,
    /// What each channel is multiplied by.
    pub(super) gain: [f32; 4],
}

/// What a thread computes in.
#[derive(Default)]
pub(super) struct Scratch {
    file: File,
    /// What the records of a block look up of the UV atlas.
    looked_up: RefCell<Vec<Row>>,
    /// Sums over the samples of a pixel, of each output.
    pixels: Vec<Column>,
    /// Whether a pixel has several samples.
    several: bool,
    compared: [Compared; 4],
    /// Columns of the Jacobian, weighted.
    weighed: Vec<Column>,
    sums: Vec<Row>,
}

/// The residuals of a channel as the normal equations see them.
#[derive(Default)]
struct Compared {
    /// What the row of the value's derivative is scaled by, where residuals do not all count alike.
    scale: Column,
    residual: Column,
    /// Their product, for the gradient alone.
    scaled: Column,
}

/// The streams of a view, in the order of [`StreamOf`](super::streams::StreamOf).
pub(super) type Streams<'a> = [Stream<'a>; 5];

/// What stands beside a view's samples.
#[derive(Clone, Copy, Default)]
pub(super) struct Beside<'a> {
    pub(super) kept: Stream<'a>,
    pub(super) levels: Stream<'a>,
    /// What levels are looked up by, where that is done anew in each pass.
    pub(super) lookup: Option<Lookup<'a>>,
}

/// What the records of a view look up, block by block.
#[derive(Clone, Copy)]
pub(super) struct Lookup<'a> {
    pub(super) finder: &'a Finder<f32>,
    pub(super) corners: &'a [Corners<f32>],
}

/// The streams of a view.
pub(super) fn streams<'a>(
    view: &'a ObservedView,
    Beside { kept, levels, .. }: Beside<'a>,
    neutral: &'a [Row],
) -> Streams<'a> {
    let samples = view.samples.surface.rows();
    // Of several samples a pixel, records are not groups.
    let targets = if several(view) { &[] } else { view.target.all() };
    [
        Stream { rows: samples.all(), stride: samples.stride(), skipped: 0 },
        kept,
        Stream { rows: neutral, ..Stream::default() },
        Stream { rows: targets, stride: view.target.stride(), skipped: 0 },
        levels,
    ]
}

/// Whether a pixel has several samples.
fn several(view: &ObservedView) -> bool {
    view.samples.records() != view.samples.groups() || view.samples.surface.places().weight.is_some()
}

thread_local! {
    /// Memory that is new in each pass costs more than its use, and a pool that threads share has them wait.
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Call `then` with the thread's scratch, prepared for a pass.
pub(super) fn with_scratch<T>(pass: &ViewPass<'_>, then: impl FnOnce(&mut Scratch) -> T) -> T {
    SCRATCH.with_borrow_mut(|scratch| {
        scratch.prepare(pass);
        then(scratch)
    })
}

impl Scratch {
    fn prepare(&mut self, pass: &ViewPass<'_>) {
        let outputs = pass.bound.program.tape.outputs.len();
        self.file.prepare(&pass.bound);
        self.several = several(pass.view);
        self.pixels.resize_with(if self.several { outputs } else { 0 }, Column::default);
        self.weighed.resize_with(if pass.is_plain() { 0 } else { outputs }, Column::default);
    }

    fn shown(&self) -> &[Column] {
        if self.several { &self.pixels } else { self.file.columns() }
    }
}

impl ViewPass<'_> {
    /// Whether every residual counts alike, and as it is.
    #[inline]
    fn is_plain(&self) -> bool {
        let [red, green, blue, coverage] = self.gain;
        self.loss == Loss::L2
            && self.view.weight.is_empty()
            && self.view.clip.is_none()
            && red == 1.0
            && green == 1.0
            && blue == 1.0
            && coverage == 1.0
    }

    /// The outputs of `count` groups from `first` on.
    #[inline(always)]
    pub(super) fn shown<'s, S: Simd>(
        &self,
        simd: S,
        scratch: &'s Scratch,
        first: usize,
        count: usize,
    ) -> &'s [Column] {
        if scratch.several {
            self.add_samples(simd, scratch, first, count);
        } else {
            self.run(simd, scratch, first, count);
        }
        scratch.shown()
    }

    /// Run the tape for `count` records from `first` on.
    #[inline(always)]
    fn run<S: Simd>(&self, simd: S, scratch: &Scratch, first: usize, count: usize) {
        let Some(Lookup { finder, corners }) = self.lookup else {
            return machine::run(simd, &self.bound, &scratch.file, &self.streams, first, count);
        };
        let stride = finder.rows();
        let mut rows = scratch.looked_up.borrow_mut();
        rows.resize(stride * BATCH, Row::ZERO);
        simd.vectorize(
            #[inline(always)]
            || {
                for (rows, corners) in rows.chunks_mut(stride).zip(&corners[first..first + count]) {
                    finder.find(
                        simd,
                        corners,
                        #[inline(always)]
                        |row, numbers| numbers.store(&mut rows[row]),
                    );
                }
            },
        );
        let mut streams = self.streams;
        streams[StreamOf::Levels as usize] = Stream { rows: &rows, stride, skipped: first };
        machine::run(simd, &self.bound, &scratch.file, &streams, first, count);
    }

    /// The channels' values of some groups, times the gain, a plane each.
    #[inline(always)]
    pub(super) fn shade<S: Simd>(
        &self,
        simd: S,
        scratch: &Scratch,
        groups: Range<usize>,
        planes: &mut [&mut [f32]],
    ) {
        let batch = self.bound.batch();
        for start in groups.clone().step_by(batch) {
            let count = batch.min(groups.end - start);
            let shown = self.shown(simd, scratch, start, count);
            for c in 0..planes.len() {
                let gain = Lanes::splat(simd, self.gain[c]);
                let rows = planes[c][(start - groups.start) * LANES..].as_chunks_mut::<LANES>().0;
                for i in 0..count {
                    (gain * load(simd, &shown[c][i])).store(&mut rows[i]);
                }
            }
        }
    }

    /// Add up the samples of each pixel, by their shares.
    #[inline(always)]
    fn add_samples<S: Simd>(&self, simd: S, scratch: &Scratch, first: usize, count: usize) {
        let Scratch { file, pixels, .. } = scratch;
        let surface = &self.view.samples.surface;
        let starts = &self.view.samples.group_start;
        self.read.iter().flat_map(|&output| &pixels[output][..count]).for_each(|cell| cell.set([0.0; LANES]));
        let (mut record, end) = (starts[first] as usize, starts[first + count] as usize);
        let mut group = first;
        while record < end {
            let block = BATCH.min(end - record);
            self.run(simd, scratch, record, block);
            for i in 0..block {
                while starts[group + 1] as usize <= record + i {
                    group += 1;
                }
                let share = match surface.places().weight {
                    Some(at) => Lanes::of_row(simd, &surface.rows().record(record + i)[at]),
                    None => Lanes::splat(simd, 1.0),
                };
                for &output in self.read {
                    let sum = &pixels[output][group - first];
                    let value = load(simd, &file.columns()[output][i]);
                    store(sum, share.mul_add(value, load(simd, sum)));
                }
            }
            record += block;
        }
    }

    /// Residuals of a channel of `count` groups from `first` on; the sum of their losses.
    #[inline(always)]
    fn compare<S: Simd>(
        &self,
        simd: S,
        channel: usize,
        (shown, compared): (&[Column], &Compared),
        first: usize,
        count: usize,
    ) -> Lanes<S> {
        let (one, gain) = (Lanes::splat(simd, 1.0), Lanes::splat(simd, self.gain[channel]));
        let mut loss = Lanes::splat(simd, 0.0);
        if self.is_plain() {
            // The root of a weight takes as long as all else.
            for i in 0..count {
                let value = load(simd, &shown[channel][i]);
                let residual = value - Lanes::of_row(simd, &self.view.target.record(first + i)[channel]);
                loss = residual.mul_add(residual, loss);
                store(&compared.residual[i], residual);
            }
            return loss;
        }
        for i in 0..count {
            let value = gain * load(simd, &shown[channel][i]);
            let wanted = Lanes::of_row(simd, &self.view.target.record(first + i)[channel]);
            let weight = self.view.weight.get(first + i).map_or(one, |row| Lanes::of_row(simd, row));
            let row = Residuals::new(self.loss).weigh(self.view.clip, value, wanted, weight);
            loss = loss + row.loss;
            store(&compared.scale[i], row.scale);
            store(&compared.residual[i], row.residual);
        }
        loss
    }

    /// Residuals of all channels, and how they are scaled, in the scratch.
    pub(super) fn residuals<S: Simd>(
        &self,
        simd: S,
        channels: &[ChannelColumns],
        scratch: &Scratch,
        first: usize,
        count: usize,
    ) {
        let shown = self.shown(simd, scratch, first, count);
        for (c, compared) in scratch.compared.iter().enumerate().take(channels.len()) {
            self.compare(simd, c, (shown, compared), first, count);
        }
    }

    /// Group `i`'s row of a channel's column, weighted, or (after the last column) of its residual.
    pub(super) fn row(
        &self,
        scratch: &Scratch,
        channel: &ChannelColumns,
        (c, column): (usize, usize),
        i: usize,
    ) -> Row {
        let compared = &scratch.compared[c];
        let Some(&tangent) = channel.tangents.get(column) else { return Row::of(compared.residual[i].get()) };
        let mut row = Row::of(scratch.shown()[tangent][i].get());
        if self.is_plain() {
            return row;
        }
        let (scale, gain) = (compared.scale[i].get(), self.gain_of(c, channel.unknowns[column]));
        row.iter_mut().zip(scale.iter()).for_each(|(x, scale)| *x *= gain * scale);
        row
    }

    /// The sums over a few blocks.
    #[inline(always)]
    pub(super) fn chunk<S: Simd>(
        &self,
        simd: S,
        channels: &[ChannelColumns],
        blocks: &[usize],
        wish: PassOutputs,
        scratch: &mut Scratch,
    ) -> Sums {
        let groups = self.view.samples.groups();
        let size = |channel: &ChannelColumns| match (wish, channel.unknowns.len() + 1) {
            (PassOutputs::Loss, _) => 0,
            (PassOutputs::Gradient, count) => count,
            (PassOutputs::Normal, count) => count * (count + 1) / 2,
        };
        let mut sums = std::mem::take(&mut scratch.sums);
        sums.clear();
        sums.resize(channels.iter().map(size).sum(), Row::ZERO);
        let wanted = if wish == PassOutputs::Normal { channels } else { &[] };
        let columns: Vec<Vec<&Column>> =
            wanted.iter().enumerate().map(|(c, channel)| self.columns(scratch, channel, c)).collect();
        let (mut loss, batch) = (Lanes::splat(simd, 0.0), self.bound.batch());
        for &block in blocks {
            let end = groups.min((block + 1) * BLOCK);
            for first in (block * BLOCK..end).step_by(batch) {
                let count = batch.min(end - first);
                let shown = self.shown(simd, scratch, first, count);
                let mut base = 0;
                for (c, channel) in channels.iter().enumerate() {
                    let compared = &scratch.compared[c];
                    let own = self.compare(simd, c, (shown, compared), first, count);
                    loss = loss + own;
                    let sums = &mut sums[base..];
                    match wish {
                        PassOutputs::Loss => {}
                        PassOutputs::Gradient => {
                            self.add_slope(simd, (c, channel), (shown, compared), (own, count), sums);
                        }
                        PassOutputs::Normal => {
                            self.weigh(simd, channel, scratch, c, count);
                            add_gram(simd, FileColumns { columns: &columns[c], groups: count }, sums);
                        }
                    }
                    base += size(channel);
                }
            }
        }
        let mut folded = vec![0.0; sums.len() + 1];
        for (sum, row) in folded.iter_mut().zip(&sums) {
            *sum = fold(row);
        }
        folded[sums.len()] = fold(&loss.to_array());
        drop(columns);
        scratch.sums = sums;
        Sums(folded)
    }

    /// Where the columns of a channel's normal equations stand, and after them the residual.
    fn columns<'s>(&self, scratch: &'s Scratch, channel: &ChannelColumns, c: usize) -> Vec<&'s Column> {
        let shown = scratch.shown();
        let column = |(k, &tangent): (usize, &usize)| {
            if self.is_plain() { &shown[tangent] } else { &scratch.weighed[k] }
        };
        let columns = channel.tangents.iter().enumerate().map(column);
        columns.chain([&scratch.compared[c].residual]).collect()
    }

    /// Weight the columns of a channel.
    #[inline(always)]
    fn weigh<S: Simd>(&self, simd: S, channel: &ChannelColumns, scratch: &Scratch, c: usize, count: usize) {
        if self.is_plain() {
            return;
        }
        let (shown, scale) = (scratch.shown(), &scratch.compared[c].scale);
        for ((&tangent, unknown), weighed) in
            channel.tangents.iter().zip(&channel.unknowns).zip(&scratch.weighed)
        {
            let gain = Lanes::splat(simd, self.gain_of(c, *unknown));
            for i in 0..count {
                let scale = gain * load(simd, &scale[i]);
                store(&weighed[i], scale * load(simd, &shown[tangent][i]));
            }
        }
    }

    /// What multiplies a channel's column: the value moves by the view's gain times what the model's does, and along the gain
    /// itself by the model's value.
    #[inline]
    fn gain_of(&self, channel: usize, unknown: Option<usize>) -> f32 {
        if unknown.is_some() { self.gain[channel] } else { 1.0 }
    }

    /// Add J^T r of a channel whose loss is that, and after it r^T r.
    #[inline(always)]
    fn add_slope<S: Simd>(
        &self,
        simd: S,
        (c, channel): (usize, &ChannelColumns),
        (shown, compared): (&[Column], &Compared),
        (loss, count): (Lanes<S>, usize),
        sums: &mut [Row],
    ) {
        let last = channel.tangents.len();
        let mut squares = Lanes::of_row(simd, &sums[last]);
        let factors = if self.is_plain() {
            squares = squares + loss;
            &compared.residual
        } else {
            for i in 0..count {
                let residual = load(simd, &compared.residual[i]);
                store(&compared.scaled[i], residual * load(simd, &compared.scale[i]));
                squares = residual.mul_add(residual, squares);
            }
            &compared.scaled
        };
        squares.store(&mut sums[last]);
        let factors = &factors[..count];
        let (tiles, rest) = channel.tangents.as_chunks::<TILE>();
        for (k, tile) in tiles.iter().enumerate() {
            let slopes = slopes(simd, shown, tile, factors);
            for (j, &slope) in slopes.iter().enumerate() {
                let gain = self.gain_of(c, channel.unknowns[TILE * k + j]);
                add_to(simd, gain, slope, &mut sums[TILE * k + j]);
            }
        }
        let first = TILE * tiles.len();
        for (j, &tangent) in rest.iter().enumerate() {
            let [slope] = slopes(simd, shown, &[tangent], factors);
            let gain = self.gain_of(c, channel.unknowns[first + j]);
            add_to(simd, gain, slope, &mut sums[first + j]);
        }
    }
}

/// Add to the sum of an unknown's slope, times what multiplies its column.
#[inline(always)]
fn add_to<S: Simd>(simd: S, gain: f32, slope: Lanes<S>, sum: &mut Row) {
    Lanes::splat(simd, gain).mul_add(slope, Lanes::of_row(simd, sum)).store(sum);
}

/// The sums of some columns times factors.
#[inline(always)]
fn slopes<S: Simd, const N: usize>(
    simd: S,
    shown: &[Column],
    tangents: &[usize; N],
    factors: &[RowCell],
) -> [Lanes<S>; N] {
    let mut columns = [&shown[0]; N];
    for k in 0..N {
        columns[k] = &shown[tangents[k]];
    }
    let mut slopes = [Lanes::splat(simd, 0.0); N];
    for (i, factor) in factors.iter().enumerate() {
        let factor = load(simd, factor);
        for k in 0..N {
            slopes[k] = load(simd, &columns[k][i]).mul_add(factor, slopes[k]);
        }
    }
    slopes
}
