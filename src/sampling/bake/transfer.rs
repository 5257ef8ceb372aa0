//! Transfer vectors: how much of the light around arrives at each vertex past the mesh itself, as coefficients of
//! spherical harmonics (precomputed radiance transfer: Sloan, Kautz and Snyder 2002; MODEL 10).
//!
//! T_lm = 1 / pi * integral of V(w) max(0, N.w) Y_lm(w), V the visibility by rays. Rays that are distributed as the
//! cosine make it the mean of V Y_lm. Of that mean, the part that goes with the open share o is known in closed form:
//! T = o T_open + mean of (V - o) Y, so that an unoccluded vertex has T_open exactly and a hidden one 0.

use fearless_simd::{Level, Simd, f32x16, prelude::*};
use glam::{Vec3, Vec3A};

use super::VertexOcclusion;
use super::harmonics::{CONSTANT, Order, open_transfer_at, scale, unscaled};
use super::interreflection::{Albedo, Gather, Nearest};
use super::vertex_rays::{Rays, VertexRays};
use super::wide_bvh::NOTHING;
use crate::progress;
use crate::scene::mesh::PosedMesh;
use crate::with_simd;

/// Directions that the functions are evaluated along at a time.
const WIDE: usize = 16;

/// Transfer vectors of each vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexTransfer {
    /// How many bands there are.
    pub order: Order,
    /// At rest.
    pub base: TransferSet,
    /// What each morph target at weight 1 adds, as many as the mesh has targets; empty for one that
    /// neither the scene nor its animation gives a weight.
    pub morphs: Vec<TransferSet>,
}

/// Transfer vectors, vertex after vertex, each of n² numbers by index l² + l + m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TransferSet {
    /// T: of light that comes straight from the environment.
    pub direct: Vec<f32>,
    /// T', rgb: of light that the mesh throws back, in two rounds. Empty where it was not asked for.
    pub bounced: Vec<[f32; 3]>,
}

impl VertexTransfer {
    /// The transfer with the morph targets at `weights`; targets beyond the list count nothing.
    #[must_use]
    pub fn posed(&self, weights: &[f32]) -> TransferSet {
        let mut sum = self.base.clone();
        for (delta, &weight) in self.morphs.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            sum.direct.iter_mut().zip(&delta.direct).for_each(|(sum, delta)| *sum += weight * delta);
            let bounced = sum.bounced.as_flattened_mut().iter_mut().zip(delta.bounced.as_flattened());
            bounced.for_each(|(sum, delta)| *sum += weight * delta);
        }
        sum
    }

    /// The open share of each vertex' hemisphere, by the same rays: T_00 / Y_00.
    #[must_use]
    pub fn occlusion(&self) -> VertexOcclusion {
        let functions = self.order.functions();
        let share = |set: &TransferSet| -> Vec<f32> {
            set.direct.iter().step_by(functions).map(|&t| (f64::from(t) / CONSTANT) as f32).collect()
        };
        VertexOcclusion { base: share(&self.base), morphs: self.morphs.iter().map(share).collect() }
    }
}

/// The transfer vectors of each vertex at rest and what each of `morphs` targets adds, with `rays` rays a vertex.
/// `pose` gives the mesh with the targets at the listed weights. With an `albedo`, also those of the light that the
/// mesh throws back. As of [`super::occlusion::bake_occlusion`], back faces occlude, vertices that coincide are one,
/// and the result is the same for any number of threads.
#[must_use]
pub fn bake_transfer(
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    morphs: usize,
    rays: u32,
    order: Order,
    albedo: Option<&Albedo<'_>>,
) -> VertexTransfer {
    let vertices = VertexRays::new(pose, morphs, rays);
    let bar = progress::bar("transfer", (vertices.len() * (1 + morphs)) as u64);
    let project = Project::new(order);
    let done = || bar.inc(1);
    let (base, morphs) = match albedo {
        None => direct_alone(&vertices, &project, &done),
        Some(albedo) => with_bounces(&vertices, &project, albedo, &done),
    };
    bar.finish_and_clear();
    VertexTransfer { order, base, morphs }
}

fn direct_alone(
    vertices: &VertexRays,
    project: &Project,
    done: &(dyn Fn() + Sync),
) -> (TransferSet, Vec<TransferSet>) {
    let width = project.order.functions();
    let spread = |direct: Vec<Vec<f32>>| vertices.spread(&direct.concat(), width);
    let keep = !vertices.targets.is_empty();
    let (direct, hits): (Vec<_>, Vec<_>) = vertices
        .at_rest(|i, rays, hits: Vec<bool>| {
            done();
            let transfer = project.of(rays, &hits, vertices.rest.normals[vertices.vertex(i)]);
            (transfer, if keep { hits } else { Vec::new() })
        })
        .into_iter()
        .unzip();
    let base = TransferSet { direct: spread(direct), bounced: Vec::new() };
    let target = |target: &PosedMesh| {
        let direct = vertices.morphed(target, &hits, |i, rays, hits: Vec<bool>| {
            done();
            project.of(rays, &hits, target.normals[vertices.vertex(i)])
        });
        TransferSet { direct: spread(direct), bounced: Vec::new() }.beyond(&base)
    };
    let morphs = vertices.targets.iter().map(target).collect();
    (base, morphs)
}

