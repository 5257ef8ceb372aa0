//! A pass over an atlas: its steps, sixteen texels at a time, and what is done with what they yield.

use std::borrow::Cow;

use fearless_simd::Level as Instructions;
use rayon::prelude::*;

use super::blur::blurred;
use super::gaussian::{Gaussian, Sources, ordered};
use super::neighbours::neighbours;
use super::records::{Made, Record};
use super::surface::means;
use super::wide::Wide;
use super::{Number, Texel};
use crate::engine::cubes_at::CubesAt;
use crate::model::params::Params;
use crate::program::graph::Input;
use crate::program::levels::{APART_FIELD, BlurOf, GaussianOf, LevelPass, SurfaceOf, Then};
use crate::program::shading::constant;
use crate::samples::{Atlas, LANES};
use crate::simd::Simd;
use crate::with_simd;

/// Records of texels that a thread takes at once.
const CHUNK: usize = 64;

/// A pass over an atlas, after those before it.
pub(super) struct Run<'a, R: Number> {
    pass: &'a LevelPass,
    atlas: &'a Atlas,
    made: &'a Made<R>,
    params: &'a Params,
    cubes: &'a CubesAt<R>,
    loads: Vec<Load>,
    /// The order in which the pass' leaves stand.
    order: Vec<usize>,
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

/// The order in which a pass' leaves stand, after what was made before.
pub(super) fn order<R: Number>(pass: &LevelPass, made: &Made<R>) -> Vec<usize> {
    match &pass.then {
        Then::Gaussian(of) => ordered(of, |name| made.place(name)),
        _ => (0..pass.leaves.len()).collect(),
    }
}

impl<'a, R: Number> Run<'a, R> {
    pub(super) fn new(
        pass: &'a LevelPass,
        (atlas, made): (&'a Atlas, &'a Made<R>),
        params: &'a Params,
        cubes: &'a CubesAt<R>,
    ) -> Self {
        let mut apart = None;
        if let Then::Neighbours(source) = &pass.then {
            let (record, offset) = made.place(source).unwrap_or_default();
            apart = Some(neighbours(atlas, |texel| made.record(record).at(texel, offset)));
        }
        let load = |input: &Input| match (made.place(&input.name), atlas.row(input)) {
            _ if apart.is_some() && input.name == APART_FIELD => Load::Apart(input.component),
            (Some((record, offset)), _) => Load::Level(record, offset + input.component),
            (None, Some(row)) => Load::Row(row),
            (None, None) => Load::Nothing,
        };
        let loads = pass.steps.fields().iter().map(load).collect();
        let order = order(pass, made);
        Self { pass, atlas, made, params, cubes, loads, order, apart: apart.unwrap_or_default() }
    }

