//! Hits packed into groups of pixels, ready to be streamed.

use rayon::prelude::*;

use super::supply::Points;
use super::surface::Surface;
use super::trace::{Hit, Hits};
use super::{LANES, SurfaceRecords, ViewSamples};

/// The fewest groups that one task fills.
const CHUNK: usize = 64;

/// The pixels that show the mesh, row by row: each one's index in the image, and where its hits start and end.
pub(super) type Pixels = [(u32, std::ops::Range<u32>)];

/// Pack the hits of a view of `width` pixels with `per_pixel` samples a pixel; `done` is told how many more pixels are
/// packed.
pub(super) fn pack(
    hits: &Hits,
    surface: &Surface<'_>,
    (width, per_pixel): (u32, u32),
    done: impl Fn(u64) + Sync,
) -> ViewSamples {
    let order = order(&hits.pixels, width);
    let mut samples = groups(&hits.pixels, &order, per_pixel);
    samples.surface = SurfaceRecords::new(surface.asked(), samples.records());
    fill(hits, surface, (&order, &samples.group_start), &mut samples.surface, done);
    samples
}

/// The groups of pixels in `order`; what their samples show is left empty.
pub(super) fn groups(pixels: &Pixels, order: &[u32], per_pixel: u32) -> ViewSamples {
    let mut samples = ViewSamples { group_start: vec![0], ..Default::default() };
    for group in order.chunks(LANES) {
        for lane in 0..LANES {
            let pixel = group.get(lane).map(|&i| &pixels[i as usize]);
            samples.pixel.push(pixel.map_or(u32::MAX, |(index, _)| *index));
            samples.coverage.push(pixel.map_or(0.0, |(_, range)| range.len() as f32 / per_pixel as f32));
        }
        // The first pixel has the most samples.
        let records = pixels[group[0] as usize].1.len();
        samples.group_start.push((samples.records() + records) as u32);
    }
    samples
}

/// The hit that each sample slot of the packed view shows.
pub(super) fn slots(hits: &Hits, width: u32) -> Vec<Hit> {
    let mut slots = Vec::new();
    for group in order(&hits.pixels, width).chunks(LANES) {
        let records = hits.pixels[group[0] as usize].1.len();
        for record in 0..records {
            slots.extend((0..LANES).map(|lane| hits.hits[hit(&hits.pixels, group, lane, record).hit]));
        }
    }
    slots
}

/// The pixels in the order in which they are packed: full ones first; among equals, along a Z-order curve, so that
/// a group is a small tile.
pub(super) fn order(pixels: &Pixels, width: u32) -> Vec<u32> {
    let mut order: Vec<u32> = (0..pixels.len() as u32).collect();
    order.par_sort_unstable_by_key(|&i| {
        let (pixel, range) = &pixels[i as usize];
        (std::cmp::Reverse(range.len()), z_order(pixel % width, pixel / width))
    });
    order
}

/// What stands at a slot.
pub(super) struct Slot {
    /// The pixel's index in the image.
    pub(super) pixel: u32,
    /// The hit's index.
    pub(super) hit: usize,
    /// The sample's share of the pixel.
    pub(super) share: f32,
}

/// What stands at a slot of a group. Lanes beyond the last pixel repeat the first, without a share; so do missing
/// samples.
pub(super) fn hit(pixels: &Pixels, group: &[u32], lane: usize, record: usize) -> Slot {
    let (pixel, range) = &pixels[group[if lane < group.len() { lane } else { 0 }] as usize];
    let real = lane < group.len() && record < range.len();
    let hit = range.start as usize + if record < range.len() { record } else { 0 };
    Slot { pixel: *pixel, hit, share: if real { 1.0 / range.len() as f32 } else { 0.0 } }
}

/// Fill each group's records.
fn fill(
    hits: &Hits,
    surface: &Surface<'_>,
    (order, group_start): (&[u32], &[u32]),
    into: &mut SurfaceRecords,
    done: impl Fn(u64) + Sync,
) {
    let (places, stride) = (*into.places(), into.rows().stride());
    let declared = places.declared();
    let mut rest = into.rows_mut().all_mut();
    let mut parts = Vec::with_capacity(group_start.len());
    for ends in group_start.windows(2) {
        let (rows, more) = rest.split_at_mut((ends[1] - ends[0]) as usize * stride);
        parts.push(rows);
        rest = more;
    }
    let parts = parts.into_par_iter().with_min_len(CHUNK);
    parts.zip(order.par_chunks(LANES)).for_each(|(rows, group)| {
        for (record, rows) in rows.chunks_exact_mut(stride).enumerate() {
            let slots: [Slot; LANES] = std::array::from_fn(|lane| hit(&hits.pixels, group, lane, record));
            let points = Points::from(slots.each_ref().map(|slot| hits.hits[slot.hit]));
            for (lane, slot) in slots.iter().enumerate() {
                places.put(rows, lane, &surface.at(points.hits[lane]), slot.share);
            }
            for (field, at) in &declared {
                surface.field(*field, &points, &mut rows[at.clone()]);
            }
        }
        done(group.len() as u64);
    });
}

/// The place of (x, y) along a Z-order curve: the bits of both interleaved. Pixels that are neighbours along it are
/// neighbours in the image, and look up the same texels.
#[must_use]
pub fn z_order(x: u32, y: u32) -> u64 {
    let spread = |v: u32| {
        let mut v = u64::from(v);
        for (shift, mask) in [
            (16, 0x0000_ffff_0000_ffff),
            (8, 0x00ff_00ff_00ff_00ff),
            (4, 0x0f0f_0f0f_0f0f_0f0f),
            (2, 0x3333_3333_3333_3333),
            (1, 0x5555_5555_5555_5555),
        ] {
            v = (v | v << shift) & mask;
        }
        v
    };
    spread(x) | spread(y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z_order_interleaves_bits() {
        assert_eq!(z_order(0b101, 0b011), 0b01_10_11);
        assert_eq!(z_order(u32::MAX, 0), 0x5555_5555_5555_5555);
    }
}
