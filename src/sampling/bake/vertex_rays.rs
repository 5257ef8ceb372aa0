//! Rays from vertices over their hemispheres, cosine-distributed: what occlusion and transfer vectors are sums over; and
//! into the mesh, within a cone about -N, as thickness is.
//!
//! Vertices that coincide in every pose and share a normal are one. The directions depend on the rest position alone,
//! so that the noise of a morph target's difference cancels where the target changes nothing, and they turn with the
//! surface (`turning`), so that of a head that moves as one each frame has the noise of the one before.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{Mat3A, Vec3, Vec3A, vec3a};
use rayon::prelude::*;

use super::low_discrepancy::{Sobol, mix};
use super::rays::RayMesh;
use super::turning::Turning;
use super::wide_bvh::WideBvh;
use crate::scene::mesh::{PosedMesh, RestSurface};

/// How far above the surface rays start, as a share of the mesh's diagonal: well above the rounding
/// of f32 positions (6e-8), well below any crease that a vertex normal resolves.
const OFFSET: f32 = 1e-5;
/// Cosine of the angle within which normals at one position count as one surface.
const SAME_NORMAL: f32 = 0.999;

/// A mesh at rest and with each of its morph targets at weight 1, and the rays from its vertices.
pub(super) struct VertexRays {
    pub(super) rest: PosedMesh,
    pub(super) targets: Vec<PosedMesh>,
    sobol: Sobol,
    /// The vertices that rays start from: one of each set that coincides.
    distinct: Vec<u32>,
    /// For each vertex, which of `distinct` it takes its value from.
    slot: Vec<u32>,
    /// A seed for each of `distinct`.
    seeds: Vec<u32>,
    /// How the frame of each of `distinct` turns from pose to pose.
    turning: Vec<Turning>,
    offset: f32,
    way: Way,
}

/// Where rays go.
#[derive(Clone, Copy)]
enum Way {
    /// Over the hemisphere of the normal.
    Outward,
    /// Within a cone about -N, whose half angle has that sine.
    Inward(f32),
}

/// The rays of one vertex.
pub(super) struct Rays {
    pub(super) origin: Vec3A,
    /// Unit directions; none for a vertex without a normal or off the finite world.
    pub(super) directions: Vec<Vec3A>,
}

/// What a ray may find of a mesh.
pub(super) trait Found: Copy + Send + Sync {
    /// Of each of a vertex' rays.
    fn along(mesh: &WideBvh, rays: &Rays) -> Vec<Self>;
}

/// Whether it meets any triangle.
impl Found for bool {
    fn along(mesh: &WideBvh, rays: &Rays) -> Vec<Self> {
        mesh.hits(rays.origin, &rays.directions)
    }
}

