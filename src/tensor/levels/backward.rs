//! Passes over the atlas backwards: from what levels get to what columns and texels do.
//!
//! The passes run in the opposite order. What a level gets of those that are blurs of it is added up texel by texel, exactly
//! unless told otherwise; so the bits do not depend on the order of threads.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use burn::backend::FloatDType;
use burn::backend::ops::FloatTensorOps as _;
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use wgpu::{BindingResource, Buffer, CommandEncoder, ComputePipeline, ShaderModule};

use super::bound::{Lent, Pass, row_of, stored_texels, uniform};
use super::stage::{HELD, LevelStage};
use super::text::{Bound, Gain, Module};
use crate::adjoint::{AdjointError, of_column};
use crate::buffer::TensorBuffer;
use crate::gpu::{Gpu, GpuError};
use crate::inputs::{INPUTS, Input};
use crate::model::params::{Column, Param};
use crate::operation::Operation as _;
use crate::row_sums::RowSums;
use crate::shaded::Scatter;
use crate::shader::atlas::Level;
use crate::shader::atlas::adjoint::{PassAdjoint, PassAdjoints};
use crate::shader::atlas::buffers::Over;
use crate::shader::tangent::chain::Seed;
use crate::{TensorError, pass};

/// The passes backwards, by what is wanted of them.
#[derive(Debug)]
pub(super) struct Adjoints {
    scatter: Scatter,
    known: Mutex<HashMap<Vec<Input>, Arc<Compiled>>>,
    sums: RowSums,
    take: ComputePipeline,
    largest: ComputePipeline,
    accumulate: ComputePipeline,
}

/// The passes backwards that yield what is wanted.
#[derive(Debug)]
struct Compiled {
    passes: Vec<CompiledPass>,
    /// Where what levels get stands, in levels; halves of blurs share one.
    places: HashMap<String, usize>,
    count: usize,
}

#[derive(Debug)]
struct CompiledPass {
    adjoint: PassAdjoint,
    bound: Vec<Bound>,
    pass: Pass,
    /// The pass forwards that leaves what this one reads, where others leave something else in its place.
    again: Option<usize>,
}

impl Adjoints {
    pub(super) fn new(gpu: &Gpu, scatter: Scatter, take: &ShaderModule) -> Result<Self, GpuError> {
        let text = concat!(include_str!("accumulate.wgsl"), include_str!("../atomic_sums.wgsl"));
        let module = pass::module(gpu, "adjoints of levels", text)?;
        let accumulate = match scatter {
            Scatter::Exact => "cs_exact",
            Scatter::Fast => "cs_fast",
        };
        Ok(Self {
            scatter,
            known: Mutex::default(),
            sums: RowSums::new(gpu)?,
            take: pass::pipeline(gpu, take, "cs_adjoints")?,
            largest: pass::pipeline(gpu, &module, "cs_largest")?,
            accumulate: pass::pipeline(gpu, &module, accumulate)?,
        })
    }

    /// That there are derivatives by `wanted`.
    pub(super) fn check(&self, stage: &LevelStage, wanted: &[Input]) -> Result<(), TensorError> {
        parts(stage, wanted).try_for_each(|part| {
            let compiled = self.compiled(stage, part)?;
            let check = |(what, numbers)| stage.shared.gpu().check_binding(what, bytes(numbers));
            self.sizes(stage, &compiled, part).into_iter().try_for_each(check)?;
            Ok(())
        })
    }

    /// What each of `wanted` gets of an adjoint of the levels that samples look up.
    pub(super) fn run(
        &self,
        stage: &LevelStage,
        inputs: &[CubeTensor; INPUTS],
        adjoint: &CubeTensor,
        wanted: &[Input],
    ) -> Result<Vec<CubeTensor>, TensorError> {
        let mut gradients = Vec::new();
        for part in parts(stage, wanted) {
            gradients.extend(self.part(stage, inputs, adjoint, part)?);
        }
        Ok(gradients)
    }

