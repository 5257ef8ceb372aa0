//! The mesh as the vertex stage reads it: attributes at rest, morph deltas, bones.

use std::collections::HashMap;

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::bake::VertexOcclusion;
use crate::model::fields::Field;
use crate::model::vertex::Bone;
use crate::scene::charts::charts;
use crate::scene::mesh::{Mesh, Morph, VertexField};
use crate::shader::Attribute;
use crate::triangles::Triangles;

/// One attribute of every vertex, as bytes; what the mesh lacks is zero, which the vertex stage takes for
/// "no direction", and occlusion 1; `fields` holds what is found of what a file of rules declares.
pub(super) fn attribute(
    attribute: Attribute,
    mesh: &Mesh,
    occlusion: Option<&VertexOcclusion>,
    fields: &HashMap<Field, Vec<f32>>,
) -> Vec<u8> {
    let count = mesh.positions.len();
    let floats = |floats: Vec<f32>| bytemuck::cast_slice(&floats).to_vec();
    let mut bytes = match attribute {
        Attribute::Position => floats(mesh.positions.iter().flat_map(Vec3::to_array).collect()),
        Attribute::Normal => floats(mesh.normals.iter().flat_map(Vec3::to_array).collect()),
        Attribute::Tangent => floats(mesh.tangents.iter().flat_map(Vec4::to_array).collect()),
        Attribute::Uv => floats(mesh.uvs.iter().flat_map(Vec2::to_array).collect()),
        Attribute::AtlasUv => floats(mesh.atlas_uvs().iter().flat_map(Vec2::to_array).collect()),
        Attribute::Occlusion => floats(occlusion.map_or_else(|| vec![1.0; count], |o| o.base.clone())),
        Attribute::Joints => {
            let joints: Vec<u32> = (0..count).flat_map(|i| influences(mesh, i).0).collect();
            bytemuck::cast_slice(&joints).to_vec()
        }
        Attribute::Weights => floats((0..count).flat_map(|i| influences(mesh, i).1).collect()),
        Attribute::Field(of) => floats(fields.get(&of).cloned().unwrap_or_default()),
        Attribute::Chart => {
            let charts = charts(&mesh.positions, mesh.atlas_uvs(), Triangles::of(mesh).of_skin());
            floats(charts.into_iter().map(|chart| chart as f32).collect())
        }
        Attribute::Corner => floats(corner_marks(count).into_flattened()),
    };
    bytes.resize(count * attribute.bytes() as usize, 0);
    bytes
}

/// Which corner of its triangle each vertex is, where triangles share none.
fn corner_marks(count: usize) -> Vec<[f32; 3]> {
    (0..count).map(|i| Vec3::AXES[i % 3].to_array()).collect()
}

/// A mesh of `triangles` of another that share no vertices, with its occlusion: vertex i is corner i % 3 of triangle i / 3.
pub(super) fn by_corner(
    mesh: &Mesh,
    triangles: &[[u32; 3]],
    occlusion: Option<&VertexOcclusion>,
) -> (Mesh, Option<VertexOcclusion>) {
    fn each<T: Copy>(of: &[T], triangles: &[[u32; 3]]) -> Vec<T> {
        // What a mesh lacks, its corners lack.
        triangles.as_flattened().iter().filter_map(|&i| of.get(i as usize).copied()).collect()
    }
    let corners = |i: usize| [0, 1, 2].map(|corner| (3 * i + corner) as u32);
    let morph = |morph: &Morph| Morph {
        positions: each(&morph.positions, triangles),
        normals: each(&morph.normals, triangles),
        ..morph.clone()
    };
    let by_corner = |of: &VertexField| {
        let numbers = triangles.as_flattened().iter().flat_map(|&i| of.of(i as usize)).copied().collect();
        VertexField { field: of.field, numbers }
    };
    let split = Mesh {
        positions: each(&mesh.positions, triangles),
        normals: each(&mesh.normals, triangles),
        tangents: each(&mesh.tangents, triangles),
        uvs: each(&mesh.uvs, triangles),
        own_atlas_uvs: each(&mesh.own_atlas_uvs, triangles),
        triangles: (0..triangles.len()).map(corners).collect(),
        morphs: mesh.morphs.iter().map(morph).collect(),
        joints: each(&mesh.joints, triangles),
        weights: each(&mesh.weights, triangles),
        bones: mesh.bones.clone(),
        fields: mesh.fields.iter().map(by_corner).collect(),
        plain: mesh.plain.clone(),
    };
    let occlusion = occlusion.map(|occlusion| VertexOcclusion {
        base: each(&occlusion.base, triangles),
        morphs: occlusion.morphs.iter().map(|open| each(open, triangles)).collect(),
    });
    (split, occlusion)
}

