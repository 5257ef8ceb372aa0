//! A tape run for blocks of records, sixteen samples at a time.
//!
//! Every operation runs over all [`WIDTH`] rows of the accumulator before the next begins: what a row waits for (a
//! logarithm, a texel) hides behind its neighbours, and finding out what to do costs little beside doing it. A register's
//! rows stand together, so that a tape's file stays in the nearest cache.

use std::cell::Cell;
use std::sync::OnceLock;

use fearless_simd::f32x16;
use fearless_simd::prelude::*;

use super::ahead;
use super::block::{Block, first_neutral};
use super::code::{CallOf, Choice, Code, Heavy, Op, Register};
use super::pass::StreamOf;
use crate::engine::gram::Source as GramSource;
use crate::engine::lanes::Lanes;
use crate::model::cube::{Cube, CubePoint};
use crate::model::real::Real;
use crate::program::evaluate::{binary, unary};
use crate::program::graph::{Binary, Native, Unary};
use crate::program::native::Unit;
use crate::program::tape::Tape;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::{Level, Simd};
use prefetch_index::prefetch_index;

/// Rows of a register: so many that dispatch costs little, so few that registers stay in the nearest cache.
const WIDTH: usize = 4;
/// Records whose outputs stand side by side: a Gram matrix adds up so many at once.
pub(super) const BATCH: usize = 16;
/// Records ahead of which fields are asked for.
pub(super) const AHEAD: usize = 8;

type Rows = [Cell<Row>; WIDTH];
/// The rows of an output.
pub(super) type Column = [Cell<Row>; BATCH];

/// Records of `stride` rows each, one for each record or group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream<'a> {
    pub(super) rows: &'a [Row],
    pub(super) stride: usize,
}

/// A tape, and what runs it.
#[derive(Debug)]
pub(super) struct Program {
    pub(super) tape: Tape,
    /// A function that was compiled ahead, by its place.
    compiled: Option<usize>,
    /// What the machine runs, made when it first does.
    code: OnceLock<Code>,
}

impl Program {
    /// `ahead`: the tape is of a plan that is compiled ahead.
    pub(super) fn new(tape: Tape, ahead: bool) -> Self {
        let compiled = if ahead { ahead::find(&tape) } else { None };
        Self { tape, compiled, code: OnceLock::new() }
    }

    /// Whether a function that was compiled ahead runs it with the instructions of `level`.
    pub(super) fn is_compiled(&self, level: Level) -> bool {
        self.compiled.is_some() && ahead::compiled_for(level)
    }

    fn code(&self) -> &Code {
        self.code.get_or_init(|| Code::new(&self.tape))
    }
}

/// A tape with all that is the same for the records of a pass.
#[derive(Debug)]
pub(super) struct Bound<'a> {
    pub(super) program: &'a Program,
    /// The instructions that run it.
    pub(super) level: Level,
    /// For each field, the stream that holds it and its row there.
    pub(super) loads: &'a [(StreamOf, usize)],
    pub(super) cubes: Vec<&'a Cube<f32>>,
    pub(super) uniforms: Vec<f32>,
}

/// Registers, the numbers that all samples share, each in all lanes, and the outputs.
#[derive(Debug, Default)]
pub(super) struct File {
    registers: Vec<Rows>,
    uniforms: Vec<Row>,
    columns: Vec<Column>,
    /// The register for what nobody reads.
    nobody: usize,
}

impl File {
    /// Have room for a tape (and for what nobody reads), and its uniform numbers in place.
    pub(super) fn prepare(&mut self, bound: &Bound<'_>) {
        if !bound.program.is_compiled(bound.level) {
            let code = bound.program.code();
            self.uniforms.clear();
            self.uniforms.extend(bound.uniforms.iter().map(|&value| Row::of([value; LANES])));
            self.nobody = code.registers;
            self.registers.resize_with(code.registers + 1, || std::array::from_fn(|_| Cell::new(Row::ZERO)));
            for &(register, uniform) in &code.filled {
                self.registers[register].iter().for_each(|cell| cell.set(self.uniforms[uniform]));
            }
        }
        let outputs = bound.program.tape.outputs.len();
        self.columns.resize_with(outputs, || std::array::from_fn(|_| Cell::new(Row::ZERO)));
    }

    /// The rows of each output.
    pub(super) fn columns(&self) -> &[Column] {
        &self.columns
    }
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, cell: &Cell<Row>) -> Lanes<S> {
    Lanes::of_row(simd, &cell.get())
}

