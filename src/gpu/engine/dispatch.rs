//! How a part is dispatched: workgroups, and their uniform block.

use super::cuts::records;
use super::fused::WORKGROUP;
use super::part::Part;
use super::parts::Parts;
use crate::MOST_OF_A_DISPATCH;
use crate::model::gain::Gain;
use crate::samples::LANES;
use skinfit_core::engine::BLOCK;
use skinfit_core::engine::view::ObservedView;

/// Pixels that a thread shades, about: fewer leave processors idle, more leave sums long.
const PIXELS_A_THREAD: usize = 4;
/// Most workgroups of a part: eight for each of the 132 processors of an H200, which the largest adapters resemble.
/// With the 56 sums of the race, a processor holds four at a time; six for each take 7% longer, as the second turn leaves
/// processors half empty.
const MOST_WORKGROUPS: usize = 1056;

/// Workgroups for `pixels` pixels, of which each thread shades a few.
fn tiles(pixels: usize, most: usize) -> u32 {
    pixels.div_ceil(WORKGROUP as usize * PIXELS_A_THREAD).clamp(1, most) as u32
}

/// Bytes of a dispatch's uniform block.
pub(super) const PART_BYTES: usize = 48;

impl Parts {
    /// Samples of a part, padding included.
    pub(super) fn samples(part: &Part, views: &[ObservedView]) -> usize {
        records(&views[part.view], &part.groups).len() * LANES
    }

    /// Pixels of a part.
    pub(super) fn slots(part: &Part) -> usize {
        part.groups.len() * LANES
    }

    /// Workgroups of a part's dispatch.
    pub(super) fn workgroups(part: &Part) -> u32 {
        tiles(part.read as usize, MOST_WORKGROUPS)
    }

    /// Most workgroups that a part's dispatch may have, at any stride.
    pub(super) fn most_workgroups(part: &Part) -> u32 {
        tiles(Self::slots(part), MOST_WORKGROUPS)
    }

    /// Workgroups of a part's image. Where nothing is added up a workgroup costs nothing, and an image takes a tenth
    /// less time than with [`MOST_WORKGROUPS`] (4 to 16 million pixels on an H200).
    pub(super) fn image_workgroups(part: &Part) -> u32 {
        tiles(Self::slots(part), MOST_OF_A_DISPATCH as usize)
    }

    /// The uniform block of a part's dispatch: its counts and gain, and where its sums go.
    pub(super) fn block(
        &self,
        views: &[ObservedView],
        part: &Part,
        gain: Gain,
        first_sum: u32,
    ) -> [u8; PART_BYTES] {
        // A target without a clip lies between the largest numbers; WGSL promises nothing about infinities.
        let clip = views[part.view].clip.map_or((f32::MIN, f32::MAX), |clip| (clip.low, clip.high));
        let slots = part.groups.len() * LANES;
        let left_out = (self.stride - 1) * BLOCK * LANES;
        let counts = [part.read, slots as u32, left_out as u32, first_sum];
        let factors = gain.channels().map(|factor| factor as f32);
        let numbers = factors.into_iter().chain([clip.0, clip.1]).map(f32::to_bits);
        let words = counts.into_iter().chain(numbers);
        let mut block = [0; PART_BYTES];
        for (bytes, word) in block.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_ne_bytes());
        }
        block
    }
}