/// The bones of a vertex and their weights. One that no bone moves is in the world already: it hangs on
/// the bone behind the last, which moves nothing.
fn influences(mesh: &Mesh, vertex: usize) -> ([u32; 4], [f32; 4]) {
    let weights = mesh.weights.get(vertex).copied().unwrap_or_default();
    match mesh.joints.get(vertex) {
        Some(joints) if weights.iter().any(|&weight| weight != 0.0) => (joints.map(u32::from), weights),
        _ => ([mesh.bones.len() as u32; 4], [1.0, 0.0, 0.0, 0.0]),
    }
}

/// For each bone three rows of its affine map and three of what it does to normals; then those of the bone
/// that moves nothing.
pub(super) fn bones(bones: &[Mat4]) -> Vec<[f32; 4]> {
    let rows = |bone: &Mat4| {
        let rows = bone.as_dmat4().transpose().to_cols_array_2d();
        let (affine, normal) = Bone::new([rows[0], rows[1], rows[2]]).rows();
        let normal = normal.map(|[x, y, z]| [x, y, z, 0.0]);
        affine.into_iter().chain(normal).map(|row| row.map(|x| x as f32)).collect::<Vec<_>>()
    };
    bones.iter().chain([&Mat4::IDENTITY]).flat_map(rows).collect()
}

/// For each of the targets (indices into the mesh's) and each vertex: the position delta with the
/// occlusion delta in w, then the normal delta.
pub(super) fn morph_deltas(
    mesh: &Mesh,
    targets: &[usize],
    occlusion: Option<&VertexOcclusion>,
) -> Vec<[f32; 4]> {
    let mut deltas = Vec::with_capacity(2 * targets.len() * mesh.positions.len());
    for &target in targets {
        let morph = &mesh.morphs[target];
        let open = occlusion.and_then(|occlusion| occlusion.morphs.get(target));
        for i in 0..mesh.positions.len() {
            let open = open.and_then(|open| open.get(i)).copied().unwrap_or_default();
            let position = morph.positions.get(i).copied().unwrap_or_default();
            let normal = morph.normals.get(i).copied().unwrap_or_default();
            deltas.extend([position.extend(open).to_array(), normal.extend(0.0).to_array()]);
        }
    }
    deltas
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_have_what_their_vertices_have() {
        let at = |x: f32| Vec3::new(x, 0.0, 0.0);
        let mesh = Mesh {
            positions: vec![at(0.0), at(1.0), at(2.0), at(3.0)],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
            morphs: vec![Morph { weight: 0.5, positions: vec![at(9.0); 4], ..Morph::default() }],
            ..Mesh::default()
        };
        let occlusion = VertexOcclusion { base: vec![0.1, 0.2, 0.3, 0.4], morphs: vec![Vec::new()] };
        let (split, open) = by_corner(&mesh, &mesh.triangles, Some(&occlusion));
        assert_eq!(split.positions, [0.0, 1.0, 2.0, 2.0, 1.0, 3.0].map(at));
        assert_eq!(split.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!((split.morphs[0].positions.len(), split.morphs[0].weight), (6, 0.5));
        assert!(split.normals.is_empty() && split.morphs[0].normals.is_empty());
        let open = open.unwrap();
        assert_eq!(open.base, [0.1, 0.2, 0.3, 0.3, 0.2, 0.4]);
        assert_eq!(open.morphs, [[0.0_f32; 0]]);
        assert_eq!(corner_marks(6)[3..], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}
