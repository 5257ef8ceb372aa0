//! The texels of bilinear lookups side by side, and their transposition to a number a lane.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x8, i32x16};

use super::lanes::{HALF, HalfLanes, Lanes};
use super::part::shorter_than_rows;
use crate::model::real::Real;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::Simd;

/// The 2 x 2 texels of each lane's lookup: the upper and the lower row, of each four channels, of each
/// the left and the right one.
pub(super) struct Corners<R>([[[R; 2]; 4]; 2]);

impl<R: Real> Corners<R> {
    /// A channel's blend at (`fx`, `fy`), and its derivatives by both.
    #[inline(always)]
    pub(super) fn with_gradient(&self, channel: usize, [fx, fy]: [R; 2]) -> [R; 3] {
        let Self([upper, lower]) = self;
        let ([a, b], [c, d]) = (upper[channel], lower[channel]);
        let (left_step, right_step) = (c - a, d - b);
        // Between the rows first, as all lookups are.
        let (left, right) = (fy.mul_add(left_step, a), fy.mul_add(right_step, b));
        let across = right - left;
        [fx.mul_add(across, left), across, fx.mul_add(right_step - left_step, left_step)]
    }
}

/// Places of first texels, by which lanes look up.
///
/// Two neighbours are one load of 32 bytes, and several lanes' registers are transposed together. Gathers of single floats
/// are several times slower.
pub(super) trait Lookup: Real {
    /// The texels there, right of them, and those `row` texels later.
    fn corners(self, texels: &[[f32; 4]], row: usize) -> Corners<Self>;

    /// Of each channel the left and the right texels of each lane's lookup, blended between its rows by `fy`.
    fn blended_rows(self, texels: &[[f32; 4]], row: usize, fy: Self) -> [[Self; 2]; 4];

    /// Numbers that stand in memory from here on, where indices are checked and not bounded. Each check ends a block of
    /// instructions, and the compiler moves what is made of texels down to the block where it is read: behind the texels of all
    /// lookups, each of which would be held meanwhile, sixteen registers where four will do.
    fn made_here<const N: usize>(numbers: [Self; N]) -> [Self; N];
}

impl<S: Simd> Lookup for Lanes<S> {
    /// Two lanes' pairs of texels share a register, and eight registers are transposed together.
    #[inline(always)]
    fn corners(self, texels: &[[f32; 4]], row: usize) -> Corners<Self> {
        if shorter_than_rows::<S>() {
            let [first, second] = self.halves();
            let (Corners(low), Corners(high)) = (first.corners(texels, row), second.corners(texels, row));
            return Corners([joined_sides([low[0], high[0]]), joined_sides([low[1], high[1]])]);
        }
        let simd = self.0.simd;
        let Line(first) = std::hint::black_box(Line(self.numbers_before()));
        let (upper, lower) = both_rows(texels, row);
        let mut rows = [[f32x16::splat(simd, 0.0); 8]; 2];
        for pair in 0..8 {
            // By way of u32, so that the end of a range cannot overflow, which would be asked too.
            let (i, j) = (first[2 * pair] as u32 as usize, first[2 * pair + 1] as u32 as usize);
            rows[0][pair] = joined(simd, &upper[i..i + 8], &upper[j..j + 8]);
            rows[1][pair] = joined(simd, &lower[i..i + 8], &lower[j..j + 8]);
        }
        Corners([transposed(simd, rows[0]), transposed(simd, rows[1])])
    }

    #[inline(always)]
    fn blended_rows(self, texels: &[[f32; 4]], row: usize, fy: Self) -> [[Self; 2]; 4] {
        if shorter_than_rows::<S>() {
            return blended_by_fours(self, texels, row, fy);
        }
        let Corners([upper, lower]) = self.corners(texels, row);
        let mut blended = upper;
        for channel in 0..4 {
            for side in 0..2 {
                let (a, b) = (upper[channel][side], lower[channel][side]);
                blended[channel][side] = fy.mul_add(b - a, a);
            }
        }
        blended
    }

    #[inline(always)]
    fn made_here<const N: usize>(numbers: [Self; N]) -> [Self; N] {
        // In loops: what makes an array of a closure's values is a call of its own, with registers of its own.
        let mut lines = [Row::ZERO; N];
        for k in 0..N {
            numbers[k].store(&mut lines[k]);
        }
        let lines = std::hint::black_box(&lines);
        let mut made = numbers;
        for k in 0..N {
            made[k] = Self::of_row(made[k].0.simd, &lines[k]);
        }
        made
    }
}

