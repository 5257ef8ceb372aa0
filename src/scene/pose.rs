//! The mesh through the vertex stage's geometry: morphed and skinned, in the world.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::mesh::{Mesh, PosedMesh};
use crate::model::vertex::{Bone, Delta, Surface, Vertex, deform};

/// Vertices are posed in blocks, so that the threads' overhead does not show.
const BLOCK: usize = 1024;

impl Mesh {
    /// The mesh as it stands in the scene: morph targets at their weights, bones at the scene's time.
    #[must_use]
    pub fn pose(&self) -> PosedMesh {
        let weights: Vec<f32> = self.morphs.iter().map(|morph| morph.weight).collect();
        self.pose_with_weights(&weights)
    }

    /// The mesh with other morph weights, in the order of `morphs`; targets beyond the end of
    /// `weights` are at 0. Bones stay. Evaluated in f64; the same for any number of threads.
    #[must_use]
    pub fn pose_with_weights(&self, weights: &[f32]) -> PosedMesh {
        let active: Vec<(usize, f64)> = weights
            .iter()
            .enumerate()
            .take(self.morphs.len())
            .filter(|&(_, &weight)| weight != 0.0)
            .map(|(i, &weight)| (i, f64::from(weight)))
            .collect();
        let bones: Vec<Bone<f64>> = self
            .bones
            .iter()
            .map(|bone| {
                let rows = bone.as_dmat4().transpose().to_cols_array_2d();
                Bone::new([rows[0], rows[1], rows[2]])
            })
            .collect();
        let count = self.positions.len();
        let surfaces =
            (0..count).into_par_iter().with_min_len(BLOCK).map(|i| self.vertex(i, &active, &bones));
        let (uvs, own_atlas_uvs) = (self.uvs.clone(), self.own_atlas_uvs.clone());
        let (triangles, fields, plain) = (self.triangles.clone(), self.fields.clone(), self.plain.clone());
        let mut posed = PosedMesh { uvs, own_atlas_uvs, triangles, fields, plain, ..PosedMesh::default() };
        let single = |v: [f64; 3]| DVec3::from(v).as_vec3();
        let (places, frames): (Vec<Vec3>, Vec<(Vec3, Vec3)>) =
            surfaces.map(|s| (single(s.position), (single(s.normal), single(s.tangent)))).unzip();
        posed.positions = places;
        posed.normals = frames.iter().map(|&(normal, _)| normal).collect();
        posed.tangents = frames.iter().zip(&self.tangents).map(|(&(_, t), rest)| t.extend(rest.w)).collect();
        posed
    }

    fn vertex(&self, i: usize, active: &[(usize, f64)], bones: &[Bone<f64>]) -> Surface<f64> {
        let wide = |v: Vec3| v.to_array().map(f64::from);
        let tangent = self.tangents.get(i).copied().unwrap_or_default();
        let vertex = Vertex {
            position: wide(self.positions[i]),
            normal: wide(self.normals[i]),
            tangent: wide(tangent.truncate()),
            handedness: f64::from(tangent.w),
            occlusion: 1.0,
        };
        let deltas = active.iter().map(|&(target, weight)| {
            let morph = &self.morphs[target];
            Delta {
                weight,
                position: wide(morph.positions[i]),
                normal: wide(morph.normals.get(i).copied().unwrap_or_default()),
                occlusion: 0.0,
            }
        });
        let influences =
            self.joints.get(i).zip(self.weights.get(i)).into_iter().flat_map(|(joints, weights)| {
                joints.iter().zip(weights).filter(|(_, weight)| **weight != 0.0)
            });
        deform(
            &vertex,
            deltas,
            influences.map(|(&joint, &weight)| (f64::from(weight), &bones[usize::from(joint)])),
        )
    }
}