fn with_bounces(
    vertices: &VertexRays,
    project: &Project,
    albedo: &Albedo<'_>,
    done: &(dyn Fn() + Sync),
) -> (TransferSet, Vec<TransferSet>) {
    let width = project.order.functions();
    let keep = !vertices.targets.is_empty();
    let of = |pose: &PosedMesh, i: usize, rays: &Rays, found: &[Nearest]| {
        done();
        let hits: Vec<bool> = found.iter().map(|&found| found != NOTHING).collect();
        let direct = project.of(rays, &hits, pose.normals[vertices.vertex(i)]);
        (direct, Gather::of(vertices, pose, rays, found, albedo))
    };
    let set = |direct: Vec<Vec<f32>>, gathers: &[Gather]| {
        let direct = direct.concat();
        let bounced = Gather::twice(gathers, &direct, width);
        TransferSet { direct: vertices.spread(&direct, width), bounced: vertices.spread(&bounced, width) }
    };
    let rest = vertices.at_rest(|i, rays, found: Vec<Nearest>| {
        let (direct, gather) = of(&vertices.rest, i, rays, &found);
        (direct, (gather, if keep { found } else { Vec::new() }))
    });
    let (direct, rest): (Vec<_>, Vec<_>) = rest.into_iter().unzip();
    let (gathers, found): (Vec<_>, Vec<_>) = rest.into_iter().unzip();
    let base = set(direct, &gathers);
    drop(gathers);
    let target = |target: &PosedMesh| {
        let morphed =
            vertices.morphed(target, &found, |i, rays, found: Vec<Nearest>| of(target, i, rays, &found));
        let (direct, gathers): (Vec<_>, Vec<_>) = morphed.into_iter().unzip();
        set(direct, &gathers).beyond(&base)
    };
    let morphs = vertices.targets.iter().map(target).collect();
    (base, morphs)
}

impl TransferSet {
    /// How much more this is than `base`.
    fn beyond(mut self, base: &Self) -> Self {
        self.direct.iter_mut().zip(&base.direct).for_each(|(own, base)| *own -= base);
        let bounced = self.bounced.as_flattened_mut().iter_mut().zip(base.bounced.as_flattened());
        bounced.for_each(|(own, base)| *own -= base);
        self
    }
}

/// A vertex' transfer vector from what its rays met.
struct Project {
    order: Order,
    level: Level,
    scales: Vec<f64>,
}

impl Project {
    fn new(order: Order) -> Self {
        let scales = order.of_each().map(|(l, m)| scale(l, m)).collect();
        Self { order, level: Level::new(), scales }
    }

    fn of(&self, rays: &Rays, hits: &[bool], normal: Vec3) -> Vec<f32> {
        let mut transfer = open_transfer_at(self.order, normal);
        let open = hits.iter().filter(|&&hit| !hit).count();
        if open == hits.len() {
            return transfer;
        }
        if open == 0 {
            return vec![0.0; transfer.len()];
        }
        let share = open as f64 / hits.len() as f64;
        let directions = &rays.directions;
        let sums = with_simd!(self.level, simd => match self.order.bands() {
            2 => sums::<2, _>(simd, directions, hits, share as f32),
            3 => sums::<3, _>(simd, directions, hits, share as f32),
            4 => sums::<4, _>(simd, directions, hits, share as f32),
            5 => sums::<5, _>(simd, directions, hits, share as f32),
            _ => sums::<6, _>(simd, directions, hits, share as f32),
        });
        // The first function is constant: o of what an open vertex has, and the sum is 0 but for rounding.
        transfer[0] = (share * CONSTANT) as f32;
        for (i, transfer) in transfer.iter_mut().enumerate().skip(1) {
            let mean = self.scales[i] * sums[i] / hits.len() as f64;
            *transfer = (share * f64::from(*transfer) + mean) as f32;
        }
        transfer
    }
}

/// The sums of (V - `share`) times each function without its scale.
#[inline(always)]
fn sums<const BANDS: usize, S: Simd>(simd: S, directions: &[Vec3A], hits: &[bool], share: f32) -> [f64; 36] {
    let mut sums = [f32x16::splat(simd, 0.0); 36];
    for (directions, hits) in directions.chunks(WIDE).zip(hits.chunks(WIDE)) {
        let mut lanes = [[0.0_f32; WIDE]; 4];
        for (k, (d, &hit)) in directions.iter().zip(hits).enumerate() {
            (lanes[0][k], lanes[1][k], lanes[2][k]) = (d.x, d.y, d.z);
            lanes[3][k] = f32::from(u8::from(!hit)) - share;
        }
        let [x, y, z, weight] = lanes.map(|lane| f32x16::from_slice(simd, &lane));
        let lit = |x: f64| f32x16::splat(simd, x as f32);
        unscaled(BANDS, [x, y, z], lit, |i, value| sums[i] = value.mul_add(weight, sums[i]));
    }
    sums.map(|sum| sum.as_slice().iter().map(|&x| f64::from(x)).sum())
}