/// A lane's pair is a register, and four registers are transposed together: numbers stay in their half of it.
impl<S: Simd> Lookup for HalfLanes<S> {
    #[inline(always)]
    fn corners(self, texels: &[[f32; 4]], row: usize) -> Corners<Self> {
        let simd = self.0.simd;
        let Line(first) = std::hint::black_box(Line(self.numbers_before()));
        let (upper, lower) = both_rows(texels, row);
        assert!(upper.len() >= 8, "a lookup is of two texels a row");
        let last = upper.len() - 8;
        let mut rows = [[[f32x8::splat(simd, 0.0); 4]; 2]; 2];
        for lane in 0..HALF {
            // A bound, not a check: that would end a block of instructions.
            let i = (first[lane] as u32 as usize).min(last);
            rows[0][lane / 4][lane % 4] = f32x8::from_slice(simd, &upper[i..i + 8]);
            rows[1][lane / 4][lane % 4] = f32x8::from_slice(simd, &lower[i..i + 8]);
        }
        Corners([sides(simd, rows[0]), sides(simd, rows[1])])
    }

    /// Blended before it is transposed: half as many numbers are.
    #[inline(always)]
    fn blended_rows(self, texels: &[[f32; 4]], row: usize, fy: Self) -> [[Self; 2]; 4] {
        let simd = self.0.simd;
        let (Line(first), Line(fy)) =
            std::hint::black_box((Line(self.numbers_before()), Line(fy.to_array())));
        let (upper, lower) = both_rows(texels, row);
        assert!(upper.len() >= 8, "a lookup is of two texels a row");
        let last = upper.len() - 8;
        let mut rows = [[f32x8::splat(simd, 0.0); 4]; 2];
        for lane in 0..HALF {
            let i = (first[lane] as u32 as usize).min(last);
            let a = f32x8::from_slice(simd, &upper[i..i + 8]);
            let b = f32x8::from_slice(simd, &lower[i..i + 8]);
            rows[lane / 4][lane % 4] = f32x8::splat(simd, fy[lane]).mul_add(b - a, a);
        }
        sides(simd, rows)
    }

    #[inline(always)]
    fn made_here<const N: usize>(numbers: [Self; N]) -> [Self; N] {
        numbers
    }
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn halves(self) -> [HalfLanes<S>; 2] {
        let (low, high) = self.0.simd.split_f32x16(self.0);
        [HalfLanes(low), HalfLanes(high)]
    }

    /// How many numbers stand before each lane's first texel. Through memory, from here on: taking sixteen numbers out of a
    /// register costs more.
    #[inline(always)]
    fn numbers_before(self) -> [i32; LANES] {
        let first: i32x16<S> = self.0.to_int();
        // Four numbers a texel.
        (first << 2).to_array()
    }
}

impl<S: Simd> HalfLanes<S> {
    #[inline(always)]
    fn numbers_before(self) -> [i32; HALF] {
        let first: i32x8<S> = self.0.to_int();
        (first << 2).to_array()
    }
}

/// The numbers of the texels, and those `row` texels later: slices of equal length, so that one check of an index covers all
/// four corners.
#[inline(always)]
fn both_rows(texels: &[[f32; 4]], row: usize) -> (&[f32], &[f32]) {
    let numbers: &[f32] = bytemuck::cast_slice(texels);
    let count = numbers.len() - 4 * row;
    (&numbers[..count], &numbers[4 * row..][..count])
}

/// [`Lookup::blended_rows`] of sixteen lanes in shorter registers, four lanes at a time: the texels of more do not fit into
/// registers.
#[inline(always)]
fn blended_by_fours<S: Simd>(
    at: Lanes<S>,
    texels: &[[f32; 4]],
    row: usize,
    fy: Lanes<S>,
) -> [[Lanes<S>; 2]; 4] {
    let simd = at.0.simd;
    let (Line(first), Line(fy)) = std::hint::black_box((Line(at.numbers_before()), Line(fy.to_array())));
    let (upper, lower) = both_rows(texels, row);
    assert!(upper.len() >= 8, "a lookup is of two texels a row");
    let last = upper.len() - 8;
    let mut fours = [[f32x8::splat(simd, 0.0); 4]; 4];
    for k in 0..4 {
        let mut pairs = [f32x8::splat(simd, 0.0); 4];
        for j in 0..4 {
            let lane = 4 * k + j;
            let i = (first[lane] as u32 as usize).min(last);
            let a = f32x8::from_slice(simd, &upper[i..i + 8]);
            let b = f32x8::from_slice(simd, &lower[i..i + 8]);
            pairs[j] = f32x8::splat(simd, fy[lane]).mul_add(b - a, a);
        }
        fours[k] = four_transposed(simd, pairs);
    }
    let [a, b, c, d] = fours;
    joined_sides([halves_apart(simd, [a, b]), halves_apart(simd, [c, d])])
}

