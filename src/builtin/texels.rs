//! The atlas as texels: which triangle each texel shows, and what the gutters repeat.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::atlas::Atlas;

/// Rounds of growing the charts into their gutters; more than the margin, so that bilinear and
/// mip-mapped lookups near a seam see only the chart's own colours.
const GUTTER: usize = 10;
/// A texel that no chart reaches.
const EMPTY: u32 = u32::MAX;

/// A place on the surface, interpolated.
pub(super) struct Place {
    /// Metres.
    pub(super) position: DVec3,
    /// Unit normal.
    pub(super) normal: DVec3,
    /// The triangle, and the barycentric weights of its corners.
    pub(super) triangle: usize,
    pub(super) weights: DVec3,
}

/// For each texel the triangle under its centre, or the covered texel whose value it repeats.
pub(super) struct Texels {
    pub(super) size: usize,
    triangle: Vec<u32>,
    source: Vec<u32>,
    /// Texels whose centre lies in more than one triangle (shared edges aside).
    #[cfg(test)]
    pub(super) overlapping: usize,
}

impl Texels {
    /// Rasterise the atlas at `size` x `size`.
    pub(super) fn new(atlas: &Atlas, size: usize) -> Self {
        let mut triangle = vec![EMPTY; size * size];
        let mut overlapping = 0;
        for (i, t) in atlas.triangles.iter().enumerate() {
            let corners = t.map(|v| atlas.uvs[v as usize] * size as f64);
            let low = corners[0].min(corners[1]).min(corners[2]).floor().max(DVec2::ZERO).as_usizevec2();
            let high = corners[0]
                .max(corners[1])
                .max(corners[2])
                .ceil()
                .as_usizevec2()
                .min(glam::USizeVec2::splat(size));
            for y in low.y..high.y {
                for x in low.x..high.x {
                    let Some(w) = barycentric(corners, DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) else {
                        continue;
                    };
                    let texel = &mut triangle[y * size + x];
                    if *texel == EMPTY {
                        *texel = i as u32;
                    } else if w.min_element() > 1e-9 {
                        overlapping += 1;
                    }
                }
            }
        }
        let source = grow(&triangle, size);
        #[cfg(not(test))]
        let _ = overlapping;
        Self {
            size,
            triangle,
            source,
            #[cfg(test)]
            overlapping,
        }
    }

    /// `paint` at every covered texel, repeated in the gutters; `empty` elsewhere. Row by row.
    pub(super) fn map<T: Copy + Send + Sync>(
        &self,
        atlas: &Atlas,
        empty: T,
        paint: impl Fn(&Place) -> T + Sync,
        done: impl Fn() + Sync,
    ) -> Vec<T> {
        let mut values = vec![empty; self.triangle.len()];
        values.par_chunks_mut(self.size).enumerate().for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let index = y * self.size + x;
                if self.triangle[index] != EMPTY {
                    *value = paint(&self.place(atlas, index));
                }
            }
            done();
        });
        self.source.iter().map(|&from| if from == EMPTY { empty } else { values[from as usize] }).collect()
    }

    fn place(&self, atlas: &Atlas, index: usize) -> Place {
        let triangle = self.triangle[index] as usize;
        let corners = atlas.triangles[triangle];
        let at = DVec2::new((index % self.size) as f64 + 0.5, (index / self.size) as f64 + 0.5);
        let flat = corners.map(|v| atlas.uvs[v as usize] * self.size as f64);
        let weights = barycentric(flat, at).unwrap_or(DVec3::splat(1.0 / 3.0));
        let blend = |of: &[DVec3]| -> DVec3 { (0..3).map(|k| of[corners[k] as usize] * weights[k]).sum() };
        let normal = blend(&atlas.normals).normalize_or(DVec3::Y);
        Place { position: blend(&atlas.positions), normal, triangle, weights }
    }

    /// Texels covered by a triangle's inside or edge.
    #[cfg(test)]
    pub(super) fn covered(&self) -> usize {
        self.triangle.iter().filter(|&&t| t != EMPTY).count()
    }
}

/// The barycentric coordinates of `p`, when it lies in the triangle.
fn barycentric([a, b, c]: [DVec2; 3], p: DVec2) -> Option<DVec3> {
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return None;
    }
    let w = DVec3::new((b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)) / area;
    (w.min_element() >= 0.0).then_some(w)
}

/// The covered texel that each texel repeats: itself, or the one that a chart's border grew from.
fn grow(triangle: &[u32], size: usize) -> Vec<u32> {
    let mut source: Vec<u32> =
        triangle.iter().enumerate().map(|(i, &t)| if t == EMPTY { EMPTY } else { i as u32 }).collect();
    for _ in 0..GUTTER {
        let old = source.clone();
        for (i, texel) in source.iter_mut().enumerate().filter(|(_, texel)| **texel == EMPTY) {
            let (x, y) = (i % size, i / size);
            let beside = [
                (x > 0).then(|| i - 1),
                (x + 1 < size).then_some(i + 1),
                (y > 0).then(|| i - size),
                (y + 1 < size).then_some(i + size),
            ];
            *texel = beside.into_iter().flatten().map(|j| old[j]).find(|&s| s != EMPTY).unwrap_or(EMPTY);
        }
    }
    source
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One square chart in the middle half of the atlas.
    fn square() -> Atlas {
        let uvs = vec![
            DVec2::new(0.25, 0.75),
            DVec2::new(0.75, 0.75),
            DVec2::new(0.75, 0.25),
            DVec2::new(0.25, 0.25),
        ];
        Atlas {
            positions: uvs.iter().map(|uv| DVec3::new(uv.x, 1.0 - uv.y, 0.0)).collect(),
            normals: vec![DVec3::Z; 4],
            tangents: vec![],
            uvs,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn texels_see_their_own_place_and_the_gutter_repeats_the_border() {
        let atlas = square();
        let texels = Texels::new(&atlas, 64);
        assert_eq!((texels.covered(), texels.overlapping), (32 * 32, 0));
        let map = texels.map(&atlas, DVec2::splat(-1.0), |place| place.position.truncate(), || {});
        for (i, &value) in map.iter().enumerate() {
            let (x, y) = (i % 64, i / 64);
            let centre = |x: usize| (x as f64 + 0.5) / 64.0;
            let steps = |x: usize| 16_usize.saturating_sub(x) + x.saturating_sub(47);
            let (want_x, want_y) = (centre(x.clamp(16, 47)), 1.0 - centre(y.clamp(16, 47)));
            match (steps(x), steps(y)) {
                (0, 0) => assert!(value.distance(DVec2::new(want_x, want_y)) < 1e-12),
                (a, b) if a + b <= GUTTER => assert!(value.x >= 0.0),
                _ => assert_eq!(value, DVec2::splat(-1.0), "texel {x}, {y}"),
            }
        }
    }
}
