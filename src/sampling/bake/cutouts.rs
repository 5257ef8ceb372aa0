//! Triangles that are cut out by their material's alpha (lashes, hair cards, nets): where rays meet them and where they go
//! through.
//!
//! With a mask there is something where alpha reaches the cutoff (glTF 2.0, section 3.9.4). What blends is there to a ray
//! where alpha lies above a threshold that is hashed of the place (Wyman and McGuire 2017, *Hashed Alpha Testing*): of many
//! rays the share stops that alpha is, and through several layers what all of them let through. A place has its
//! threshold in every pose, so that the noise moves with the mesh.

use std::sync::Arc;

use glam::Vec2;

use super::cache::Key;
use super::low_discrepancy::mix;
use super::packet::LANES;
use crate::scene::mesh::PosedMesh;
use crate::scene::plain::{Alpha, PlainParts};

/// Cells along a triangle's side, each with one threshold: finer than rays lie.
const CELLS: f32 = 4096.0;

/// The triangles of a mesh that have holes or blend.
pub(super) struct Cutouts {
    plain: Arc<PlainParts>,
    /// Their places in the mesh, in order, and the texture coordinates of their corners.
    triangles: Vec<(u32, [Vec2; 3])>,
}

impl Cutouts {
    /// Those of a mesh; `None` where nothing of it has holes or blends.
    pub(super) fn of(mesh: &PosedMesh) -> Option<Self> {
        let plain = mesh.plain.clone()?;
        let uv = |i: u32| mesh.uvs.get(i as usize).copied().unwrap_or_default();
        let open = (0..).zip(&mesh.triangles).filter(|&(triangle, _)| plain.is_open(triangle));
        let triangles: Vec<_> = open.map(|(triangle, corners)| (triangle, corners.map(uv))).collect();
        (!triangles.is_empty()).then_some(Self { plain, triangles })
    }

    /// Whether a triangle of the mesh is one of them.
    pub(super) fn has(&self, triangle: u32) -> bool {
        self.corners(triangle).is_some()
    }

    fn corners(&self, triangle: u32) -> Option<&[Vec2; 3]> {
        let at = self.triangles.binary_search_by_key(&triangle, |&(triangle, _)| triangle).ok()?;
        Some(&self.triangles[at].1)
    }

    /// Which of the rays `met`, a bit each, find something where they meet a triangle: at those weights of its second and
    /// third corner.
    pub(super) fn stopped(&self, triangle: u32, met: u64, shares: [[f32; LANES]; 2]) -> u64 {
        let (Some(uvs), Some(material)) = (self.corners(triangle), self.plain.material(triangle)) else {
            return met;
        };
        let stops = |lane: &usize| {
            let [v, w] = shares.map(|share| share[*lane]);
            let weights = [1.0 - v - w, v, w];
            let uv = (0..3).map(|i| weights[i] * uvs[i]).sum();
            material.seen(uv, self.plain.tint(triangle, weights)) > threshold(triangle, [v, w])
        };
        let lanes = (0..LANES).filter(|lane| met >> lane & 1 == 1);
        lanes.filter(stops).fold(0, |bits, lane| bits | 1 << lane)
    }

    /// A key with all that decides where rays go through.
    pub(super) fn key(&self, key: Key) -> Key {
        let (places, uvs): (Vec<u32>, Vec<[Vec2; 3]>) = self.triangles.iter().copied().unzip();
        let of = |&triangle: &u32| self.plain.of_triangle[triangle as usize].unwrap_or(u16::MAX);
        let materials: Vec<u16> = places.iter().map(of).collect();
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let tint = |&triangle: &u32| corners.map(|weights| self.plain.tint(triangle, weights)[3]);
        let tints: Vec<f32> = places.iter().flat_map(tint).collect();
        let mut key = key.with(&places).with(uvs.as_flattened()).with(&materials).with(&tints);
        for (place, material) in (0_u64..).zip(&self.plain.materials).filter(|(_, of)| of.is_open()) {
            let (blends, cutoff) = match material.alpha {
                Alpha::Mask(cutoff) => (0, cutoff),
                Alpha::Opaque | Alpha::Blend => (1, 0.0),
            };
            key = key.with(&[place, blends]).with(&[cutoff, material.base_color[3]]);
            if let Some(picture) = &material.color_map {
                let map = &picture.map;
                let alpha: Vec<f32> = map.texels.iter().map(|texel| texel[3]).collect();
                let [u, v] = picture.wrap.map(|wrap| wrap as u64);
                let nearest = u64::from(picture.nearest);
                key = key.with(&[map.width as u64, map.height as u64, u, v, nearest]).with(&alpha);
            }
        }
        key
    }
}

/// A number in [0, 1) of a place of a triangle, even over its cells.
fn threshold(triangle: u32, shares: [f32; 2]) -> f32 {
    let [i, j] = shares.map(|share| (share * CELLS) as u32);
    (mix(triangle ^ mix(i ^ mix(j))) >> 8) as f32 / 16_777_216.0
}
