//! The texels of sixteen bilinear lookups, and their transposition to a number a lane.

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x16, i32x16};

use super::lanes::Lanes;
use crate::simd::Simd;

/// The 2 x 2 texels of each lane's lookup: for each corner, four channels of sixteen lanes.
///
/// A texel is one 16-byte load; four lanes' texels are joined in a register and transposed. Gathers
/// of single floats are several times slower.
pub(super) struct Corners<S: Simd>([[Lanes<S>; 4]; 4]);

impl<S: Simd> Corners<S> {
    #[inline(always)]
    pub(super) fn load(texels: &[[f32; 4]], row: usize, first: Lanes<S>) -> Self {
        let simd = first.0.simd;
        let first: i32x16<S> = first.0.to_int();
        // Through memory: taking sixteen numbers out of a register costs more.
        let first = std::hint::black_box(first.to_array());
        // Slices of equal length, so that one check of an index covers all four corners.
        let count = texels.len() - row - 1;
        let (a, b) = (&texels[..count], &texels[1..][..count]);
        let (c, d) = (&texels[row..][..count], &texels[row + 1..][..count]);
        let mut joined = [[f32x16::splat(simd, 0.0); 4]; 4];
        // Lane by lane, so that few indices are held at a time.
        for quarter in 0..4 {
            let lane = 4 * quarter;
            let index = [first[lane], first[lane + 1], first[lane + 2], first[lane + 3]];
            joined[0][quarter] = four_texels(simd, a, index);
            joined[1][quarter] = four_texels(simd, b, index);
            joined[2][quarter] = four_texels(simd, c, index);
            joined[3][quarter] = four_texels(simd, d, index);
        }
        let [a, b, c, d] = joined;
        Self([transpose(simd, a), transpose(simd, b), transpose(simd, c), transpose(simd, d)])
    }

    /// A channel's four corners.
    #[inline(always)]
    pub(super) fn of(&self, channel: usize) -> [Lanes<S>; 4] {
        let [a, b, c, d] = &self.0;
        [a[channel], b[channel], c[channel], d[channel]]
    }
}

/// Four RGBA quadruples in one register.
#[inline(always)]
fn four_texels<S: Simd>(simd: S, texels: &[[f32; 4]], index: [i32; 4]) -> f32x16<S> {
    join(
        simd,
        f32x4::load_array_ref(simd, &texels[index[0] as usize]),
        f32x4::load_array_ref(simd, &texels[index[1] as usize]),
        f32x4::load_array_ref(simd, &texels[index[2] as usize]),
        f32x4::load_array_ref(simd, &texels[index[3] as usize]),
    )
}

/// Four RGBA quadruples in one register, without a detour through memory: wide loads of what was
/// just stored in parts would stall.
#[inline(always)]
fn join<S: Simd>(simd: S, a: f32x4<S>, b: f32x4<S>, c: f32x4<S>, d: f32x4<S>) -> f32x16<S> {
    simd.combine_f32x8(simd.combine_f32x4(a, b), simd.combine_f32x4(c, d))
}

/// Sixteen RGBA quadruples to four channels of sixteen.
#[inline(always)]
fn transpose<S: Simd>(simd: S, lanes: [f32x16<S>; 4]) -> [Lanes<S>; 4] {
    let (rb0, ga0) = simd.deinterleave_f32x16(lanes[0], lanes[1]);
    let (rb1, ga1) = simd.deinterleave_f32x16(lanes[2], lanes[3]);
    let (r, b) = simd.deinterleave_f32x16(rb0, rb1);
    let (g, a) = simd.deinterleave_f32x16(ga0, ga1);
    [Lanes(r), Lanes(g), Lanes(b), Lanes(a)]
}
