//! What samples find in levels, as `shader/atlas/level.wgsl` has it.

use std::sync::Arc;

use fearless_simd::Level as Instructions;
use rayon::prelude::*;

use super::block::Block;
use super::{LevelMaker, Made, Number};
use crate::engine::cubes_at::CubesAt;
use crate::model::params::Params;
use crate::model::real::Real;
use crate::samples::{Atlas, LANES, ViewSamples};
use crate::simd::Simd;
use crate::with_simd;

/// Records of samples that a thread takes at once.
const CHUNK: usize = 256;

/// The texels that a record of samples looks up, four each, and what these count; a sample that finds none has shares
/// of 0.
#[derive(Clone, Debug)]
pub struct Corners<R> {
    texels: [[u32; LANES]; 4],
    shares: [[R; LANES]; 4],
}

impl<R: Copy> Corners<R> {
    /// What the record's sample in a lane looks up, and what that counts.
    #[must_use]
    pub fn of(&self, lane: usize) -> [(u32, R); 4] {
        std::array::from_fn(|k| (self.texels[k][lane], self.shares[k][lane]))
    }
}

/// The four texels around texture coordinates; one that is not of `chart` counts nothing, and where none is, the chart's
/// nearest counts alone. `None` where the chart has none.
fn corners<R: Number>(atlas: &Atlas, uv: [f32; 2], chart: u32) -> Option<[(usize, R); 4]> {
    let one = R::from(1.0);
    let place = uv.map(|x| R::from(x) * one.lit(f64::from(atlas.size())) - one.lit(0.5));
    let low = place.map(R::floor);
    let f = [place[0] - low[0], place[1] - low[1]];
    let first = low.map(|x| {
        let x: f64 = x.into();
        x as i64
    });
    let mut sum = R::from(0.0);
    let mut corners = [(0, R::from(0.0)); 4];
    for (k, corner) in corners.iter_mut().enumerate() {
        let (right, below) = (k & 1, k >> 1);
        let share = |f: R, side: usize| if side == 1 { f } else { one - f };
        let at = atlas.place(first[0].saturating_add(right as i64), first[1].saturating_add(below as i64));
        let Some(at) = at.filter(|&at| atlas.chart(at) == chart) else { continue };
        *corner = (at, share(f[0], right) * share(f[1], below));
        sum = sum + corner.1;
    }
    if R::from(0.0).lt(sum) {
        return Some(corners.map(|(at, share)| (at, share / sum)));
    }
    let nearest = atlas.nearest(chart, place.map(Into::into))?;
    Some([(nearest, one), (nearest, R::from(0.0)), (nearest, R::from(0.0)), (nearest, R::from(0.0))])
}

/// The four texels around texture coordinates, clamped at the atlas' edge, whatever they are of: covered ones, and those that
/// were [filled](crate::samples::Atlas::dilation). One that is neither counts as darkness. As
/// `shader/atlas/level_dilated.wgsl` has it.
fn dilated_corners<R: Number>(atlas: &Atlas, uv: [f32; 2]) -> Option<[(usize, R); 4]> {
    let one = R::from(1.0);
    let most = one.lit(f64::from(atlas.size() - 1));
    let place = uv.map(|x| R::from(x) * one.lit(f64::from(atlas.size())) - one.lit(0.5));
    let place = place.map(|x| x.max(R::from(0.0)).min(most));
    let low = place.map(R::floor);
    let f = [place[0] - low[0], place[1] - low[1]];
    let first = low.map(|x| {
        let x: f64 = x.into();
        x as i64
    });
    let last = i64::from(atlas.size() - 1);
    (atlas.covered() > 0).then(|| {
        std::array::from_fn(|k| {
            let (right, below) = (k & 1, k >> 1);
            let share = |f: R, side: usize| if side == 1 { f } else { one - f };
            let [column, row] = [(first[0] + right as i64).min(last), (first[1] + below as i64).min(last)];
            let filled = || atlas.dilation().number(row as u32 * atlas.size() + column as u32);
            match atlas.place(column, row).or_else(filled) {
                Some(at) => (at, share(f[0], right) * share(f[1], below)),
                None => (0, R::from(0.0)),
            }
        })
    })
}

