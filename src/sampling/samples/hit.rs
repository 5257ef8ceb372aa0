//! Points of the mesh that rays find.

use std::iter::Sum;
use std::ops::Mul;

use glam::{Vec2, Vec3};

use crate::scene::mesh::PosedMesh;

/// A point of the mesh: a triangle, and the weights of its second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle.
    pub triangle: u32,
    /// The weights of its second and third vertex.
    pub barycentric: [f32; 2],
}

impl Hit {
    /// The weights of the three vertices.
    #[must_use]
    pub fn weights(&self) -> [f32; 3] {
        let [u, v] = self.barycentric;
        [1.0 - u - v, u, v]
    }

    /// The texture coordinates there; 0 where the mesh has none.
    #[must_use]
    pub fn uv(&self, mesh: &PosedMesh) -> Vec2 {
        self.mean(mesh, &mesh.uvs)
    }

    /// Those by which the mesh lies in the UV atlas.
    pub(super) fn atlas_uv(&self, mesh: &PosedMesh) -> Vec2 {
        self.mean(mesh, mesh.atlas_uvs())
    }

    /// Where the mesh is there.
    pub(super) fn place(&self, mesh: &PosedMesh) -> Vec3 {
        self.mean(mesh, &mesh.positions)
    }

    /// What the corners have, by their weights; nothing where the mesh has none of it.
    fn mean<T: Copy + Default + Sum>(&self, mesh: &PosedMesh, of: &[T]) -> T
    where
        f32: Mul<T, Output = T>,
    {
        if of.is_empty() {
            return T::default();
        }
        let corners = mesh.triangles[self.triangle as usize];
        self.weights().into_iter().zip(corners).map(|(weight, i)| weight * of[i as usize]).sum()
    }
}
