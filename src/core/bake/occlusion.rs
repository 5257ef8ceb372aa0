//! Ambient occlusion: the cosine-weighted open share of each vertex' hemisphere, by rays against
//! the mesh itself.

use std::collections::HashMap;

use glam::{Mat3A, Vec3, Vec3A, vec3a};
use rayon::prelude::*;

use super::VertexOcclusion;
use super::low_discrepancy::{Sobol, mix};
use super::rays::RayMesh;
use crate::progress;
use crate::scene::mesh::PosedMesh;

/// How far above the surface rays start, as a share of the mesh's diagonal: well above the rounding
/// of f32 positions (6e-8), well below any crease that a vertex normal resolves.
const OFFSET: f32 = 1e-5;
/// Cosine of the angle within which normals at one position count as one surface.
const SAME_NORMAL: f32 = 0.999;

/// The occlusion of each vertex at rest and what each of `morphs` targets adds, with `rays` rays a
/// vertex. `pose` gives the mesh with the targets at the listed weights.
///
/// Back faces occlude too. Vertices that coincide in every pose and share a normal get one value. The rays
/// depend on the rest position alone, so that the noise of a target's difference cancels where the
/// target changes nothing.
#[must_use]
pub fn bake_occlusion(
    pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
    morphs: usize,
    rays: u32,
) -> VertexOcclusion {
    let weights = |target: Option<usize>| -> Vec<f32> {
        (0..morphs).map(|i| f32::from(u8::from(Some(i) == target))).collect()
    };
    let rest = pose(&weights(None));
    let targets: Vec<PosedMesh> = (0..morphs).map(|i| pose(&weights(Some(i)))).collect();
    let baker = Baker::new(&rest, &targets, rays);
    let bar = progress::bar("occlusion", (baker.distinct.len() * (1 + morphs)) as u64);
    let (base, hits) = baker.rest(&rest, &|| bar.inc(1));
    let morphs = targets
        .iter()
        .map(|target| {
            let open = baker.morphed(&rest, target, &hits, &|| bar.inc(1));
            open.iter().zip(&base).map(|(open, base)| open - base).collect()
        })
        .collect();
    bar.finish_and_clear();
    VertexOcclusion { base, morphs }
}

/// What all poses share.
struct Baker {
    sobol: Sobol,
    /// The vertices that are baked: one of each set that coincides.
    distinct: Vec<u32>,
    /// For each vertex, which of `distinct` it takes its value from.
    slot: Vec<u32>,
    /// A seed for each of `distinct`.
    seeds: Vec<u32>,
}

/// For each ray of a vertex, whether it hit.
type Hits = Vec<bool>;

impl Baker {
    fn new(rest: &PosedMesh, targets: &[PosedMesh], rays: u32) -> Self {
        let mut at_position: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
        let (mut distinct, mut slot): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for vertex in 0..rest.positions.len() {
            let known = at_position.entry(bits(rest.positions[vertex])).or_default();
            let same = |&&other: &&u32| {
                let twin = distinct[other as usize] as usize;
                std::iter::once(rest).chain(targets).all(|pose| {
                    pose.positions[vertex] == pose.positions[twin]
                        && (pose.normals[vertex] == pose.normals[twin]
                            || pose.normals[vertex].dot(pose.normals[twin]) > SAME_NORMAL)
                })
            };
            let found = known.iter().find(same).copied();
            slot.push(found.unwrap_or_else(|| {
                known.push(distinct.len() as u32);
                distinct.push(vertex as u32);
                distinct.len() as u32 - 1
            }));
        }
        let seed = |&vertex: &u32| {
            let [x, y, z] = bits(rest.positions[vertex as usize]);
            mix(x ^ mix(y ^ mix(z)))
        };
        let seeds = distinct.iter().map(seed).collect();
        Self { sobol: Sobol::new(rays.max(1)), distinct, slot, seeds }
    }

    /// The open share of each vertex, and which rays hit for each of `distinct`.
    fn rest(&self, rest: &PosedMesh, done: &(dyn Fn() + Sync)) -> (Vec<f32>, Vec<Hits>) {
        let mesh = RayMesh::new(&rest.positions, &rest.triangles);
        let offset = offset(&rest.positions);
        let hits: Vec<Hits> = (0..self.distinct.len())
            .into_par_iter()
            .map(|i| {
                let hits = self.rays(i, rest, offset).map(|(origin, d)| mesh.hits(origin, d, 0.0)).collect();
                done();
                hits
            })
            .collect();
        (self.spread(&hits.iter().map(open_share).collect::<Vec<_>>()), hits)
    }

