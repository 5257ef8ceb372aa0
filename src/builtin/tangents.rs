//! MikkTSpace tangents of the atlas, one a vertex: what the normal map is painted in, and what the
//! file carries.

use bevy_mikktspace::{Geometry, TangentSpace};

use super::atlas::Atlas;

/// Unit tangents with the handedness in w: bitangent = w cross(N, T), towards the image's top.
pub(super) fn tangents(atlas: &Atlas) -> Vec<[f32; 4]> {
    // A vertex that no triangle gives one keeps a frame about its normal.
    let start = atlas.normals.iter().map(|n| n.any_orthonormal_vector().as_vec3().extend(1.0).to_array());
    let mut corners = Corners { atlas, tangents: start.collect() };
    // The error has no values today; the frames above then stand.
    let _ = bevy_mikktspace::generate_tangents(&mut corners);
    corners.tangents
}

struct Corners<'a> {
    atlas: &'a Atlas,
    tangents: Vec<[f32; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.atlas.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.atlas.triangles.len()
    }
    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.atlas.positions[self.vertex(face, corner)].as_vec3().to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.atlas.normals[self.vertex(face, corner)].as_vec3().to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.atlas.uvs[self.vertex(face, corner)].as_vec2().to_array()
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let Some(space) = space else { return };
        let [x, y, z, w] = space.tangent_encoded();
        let length = (x * x + y * y + z * z).sqrt();
        if length > 0.5 {
            let vertex = self.vertex(face, corner);
            // MikkTSpace counts v upwards, glTF downwards: the bitangent turns round.
            self.tangents[vertex] = [x / length, y / length, z / length, -w];
        }
    }
}
