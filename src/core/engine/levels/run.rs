//! A pass over an atlas: its steps, sixteen texels at a time, and what is done with what they yield.

use std::borrow::Cow;

use fearless_simd::Level as Instructions;
use rayon::prelude::*;

use super::blur::blurred;
use super::gaussian::{Gaussian, Sources, ordered};
use super::neighbours::neighbours;
use super::records::{Made, Record};
use super::surface::means;
use super::{Number, Texel};
use crate::engine::cubes_at::{CubesAt, Sixteen};
use crate::model::batch::Batch;
use crate::model::params::Params;
use crate::program::graph::Input;
use crate::program::levels::{APART_FIELD, BlurOf, GaussianOf, LevelPass, SurfaceOf, Then};
use crate::program::shading::constant;
use crate::program::steps::Setting;
use crate::samples::{Atlas, LANES};
use crate::with_simd;

/// Records of texels that a thread takes at once.
const CHUNK: usize = 64;

/// A pass over an atlas, after those before it.
pub(super) struct Run<'a, R: Number> {
    pass: &'a LevelPass,
    atlas: &'a Atlas,
    made: &'a Made<R>,
    shared: Setting<'a, Sixteen<R>>,
    like: Sixteen<R>,
    loads: Vec<Load>,
    /// How far each texel's neighbours lie apart, where the pass is over these.
    apart: Vec<Texel<R>>,
}

/// Where a pass reads one of its fields.
enum Load {
    /// A row of the texels' records.
    Row(usize),
    /// A number of a record of levels.
    Level(usize, usize),
    /// How far neighbours lie apart.
    Apart(usize),
    /// Nothing is there.
    Nothing,
}

impl<'a, R: Number> Run<'a, R> {
    pub(super) fn new(
        pass: &'a LevelPass,
        (atlas, made): (&'a Atlas, &'a Made<R>),
        params: &Params,
        cubes: &'a CubesAt<R>,
    ) -> Self {
        let like = Batch([R::from(0.0); LANES]);
        let value = |input: &Input| constant(input, params).unwrap_or(0.0);
        let shared = pass.steps.setting(like, value, |name| cubes.named(name));
        let (mut apart, mut over_neighbours) = (Vec::new(), false);
        if let Then::Neighbours(source) = &pass.then {
            over_neighbours = true;
            if let Some((record, offset)) = made.place(source) {
                apart = neighbours(atlas, |texel| made.record(record).at(texel, offset));
            }
        }
        let load = |input: &Input| match (made.place(&input.name), atlas.row(input)) {
            _ if over_neighbours && input.name == APART_FIELD => Load::Apart(input.component),
            (Some((record, offset)), _) => Load::Level(record, offset + input.component),
            (None, Some(row)) => Load::Row(row),
            (None, None) => Load::Nothing,
        };
        let loads = pass.steps.fields().iter().map(load).collect();
        Self { pass, atlas, made, shared, like, loads, apart }
    }

    /// What the pass leaves.
    pub(super) fn record(&self) -> Record<R> {
        match &self.pass.then {
            Then::Leave | Then::Neighbours(_) => self.each(|_, numbers, lane, _, leaves| {
                let mut numbers = numbers.iter().map(|number| number.0[lane]);
                for ((_, count), leaf) in self.pass.leaves.iter().zip(leaves.chunks_mut(3)) {
                    leaf.iter_mut().zip(numbers.by_ref().take(*count)).for_each(|(x, number)| *x = number);
                }
            }),
            Then::Blur(blur) => self.blur(blur),
            Then::Gaussian(of) => self.gaussian(of),
            Then::Surface(of) => self.surface(of),
        }
    }

    /// A level with the atlas' margins.
    fn level(&self, name: &str) -> Option<Vec<Texel<R>>> {
        let level = self.made.texels(name)?;
        Some(match self.atlas.margins().added(&level) {
            Cow::Borrowed(_) => level,
            Cow::Owned(added) => added,
        })
    }

    fn blur(&self, blur: &BlurOf) -> Record<R> {
        let Some(source) = self.level(&blur.source) else {
            return Record::new(self.pass.leaves.len(), self.atlas.covered());
        };
        let moved = blur.moving.as_ref().map(|moved| moved.as_ref().and_then(|moved| self.level(moved)));
        let moved = moved.as_ref().map(Option::as_deref);
        self.each(|at, numbers, lane, _, leaves| {
            let blurred = blurred(blur, self.atlas, at, (&source, moved), |i| numbers[i].0[lane]);
            leaves[..3].copy_from_slice(&blurred);
        })
    }