#[inline(always)]
pub(super) fn store<S: Simd>(cell: &Cell<Row>, value: Lanes<S>) {
    let mut row = Row::ZERO;
    value.store(&mut row);
    cell.set(row);
}

/// Columns as the Gram matrix reads them.
#[derive(Clone, Copy)]
pub(super) struct FileColumns<'a> {
    pub(super) columns: &'a [&'a Column],
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
        f32x16::load_array_ref(simd, &self.columns[column][group].get())
    }
}

/// Run a tape for `count` records (at most [`BATCH`]) from `first` on, into the file's columns.
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
    if let Some(tape) = bound.program.compiled {
        let block = Block { bound, streams, first, count, cubes: &bound.cubes, columns: &file.columns };
        if ahead::run(tape, simd, block) {
            return;
        }
    }
    let code = bound.program.code();
    simd.vectorize(
        #[inline(always)]
        || {
            for start in (0..count).step_by(WIDTH) {
                let count = WIDTH.min(count - start);
                run_each(simd, code, bound, file, streams, [first + start, count, start]);
            }
        },
    );
}

/// Run code for `count` records from `first` on; `start` says where in the columns their outputs begin.
#[inline(always)]
fn run_each<S: Simd>(
    simd: S,
    code: &Code,
    bound: &Bound<'_>,
    file: &File,
    streams: &[Stream<'_>],
    [first, count, start]: [usize; 3],
) {
    let mut a = [Lanes::splat(simd, 0.0); WIDTH];
    // A = f(A) row by row; each operation has a loop of its own: the compiler then knows what it is.
    macro_rules! each {
        ($i:ident => $value:expr) => {
            for $i in 0..WIDTH {
                a[$i] = $value;
            }
        };
    }
    // The same with operands: `r` has a row for each of A's, `u` one for all.
    macro_rules! with {
        ($i:ident, r $x:ident => $value:expr) => {{
            let rows = &file.registers[*$x];
            each!($i => {
                let $x = load(simd, &rows[$i]);
                $value
            });
        }};
        ($i:ident, u $x:ident => $value:expr) => {{
            let $x = Lanes::of_row(simd, &file.uniforms[*$x]);
            each!($i => $value);
        }};
        ($i:ident, r $x:ident, $k:ident $y:ident => $value:expr) => {{
            let rows = &file.registers[*$x];
            with!($i, $k $y => {
                let $x = load(simd, &rows[$i]);
                $value
            });
        }};
        ($i:ident, u $x:ident, $k:ident $y:ident => $value:expr) => {{
            let $x = Lanes::of_row(simd, &file.uniforms[*$x]);
            with!($i, $k $y => $value);
        }};
    }
    macro_rules! op {
        ($op:ident, $a:expr) => {
            unary(Unary::$op, $a)
        };
        ($op:ident, $a:expr, $b:expr) => {
            binary(Binary::$op, $a, $b)
        };
    }
    let ops = &code.ops[..];
    let mut at = 0;
    while let Some(op) = ops.get(at) {
        at += 1;
        match op {
            Op::Load(field, out) => {
                let (stream, place) = bound.loads[*field];
                let Stream { rows, stride } = streams[stream as usize];
                let place = if stream == StreamOf::Neutral { first_neutral(rows, place) } else { place };
                let out = &file.registers[*out];
                if count == WIDTH {
                    let start = first * stride + place;
                    let now = &rows[start..start + (WIDTH - 1) * stride + 1];
                    for i in 0..WIDTH {
                        out[i].set(now[i * stride]);
                        // A few lines with each field, one after the other: not all of a block at once.
                        prefetch_index(rows, (first + AHEAD) * stride + place * WIDTH + i);
                    }
                } else {
                    for i in 0..WIDTH {
                        let record = first + i.min(count - 1);
                        out[i].set(rows[record * stride + place]);
                    }
                }
            }
            Op::Store(out) => {
                let out = &file.registers[*out];
                for i in 0..WIDTH {
                    store(&out[i], a[i]);
                }
            }
            Op::Put(output) => {
                let out = &file.columns[*output][start..start + WIDTH];
                for i in 0..WIDTH {
                    store(&out[i], a[i]);
                }
            }
            Op::SetR(x) => with!(i, r x => x),
            Op::SetU(x) => with!(i, u x => x),
            Op::Negate => each!(i => op!(Negate, a[i])),
            Op::Abs => each!(i => op!(Abs, a[i])),
            Op::Sqrt => each!(i => op!(Sqrt, a[i])),
            Op::Reciprocal => each!(i => op!(Reciprocal, a[i])),
            Op::Floor => each!(i => op!(Floor, a[i])),
            Op::IsFinite => each!(i => op!(IsFinite, a[i])),
            Op::AddR(x) => with!(i, r x => op!(Add, a[i], x)),
            Op::AddU(x) => with!(i, u x => op!(Add, a[i], x)),
            Op::SubtractR(x) => with!(i, r x => op!(Subtract, a[i], x)),
            Op::SubtractU(x) => with!(i, u x => op!(Subtract, a[i], x)),
            Op::MultiplyR(x) => with!(i, r x => op!(Multiply, a[i], x)),
            Op::MultiplyU(x) => with!(i, u x => op!(Multiply, a[i], x)),
            Op::DivideR(x) => with!(i, r x => op!(Divide, a[i], x)),
            Op::DivideU(x) => with!(i, u x => op!(Divide, a[i], x)),
            Op::MinR(x) => with!(i, r x => op!(Min, a[i], x)),
            Op::MinU(x) => with!(i, u x => op!(Min, a[i], x)),
            Op::MaxR(x) => with!(i, r x => op!(Max, a[i], x)),
            Op::MaxU(x) => with!(i, u x => op!(Max, a[i], x)),
            Op::LessR(x) => with!(i, r x => op!(Less, a[i], x)),
            Op::LessU(x) => with!(i, u x => op!(Less, a[i], x)),
            Op::GreaterEqualR(x) => with!(i, r x => op!(GreaterEqual, a[i], x)),
            Op::GreaterEqualU(x) => with!(i, u x => op!(GreaterEqual, a[i], x)),
            Op::FromR(x) => with!(i, r x => op!(Subtract, x, a[i])),
            Op::FromU(x) => with!(i, u x => op!(Subtract, x, a[i])),
            Op::UnderR(x) => with!(i, r x => op!(Divide, x, a[i])),
            Op::UnderU(x) => with!(i, u x => op!(Divide, x, a[i])),
            Op::ProductRR(x, y) => with!(i, r x, r y => x * y),
            Op::ProductRU(x, y) => with!(i, r x, u y => x * y),
            Op::MultiplyAddRR(x, y) => with!(i, r x, r y => a[i].mul_add(x, y)),
            Op::MultiplyAddRU(x, y) => with!(i, r x, u y => a[i].mul_add(x, y)),
            Op::MultiplyAddUR(x, y) => with!(i, u x, r y => a[i].mul_add(x, y)),
            Op::MultiplyAddUU(x, y) => with!(i, u x, u y => a[i].mul_add(x, y)),
            Op::AddProductRR(x, y) => with!(i, r x, r y => x.mul_add(y, a[i])),
            Op::AddProductRU(x, y) => with!(i, r x, u y => x.mul_add(y, a[i])),
            Op::SubtractProductRR(x, y) => with!(i, r x, r y => (-x).mul_add(y, a[i])),
            Op::SubtractProductRU(x, y) => with!(i, r x, u y => (-x).mul_add(y, a[i])),
            Op::FromProductRR(x, y) => with!(i, r x, r y => (-a[i]).mul_add(x, y)),
            Op::FromProductRU(x, y) => with!(i, r x, u y => (-a[i]).mul_add(x, y)),
            Op::FromProductUR(x, y) => with!(i, u x, r y => (-a[i]).mul_add(x, y)),
            Op::FromProductUU(x, y) => with!(i, u x, u y => (-a[i]).mul_add(x, y)),
            Op::Heavy(heavy) => {
                run_heavy(simd, heavy, &bound.cubes, file);
                // So that A need not be kept meanwhile.
                a = [Lanes::splat(simd, 0.0); WIDTH];
            }
            Op::Unit(call, flag, skip) => {
                if units(simd, call, Some(*flag), file) {
                    at += skip;
                }
                a = [Lanes::splat(simd, 0.0); WIDTH];
            }
        }
    }
}

/// An operation from memory to memory. A function of its own, so that the accumulator stays in the processor's registers.
#[inline(never)]
fn run_heavy<S: Simd>(simd: S, heavy: &Heavy, cubes: &[&Cube<f32>], file: &File) {
    simd.vectorize(
        #[inline(always)]
        || heavy_each(simd, heavy, cubes, file),
    );
}

#[inline(always)]
fn heavy_each<S: Simd>(simd: S, heavy: &Heavy, cubes: &[&Cube<f32>], file: &File) {
    let rows = |register: Register| &file.registers[register];
    macro_rules! each {
        ($out:expr, $i:ident => $value:expr) => {{
            let out = rows($out);
            for $i in 0..WIDTH {
                store(&out[$i], $value);
            }
        }};
    }
    match heavy {
        Heavy::Log2(a, out) => {
            let a = rows(*a);
            each!(*out, i => load(simd, &a[i]).log2());
        }
        Heavy::Exp2(a, out) => {
            let a = rows(*a);
            each!(*out, i => load(simd, &a[i]).exp2());
        }
        Heavy::Select(choice, [a, yes, no], out) => {
            let (a, yes, no) = (rows(*a), rows(*yes), rows(*no));
            let half = Lanes::splat(simd, 0.5);
            match choice {
                Choice::IsFinite => each!(*out, i => {
                    Lanes::select(load(simd, &a[i]).is_finite(), load(simd, &yes[i]), load(simd, &no[i]))
                }),
                Choice::Holds => each!(*out, i => {
                    Lanes::select(load(simd, &a[i]).ge(half), load(simd, &yes[i]), load(simd, &no[i]))
                }),
            }
        }
        Heavy::Compare([a, b, yes, no], or_equal, out) => {
            let (a, b, yes, no) = (rows(*a), rows(*b), rows(*yes), rows(*no));
            if *or_equal {
                each!(*out, i => {
                    let mask = load(simd, &a[i]).ge(load(simd, &b[i]));
                    Lanes::select(mask, load(simd, &yes[i]), load(simd, &no[i]))
                });
            } else {
                each!(*out, i => {
                    let mask = load(simd, &a[i]).lt(load(simd, &b[i]));
                    Lanes::select(mask, load(simd, &yes[i]), load(simd, &no[i]))
                });
            }
        }
        Heavy::Call(call) => match call.native {
            Native::Place => place(simd, call, file),
            Native::Lookup(resource) => look_up(simd, call, cubes[resource as usize], file),
            Native::Unit => {
                units(simd, call, None, file);
            }
        },
        Heavy::Mend { flag, parts, fallback } => {
            let (flag, half) = (rows(*flag), Lanes::splat(simd, 0.5));
            for (part, fallback) in parts.iter().zip(fallback) {
                if let Some(part) = part {
                    let (part_rows, fallback) = (rows(*part), rows(*fallback));
                    each!(*part, i => {
                        let there = load(simd, &flag[i]).ge(half);
                        Lanes::select(there, load(simd, &part_rows[i]), load(simd, &fallback[i]))
                    });
                }
            }
        }
    }
}

#[inline(always)]
fn three<S: Simd>(simd: S, rows: [&Rows; 3], i: usize) -> [Lanes<S>; 3] {
    [load(simd, &rows[0][i]), load(simd, &rows[1][i]), load(simd, &rows[2][i])]
}

#[inline(always)]
fn put<S: Simd, const N: usize>(rows: &[&Rows; N], i: usize, values: [Lanes<S>; N]) {
    for k in 0..N {
        store(&rows[k][i], values[k]);
    }
}

impl File {
    fn three(&self, registers: [Register; 3]) -> [&Rows; 3] {
        registers.map(|register| &self.registers[register])
    }

    /// The registers of a call's parts; what nobody reads has one, too.
    fn parts<const N: usize>(&self, parts: &[Option<Register>]) -> [&Rows; N] {
        std::array::from_fn(|k| &self.registers[parts.get(k).copied().flatten().unwrap_or(self.nobody)])
    }
}

/// Unit vectors. Whether every sample has one; the flag says which.
#[inline(never)]
fn units<S: Simd>(simd: S, call: &CallOf, flag: Option<Register>, file: &File) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            let (v, out) = (file.three(call.arguments), file.parts::<3>(&call.parts));
            let flag = &file.registers[flag.unwrap_or(file.nobody)];
            let along = call.along.first().map(|d| (file.three(*d), file.parts::<3>(&call.slopes[0])));
            let mut all = true;
            for i in 0..WIDTH {
                let unit = Unit::new(three(simd, v, i));
                put(&out, i, unit.direction);
                if let Some((d, out)) = &along {
                    put(out, i, unit.along(three(simd, *d, i)));
                }
                for (d, slopes) in call.along.iter().zip(&call.slopes).skip(1) {
                    put(&file.parts::<3>(slopes), i, unit.along(three(simd, file.three(*d), i)));
                }
                all &= unit.all;
                let (one, zero) = (Lanes::splat(simd, 1.0), Lanes::splat(simd, 0.0));
                store(&flag[i], Lanes::select(unit.has_direction, one, zero));
            }
            all
        },
    )
}

