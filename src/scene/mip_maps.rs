//! The coarser levels of a scene's texture maps, for filters that read them.

use rayon::prelude::*;

use super::maps::{Map, Maps, OwnMap};
use crate::model::texture_filter::TextureFilter;

/// The fewest rows that one task makes.
const CHUNK: usize = 16;

/// Levels of a scene's maps below the finest, each half as wide and high as the one before, down to one texel.
///
/// A side of an odd number of texels is halved downwards, as graphics adapters count; texels then are means by area over
/// what they cover of the level before, so that no level's mean is another.
#[derive(Clone, Debug, Default)]
pub struct MipMaps {
    filter: TextureFilter,
    /// From the second level on. A map that has come to one texel is in no further one.
    levels: Vec<Maps>,
}

impl MipMaps {
    /// The levels of `maps`, where `filter` reads them. All cores; the same for any number of threads.
    #[must_use]
    pub fn new(maps: &Maps, filter: TextureFilter) -> Option<Self> {
        if !filter.reads_levels() {
            return None;
        }
        let mut levels: Vec<Maps> = Vec::new();
        while let Some(next) = halved(levels.last().unwrap_or(maps)) {
            levels.push(next);
        }
        Some(Self { filter, levels })
    }

    /// What reads them.
    #[must_use]
    pub const fn filter(&self) -> TextureFilter {
        self.filter
    }

    /// The levels from the second on.
    #[must_use]
    pub fn levels(&self) -> &[Maps] {
        &self.levels
    }
}

/// The next level; `None` where all maps are of one texel.
fn halved(maps: &Maps) -> Option<Maps> {
    let Maps { color, normal, specular, attenuator, own, .. } = maps;
    let next = Maps {
        color: color.as_ref().and_then(half),
        normal: normal.as_ref().and_then(half),
        specular: specular.as_ref().and_then(half),
        attenuator: attenuator.as_ref().and_then(half),
        own: own.iter().filter_map(|(field, map)| Some((*field, half_of_own(map)?))).collect(),
        ..Maps::default()
    };
    let Maps { color, normal, specular, attenuator, own, .. } = &next;
    let built_in = color.is_some() || normal.is_some() || specular.is_some() || attenuator.is_some();
    let any = built_in || !own.is_empty();
    any.then_some(next)
}

fn half_of_own(map: &OwnMap) -> Option<OwnMap> {
    match map {
        OwnMap::Scalar(map) => half(map).map(OwnMap::Scalar),
        OwnMap::Color(map) => half(map).map(OwnMap::Color),
    }
}

/// The level after that of a map; `None` after one texel.
fn half<const C: usize>(map: &Map<C>) -> Option<Map<C>> {
    let Map { width, height, texels } = map;
    if width.max(height) <= &1 {
        return None;
    }
    let (columns, rows) = (covered(*width), covered(*height));
    let texel = |row: &Covered, column: &Covered| {
        // In f64, so that the mean of equal texels is that texel.
        let mut sum = [0.0_f64; C];
        for (y, share) in row.weights() {
            for (x, across) in column.weights() {
                let weight = share * across;
                (0..C).for_each(|c| sum[c] += weight * f64::from(texels[y * width + x][c]));
            }
        }
        sum.map(|x| x as f32)
    };
    let mut made = vec![[0.0; C]; columns.len() * rows.len()];
    let of_rows = made.par_chunks_mut(columns.len()).with_min_len(CHUNK).zip(&rows);
    of_rows.for_each(|(made, row)| {
        made.iter_mut().zip(&columns).for_each(|(made, column)| *made = texel(row, column));
    });
    Some(Map { width: columns.len(), height: rows.len(), texels: made })
}

/// Which texels of a side a texel of the next level covers, and how much of it each is.
struct Covered {
    first: usize,
    shares: [f64; 3],
    count: usize,
}

impl Covered {
    fn weights(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.first..).zip(self.shares).take(self.count)
    }
}

