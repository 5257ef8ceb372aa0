//! A pass over an atlas: its steps, sixty-four texels at a time, and what is done with what they yield.

use std::borrow::Cow;

use fearless_simd::SimdBase;
use rayon::prelude::*;

use super::block::Block;
use super::blur::blurred;
use super::gaussian::{Gaussian, Sources, ordered};
use super::neighbours::neighbours;
use super::records::{Made, Record};
use super::surface::means;
use super::wide::Wide;
use super::{Number, Texel};
use crate::engine::cubes_at::CubesAt;
use crate::model::batch::Batch;
use crate::model::params::Params;
use crate::program::graph::Input;
use crate::program::levels::{APART_FIELD, BlurOf, GaussianOf, LevelPass, SurfaceOf, Then};
use crate::program::shading::constant;
use crate::program::steps::Setting;
use crate::samples::{Atlas, LANES};
use crate::simd::Simd;
use crate::with_simd;

/// Records of texels that a thread takes at once.
const CHUNK: usize = 64;

/// Records that each step is made of at once: what it is, is found out once for all of them.
const AT_ONCE: usize = 4;

/// A number of each texel of those records.
type Numbers<R, S> = Batch<<R as Number>::Sixteen<S>, AT_ONCE>;

/// What a pass' steps yield of sixteen texels.
pub(super) struct Yielded<'a, R: Number, S: Simd> {
    numbers: &'a [Numbers<R, S>],
    record: usize,
}

impl<R: Number, S: Simd> Yielded<'_, R, S> {
    /// One of their numbers.
    #[inline(always)]
    pub(super) fn number(&self, at: usize) -> R::Sixteen<S> {
        self.numbers[at].0[self.record]
    }
}

/// A pass over an atlas, after those before it.
pub struct Run<'a, R: Number> {
    pass: &'a LevelPass,
    atlas: &'a Atlas,
    made: &'a Made<R>,
    params: &'a Params,
    cubes: &'a CubesAt<R>,
    loads: Vec<Load>,
    /// Levels' numbers that are read together.
    blocks: Vec<Block>,
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
    /// One that is read together with others.
    Together,
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

/// Numbers of levels are read together, not one by one, where this number of them stand side by side.
const TOGETHER: usize = 3;

