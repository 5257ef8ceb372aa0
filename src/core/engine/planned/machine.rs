//! A tape run for blocks of records, sixteen samples at a time.
//!
//! Every instruction runs over all [`WIDTH`] rows of its registers before the next begins: what a row waits for (a
//! logarithm, a texel) hides behind its neighbours, and finding out what to do costs little beside doing it. A
//! register's rows stand together, so that a tape's file stays in the nearest cache.

use std::cell::Cell;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use crate::engine::gram::Source as GramSource;
use crate::engine::lanes::Lanes;
use crate::model::cube::Cube;
use crate::model::real::Real;
use crate::program::evaluate::{binary, unary};
use crate::program::graph::{Binary, LOOKUP_PARTS, Unary};
use crate::program::tape::{Instruction, Slot, Tape, Test};
use crate::samples::rows::{Row, prefetch_rows};
use crate::simd::Simd;

/// Rows of a register.
pub(super) const WIDTH: usize = 8;

/// Records of `stride` rows each, one for each record or group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream<'a> {
    pub(super) rows: &'a [Row],
    pub(super) stride: usize,
}

/// A tape with all that is the same for the records of a pass.
#[derive(Debug)]
pub(super) struct Bound<'a> {
    pub(super) tape: &'a Tape,
    /// For each field, the stream that holds it and its row there.
    pub(super) loads: &'a [(usize, usize)],
    pub(super) cubes: Vec<&'a Cube<f32>>,
    pub(super) uniforms: Vec<f32>,
}

/// Registers, then a row for each number that all samples share.
#[derive(Debug, Default)]
pub(super) struct File {
    cells: Vec<Cell<Row>>,
}

/// Where a slot's rows stand: the first, and which bits of a row's number count.
#[derive(Clone, Copy, Debug)]
pub(super) struct At {
    first: usize,
    mask: usize,
}

impl At {
    pub(super) const fn of(slot: Slot, tape: &Tape) -> Self {
        match slot {
            Slot::Register(at) => Self { first: at * WIDTH, mask: WIDTH - 1 },
            Slot::Uniform(at) => Self { first: tape.registers * WIDTH + at, mask: 0 },
        }
    }
}

impl File {
    /// Have room for a tape, and its uniform numbers in place.
    pub(super) fn prepare(&mut self, bound: &Bound<'_>) {
        let registers = bound.tape.registers * WIDTH;
        self.cells.resize(registers + bound.uniforms.len(), Cell::new(Row::ZERO));
        for (cell, &value) in self.cells[registers..].iter().zip(&bound.uniforms) {
            cell.set(Row::of([value; crate::samples::LANES]));
        }
    }

    /// The row of a slot for the i-th record of a block.
    #[inline(always)]
    pub(super) fn row(&self, at: At, i: usize) -> Row {
        self.cells[at.first + (i & at.mask)].get()
    }

    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, at: At, i: usize) -> Lanes<S> {
        Lanes::of_row(simd, &self.row(at, i))
    }

    #[inline(always)]
    fn put<S: Simd>(&self, register: usize, i: usize, value: Lanes<S>) {
        let mut row = Row::ZERO;
        value.store(&mut row);
        self.cells[register * WIDTH + i].set(row);
    }
}

/// Columns of a file as the Gram matrix reads them.
#[derive(Clone, Copy)]
pub(super) struct FileColumns<'a> {
    pub(super) file: &'a File,
    pub(super) columns: &'a [At],
    pub(super) groups: usize,
}

impl GramSource for FileColumns<'_> {
    fn columns(&self) -> usize {
        self.columns.len()
    }
    fn groups(&self) -> usize {
        self.groups
    }
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, group: usize, column: usize) -> f32x16<S> {
        f32x16::load_array_ref(simd, &self.file.row(self.columns[column], group))
    }
}

