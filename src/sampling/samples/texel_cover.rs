//! The texels that a mesh covers of its UV atlas, as a graphics adapter would draw it.
//!
//! A texel is covered where its centre lies in a triangle, edges by the top-left rule (Direct3D and Vulkan alike), both sides,
//! without depth; where triangles overlap, the later one stays.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use super::texel_error::AtlasError;
use super::trace::Hit;
use crate::scene::mesh::tile_outside_atlas;

/// A texel that the mesh does not cover.
pub(super) const EMPTY: u32 = u32::MAX;

/// The share of covered texels that may be of two places: rounding at the borders of triangles makes a few.
const OVERLAP: f64 = 1e-3;

/// A mesh as it is laid out in an atlas of `size` texels a side.
#[derive(Clone, Copy)]
pub(super) struct Layout<'a> {
    pub(super) uvs: &'a [Vec2],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) size: u32,
}

/// A triangle in the atlas, counter-clockwise as v runs downwards: its vertices, and their places in texels.
pub(super) struct Triangle {
    index: u32,
    /// Whether its second and third vertex changed places.
    turned: bool,
    pub(super) vertices: [usize; 3],
    corners: [DVec2; 3],
}

impl<'a> Layout<'a> {
    /// Of a mesh, where light can stand in such an atlas of it.
    ///
    /// # Errors
    /// When it has no texture coordinates, or they do not lie in the unit square.
    pub(super) fn new(uvs: &'a [Vec2], triangles: &'a [[u32; 3]], size: u32) -> Result<Self, AtlasError> {
        if uvs.is_empty() {
            return Err(AtlasError::NoUvs);
        }
        // Those of parts that are not skin are no part of it.
        let corners = triangles.iter().filter(|[a, b, _]| a != b).flatten();
        let of_skin: Vec<Vec2> = corners.filter_map(|&i| uvs.get(i as usize).copied()).collect();
        match tile_outside_atlas(&of_skin) {
            Some([u, v]) => Err(AtlasError::Outside { u, v }),
            None => Ok(Self { uvs, triangles, size }),
        }
    }

    /// For each texel the triangle that it shows, or [`EMPTY`].
    ///
    /// # Errors
    /// When too many texels are of two places.
    pub(super) fn shown(&self) -> Result<Vec<u32>, AtlasError> {
        let (shown, share) = self.cover();
        if share > OVERLAP { Err(AtlasError::Overlap { share }) } else { Ok(shown) }
    }

    /// For each texel the triangle that it shows, and the share of those that are of several.
    pub(super) fn cover(&self) -> (Vec<u32>, f64) {
        let size = self.size;
        let texels = size as usize * size as usize;
        // The last triangle stays whatever thread comes last; 0 is none.
        let shown: Vec<AtomicU32> = (0..texels).map(|_| AtomicU32::new(0)).collect();
        let again = AtomicUsize::new(0);
        (0..self.triangles.len() as u32).into_par_iter().for_each(|index| {
            let triangle = self.triangle(index);
            let [a, b, c] = triangle.corners;
            if (b - a).perp_dot(c - a) == 0.0 {
                return;
            }
            let most = f64::from(size);
            let low = (a.min(b).min(c) - 0.5).ceil().clamp(DVec2::ZERO, DVec2::splat(most));
            let high = (a.max(b).max(c) + 0.5).floor().clamp(DVec2::ZERO, DVec2::splat(most));
            for row in low.y as u32..high.y as u32 {
                for column in low.x as u32..high.x as u32 {
                    let texel = row * size + column;
                    if triangle.covers(centre(texel, size)) {
                        let before = shown[texel as usize].fetch_max(index + 1, Ordering::Relaxed);
                        again.fetch_add(usize::from(before > 0), Ordering::Relaxed);
                    }
                }
            }
        });
        let shown: Vec<u32> =
            shown.into_iter().map(|shown| shown.into_inner().checked_sub(1).unwrap_or(EMPTY)).collect();
        let once = shown.iter().filter(|&&shown| shown != EMPTY).count();
        let share = again.into_inner().min(once) as f64 / once.max(1) as f64;
        (shown, share)
    }