/// What each record of a view looks up, `dilated`: by one fetch; none where it has neither texels nor texture coordinates.
/// All cores.
#[must_use]
pub fn corners_of<R: Number>(samples: &ViewSamples, dilated: bool) -> Vec<Corners<R>> {
    let places = samples.surface.places();
    let (Some(atlas), Some(at), Some(of_chart)) = (&samples.atlas, places.uv, places.chart) else {
        return Vec::new();
    };
    let rows = samples.surface.rows();
    let of_record = |record: usize| {
        let mut found = Corners { texels: [[0; LANES]; 4], shares: [[R::from(0.0); LANES]; 4] };
        for lane in 0..LANES {
            let number = |row: usize| rows.number(row, record * LANES + lane);
            let uv = [number(at), number(at + 1)];
            let four = if dilated {
                dilated_corners(atlas, uv)
            } else {
                corners(atlas, uv, number(of_chart) as u32)
            };
            for (k, (texel, share)) in four.into_iter().flatten().enumerate() {
                (found.texels[k][lane], found.shares[k][lane]) = (texel as u32, share);
            }
        }
        found
    };
    (0..samples.records()).into_par_iter().with_min_len(CHUNK).map(of_record).collect()
}

/// Looks levels up: numbers that stand side by side together.
#[derive(Debug)]
pub struct Finder<R> {
    made: Arc<Made<R>>,
    blocks: Vec<Block>,
    rows: usize,
    /// Rows of what nothing leaves.
    empty: Vec<usize>,
}

impl<R: Number> Finder<R> {
    /// Of the levels that a maker has made.
    #[must_use]
    pub fn new(maker: &LevelMaker<R>, made: Arc<Made<R>>) -> Self {
        let mut numbers = Vec::new();
        let mut row = 0;
        for (name, count) in &maker.program.looked_up {
            if let Some((record, offset)) = made.place(name) {
                numbers.extend((0..*count).map(|c| (record, offset + c, row + c)));
            }
            row += count;
        }
        let empty = (0..row).filter(|row| !numbers.iter().any(|(.., found)| found == row)).collect();
        let blocks = Block::of(numbers);
        Self { made, blocks, rows: row, empty }
    }

    /// What a record of samples finds, a row a number; 0 of what nothing leaves.
    #[inline(always)]
    pub fn find<S: Simd>(&self, simd: S, corners: &Corners<R>, mut put: impl FnMut(usize, R::Sixteen<S>)) {
        let nothing = R::splat(simd, R::from(0.0));
        for &row in &self.empty {
            put(row, nothing);
        }
        for block in &self.blocks {
            let record = self.made.record(block.record);
            // A row a sample, and then a row a number.
            let mut found = [nothing; LANES];
            for lane in 0..LANES {
                let mut sum = nothing;
                for k in 0..4 {
                    let texel = corners.texels[k][lane] as usize;
                    let numbers = R::load(simd, record.sixteen(texel, block.first));
                    sum = numbers.mul_add(R::splat(simd, corners.shares[k][lane]), sum);
                }
                found[lane] = sum;
            }
            R::transpose(simd, &mut found);
            for &(k, row) in &block.rows {
                put(row, found[k]);
            }
        }
    }
}

impl<R: Number> LevelMaker<R> {
    /// What the samples of a view look up at `params`, [`Self::rows`] rows a record; 0 where they find nothing, or have
    /// neither texels nor texture coordinates.
    pub fn look_up<T: Send>(
        &self,
        samples: &ViewSamples,
        params: &Params,
        cubes: impl FnOnce() -> CubesAt<R>,
        row: impl Fn([R; LANES]) -> T + Sync,
    ) -> Vec<T> {
        let (stride, records) = (self.rows(), samples.records());
        if stride == 0 {
            return Vec::new();
        }
        let finder = samples.atlas.as_ref().map(|atlas| Finder::new(self, self.levels(atlas, params, cubes)));
        let corners = corners_of(samples, self.program.dilated);
        let instructions = Instructions::new();
        let chunks = (0..records.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            let own = chunk * CHUNK..records.min((chunk + 1) * CHUNK);
            let mut found = vec![[R::from(0.0); LANES]; stride * own.len()];
            if let Some(finder) = finder.as_ref().filter(|_| !corners.is_empty()) {
                with_simd!(instructions, simd => {
                    for (rows, corners) in found.chunks_mut(stride).zip(&corners[own]) {
                        finder.find(
                            simd,
                            corners,
                            #[inline(always)]
                            |row, numbers| rows[row] = R::array(numbers),
                        );
                    }
                });
            }
            found.into_iter().map(&row).collect::<Vec<T>>()
        });
        chunks.collect::<Vec<_>>().into_iter().flatten().collect()
    }
}

impl<R> Finder<R> {
    /// Rows of a record.
    #[inline]
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }
}