#[inline(always)]
fn place<S: Simd>(simd: S, call: &CallOf, file: &File) {
    let (d, out) = (file.three(call.arguments), file.parts::<3>(&call.parts));
    let along = call.along.first().map(|d| (file.three(*d), file.parts::<2>(&call.slopes[0])));
    for i in 0..WIDTH {
        let point = CubePoint::of_unit(three(simd, d, i));
        put(&out, i, point.place());
        if let Some((d, out)) = &along {
            put(out, i, point.tangent(three(simd, *d, i)));
        }
        for (d, slopes) in call.along.iter().zip(&call.slopes).skip(1) {
            put(&file.parts::<2>(slopes), i, point.tangent(three(simd, file.three(*d), i)));
        }
    }
}

#[inline(always)]
fn look_up<S: Simd>(simd: S, call: &CallOf, cube: &Cube<f32>, file: &File) {
    let (place, out) = (file.three(call.arguments), file.parts::<4>(&call.parts));
    let along = |d: [&Rows; 3], i: usize| cube.texels([load(simd, &d[0][i]), load(simd, &d[1][i])]);
    match &call.along[..] {
        [] => {
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                put(&out, i, cube.sample_at(&cube.footprint_at(face, s, t)));
            }
        }
        [d] => {
            let (d, slopes) = (file.three(*d), file.parts::<4>(&call.slopes[0]));
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                let (value, slope) = cube.sample_with_slope(&cube.footprint_at(face, s, t), along(d, i));
                put(&out, i, value);
                put(&slopes, i, slope);
            }
        }
        several => {
            for i in 0..WIDTH {
                let [face, s, t] = three(simd, place, i);
                let [value, across, down] = cube.sample_with_gradient(&cube.footprint_at(face, s, t));
                put(&out, i, value);
                for (d, slopes) in several.iter().zip(&call.slopes) {
                    let [ds, dt] = along(file.three(*d), i);
                    let mut slope = value;
                    for c in 0..4 {
                        slope[c] = ds.mul_add(across[c], dt * down[c]);
                    }
                    put(&file.parts::<4>(slopes), i, slope);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::program::evaluate::Shared;
    use crate::program::graph::{Graph, Id, Input};
    use crate::simd::{levels, name};
    use crate::with_simd;

    const FIELDS: usize = 4;
    /// Two blocks, the second not full.
    const RECORDS: usize = BATCH + 3;
    const UNIFORMS: [f64; 2] = [0.75, -1.5];

    /// A graph of operations drawn at random, of numbers of moderate size.
    fn drawn(rng: &mut StdRng) -> (Graph, Vec<Id>) {
        let mut graph = Graph::default();
        let mut pool: Vec<Id> = (0..FIELDS).map(|k| graph.field("x", k)).collect();
        pool.extend((0..UNIFORMS.len()).map(|k| graph.uniform("u", k)));
        let one = graph.constant(1.0);
        pool.push(one);
        for _ in 0..rng.random_range(5..60) {
            let mut pick = || pool[rng.random_range(0..pool.len())];
            let (a, b, c) = (pick(), pick(), pick());
            let size = graph.unary(Unary::Abs, b);
            let above = graph.binary(Binary::Add, size, one);
            let made = match rng.random_range(0..14) {
                0 => graph.binary(Binary::Add, a, b),
                1 => graph.binary(Binary::Subtract, a, b),
                2 => graph.binary(Binary::Multiply, a, b),
                3 => graph.binary(Binary::Divide, a, above),
                4 => graph.binary(Binary::Min, a, b),
                5 => graph.binary(Binary::Max, a, b),
                6 => graph.binary(Binary::Less, a, b),
                7 => graph.binary(Binary::GreaterEqual, a, b),
                8 => {
                    let less = graph.binary(Binary::Less, a, c);
                    graph.select(less, b, c)
                }
                9 => graph.unary(Unary::Sqrt, above),
                10 => graph.unary(Unary::Log2, above),
                11 => {
                    let product = graph.binary(Binary::Multiply, a, b);
                    graph.binary(Binary::Add, product, c)
                }
                12 => {
                    let product = graph.binary(Binary::Multiply, a, b);
                    graph.binary(Binary::Subtract, c, product)
                }
                _ => {
                    // Some vectors are 0: the fallback stands in, which may be made of anything.
                    let unit = graph.call(Native::Unit, vec![a, b, a, c, b, one], Vec::new());
                    // Never along itself: of a 0 that is a matter of roundings there is no direction to compare.
                    let moved = graph.call(Native::Unit, vec![a, b, a, c, b, one], vec![c, a, above]);
                    let turned = graph.call(Native::Place, unit.clone(), moved);
                    pool.extend(&unit);
                    turned[0]
                }
            };
            // Products of products would leave f32's range.
            let (low, high) = (graph.constant(-4.0), graph.constant(4.0));
            let raised = graph.binary(Binary::Max, made, low);
            pool.push(graph.binary(Binary::Min, raised, high));
        }
        let outputs = (0..5).map(|_| pool[rng.random_range(0..pool.len())]).collect();
        (graph, outputs)
    }

    #[test]
    fn the_machine_computes_what_the_tape_says_of_graphs_drawn_at_random() {
        let mut rng = StdRng::seed_from_u64(8);
        let (mut compared, mut skipped) = (0, 0);
        for draw in 0..300 {
            let (graph, outputs) = drawn(&mut rng);
            let tape = Tape::new(&graph, &outputs);
            // A tenth of the samples are all 0; of others, no comparison is a matter of roundings.
            let mut rows = vec![Row::ZERO; FIELDS * RECORDS];
            for lane in 0..RECORDS * LANES {
                for field in 0..FIELDS {
                    let number = rng.random_range(-2.0..2.0);
                    let there = lane % 10 != 0;
                    rows[lane / LANES * FIELDS + field][lane % LANES] = if there { number } else { 0.0 };
                }
            }
            let uniform = |input: &Input| UNIFORMS[input.component];
            let uniforms: Vec<f64> = tape.uniform_values(uniform);
            let shared = Shared { uniforms: uniforms.clone(), cubes: Vec::new() };
            // In f32 with numbers a little beside these, each by another share.
            let nudged = [0.0, 1e-6, -2e-6, 3e-6].map(|share: f32| {
                let beside =
                    |input: &Input| uniform(input) * f64::from(1.0 + share * (5 + input.component) as f32);
                let uniforms = tape.uniform_values(beside).into_iter().map(|x| x as f32).collect();
                (share, Shared { uniforms, cubes: Vec::new() })
            });
            let loads: Vec<(StreamOf, usize)> =
                tape.fields.iter().map(|input| (StreamOf::Samples, input.component)).collect();
            let program = Program::new(tape.clone(), false);
            let uniforms: Vec<f32> = uniforms.into_iter().map(|x| x as f32).collect();
            for level in levels() {
                let (cubes, uniforms) = (Vec::new(), uniforms.clone());
                let bound = Bound { program: &program, level, loads: &loads, cubes, uniforms };
                let mut file = File::default();
                file.prepare(&bound);
                for first in (0..RECORDS).step_by(BATCH) {
                    let count = BATCH.min(RECORDS - first);
                    let streams = [Stream { rows: &rows, stride: FIELDS }];
                    with_simd!(level, simd => run(simd, &bound, &file, &streams, first, count));
                    for i in 0..count {
                        for lane in 0..LANES {
                            let field = |input: &Input| rows[(first + i) * FIELDS + input.component][lane];
                            let wanted = tape.run(&shared, 0.0_f64, |input| f64::from(field(input)));
                            let single: Vec<Vec<f32>> = nudged
                                .iter()
                                .map(|(share, shared)| {
                                    let at = |input: &Input| {
                                        field(input) * (1.0 + share * (1 + input.component) as f32)
                                    };
                                    tape.run(shared, 0.0_f32, at)
                                })
                                .collect();
                            for (k, want) in wanted.into_iter().enumerate() {
                                // The direction of what is 0 but for roundings, for instance, is nothing to compare.
                                let sure =
                                    |x: &Vec<f32>| (f64::from(x[k]) - want).abs() < 1e-4 * (1.0 + want.abs());
                                if !single.iter().all(sure) {
                                    skipped += 1;
                                    continue;
                                }
                                let got = f64::from(file.columns()[k][i].get()[lane]);
                                // Roundings of f32 over some sixty operations of slopes up to 4.
                                let close = (got - want).abs() <= 1e-3 * (1.0 + want.abs());
                                assert!(close, "{} graph {draw}, output {k}: {got} {want}", name(level));
                                compared += 1;
                            }
                        }
                    }
                }
            }
        }
        assert!(skipped * 20 < compared, "{skipped} were not compared, and {compared} were");
    }
}