    pub(super) fn triangle(&self, index: u32) -> Triangle {
        let mut vertices = self.triangles[index as usize].map(|i| i as usize);
        let corner = |i: usize| f64::from(self.size) * self.uvs[i].as_dvec2();
        let [a, b, c] = vertices.map(corner);
        let turned = (b - a).perp_dot(c - a) < 0.0;
        if turned {
            vertices.swap(1, 2);
        }
        Triangle { index, turned, corners: vertices.map(corner), vertices }
    }
}

impl Triangle {
    /// Twice the area of the triangle between each edge and a place; the edge lies opposite to the vertex.
    fn areas(&self, at: DVec2) -> [f64; 3] {
        let [a, b, c] = self.corners;
        [[b, c], [c, a], [a, b]].map(|[from, to]| (to - from).perp_dot(at - from))
    }

    /// Whether a place is drawn: inside, or on an edge that is the triangle's top or on its left.
    fn covers(&self, at: DVec2) -> bool {
        let [a, b, c] = self.corners;
        let edges = [c - b, a - c, b - a];
        // The inside lies to the right of an edge that goes up, below one that goes right.
        let drawn = |edge: DVec2| edge.y < 0.0 || (edge.y == 0.0 && edge.x > 0.0);
        let areas = self.areas(at);
        edges.into_iter().zip(areas).all(|(edge, area)| area > 0.0 || (area == 0.0 && drawn(edge)))
    }

    /// The point of the mesh where its vertices count so much.
    pub(super) fn hit(&self, [_, mut u, mut v]: [f64; 3]) -> Hit {
        if self.turned {
            std::mem::swap(&mut u, &mut v);
        }
        Hit { triangle: self.index, barycentric: [u as f32, v as f32] }
    }

    /// What each vertex counts at a place.
    pub(super) fn weights(&self, at: DVec2) -> [f64; 3] {
        let areas = self.areas(at);
        let sum: f64 = areas.iter().sum();
        areas.map(|area| area / sum)
    }

    /// How the weights change from a texel to its right neighbour, and to the one below.
    pub(super) fn steps(&self) -> [[f64; 3]; 2] {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a);
        let edges = [c - b, a - c, b - a];
        [edges.map(|edge| -edge.y / area), edges.map(|edge| edge.x / area)]
    }
}

/// Where a texel is sampled, in texels.
pub(super) fn centre(texel: u32, size: u32) -> DVec2 {
    DVec2::new(f64::from(texel % size), f64::from(texel / size)) + 0.5
}

/// Which texels are not empty, and each texel's place among them.
pub(super) fn covered(shown: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let texels: Vec<u32> = (0..shown.len() as u32).filter(|&texel| shown[texel as usize] != EMPTY).collect();
    let mut places = vec![EMPTY; shown.len()];
    texels.iter().enumerate().for_each(|(place, &texel)| places[texel as usize] = place as u32);
    (texels, places)
}

/// Whether light can stand in an atlas of `size` texels a side, laid out by these texture coordinates.
///
/// # Errors
/// When there are none, they do not lie in the unit square, or too many texels are of two places.
pub fn overlap(uvs: &[Vec2], triangles: &[[u32; 3]], size: u32) -> Result<(), AtlasError> {
    Layout::new(uvs, triangles, size)?.shown().map(|_| ())
}

/// A texel that the mesh covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listed {
    /// Column and row.
    pub texel: [u32; 2],
    /// The triangle, and how much its second and third corner count at the texel's centre.
    pub triangle: u32,
    /// See there.
    pub shares: [f32; 2],
}

/// Every texel of an atlas that a mesh covers, row by row. All cores.
///
/// # Errors
/// As of [`overlap`].
pub fn listed(uvs: &[Vec2], triangles: &[[u32; 3]], size: u32) -> Result<Vec<Listed>, AtlasError> {
    let layout = Layout::new(uvs, triangles, size)?;
    let shown = layout.shown()?;
    let (texels, _) = covered(&shown);
    let listed = |texel: u32| {
        let triangle = layout.triangle(shown[texel as usize]);
        let Hit { triangle, barycentric } = triangle.hit(triangle.weights(centre(texel, size)));
        Listed { texel: [texel % size, texel / size], triangle, shares: barycentric }
    };
    Ok(texels.into_par_iter().map(listed).collect())
}