    /// Of as many as shaders have bindings for.
    fn part(
        &self,
        stage: &LevelStage,
        inputs: &[CubeTensor; INPUTS],
        adjoint: &CubeTensor,
        wanted: &[Input],
    ) -> Result<Vec<CubeTensor>, TensorError> {
        let compiled = self.compiled(stage, wanted)?;
        let zeros = |input: &Input| {
            let zeros = CubeBackend::float_zeros(stage.shape(*input), &adjoint.device, FloatDType::F32);
            (input.name(), zeros)
        };
        let given = std::iter::once(("the levels' adjoint", adjoint.clone()));
        let lent = stage.lend(inputs, given.chain(wanted.iter().map(zeros)).collect(), &[])?;
        let gradient = |input: Input| wanted.iter().position(|&of| of == input).map(|i| &lent.beside[1 + i]);
        let room = self.room(stage, &compiled, wanted)?;
        let mut encoder = stage.encoder("adjoint of levels");
        stage.encode(&mut encoder, &lent);
        let place = |name: &str| compiled.places.get(name).copied();
        for [level, numbers, first] in stage.looked_up(place).into_iter().flatten() {
            let part = stage.taken([first, numbers, level]);
            let bound = vec![
                (0, part.as_entire_binding()),
                (1, stage.stored.texels.as_entire_binding()),
                (3, room.adjoints.as_entire_binding()),
                (4, lent.beside[0].binding()),
            ];
            pass::dispatch(stage.shared.gpu(), &mut encoder, &self.take, &[bound], stage.texels() as u64);
        }
        for one in &compiled.passes {
            let bound = |bound: &Bound| match *bound {
                Bound::Adjoints => room.adjoints.as_entire_binding(),
                Bound::Largest => room.largest.as_entire_binding(),
                Bound::Sums => room.sums.as_entire_binding(),
                Bound::ByColumns => room.by_columns.as_entire_binding(),
                Bound::Gradient(input) => {
                    gradient(input).map_or_else(|| room.adjoints.as_entire_binding(), TensorBuffer::binding)
                }
            };
            let bound: Vec<BindingResource<'_>> = one.bound.iter().map(bound).collect();
            self.encode(stage, &mut encoder, &lent, (&compiled, one), (&room, &bound));
        }
        if let Some(result) = gradient(Input::Columns) {
            let size = (stage.texels(), stage.free.columns.len());
            self.sums.add_up(stage.shared.gpu(), &mut encoder, &room.by_columns, size, result)?;
        }
        stage.submit(encoder)?;
        Ok(lent.beside.into_iter().skip(1).map(TensorBuffer::into_tensor).collect())
    }

    /// What buffers of a run hold, and how many numbers these are.
    fn sizes(&self, stage: &LevelStage, compiled: &Compiled, wanted: &[Input]) -> [(&'static str, usize); 4] {
        let words = if self.scatter == Scatter::Exact { 2 } else { 1 };
        let columns = if wanted.contains(&Input::Columns) { stage.free.columns.len() } else { 0 };
        [
            ("adjoints of levels", 3 * stage.places() * compiled.count),
            ("largest adjoint", 1),
            ("sums of adjoints of levels", 3 * stage.places() * words),
            ("slopes by columns of each texel of the light map", columns * stage.texels()),
        ]
    }

    fn room(&self, stage: &LevelStage, compiled: &Compiled, wanted: &[Input]) -> Result<Room, GpuError> {
        let gpu = stage.shared.gpu();
        let made =
            self.sizes(stage, compiled, wanted).map(|(what, numbers)| gpu.scratch(what, bytes(numbers)));
        let [adjoints, largest, sums, by_columns] = made;
        Ok(Room { adjoints: adjoints?, largest: largest?, sums: sums?, by_columns: by_columns? })
    }

    fn encode(
        &self,
        stage: &LevelStage,
        encoder: &mut CommandEncoder,
        lent: &Lent,
        (compiled, one): (&Compiled, &CompiledPass),
        (room, bound): (&Room, &[BindingResource<'_>]),
    ) {
        let gpu = stage.shared.gpu();
        let own = || (&one.pass, &one.adjoint.plan);
        let (list, _) = stage.stored.list(Over::Texels);
        if let Some(again) = one.again {
            stage.pass(encoder, lent, again);
        }
        let Some(source) = &one.adjoint.source else {
            stage.run(encoder, lent, own(), (list, bound), stage.texels() as u64);
            return;
        };
        let numbers = 3 * stage.places();
        let leaf = compiled.places[&one.adjoint.leaves[0].name] * numbers;
        // Nothing moves a source that has no place: the kernel alone does.
        let of_source = compiled.places.get(source);
        let first = of_source.map_or(0, |place| place * numbers);
        let part = [leaf, first, numbers, headroom(stage) as usize, usize::from(!Level::is_half(source))];
        let part = uniform(gpu, &part.map(|number| number as u32));
        let [adjoints, largest, sums] =
            [&room.adjoints, &room.largest, &room.sums].map(Buffer::as_entire_binding);
        let head = || vec![(0, part.as_entire_binding()), (1, adjoints.clone())];
        encoder.clear_buffer(&room.sums, 0, None);
        if self.scatter == Scatter::Exact {
            encoder.clear_buffer(&room.largest, 0, None);
            let given = [head(), vec![(2, largest.clone())]].concat();
            pass::dispatch(gpu, encoder, &self.largest, &[given], numbers as u64);
        }
        stage.run(encoder, lent, own(), (list, bound), stage.texels() as u64);
        if of_source.is_none() {
            return;
        }
        let mut bound = head();
        bound.extend((self.scatter == Scatter::Exact).then_some((2, largest)));
        bound.push((3, sums));
        pass::dispatch(gpu, encoder, &self.accumulate, &[bound], numbers as u64);
    }

    fn compiled(&self, stage: &LevelStage, wanted: &[Input]) -> Result<Arc<Compiled>, TensorError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(compiled) = known.get(wanted) {
            return Ok(Arc::clone(compiled));
        }
        let made = Arc::new(Compiled::new(stage, wanted, self.scatter)?);
        known.insert(wanted.to_vec(), Arc::clone(&made));
        Ok(made)
    }
}

/// Buffers of one run.
struct Room {
    adjoints: Buffer,
    largest: Buffer,
    sums: Buffer,
    by_columns: Buffer,
}

/// Of numbers of 32 bits; no buffer is empty.
fn bytes(numbers: usize) -> u64 {
    4 * numbers.max(1) as u64
}

/// A texel may be read by every blurred one.
fn headroom(stage: &LevelStage) -> u32 {
    stage.texels().max(1).ilog2() + 1
}

/// What is wanted, in parts that a shader has bindings for: beside what all bind a draw has what levels and columns get.
fn parts<'w>(stage: &LevelStage, wanted: &'w [Input]) -> impl Iterator<Item = &'w [Input]> {
    let limit = stage.shared.gpu().device.limits().max_storage_buffers_per_shader_stage as usize;
    wanted.chunks(limit.saturating_sub(6).max(1))
}