    /// What the pass leaves, in memory that others have left.
    pub(super) fn record(&self, memory: Vec<R>) -> Record<R> {
        match &self.pass.then {
            Then::Leave | Then::Neighbours(_) => self.left(memory),
            Then::Blur(blur) => self.blur(blur, memory),
            Then::Gaussian(of) => self.gaussian(of, memory),
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

    fn blur(&self, blur: &BlurOf, memory: Vec<R>) -> Record<R> {
        let Some(source) = self.level(&blur.source) else {
            return Record::new(self.pass.leaves.len(), self.atlas.covered());
        };
        let moved = blur.moving.as_ref().map(|moved| moved.as_ref().and_then(|moved| self.level(moved)));
        let moved = moved.as_ref().map(Option::as_deref);
        self.each(memory, |at, numbers, lane, leaves| {
            let blurred = blurred(blur, self.atlas, at, (&source, moved), |i| numbers[i][lane]);
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
        let kernel = self.each(Vec::new(), |_, numbers, lane, leaves| {
            leaves.iter_mut().zip(numbers.iter().take(2)).for_each(|(x, number)| *x = number[lane]);
        });
        let kernel: Vec<Texel<R>> = (0..self.atlas.covered()).map(|texel| kernel.at(texel, 0)).collect();
        let source = (source.as_slice(), moved.as_ref().map(Option::as_deref));
        let means = means([&places, &facing, &areas], &kernel, source);
        let stride = record.stride;
        for (leaves, mean) in record.of_texels().chunks_mut(stride).zip(means) {
            leaves[..3].copy_from_slice(&mean);
        }
        record
    }

    fn gaussian(&self, of: &GaussianOf, memory: Vec<R>) -> Record<R> {
        let sources = Sources::new(of, &self.order, self.made, self.atlas);
        let gaussian = Gaussian::new(of, &self.order, self.atlas, &sources);
        with_simd!(Instructions::new(), simd => {
            self.blocks(
                simd,
                memory,
                #[inline(always)]
                |first, numbers, leaves, stride| gaussian.blur(simd, first, numbers, (leaves, stride)),
            )
        })
    }

    /// What the steps yield, number by number, as leaves of one number to three.
    fn left(&self, memory: Vec<R>) -> Record<R> {
        let mut next = 0;
        let number = |within: bool| {
            within.then(|| {
                next += 1;
                next - 1
            })
        };
        // Of fewer than three components, 0 after.
        let counts = self.pass.leaves.iter().flat_map(|(_, count)| [0, 1, 2].map(|c| c < *count));
        let slots: Vec<Option<usize>> = counts.map(number).collect();
        with_simd!(Instructions::new(), simd => {
            let nothing = R::splat(simd, R::from(0.0));
            self.blocks(
                simd,
                memory,
                #[inline(always)]
                |_, numbers, leaves, stride| {
                    // What is written beyond a texel's own numbers is written over: the last ones come first.
                    for (block, slots) in slots.chunks(LANES).enumerate().rev() {
                        let mut rows = [nothing; LANES];
                        for (row, slot) in rows.iter_mut().zip(slots) {
                            if let Some(number) = *slot {
                                *row = numbers[number];
                            }
                        }
                        R::transpose(simd, &mut rows);
                        for lane in 0..leaves.len() / stride {
                            rows[lane].store(&mut leaves[lane * stride + block * LANES..]);
                        }
                    }
                },
            )
        })
    }

    /// The pass' record: `then` makes a texel's numbers of its place and what the steps yield in a lane.
    fn each(&self, memory: Vec<R>, then: impl Fn(usize, &[[R; LANES]], usize, &mut [R]) + Sync) -> Record<R> {
        with_simd!(Instructions::new(), simd => {
            self.blocks(simd, memory, #[inline(always)] |first, numbers, leaves, stride| {
                let numbers: Vec<[R; LANES]> = numbers.iter().map(|&numbers| R::array(numbers)).collect();
                for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                    then(first + lane, &numbers, lane, leaves);
                }
            })
        })
    }

    /// The pass' record: `then` makes the numbers of up to sixteen texels of the first one's place and what the steps yield;
    /// so many numbers a texel.
    #[inline(always)]
    fn blocks<S: Simd>(
        &self,
        simd: S,
        memory: Vec<R>,
        then: impl Fn(usize, &[R::Sixteen<S>], &mut [R], usize) + Sync,
    ) -> Record<R> {
        let like = R::splat(simd, R::from(0.0));
        let value = |input: &Input| constant(input, self.params).unwrap_or(0.0);
        let shared = self.pass.steps.setting(like, value, |name| self.cubes.named(name));
        let mut record = Record::within(memory, self.pass.leaves.len(), self.atlas.covered());
        let stride = record.stride;
        let chunks = record.of_texels().par_chunks_mut(stride * CHUNK * LANES).enumerate();
        chunks.for_each_init(Memory::<R, S>::default, |Memory { registers, numbers }, (chunk, texels)| {
            simd.vectorize(
                #[inline(always)]
                || {
                    for (block, texels) in texels.chunks_mut(stride * LANES).enumerate() {
                        let first = (chunk * CHUNK + block) * LANES;
                        self.pass.steps.run(
                            &shared,
                            like,
                            registers,
                            #[inline(always)]
                            |at| self.field(simd, at, first),
                        );
                        self.pass.steps.put(&shared, registers, numbers);
                        then(first, numbers, texels, stride);
                    }
                },
            );
        });
        record
    }

    /// A field of sixteen texels; beyond the last one, that one's.
    #[inline(always)]
    fn field<S: Simd>(&self, simd: S, at: usize, first: usize) -> R::Sixteen<S> {
        let last = self.atlas.covered() - 1;
        let mut lanes = [R::from(0.0); LANES];
        match self.loads[at] {
            Load::Row(row) => return R::held(simd, &self.atlas.rows().record(first / LANES)[row]),
            Load::Level(record, offset) => {
                let record = self.made.record(record);
                for (lane, number) in lanes.iter_mut().enumerate() {
                    *number = record.numbers[(first + lane).min(last) * record.stride + offset];
                }
            }
            Load::Apart(component) => {
                for (lane, number) in lanes.iter_mut().enumerate() {
                    if let Some(apart) = self.apart.get((first + lane).min(last)) {
                        *number = apart[component];
                    }
                }
            }
            Load::Nothing => {}
        }
        R::load(simd, &lanes)
    }
}

/// What a thread computes in.
struct Memory<R: Number, S: Simd> {
    registers: Vec<R::Sixteen<S>>,
    numbers: Vec<R::Sixteen<S>>,
}

impl<R: Number, S: Simd> Default for Memory<R, S> {
    fn default() -> Self {
        Self { registers: Vec::new(), numbers: Vec::new() }
    }
}