/// The blocks of fields that are read together.
fn together(loads: &mut [Load]) -> Vec<Block> {
    let number = |(at, load): (usize, &Load)| match *load {
        Load::Level(record, offset) => Some((record, offset, at)),
        _ => None,
    };
    let mut blocks = Block::of(loads.iter().enumerate().filter_map(number).collect());
    blocks.retain(|block| block.rows.len() >= TOGETHER);
    for &(_, at) in blocks.iter().flat_map(|block| &block.rows) {
        loads[at] = Load::Together;
    }
    blocks
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
        let mut loads: Vec<Load> = pass.steps.fields().iter().map(load).collect();
        let blocks = together(&mut loads);
        let order = order(pass, made);
        Self { pass, atlas, made, params, cubes, loads, blocks, order, apart: apart.unwrap_or_default() }
    }

    /// As [`Number::leave`].
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
        with_simd!(R::instructions(), simd => {
            self.blocks(
                simd,
                memory,
                #[inline(always)]
                |first, yielded, leaves, stride| gaussian.blur(simd, first, &yielded, (leaves, stride)),
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
        with_simd!(R::instructions(), simd => {
            let nothing = R::splat(simd, R::from(0.0));
            self.blocks(
                simd,
                memory,
                #[inline(always)]
                |_, yielded, leaves, stride| {
                    // What is written beyond a texel's own numbers is written over: the last ones come first.
                    for (block, slots) in slots.chunks(LANES).enumerate().rev() {
                        let mut rows = [nothing; LANES];
                        for (row, slot) in rows.iter_mut().zip(slots) {
                            if let Some(at) = *slot {
                                *row = yielded.number(at);
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
        with_simd!(R::instructions(), simd => {
            self.blocks(simd, memory, #[inline(always)] |first, yielded, leaves, stride| {
                let numbers: Vec<[R; LANES]> =
                    (0..yielded.numbers.len()).map(|at| R::array(yielded.number(at))).collect();
                for (lane, leaves) in leaves.chunks_mut(stride).enumerate() {
                    then(first + lane, &numbers, lane, leaves);
                }
            })
        })
    }

    /// The pass' record: `then` makes the numbers of up to sixteen texels of the first one's place and what the steps
    /// yield; its last argument is how many numbers a texel has.
    #[inline(always)]
    fn blocks<S: Simd>(
        &self,
        simd: S,
        memory: Vec<R>,
        then: impl Fn(usize, Yielded<'_, R, S>, &mut [R], usize) + Sync,
    ) -> Record<R> {
        if const { <S::f32s as SimdBase<S>>::LEN > R::WIDEST } {
            unreachable!("instructions that nothing is compiled for")
        }
        let like = Batch([R::splat(simd, R::from(0.0)); AT_ONCE]);
        let value = |input: &Input| constant(input, self.params).unwrap_or(0.0);
        let shared = self.pass.steps.setting(like, value, |name| self.cubes.named(name));
        let mut record = Record::within(memory, self.pass.leaves.len(), self.atlas.covered());
        let stride = record.stride;
        let chunks = record.of_texels().par_chunks_mut(stride * CHUNK * LANES).enumerate();
        let memory = || Memory::<R, S> { read: vec![like; self.loads.len()], ..Memory::default() };
        chunks.for_each_init(memory, |memory, (chunk, texels)| {
            simd.vectorize(
                #[inline(always)]
                || {
                    for (group, texels) in texels.chunks_mut(stride * LANES * AT_ONCE).enumerate() {
                        let first = (chunk * CHUNK + group * AT_ONCE) * LANES;
                        self.yields(simd, first, &shared, memory);
                        for (record, texels) in texels.chunks_mut(stride * LANES).enumerate() {
                            let yielded = Yielded { numbers: &memory.numbers, record };
                            then(first + record * LANES, yielded, texels, stride);
                        }
                    }
                },
            );
        });
        record
    }

    /// What the steps yield of the texels from `first` on, in the memory's numbers. Whatever is done with it calls this one
    /// function: the steps for so many numbers at once are long.
    #[inline(never)]
    fn yields<S: Simd>(
        &self,
        simd: S,
        first: usize,
        shared: &Setting<'_, Numbers<R, S>>,
        Memory { registers, numbers, read }: &mut Memory<R, S>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let like = Batch([R::splat(simd, R::from(0.0)); AT_ONCE]);
                self.read(simd, first, read);
                self.pass.steps.run(
                    shared,
                    like,
                    registers,
                    #[inline(always)]
                    |at| match self.loads[at] {
                        Load::Together => read[at],
                        _ => self.field(simd, at, first),
                    },
                );
                self.pass.steps.put(shared, registers, numbers);
            },
        );
    }

    /// Read together what stands side by side of sixteen texels: a row a texel, and then a row a number.
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, first: usize, read: &mut [Numbers<R, S>]) {
        let last = self.atlas.covered() - 1;
        for block in &self.blocks {
            let record = self.made.record(block.record);
            for k in 0..AT_ONCE {
                let mut rows = [R::splat(simd, R::from(0.0)); LANES];
                for (lane, row) in rows.iter_mut().enumerate() {
                    let texel = (first + k * LANES + lane).min(last);
                    *row = R::load(simd, record.sixteen(texel, block.first));
                }
                R::transpose(simd, &mut rows);
                for &(number, at) in &block.rows {
                    read[at].0[k] = rows[number];
                }
            }
        }
    }

    /// A field of texels from `first` on; beyond the last one, that one's.
    #[inline(always)]
    fn field<S: Simd>(&self, simd: S, at: usize, first: usize) -> Numbers<R, S> {
        let mut numbers = Batch([R::splat(simd, R::from(0.0)); AT_ONCE]);
        for (k, sixteen) in numbers.0.iter_mut().enumerate() {
            *sixteen = self.sixteen(simd, at, first + k * LANES);
        }
        numbers
    }

    /// A field of sixteen texels.
    #[inline(always)]
    fn sixteen<S: Simd>(&self, simd: S, at: usize, first: usize) -> R::Sixteen<S> {
        let last = self.atlas.covered() - 1;
        let mut lanes = [R::from(0.0); LANES];
        match self.loads[at] {
            Load::Row(row) => {
                return R::held(simd, &self.atlas.rows().record((first / LANES).min(last / LANES))[row]);
            }
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
            Load::Together | Load::Nothing => {}
        }
        R::load(simd, &lanes)
    }
}

/// What a thread computes in.
struct Memory<R: Number, S: Simd> {
    registers: Vec<Numbers<R, S>>,
    numbers: Vec<Numbers<R, S>>,
    /// What was read together.
    read: Vec<Numbers<R, S>>,
}

impl<R: Number, S: Simd> Default for Memory<R, S> {
    fn default() -> Self {
        Self { registers: Vec::new(), numbers: Vec::new(), read: Vec::new() }
    }
}