/// What the texels of the next level cover of a side of `size` texels.
fn covered(size: usize) -> Vec<Covered> {
    let half = (size / 2).max(1);
    // In units of which a texel of this side has `half`, and one of the next `size`.
    let texel = |i: usize| {
        let (start, end) = (i * size, (i + 1) * size);
        let first = start / half;
        let count = end.div_ceil(half) - first;
        let share = |k: usize| {
            let (from, to) = ((first + k) * half, (first + k + 1) * half);
            to.min(end).saturating_sub(from.max(start)) as f64 / size as f64
        };
        Covered { first, shares: std::array::from_fn(share), count }
    };
    (0..half).map(texel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels(map: &Map<3>) -> Vec<Map<3>> {
        let maps = Maps { color: Some(map.clone()), ..Maps::default() };
        let made = MipMaps::new(&maps, TextureFilter::Trilinear).unwrap();
        made.levels().iter().map(|maps| maps.color.clone().unwrap()).collect()
    }

    fn mean(map: &Map<3>) -> [f64; 3] {
        let sum = |c: usize| map.texels.iter().map(|texel| f64::from(texel[c])).sum::<f64>();
        std::array::from_fn(|c| sum(c) / map.texels.len() as f64)
    }

    const SIZES: [(usize, usize); 9] =
        [(1, 1), (2, 1), (1, 7), (3, 3), (8, 8), (5, 12), (97, 31), (100, 1), (257, 255)];

    #[test]
    fn levels_of_a_constant_are_that_constant_to_the_bit() {
        let grey = [0.1, 0.7, 1.0 / 3.0];
        for (width, height) in SIZES {
            let map = Map { width, height, texels: vec![grey; width * height] };
            let levels = levels(&map);
            assert_eq!(levels.len(), width.max(height).ilog2() as usize, "{width} x {height}");
            assert!(levels.iter().all(|level| level.texels.iter().all(|texel| *texel == grey)));
        }
    }

    #[test]
    fn every_level_has_the_mean_of_the_map_and_the_adapters_size() {
        for (width, height) in SIZES {
            let noise = |i: usize| [0, 1, 2].map(|c| ((i * 7919 + c * 104_729) % 1009) as f32 / 1009.0);
            let map = Map { width, height, texels: (0..width * height).map(noise).collect() };
            let want = mean(&map);
            for (level, made) in (1_u32..).zip(levels(&map)) {
                let side = |size: usize| (size >> level).max(1);
                assert_eq!((made.width, made.height), (side(width), side(height)));
                // A rounding of f32 a level and texel, of which most cancel.
                let off = (0..3).map(|c| (mean(&made)[c] - want[c]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-7, "{width} x {height}, level {level}: {off}");
            }
        }
    }

    #[test]
    fn an_odd_side_is_weighed_by_area() {
        let row = |texels: &[f32]| Map {
            width: texels.len(),
            height: 1,
            texels: texels.iter().map(|&x| [x; 3]).collect(),
        };
        // Five texels in two: each is two of them and a half.
        let half = &levels(&row(&[1.0, 0.0, 0.0, 0.0, 0.0]))[0];
        assert_eq!(half.texels, [[0.4; 3], [0.0; 3]]);
        let middle = &levels(&row(&[0.0, 0.0, 1.0, 0.0, 0.0]))[0];
        assert_eq!(middle.texels, [[0.2; 3], [0.2; 3]]);
    }

    #[test]
    fn nothing_is_made_that_no_filter_reads() {
        let maps =
            Maps { color: Some(Map { width: 4, height: 4, texels: vec![[0.5; 3]; 16] }), ..Maps::default() };
        assert!(MipMaps::new(&maps, TextureFilter::Bilinear).is_none());
        assert!(MipMaps::new(&Maps::default(), TextureFilter::Trilinear).unwrap().levels().is_empty());
        // A small map ends before a larger one does.
        let specular = Some(Map { width: 2, height: 2, texels: vec![[1.0]; 4] });
        let both = MipMaps::new(&Maps { specular, ..maps }, TextureFilter::Anisotropic).unwrap();
        let there: Vec<bool> = both.levels().iter().map(|level| level.specular.is_some()).collect();
        assert_eq!(there, [true, false]);
    }
}