/// Run a tape for `count` records (at most [`WIDTH`]) from `first` on.
///
/// A function of its own: it is long, and would be compiled again wherever it is called.
#[inline(never)]
pub(super) fn run<S: Simd>(
    simd: S,
    bound: &Bound<'_>,
    file: &File,
    streams: &[Stream<'_>],
    first: usize,
    count: usize,
) {
    simd.vectorize(
        #[inline(always)]
        || run_each(simd, bound, file, streams, first, count),
    );
}

#[inline(always)]
fn run_each<S: Simd>(
    simd: S,
    bound: &Bound<'_>,
    file: &File,
    streams: &[Stream<'_>],
    first: usize,
    count: usize,
) {
    let tape = bound.tape;
    let at = |slot| At::of(slot, tape);
    let get = |a: At, i: usize| file.lanes(simd, a, i);
    macro_rules! each {
        ($out:expr, $i:ident => $value:expr) => {
            for $i in 0..WIDTH {
                file.put($out, $i, $value);
            }
        };
    }
    for stream in streams {
        prefetch_rows(stream.rows, (first + WIDTH) * stream.stride, WIDTH * stream.stride);
    }
    for instruction in &tape.instructions {
        match *instruction {
            Instruction::Load(field, out) => {
                let (stream, place) = bound.loads[field];
                let stream = streams[stream];
                for i in 0..WIDTH {
                    let record = first + i.min(count - 1);
                    file.cells[out * WIDTH + i].set(stream.rows[record * stream.stride + place]);
                }
            }
            // Each operation has a loop of its own: the compiler then knows what it is.
            Instruction::Binary(op, a, b, out) => {
                let (a, b) = (at(a), at(b));
                macro_rules! of {
                    ($($op:ident)*) => {
                        match op {$(
                            Binary::$op => each!(out, i => binary(Binary::$op, get(a, i), get(b, i))),
                        )*}
                    };
                }
                of!(Add Subtract Multiply Divide Min Max Less GreaterEqual);
            }
            Instruction::Unary(op, a, out) => {
                let a = at(a);
                macro_rules! of {
                    ($($op:ident)*) => {
                        match op {$(
                            Unary::$op => each!(out, i => unary(Unary::$op, get(a, i))),
                        )*}
                    };
                }
                of!(Negate Abs Sqrt Reciprocal Floor Exp2 Log2 IsFinite);
            }
            Instruction::MultiplyAdd([a, b, c], out) => {
                let (a, b, c) = (at(a), at(b), at(c));
                each!(out, i => get(a, i).mul_add(get(b, i), get(c, i)));
            }
            Instruction::SubtractProduct([a, b, c], out) => {
                let (a, b, c) = (at(a), at(b), at(c));
                each!(out, i => (-get(a, i)).mul_add(get(b, i), get(c, i)));
            }
            Instruction::Select(test, yes, no, out) => {
                let (yes, no) = (at(yes), at(no));
                macro_rules! choose {
                    ($i:ident => $mask:expr) => {
                        each!(out, $i => Lanes::select($mask, get(yes, $i), get(no, $i)))
                    };
                }
                match test {
                    Test::Less(a, b) => {
                        let (a, b) = (at(a), at(b));
                        choose!(i => get(a, i).lt(get(b, i)));
                    }
                    Test::GreaterEqual(a, b) => {
                        let (a, b) = (at(a), at(b));
                        choose!(i => get(a, i).ge(get(b, i)));
                    }
                    Test::IsFinite(a) => {
                        let a = at(a);
                        choose!(i => get(a, i).is_finite());
                    }
                    Test::Holds(a) => {
                        let (a, half) = (at(a), Lanes::splat(simd, 0.5));
                        choose!(i => get(a, i).ge(half));
                    }
                }
            }
            Instruction::Lookup(resource, [face, s, t], ref parts) => {
                let (face, s, t) = (at(face), at(s), at(t));
                look_up(simd, bound.cubes[resource], file, [face, s, t], parts);
            }
        }
    }
}

/// The parts of a lookup that have a register.
#[inline(always)]
fn look_up<S: Simd>(
    simd: S,
    cube: &Cube<f32>,
    file: &File,
    [face, s, t]: [At; 3],
    parts: &[Option<usize>; LOOKUP_PARTS],
) {
    let gradient = parts[4..].iter().any(Option::is_some);
    for i in 0..WIDTH {
        let at = cube.footprint_at(file.lanes(simd, face, i), file.lanes(simd, s, i), file.lanes(simd, t, i));
        if gradient {
            let found = cube.sample_with_gradient(&at);
            for (part, register) in parts.iter().enumerate() {
                if let Some(register) = *register {
                    file.put(register, i, found[part / 4][part % 4]);
                }
            }
        } else {
            let found = cube.sample_at(&at);
            for (register, value) in parts.iter().zip(found) {
                if let Some(register) = *register {
                    file.put(register, i, value);
                }
            }
        }
    }
}
