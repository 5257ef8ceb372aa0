//! The mesh cut along its seams, and its charts packed into one square.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::charts::{Chart, assign};
use super::head::Head;
use super::surface::Surface;
use super::unwrap::flatten;

/// The margin around each chart, as a share of the square: 6 texels of 1024.
pub(super) const MARGIN: f64 = 6.0 / 1024.0;

/// A mesh whose vertices are split at the seams.
pub(super) struct Atlas {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// As [`tangents`](super::tangents::tangents) gives them; empty until then.
    pub(super) tangents: Vec<[f32; 4]>,
    /// glTF texture coordinates: v downwards.
    pub(super) uvs: Vec<DVec2>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// One chart: its vertices in the surface, its triangles over them, and where they lie flat.
struct Patch {
    chart: Chart,
    vertices: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    flat: Vec<DVec2>,
}

impl Patch {
    fn new(surface: &Surface, charts: &[Chart], chart: Chart) -> Self {
        let mut local = vec![u32::MAX; surface.positions.len()];
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for (t, _) in surface.triangles.iter().zip(charts).filter(|&(_, &c)| c == chart) {
            triangles.push(t.map(|i| {
                let slot = &mut local[i as usize];
                if *slot == u32::MAX {
                    *slot = vertices.len() as u32;
                    vertices.push(i);
                }
                *slot
            }));
        }
        let positions: Vec<DVec3> = vertices.iter().map(|&i| surface.positions[i as usize]).collect();
        let mut flat = flatten(&positions, &triangles);
        upright(&mut flat, &positions, if chart == Chart::Floor { DVec3::Z } else { DVec3::Y });
        flat.iter_mut().for_each(|p| *p *= chart.density());
        let low = flat.iter().copied().reduce(DVec2::min).unwrap_or_default();
        flat.iter_mut().for_each(|p| *p -= low);
        Self { chart, vertices, triangles, flat }
    }

    fn size(&self) -> DVec2 {
        self.flat.iter().copied().reduce(DVec2::max).unwrap_or_default()
    }
}

/// Turn a flat chart so that `up` runs upwards.
fn upright(flat: &mut [DVec2], positions: &[DVec3], up: DVec3) {
    let count = flat.len() as f64;
    let middle = flat.iter().sum::<DVec2>() / count;
    let height = positions.iter().map(|p| p.dot(up)).sum::<f64>() / count;
    let rise: DVec2 = flat.iter().zip(positions).map(|(&q, p)| (q - middle) * (p.dot(up) - height)).sum();
    // The rotation that takes `rise` to +t.
    let turn = DVec2::new(rise.y, rise.x).normalize_or(DVec2::X);
    flat.iter_mut().for_each(|q| *q = turn.rotate(*q - middle));
}

/// Places for boxes in the unit square by the skyline rule (lowest, then leftmost), or `None`.
fn pack(sizes: &[DVec2]) -> Option<Vec<DVec2>> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[b].y.total_cmp(&sizes[a].y));
    let mut places = vec![DVec2::ZERO; sizes.len()];
    // The skyline: (from x, height), up to the next step or 1.
    let mut skyline = vec![(0.0, 0.0)];
    for i in order {
        let size = sizes[i];
        let height_over = |x: f64| {
            (0..skyline.len())
                .filter(|&k| skyline[k].0 < x + size.x && skyline.get(k + 1).map_or(1.0, |n| n.0) > x)
                .map(|k| skyline[k].1)
                .fold(0.0, f64::max)
        };
        let best = skyline
            .iter()
            .map(|step| step.0)
            .filter(|x| x + size.x <= 1.0)
            .map(|x| (height_over(x), x))
            .min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal))?;
        let (y, x) = best;
        if y + size.y > 1.0 {
            return None;
        }
        places[i] = DVec2::new(x, y);
        let end = x + size.x;
        let after = skyline.iter().rev().find(|step| step.0 <= end).map_or(0.0, |step| step.1);
        skyline.retain(|step| step.0 < x || step.0 > end);
        skyline.push((x, y + size.y));
        if end < 1.0 {
            skyline.push((end, after));
        }
        skyline.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    Some(places)
}

impl Atlas {
    /// Cut, flatten and pack the surface.
    pub(super) fn new(head: &Head, surface: &Surface) -> Self {
        let charts = assign(head, surface);
        let patches: Vec<Patch> =
            Chart::ALL.par_iter().map(|&chart| Patch::new(surface, &charts, chart)).collect();
        let boxes = |scale: f64| -> Vec<DVec2> {
            patches.iter().map(|patch| patch.size() * scale + 2.0 * MARGIN).collect()
        };
        // The largest scale that fits; a scale near zero always does.
        let (mut low, mut high) = (1e-6, 100.0);
        for _ in 0..50 {
            let scale = 0.5 * (low + high);
            if pack(&boxes(scale)).is_some() { low = scale } else { high = scale }
        }
        let places = pack(&boxes(low)).unwrap_or_else(|| vec![DVec2::ZERO; patches.len()]);
        let mut atlas =
            Self { positions: vec![], normals: vec![], tangents: vec![], uvs: vec![], triangles: vec![] };
        for (patch, place) in patches.iter().zip(places) {
            let first = atlas.positions.len() as u32;
            for (&i, &q) in patch.vertices.iter().zip(&patch.flat) {
                atlas.positions.push(surface.positions[i as usize]);
                atlas.normals.push(surface.normals[i as usize]);
                let st = place + MARGIN + q * low;
                atlas.uvs.push(DVec2::new(st.x, 1.0 - st.y));
            }
            atlas.triangles.extend(patch.triangles.iter().map(|t| t.map(|i| first + i)));
            debug_assert_eq!(patch.vertices.len(), patch.flat.len(), "{:?}", patch.chart);
        }
        atlas
    }
}