impl Compiled {
    fn new(stage: &LevelStage, wanted: &[Input], scatter: Scatter) -> Result<Self, TensorError> {
        let gpu = stage.shared.gpu();
        let columns = &stage.free.columns;
        let (seeds, gains) = seeds(columns, wanted);
        let row = row_of(&stage.atlas);
        let texels = stored_texels(&stage.atlas, &row);
        let PassAdjoints { passes, moving } =
            PassAdjoints::new(&stage.plan, &seeds, &texels, &stage.shaders.layers)
                .map_err(AdjointError::from)?;
        let (halves, lasting): (Vec<String>, Vec<String>) =
            moving.into_iter().partition(|level| Level::is_half(level));
        let mut places: HashMap<String, usize> = lasting.into_iter().zip(0..).collect();
        let half = places.len();
        let count = half + usize::from(!halves.is_empty());
        places.extend(halves.into_iter().map(|level| (level, half)));
        let first = |name: &str| places.get(name).copied().unwrap_or(0) * stage.places();
        let headroom = headroom(stage);
        let made = |adjoint: PassAdjoint| -> Result<CompiledPass, TensorError> {
            let module = Module::new(&adjoint, (&gains, columns), &first, (scatter, headroom));
            let constants = stage.constants(&adjoint.plan)?;
            let pass = Pass::new(gpu, &adjoint.plan, (&module.wgsl, &module.kinds()), constants)?;
            // What is blurred tells how a kernel's move shows.
            let source =
                adjoint.source.as_ref().filter(|source| Level::is_half(source) && !adjoint.moved.is_empty());
            let leaves =
                |name: &String| stage.shaders.shaders.iter().position(|shader| shader.leaves.contains(name));
            let again = source.and_then(leaves);
            Ok(CompiledPass { adjoint, bound: module.bound, pass, again })
        };
        let passes = passes.into_iter().map(made).collect::<Result<_, _>>()?;
        Ok(Self { passes, places, count })
    }
}

/// What moves for the sake of what is wanted, and what becomes of what it gets.
fn seeds(columns: &[Column], wanted: &[Input]) -> (Vec<Seed>, Vec<Gain>) {
    let mut all = Vec::new();
    if wanted.contains(&Input::Columns) {
        let mut params: Vec<Param> = Vec::new();
        for column in columns {
            if !params.contains(&column.param) {
                params.push(column.param);
            }
        }
        for param in params {
            let own = (0..columns.len()).filter(|&k| columns[k].param == param).collect();
            all.push((of_column(param), Gain::Columns(own)));
        }
    }
    for &(input, name) in HELD.iter().filter(|(input, _)| wanted.contains(input)) {
        let unit = if input.width() == Some(3) { "vec3f(1.0)" } else { "1.0" };
        all.push((Seed::named(name, unit), Gain::Input(input)));
    }
    all.into_iter().unzip()
}
