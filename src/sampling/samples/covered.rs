//! Samples that a rasteriser found instead of rays: which of them show the mesh, packed as the rays' hits are.
//!
//! What they show is not here: whoever rasterised them puts it where [`Covered::sources`] says.

use std::ops::Range;

use rayon::prelude::*;

use super::group::{groups, hit, order};
use super::{LANES, ViewSamples, asked_records};
use crate::scene::Scene;
use crate::scene::view::Camera;

/// A bit for each sample of an image, row by row.
#[derive(Clone, Debug)]
pub struct SampleMask {
    /// Words a row.
    stride: usize,
    words: Vec<u32>,
}

impl SampleMask {
    /// A mask of `width` by `height` samples; none is set.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        let stride = width.div_ceil(u32::BITS) as usize;
        Self { stride, words: vec![0; stride * height as usize] }
    }

    /// Whether the sample in that column and row is set.
    #[must_use]
    pub fn is_set(&self, x: u32, y: u32) -> bool {
        self.words[y as usize * self.stride + (x / u32::BITS) as usize] >> (x % u32::BITS) & 1 == 1
    }

    /// Set those of a rectangle whose corner is at (x, y): its words, `words_a_row` of them.
    pub fn set_rectangle(&mut self, x: u32, y: u32, words_a_row: usize, words: &[u32]) {
        for (row, words) in (y as usize..).zip(words.chunks_exact(words_a_row.max(1))) {
            let into = &mut self.words[row * self.stride..][..self.stride];
            let (first, shift) = ((x / u32::BITS) as usize, x % u32::BITS);
            for (k, &word) in words.iter().enumerate().filter(|(_, word)| **word != 0) {
                into[first + k] |= word << shift;
                let beyond = word.checked_shr(u32::BITS - shift).unwrap_or(0);
                if beyond != 0 {
                    into[first + k + 1] |= beyond;
                }
            }
        }
    }
}

/// The sample that stands at a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Its column among the samples of the image.
    pub x: u32,
    /// Its row.
    pub y: u32,
    /// Its share of its pixel's covered area; 0 for padding.
    pub share: f32,
}

/// The samples of a view that show the mesh.
#[derive(Clone, Debug)]
pub struct Covered {
    /// Pixels across.
    width: u32,
    /// Samples along a pixel's side.
    axis: u32,
    /// For each pixel, row by row: its index in the image, and where its samples start and end.
    pixels: Vec<(u32, Range<u32>)>,
    /// For each sample, which of its pixel's it is, row by row.
    places: Vec<u16>,
    /// The order in which pixels are packed.
    order: Vec<u32>,
}

impl Covered {
    /// Group the samples in `mask` as [`super::sample_view`] groups its hits: `scene.quality.samples_per_axis`
    /// along a pixel's side of `camera`'s image. With the groups, which have places for what the effects ask for
    /// but hold no surface; without a group where no sample is set.
    #[must_use]
    pub fn new(scene: &Scene, camera: &Camera, mask: &SampleMask) -> (Self, ViewSamples) {
        let axis = scene.quality.samples_per_axis.max(1);
        let rows = (0..camera.height).into_par_iter().map(|y| row(mask, camera.width, axis, y));
        let rows: Vec<Row> = rows.collect();
        let (mut pixels, mut places) = (Vec::new(), Vec::new());
        for row in rows {
            let mut start = places.len() as u32;
            for (pixel, count) in row.pixels {
                pixels.push((pixel, start..start + count));
                start += count;
            }
            places.extend(row.places);
        }
        let order = order(&pixels, camera.width);
        let mut samples = groups(&pixels, &order, axis * axis);
        samples.surface = asked_records(scene, 0);
        (Self { width: camera.width, axis, pixels, places, order }, samples)
    }

    /// Groups of pixels.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.order.len().div_ceil(LANES)
    }

    /// Samples that show the mesh.
    #[must_use]
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// Samples along a pixel's side.
    #[must_use]
    pub const fn axis(&self) -> u32 {
        self.axis
    }

    /// What stands at each slot of a group, record by record.
    pub fn sources(&self, group: usize) -> impl Iterator<Item = Source> + '_ {
        let first = group * LANES;
        let group = &self.order[first..self.order.len().min(first + LANES)];
        let records = self.pixels[group[0] as usize].1.len();
        (0..records * LANES).map(move |slot| {
            let at = hit(&self.pixels, group, slot % LANES, slot / LANES);
            let (place, axis) = (u32::from(self.places[at.hit]), self.axis);
            Source {
                x: at.pixel % self.width * axis + place % axis,
                y: at.pixel / self.width * axis + place / axis,
                share: at.share,
            }
        })
    }
}

/// A row of pixels that show the mesh.
#[derive(Default)]
struct Row {
    /// For each, its index in the image and how many samples it has.
    pixels: Vec<(u32, u32)>,
    /// For each of their samples, which of the pixel's it is.
    places: Vec<u16>,
}

/// The pixels of row `y` of which samples are set.
fn row(mask: &SampleMask, width: u32, axis: u32, y: u32) -> Row {
    let Row { mut pixels, mut places } = Row::default();
    for x in 0..width {
        let before = places.len();
        let set = |place: &u32| mask.is_set(x * axis + place % axis, y * axis + place / axis);
        places.extend((0..axis * axis).filter(set).map(|place| place as u16));
        if places.len() > before {
            pixels.push((y * width + x, (places.len() - before) as u32));
        }
    }
    Row { pixels, places }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_land_where_they_belong() {
        let (width, height) = (101, 9);
        for (x, y, across, down) in [(0, 0, 101, 9), (31, 2, 40, 3), (32, 8, 69, 1), (70, 0, 31, 9)] {
            let mut mask = SampleMask::new(width, height);
            let words_a_row = (across as usize).div_ceil(32);
            let inside = |x: u32, y: u32| x < across && y < down && (x * 7 + y * 3) % 5 < 2;
            let mut words = vec![0; words_a_row * down as usize];
            for j in 0..down {
                for i in (0..across).filter(|&i| inside(i, j)) {
                    words[j as usize * words_a_row + i as usize / 32] |= 1 << (i % 32);
                }
            }
            mask.set_rectangle(x, y, words_a_row, &words);
            for j in 0..height {
                for i in 0..width {
                    let want = i >= x && j >= y && inside(i - x, j - y);
                    assert_eq!(mask.is_set(i, j), want, "({i}, {j})");
                }
            }
        }
    }
}
