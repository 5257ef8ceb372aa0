//! The texels of sixteen bilinear lookups, and their transposition to a number a lane.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, i32x16};

use super::lanes::Lanes;
use crate::samples::LANES;
use crate::samples::rows::Row;
use crate::simd::Simd;

/// The 2 x 2 texels of each lane's lookup: the upper and the lower row, of each four channels, of each
/// the left and the right one.
///
/// Two neighbours are one load of 32 bytes; two lanes' share a register, and eight registers are
/// transposed together. Gathers of single floats are several times slower.
pub(super) struct Corners<S: Simd>([[[Lanes<S>; 2]; 4]; 2]);

impl<S: Simd> Corners<S> {
    /// The texels at `first`, right of it, and those `row` texels later.
    #[inline(always)]
    pub(super) fn load(texels: &[[f32; 4]], row: usize, first: Lanes<S>) -> Self {
        let simd = first.0.simd;
        let first: i32x16<S> = first.0.to_int();
        // Four numbers a texel. Through memory: taking sixteen numbers out of a register costs more.
        let Line(first) = std::hint::black_box(Line((first << 2).to_array()));
        // Slices of equal length, so that one check of an index covers all four corners.
        let numbers: &[f32] = bytemuck::cast_slice(texels);
        let count = numbers.len() - 4 * row;
        let (upper, lower) = (&numbers[..count], &numbers[4 * row..][..count]);
        let mut rows = [[f32x16::splat(simd, 0.0); 8]; 2];
        for pair in 0..8 {
            // By way of u32, so that the end of a range cannot overflow, which would be asked too.
            let (i, j) = (first[2 * pair] as u32 as usize, first[2 * pair + 1] as u32 as usize);
            rows[0][pair] = joined(simd, &upper[i..i + 8], &upper[j..j + 8]);
            rows[1][pair] = joined(simd, &lower[i..i + 8], &lower[j..j + 8]);
        }
        Self([transposed(simd, rows[0]), transposed(simd, rows[1])])
    }

    /// A channel's four corners.
    #[inline(always)]
    pub(super) fn of(&self, channel: usize) -> [Lanes<S>; 4] {
        let [upper, lower] = &self.0;
        let ([a, b], [c, d]) = (upper[channel], lower[channel]);
        [a, b, c, d]
    }
}

/// A cache line on the stack. A function that holds one aligns its stack to lines; in one that does not, each register
/// that is put there for a while lies across two of them, and a forward pass takes a fifth longer.
#[repr(align(64))]
struct Line([i32; LANES]);

/// Numbers that stand in memory from here on. Each check of an index ends a block of instructions, and the compiler moves what
/// is made of texels down to the block where it is read: behind the texels of all lookups, each of which would be held
/// meanwhile, sixteen registers where four will do.
#[inline(always)]
pub(super) fn made_here<S: Simd, const N: usize>(numbers: [Lanes<S>; N]) -> [Lanes<S>; N] {
    // In loops: what makes an array of a closure's values is a call of its own, with registers of its own.
    let mut lines = [Row::ZERO; N];
    for k in 0..N {
        numbers[k].store(&mut lines[k]);
    }
    let lines = std::hint::black_box(&lines);
    let mut made = numbers;
    for k in 0..N {
        made[k] = Lanes::of_row(made[k].0.simd, &lines[k]);
    }
    made
}

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