impl VertexRays {
    /// `count` rays a vertex. `pose` gives the mesh with its `morphs` targets at the listed weights.
    pub(super) fn new(pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync), morphs: usize, count: u32) -> Self {
        let weights = |target: Option<usize>| -> Vec<f32> {
            (0..morphs).map(|i| f32::from(u8::from(Some(i) == target))).collect()
        };
        let rest = pose(&weights(None));
        let targets: Vec<PosedMesh> = (0..morphs).map(|i| pose(&weights(Some(i)))).collect();
        let (distinct, slot) = distinct(&rest, &targets);
        let own = || RestSurface { positions: rest.positions.clone(), normals: rest.normals.clone() };
        let known = rest.rest.as_deref().filter(|still| still.positions.len() == rest.positions.len());
        let still = known.map_or_else(|| Cow::Owned(own()), Cow::Borrowed);
        let seed = |&vertex: &u32| {
            let [x, y, z] = bits(still.positions[vertex as usize]);
            mix(x ^ mix(y ^ mix(z)))
        };
        let seeds = distinct.iter().map(seed).collect();
        let turning = Turning::of(&still, &rest.triangles, &distinct);
        let offset = offset(&rest.positions);
        let sobol = Sobol::new(count.max(1));
        drop(still);
        Self { rest, targets, sobol, distinct, slot, seeds, turning, offset, way: Way::Outward }
    }

    /// The same of rays into the mesh, within a cone about -N whose half angle has the sine `widest`.
    pub(super) fn inward(
        pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync),
        morphs: usize,
        count: u32,
        widest: f32,
    ) -> Self {
        Self { way: Way::Inward(widest), ..Self::new(pose, morphs, count) }
    }

    /// How many vertices there are that rays start from.
    pub(super) fn len(&self) -> usize {
        self.distinct.len()
    }

    /// The vertex that stands for the `i`th of them.
    pub(super) fn vertex(&self, i: usize) -> usize {
        self.distinct[i] as usize
    }

    /// Which of them a vertex is.
    pub(super) fn slot(&self, vertex: u32) -> u32 {
        self.slot[vertex as usize]
    }

    /// The rays of the `i`th in a pose.
    pub(super) fn rays(&self, i: usize, pose: &PosedMesh) -> Rays {
        let vertex = self.vertex(i);
        let normal = Vec3A::from(pose.normals[vertex]).normalize_or_zero();
        let position = Vec3A::from(pose.positions[vertex]);
        let (axis, widest) = match self.way {
            Way::Outward => (normal, 1.0),
            Way::Inward(widest) => (-normal, widest),
        };
        let origin = position + self.offset * axis;
        if normal == Vec3A::ZERO || !position.is_finite() {
            return Rays { origin, directions: Vec::new() };
        }
        let frame = self.turning[i].frame(pose, vertex, axis);
        Rays { origin, directions: self.sobol.cone(self.seeds[i], widest).map(|d| frame * d).collect() }
    }

    /// What `of` makes of each one's rays at rest, with what they found. All cores.
    pub(super) fn at_rest<F: Found, R: Send>(&self, of: impl Fn(usize, &Rays, Vec<F>) -> R + Sync) -> Vec<R> {
        let mesh = RayMesh::of(&self.rest);
        let found = |i: usize| {
            let rays = self.rays(i, &self.rest);
            let found = F::along(mesh.wide(), &rays);
            of(i, &rays, found)
        };
        (0..self.len()).into_par_iter().map(found).collect()
    }

    /// The same with a target at weight 1. A vertex that did not move keeps what it had along the rays that miss
    /// everything that moved.
    pub(super) fn morphed<F: Found, R: Send>(
        &self,
        target: &PosedMesh,
        at_rest: &[Vec<F>],
        of: impl Fn(usize, &Rays, Vec<F>) -> R + Sync,
    ) -> Vec<R> {
        let mesh = RayMesh::of(target);
        let moved = moved_triangles(&self.rest, target);
        let found = |i: usize| {
            let rays = self.rays(i, target);
            let vertex = self.vertex(i);
            let stays = |vertex: usize| self.rest.positions[vertex] == target.positions[vertex];
            let still = stays(vertex)
                && self.rest.normals[vertex] == target.normals[vertex]
                && self.turning[i].neighbour().is_none_or(stays);
            let found = match still {
                true => kept(&at_rest[i], moved.as_ref().map(RayMesh::wide), mesh.wide(), &rays),
                false => F::along(mesh.wide(), &rays),
            };
            of(i, &rays, found)
        };
        (0..self.len()).into_par_iter().map(found).collect()
    }

    /// Each vertex' `width` numbers, from those of the ones that rays start from.
    pub(super) fn spread<T: Copy>(&self, distinct: &[T], width: usize) -> Vec<T> {
        self.slot.iter().flat_map(|&slot| &distinct[slot as usize * width..][..width]).copied().collect()
    }
}

/// What rays from where nothing moved find, given what they found `before`.
fn kept<F: Found>(before: &[F], moved: Option<&WideBvh>, mesh: &WideBvh, rays: &Rays) -> Vec<F> {
    let mut found = before.to_vec();
    let Some(moved) = moved else { return found };
    let met = bool::along(moved, rays);
    let again: Vec<usize> = (0..found.len()).filter(|&k| met[k]).collect();
    let directions = again.iter().map(|&k| rays.directions[k]).collect();
    let anew = F::along(mesh, &Rays { origin: rays.origin, directions });
    again.into_iter().zip(anew).for_each(|(k, anew)| found[k] = anew);
    found
}

/// One of each set of vertices that coincide, and for each vertex which of these it is.
fn distinct(rest: &PosedMesh, targets: &[PosedMesh]) -> (Vec<u32>, Vec<u32>) {
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
    (distinct, slot)
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