/// Eight lanes' pairs of RGBA texels to channels of left and right texels.
#[inline(always)]
fn sides<S: Simd>(simd: S, [low, high]: [[f32x8<S>; 4]; 2]) -> [[HalfLanes<S>; 2]; 4] {
    halves_apart(simd, [four_transposed(simd, low), four_transposed(simd, high)])
}

/// Channels of twice four lanes, the left texels' numbers in one half and the right ones' in the other, to those of eight.
#[inline(always)]
fn halves_apart<S: Simd>(simd: S, [low, high]: [[f32x8<S>; 4]; 2]) -> [[HalfLanes<S>; 2]; 4] {
    let mut sides = [[HalfLanes::splat(simd, 0.0); 2]; 4];
    for channel in 0..4 {
        let ((a, b), (c, d)) = (simd.split_f32x8(low[channel]), simd.split_f32x8(high[channel]));
        sides[channel] = [HalfLanes(simd.combine_f32x4(a, c)), HalfLanes(simd.combine_f32x4(b, d))];
    }
    sides
}

/// Four lanes' pairs of RGBA texels to each channel's left numbers and, behind them, its right ones.
#[inline(always)]
fn four_transposed<S: Simd>(simd: S, [a, b, c, d]: [f32x8<S>; 4]) -> [f32x8<S>; 4] {
    let ((rb0, ga0), (rb1, ga1)) = (unzipped(simd, a, b), unzipped(simd, c, d));
    let ((r, b), (g, a)) = (unzipped(simd, rb0, rb1), unzipped(simd, ga0, ga1));
    [r, g, b, a]
}

/// The numbers at even and at odd places of each half: one instruction each, where halves do not mix.
#[inline(always)]
fn unzipped<S: Simd>(simd: S, a: f32x8<S>, b: f32x8<S>) -> (f32x8<S>, f32x8<S>) {
    let ((a0, a1), (b0, b1)) = (simd.split_f32x8(a), simd.split_f32x8(b));
    (
        simd.combine_f32x4(simd.unzip_low_f32x4(a0, b0), simd.unzip_low_f32x4(a1, b1)),
        simd.combine_f32x4(simd.unzip_high_f32x4(a0, b0), simd.unzip_high_f32x4(a1, b1)),
    )
}

/// Two halves' channels as a row's.
#[inline(always)]
fn joined_sides<S: Simd>([low, high]: [[[HalfLanes<S>; 2]; 4]; 2]) -> [[Lanes<S>; 2]; 4] {
    let simd = low[0][0].0.simd;
    let mut sides = [[Lanes::splat(simd, 0.0); 2]; 4];
    for channel in 0..4 {
        for side in 0..2 {
            sides[channel][side] = Lanes(simd.combine_f32x8(low[channel][side].0, high[channel][side].0));
        }
    }
    sides
}

/// A cache line on the stack. A function that holds one aligns its stack to lines; in one that does not, each register
/// that is put there for a while lies across two of them, and a forward pass takes a fifth longer.
#[repr(align(64))]
struct Line<T>(T);

/// Two lanes' pairs of texels in one register.
#[inline(always)]
fn joined<S: Simd>(simd: S, i: &[f32], j: &[f32]) -> f32x16<S> {
    simd.combine_f32x8(f32x8::from_slice(simd, i), f32x8::from_slice(simd, j))
}

/// Sixteen lanes' pairs of RGBA texels, two lanes a register, to channels of left and right texels.
#[inline(always)]
fn transposed<S: Simd>(simd: S, lanes: [f32x16<S>; 8]) -> [[Lanes<S>; 2]; 4] {
    let (rb0, ga0) = simd.deinterleave_f32x16(lanes[0], lanes[1]);
    let (rb1, ga1) = simd.deinterleave_f32x16(lanes[2], lanes[3]);
    let (rb2, ga2) = simd.deinterleave_f32x16(lanes[4], lanes[5]);
    let (rb3, ga3) = simd.deinterleave_f32x16(lanes[6], lanes[7]);
    let (r0, b0) = simd.deinterleave_f32x16(rb0, rb1);
    let (r1, b1) = simd.deinterleave_f32x16(rb2, rb3);
    let (g0, a0) = simd.deinterleave_f32x16(ga0, ga1);
    let (g1, a1) = simd.deinterleave_f32x16(ga2, ga3);
    let (r, r_right) = simd.deinterleave_f32x16(r0, r1);
    let (g, g_right) = simd.deinterleave_f32x16(g0, g1);
    let (b, b_right) = simd.deinterleave_f32x16(b0, b1);
    let (a, a_right) = simd.deinterleave_f32x16(a0, a1);
    [
        [Lanes(r), Lanes(r_right)],
        [Lanes(g), Lanes(g_right)],
        [Lanes(b), Lanes(b_right)],
        [Lanes(a), Lanes(a_right)],
    ]
}
