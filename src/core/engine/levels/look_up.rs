//! What samples find in levels, as `shader/atlas/level.wgsl` has it.

use std::sync::Arc;

use rayon::prelude::*;

use super::{LevelMaker, Levels, Number};
use crate::engine::cubes_at::CubesAt;
use crate::model::params::Params;
use crate::samples::{Atlas, LANES, ViewSamples};

/// Records of samples that a thread takes at once.
const CHUNK: usize = 256;

/// The texels around a place that hold something, and what each counts.
type Corners<R> = [(usize, R); 4];

/// The four texels around texture coordinates; one that is not of `chart` counts nothing, and where none is, the chart's
/// nearest counts alone. `None` where the chart has none.
fn corners<R: Number>(atlas: &Atlas, uv: [f32; 2], chart: u32) -> Option<Corners<R>> {
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
        let levels = samples.atlas.as_ref().map(|atlas| (atlas, self.levels(atlas, params, cubes)));
        let chunks = (0..records.div_ceil(CHUNK)).into_par_iter().map(|chunk| {
            let mut rows = Vec::with_capacity(stride * CHUNK);
            for record in chunk * CHUNK..records.min((chunk + 1) * CHUNK) {
                self.record(samples, levels.as_ref(), record, &mut |numbers| rows.push(row(numbers)));
            }
            rows
        });
        chunks.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    fn record(
        &self,
        samples: &ViewSamples,
        levels: Option<&(&Arc<Atlas>, Arc<Levels<R>>)>,
        record: usize,
        put: &mut impl FnMut([R; LANES]),
    ) {
        let places = samples.surface.places();
        let found: [Option<Corners<R>>; LANES] = std::array::from_fn(|lane| {
            let ((atlas, _), at, of_chart) = (levels?, places.uv?, places.chart?);
            let rows = samples.surface.rows();
            let number = |row: usize| rows.number(row, record * LANES + lane);
            corners(atlas, [number(at), number(at + 1)], number(of_chart) as u32)
        });
        for (name, count) in &self.program.looked_up {
            let level = levels.and_then(|(_, levels)| levels.get(name));
            for component in 0..*count {
                put(std::array::from_fn(|lane| {
                    let zero = R::from(0.0);
                    let (Some(level), Some(corners)) = (level, &found[lane]) else { return zero };
                    corners.iter().fold(zero, |sum, &(at, share)| sum + share * level[at][component])
                }));
            }
        }
    }
}