    fn surface(&self, of: &SurfaceOf) -> Record<R> {
        let mut record = Record::new(self.pass.leaves.len(), self.atlas.covered());
        let texels = of.texels.each_ref().map(|name| self.made.texels(name));
        let ([Some(places), Some(facing), Some(areas)], Some(source)) =
            (texels, self.made.texels(&of.source))
        else {
            return record;
        };
        let moved = of.moving.as_ref().map(|moved| moved.as_ref().and_then(|moved| self.made.texels(moved)));
        // The variance, and how it moves, or 0.
        let kernel = self.each(|_, numbers, lane, _, leaves| {
            leaves.iter_mut().zip(numbers.iter().take(2)).for_each(|(x, number)| *x = number.0[lane]);
        });
        let kernel: Vec<Texel<R>> = (0..self.atlas.covered()).map(|texel| kernel.at(texel, 0)).collect();
        let source = (source.as_slice(), moved.as_ref().map(Option::as_deref));
        let means = means([&places, &facing, &areas], &kernel, source);
        for (leaves, mean) in record.numbers.chunks_mut(record.stride).zip(means) {
            leaves[..3].copy_from_slice(&mean);
        }
        record
    }

    fn gaussian(&self, of: &GaussianOf) -> Record<R> {
        let order = ordered(of, |name| self.made.place(name));
        let sources = Sources::new(of, &order, self.made, self.atlas);
        let gaussian = Gaussian { of, atlas: self.atlas, sources: &sources, order: &order };
        self.each(|at, numbers, lane, near, leaves| {
            gaussian.blur(at, |i| numbers[i].0[lane], near, leaves);
        })
    }

    /// The pass' record: `then` makes a texel's numbers of its place and what the steps yield in a lane.
    fn each(
        &self,
        then: impl Fn(usize, &[Sixteen<R>], usize, &mut Vec<super::gaussian::Weighed<R>>, &mut [R]) + Sync,
    ) -> Record<R> {
        let covered = self.atlas.covered();
        let mut record = Record::new(self.pass.leaves.len(), covered);
        let instructions = Instructions::new();
        let chunks = record.numbers.par_chunks_mut(record.stride * CHUNK * LANES).enumerate();
        chunks.for_each_init(Memory::default, |memory, (chunk, texels)| {
            let Memory { registers, numbers, near } = memory;
            for (block, texels) in texels.chunks_mut(record.stride * LANES).enumerate() {
                let first = (chunk * CHUNK + block) * LANES;
                numbers.clear();
                // The same numbers with any instructions: nothing is fused, and lanes do not meet.
                with_simd!(instructions, simd => {
                    let _ = simd;
                    self.pass.steps.run(&self.shared, self.like, registers, |at| self.field(at, first));
                    numbers.extend(self.pass.steps.outputs(&self.shared, registers));
                    for (lane, leaves) in texels.chunks_mut(record.stride).enumerate() {
                        then(first + lane, numbers, lane, near, leaves);
                    }
                });
            }
        });
        record
    }

    /// A field of sixteen texels; beyond the last one, that one's.
    #[inline(always)]
    fn field(&self, at: usize, first: usize) -> Sixteen<R> {
        let last = self.atlas.covered() - 1;
        match self.loads[at] {
            Load::Row(row) => Batch(self.atlas.rows().record(first / LANES)[row].map(R::from)),
            Load::Level(record, offset) => {
                let record = self.made.record(record);
                Batch(std::array::from_fn(|lane| {
                    record.numbers[(first + lane).min(last) * record.stride + offset]
                }))
            }
            Load::Apart(component) => Batch(std::array::from_fn(|lane| {
                self.apart.get((first + lane).min(last)).map_or(R::from(0.0), |apart| apart[component])
            })),
            Load::Nothing => self.like,
        }
    }
}

/// What a thread computes in.
struct Memory<R> {
    registers: Vec<Sixteen<R>>,
    numbers: Vec<Sixteen<R>>,
    near: Vec<super::gaussian::Weighed<R>>,
}

impl<R> Default for Memory<R> {
    fn default() -> Self {
        Self { registers: Vec::new(), numbers: Vec::new(), near: Vec::new() }
    }
}
