//! Frames that turn with the surface: about a vertex' normal by an edge that starts there.
//!
//! A frame that is made of the normal alone turns about it as the normal moves, and with it the directions of all rays,
//! so that what they miss is another in each pose.

use glam::{Mat3A, Vec3A};

use super::vertex_rays::frame;
use crate::scene::mesh::{PosedMesh, RestSurface};

/// Cosine of the angle within which a normal counts as the one at rest: some ten roundings of f32.
const SAME_NORMAL: f32 = 1.0 - 1e-6;
/// The least sine between an edge and the normal: below it a tangent would be roundings.
const LEAST_SINE: f32 = 1e-2;

/// How the frame of one vertex turns.
pub(super) enum Turning {
    /// With this edge.
    Edge(Edge),
    /// With the normal alone: no edge there has a direction across it.
    Normal,
}

/// An edge at rest.
pub(super) struct Edge {
    /// Where it ends.
    end: usize,
    /// Both ends at rest.
    ends: [Vec3A; 2],
    normal: Vec3A,
    /// What takes a direction at rest to its numbers along the edge, across it and along the normal.
    inverse: Mat3A,
}

impl Turning {
    /// Of each of these vertices.
    pub(super) fn of(rest: &RestSurface, triangles: &[[u32; 3]], vertices: &[u32]) -> Vec<Self> {
        // Edges of the first triangle that has one at a vertex; any will do that is the same in each pose.
        let mut found: Vec<Option<Edge>> = (0..rest.positions.len()).map(|_| None).collect();
        for triangle in triangles {
            for corner in 0..3 {
                let [vertex, next, last] = [0, 1, 2].map(|i| triangle[(corner + i) % 3] as usize);
                if found[vertex].is_none() {
                    found[vertex] =
                        Edge::at_rest(rest, vertex, next).or_else(|| Edge::at_rest(rest, vertex, last));
                }
            }
        }
        let of = |&vertex: &u32| found[vertex as usize].take().map_or(Self::Normal, Self::Edge);
        vertices.iter().map(of).collect()
    }

    /// Where its edge ends.
    pub(super) fn neighbour(&self) -> Option<usize> {
        match self {
            Self::Edge(edge) => Some(edge.end),
            Self::Normal => None,
        }
    }

    /// The frame with Z along `axis` (the unit normal of the vertex in this pose, or its opposite).
    pub(super) fn frame(&self, pose: &PosedMesh, vertex: usize, axis: Vec3A) -> Mat3A {
        let Self::Edge(edge) = self else { return frame(axis) };
        let normal = Vec3A::from(pose.normals[vertex]).normalize_or_zero();
        // To the bit as without an edge: a mesh that nothing moves is as it always was.
        let ends = [vertex, edge.end].map(|end| Vec3A::from(pose.positions[end]));
        if ends == edge.ends && normal.dot(edge.normal) > SAME_NORMAL {
            return frame(axis);
        }
        let Some(now) = about(normal, ends) else { return frame(axis) };
        let at_rest = frame(if axis.dot(normal) < 0.0 { -edge.normal } else { edge.normal });
        now * edge.inverse * at_rest
    }
}

impl Edge {
    fn at_rest(rest: &RestSurface, vertex: usize, end: usize) -> Option<Self> {
        let normal = Vec3A::from(rest.normals[vertex]).normalize_or_zero();
        let ends = [vertex, end].map(|end| Vec3A::from(rest.positions[end]));
        let inverse = about(normal, ends)?.transpose();
        Some(Self { end, ends, normal, inverse })
    }
}

/// The frame with Z along the unit `normal` and X along the edge, as far as it lies across the normal.
fn about(normal: Vec3A, [from, to]: [Vec3A; 2]) -> Option<Mat3A> {
    let edge = (to - from).try_normalize()?;
    let across = edge - normal * edge.dot(normal);
    let tangent = (across.length() > LEAST_SINE).then(|| across.normalize())?;
    (normal != Vec3A::ZERO).then(|| Mat3A::from_cols(tangent, normal.cross(tangent), normal))
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3, vec3};

    use super::*;

    fn mesh() -> PosedMesh {
        PosedMesh {
            positions: vec![Vec3::ZERO, vec3(1.0, 0.2, 0.0), vec3(0.1, 1.0, 0.3)],
            normals: vec![vec3(0.1, 0.2, 0.97).normalize(); 3],
            triangles: vec![[0, 1, 2]],
            ..PosedMesh::default()
        }
    }

    fn rest(mesh: &PosedMesh) -> RestSurface {
        RestSurface { positions: mesh.positions.clone(), normals: mesh.normals.clone() }
    }

    fn turned(mesh: &PosedMesh, by: Quat) -> PosedMesh {
        let all = |vectors: &[Vec3]| vectors.iter().map(|&v| by * v).collect();
        PosedMesh { positions: all(&mesh.positions), normals: all(&mesh.normals), ..mesh.clone() }
    }

    #[test]
    fn frames_turn_as_the_mesh_does() {
        let mesh = mesh();
        let turning = Turning::of(&rest(&mesh), &mesh.triangles, &[0, 1, 2]);
        // About the normal, too, which the normal does not tell; and over, where its own frame jumps.
        for by in [
            Quat::from_axis_angle(mesh.normals[0], 1.0),
            Quat::from_rotation_x(3.0),
            Quat::from_rotation_y(0.3),
        ] {
            let moved = turned(&mesh, by);
            for (vertex, turning) in turning.iter().enumerate() {
                for sign in [1.0, -1.0] {
                    let before = turning.frame(&mesh, vertex, sign * Vec3A::from(mesh.normals[vertex]));
                    let after = turning.frame(&moved, vertex, sign * Vec3A::from(moved.normals[vertex]));
                    let wanted = Mat3A::from_quat(by) * before;
                    // Roundings of f32.
                    assert!(after.abs_diff_eq(wanted, 1e-5), "{after} {wanted}");
                }
            }
        }
    }

    #[test]
    fn what_does_not_move_and_what_has_no_edge_has_the_frame_of_its_normal() {
        let mesh = mesh();
        let turning = Turning::of(&rest(&mesh), &mesh.triangles, &[1]);
        let normal = Vec3A::from(mesh.normals[1]).normalize();
        assert_eq!(turning[0].frame(&mesh, 1, normal), frame(normal));
        assert_eq!(turning[0].neighbour(), Some(2));
        let flat = PosedMesh { positions: vec![Vec3::ZERO; 3], ..mesh };
        let turning = Turning::of(&rest(&flat), &flat.triangles, &[1]);
        assert!(turning[0].neighbour().is_none() && turning[0].frame(&flat, 1, normal) == frame(normal));
    }
}
