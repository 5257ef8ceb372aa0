//! Hits packed into groups of pixels, ready to be streamed.

use rayon::prelude::*;

use super::surface::Surface;
use super::trace::Hits;
use super::{LANES, SurfaceArrays, ViewSamples};

/// Groups that one task fills.
const CHUNK: usize = 64;

/// Pack the hits of a view of `width` pixels with `per_pixel` samples a pixel.
pub(super) fn pack(hits: &Hits, surface: &Surface<'_>, width: u32, per_pixel: u32) -> ViewSamples {
    let mut order: Vec<u32> = (0..hits.pixels.len() as u32).collect();
    // Full pixels first; among equals, along a Z-order curve, so that a group is a small tile.
    order.par_sort_unstable_by_key(|&i| {
        let (pixel, range) = &hits.pixels[i as usize];
        (std::cmp::Reverse(range.len()), z_order(pixel % width, pixel / width))
    });
    let groups: Vec<&[u32]> = order.chunks(LANES).collect();
    let parts: Vec<ViewSamples> =
        groups.par_chunks(CHUNK).map(|groups| pack_groups(hits, surface, groups, per_pixel)).collect();
    join(parts)
}

fn pack_groups(hits: &Hits, surface: &Surface<'_>, groups: &[&[u32]], per_pixel: u32) -> ViewSamples {
    let mut samples = ViewSamples { group_start: vec![0], ..Default::default() };
    for group in groups {
        // Lanes beyond the last pixel repeat the first, without weight.
        let lane = |lane: usize| &hits.pixels[group[if lane < group.len() { lane } else { 0 }] as usize];
        for i in 0..LANES {
            let (pixel, range) = lane(i);
            let real = i < group.len();
            samples.pixel.push(if real { *pixel } else { u32::MAX });
            samples.coverage.push(if real { range.len() as f32 / per_pixel as f32 } else { 0.0 });
        }
        let records = (0..LANES).map(|i| lane(i).1.len()).max().unwrap_or(0);
        for record in 0..records {
            for i in 0..LANES {
                let range = &lane(i).1;
                let real = i < group.len() && record < range.len();
                samples.weight.push(if real { 1.0 / range.len() as f32 } else { 0.0 });
                let hit = range.start as usize + if record < range.len() { record } else { 0 };
                surface.push(hits.hits[hit], &mut samples.surface);
            }
        }
        let end = samples.records() + records;
        samples.group_start.push(end as u32);
    }
    samples
}

fn join(parts: Vec<ViewSamples>) -> ViewSamples {
    let mut all = ViewSamples { group_start: vec![0], ..Default::default() };
    for mut part in parts {
        let base = all.records() as u32;
        all.group_start.extend(part.group_start[1..].iter().map(|end| base + end));
        all.pixel.append(&mut part.pixel);
        all.coverage.append(&mut part.coverage);
        all.weight.append(&mut part.weight);
        for (plane, more) in all.surface.planes_mut().into_iter().zip(part.surface.planes_mut()) {
            plane.append(more);
        }
    }
    all
}

impl SurfaceArrays {
    /// Every plane, in the order of declaration.
    fn planes_mut(&mut self) -> Vec<&mut Vec<f32>> {
        let Self { base, bump, view, normal, occlusion, silhouette, dapple, albedo, specular, attenuator } =
            self;
        let vectors = [base, bump, view, normal, albedo].into_iter().flatten();
        vectors.chain([occlusion, silhouette, dapple, specular, attenuator]).collect()
    }
}

/// The bits of x and y interleaved.
fn z_order(x: u32, y: u32) -> u64 {
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