    /// The open share of each vertex in a morphed pose. A vertex that did not move keeps what it
    /// had along the rays that miss everything that moved.
    fn morphed(
        &self,
        rest: &PosedMesh,
        target: &PosedMesh,
        rest_hits: &[Hits],
        done: &(dyn Fn() + Sync),
    ) -> Vec<f32> {
        let mesh = RayMesh::new(&target.positions, &target.triangles);
        let moved = moved_triangles(rest, target);
        let offset = offset(&rest.positions);
        let open: Vec<f32> = (0..self.distinct.len())
            .into_par_iter()
            .map(|i| {
                let vertex = self.distinct[i] as usize;
                let still = rest.positions[vertex] == target.positions[vertex]
                    && rest.normals[vertex] == target.normals[vertex];
                let rays = self.rays(i, target, offset).zip(&rest_hits[i]);
                let hits: Hits = rays
                    .map(|((origin, d), &before)| match &moved {
                        None if still => before,
                        Some(moved) if still && !moved.hits(origin, d, 0.0) => before,
                        _ => mesh.hits(origin, d, 0.0),
                    })
                    .collect();
                done();
                open_share(&hits)
            })
            .collect();
        self.spread(&open)
    }

    /// The rays of one of `distinct`; none for a vertex without a normal or off the finite world.
    fn rays(&self, i: usize, pose: &PosedMesh, offset: f32) -> impl Iterator<Item = (Vec3A, Vec3A)> {
        let vertex = self.distinct[i] as usize;
        let normal = Vec3A::from(pose.normals[vertex]).normalize_or_zero();
        let position = Vec3A::from(pose.positions[vertex]);
        let usable = normal != Vec3A::ZERO && position.is_finite();
        let frame = if usable { frame(normal) } else { Mat3A::IDENTITY };
        let directions = self.sobol.hemisphere(self.seeds[i]).take(if usable { usize::MAX } else { 0 });
        directions.map(move |d| (position + offset * normal, frame * d))
    }

    fn spread(&self, distinct: &[f32]) -> Vec<f32> {
        self.slot.iter().map(|&slot| distinct[slot as usize]).collect()
    }
}

/// The triangles that differ between two poses, as they stand in both.
fn moved_triangles(rest: &PosedMesh, target: &PosedMesh) -> Option<RayMesh> {
    let moved: Vec<[u32; 3]> = (rest.triangles.iter().copied())
        .filter(|t| t.iter().any(|&v| rest.positions[v as usize] != target.positions[v as usize]))
        .collect();
    let count = rest.positions.len() as u32;
    let shifted = moved.iter().map(|t| t.map(|v| v + count));
    let triangles: Vec<[u32; 3]> = moved.iter().copied().chain(shifted).collect();
    (!triangles.is_empty())
        .then(|| RayMesh::new(&[&rest.positions[..], &target.positions].concat(), &triangles))
}

fn open_share(hits: &Hits) -> f32 {
    let open = hits.iter().filter(|&&hit| !hit).count();
    // A vertex without rays is taken as open.
    if hits.is_empty() { 1.0 } else { open as f32 / hits.len() as f32 }
}

/// Position bits in which 0 and -0 are one.
fn bits(position: Vec3) -> [u32; 3] {
    position.to_array().map(|x| (x + 0.0).to_bits())
}

/// How far above a surface of these positions rays start.
pub(crate) fn offset(positions: &[Vec3]) -> f32 {
    let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let (size, distance) = ((high - low).length(), low.abs().max(high.abs()).max_element());
    // Far from the origin, positions are coarser.
    OFFSET * size.max(0.1 * distance)
}

/// A frame with Z along the unit `normal`, continuous but at -Z (Duff et al., *Building an
/// Orthonormal Basis, Revisited*, JCGT 2017).
pub(crate) fn frame(normal: Vec3A) -> Mat3A {
    let sign = 1_f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    Mat3A::from_cols(
        vec3a(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
        vec3a(b, sign + normal.y * normal.y * a, -normal.y),
        normal,
    )
}
