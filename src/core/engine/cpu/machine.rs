//! A tape run for blocks of records, sixteen samples at a time.
//!
//! Every operation runs over all [`WIDTH`] rows of the accumulator before the next begins: what a row waits for (a
//! logarithm, a texel) hides behind its neighbours, and finding out what to do costs little beside doing it.

#[cfg(test)]
mod tests;

use prefetch_index::prefetch_index;

use super::ahead;
use super::block::Block;
use super::code::{Code, Op};
use super::file::{File, WIDTH};
use super::heavy::{run_heavy, units};
use super::program::Bound;
use super::streams::{AHEAD, Stream, StreamOf, first_neutral, load, store};
use crate::engine::lanes::Lanes;
use crate::model::real::Real;
use crate::program::evaluate::{binary, unary};
use crate::program::graph::{Binary, Unary};
use crate::simd::Simd;

/// Run a tape for `count` records (at most [`BATCH`](super::streams::BATCH)) from `first` on, into the file's columns.
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
        let Bound { loads, uniforms, cubes, .. } = bound;
        let block = Block { loads, uniforms, streams, first, count, cubes, columns: &file.columns };
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
                let Stream { rows, stride, skipped } = streams[stream as usize];
                let first = first - skipped;
                let place = if stream == StreamOf::Neutral { first_neutral(rows, place) } else { place };
                let out = &file.registers[*out];
                if count == WIDTH {
                    let start = first * stride + place;
                    let now = &rows[start..start + (WIDTH - 1) * stride + 1];
                    for i in 0..WIDTH {
                        out[i].set(*now[i * stride]);
                        // A few lines with each field, one after the other: not all of a block at once.
                        prefetch_index(rows, (first + AHEAD) * stride + place * WIDTH + i);
                    }
                } else {
                    for i in 0..WIDTH {
                        let record = first + i.min(count - 1);
                        out[i].set(*rows[record * stride + place]);
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
