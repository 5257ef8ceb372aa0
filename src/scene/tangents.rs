//! Tangents that a file leaves out, by MikkTSpace.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace};
use glam::{Vec3, Vec4};

use super::mesh::Mesh;
use crate::model::vertex::perpendicular;

/// Some unit tangent for every vertex, where only the normal matters.
pub(super) fn any_frame(mesh: &mut Mesh) {
    mesh.tangents = mesh.normals.iter().map(|&n| frame(n)).collect();
}

fn frame(normal: Vec3) -> Vec4 {
    Vec3::from(perpendicular(normal.to_array())).extend(1.0)
}

/// MikkTSpace tangents for the vertices that have none (zero), from the triangles that touch them.
///
/// Where a vertex has different tangents in different triangles (at a seam where the texture is
/// mirrored) it is split; the copies go to the end.
pub(super) fn complete(mesh: &mut Mesh) {
    let missing: Vec<bool> = mesh.tangents.iter().map(|t| t.truncate() == Vec3::ZERO).collect();
    let lacks = |t: &[u32; 3]| t.iter().any(|&v| missing[v as usize]);
    let faces: Vec<usize> = (0..mesh.triangles.len()).filter(|&i| lacks(&mesh.triangles[i])).collect();
    if faces.is_empty() {
        return;
    }
    let mut corners = Corners { mesh, faces: &faces, tangents: vec![Vec4::ZERO; 3 * faces.len()] };
    if bevy_mikktspace::generate_tangents(&mut corners).is_err() {
        // The error has no values today; every vertex then gets some frame below.
        corners.tangents.clear();
    }
    let tangents = corners.tangents;
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    for (&tangent, i) in tangents.iter().zip(0..) {
        let (face, corner) = (faces[i / 3], i % 3);
        let vertex = mesh.triangles[face][corner];
        if !missing[vertex as usize] {
            continue;
        }
        let place = &mut mesh.tangents[vertex as usize];
        if place.truncate() == Vec3::ZERO {
            *place = tangent;
        } else if *place != tangent {
            let key = (vertex, tangent.to_array().map(f32::to_bits));
            mesh.triangles[face][corner] = *copies.entry(key).or_insert_with(|| mesh.copy(vertex, tangent));
        }
    }
    for (tangent, &normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        if tangent.truncate() == Vec3::ZERO || !tangent.is_finite() {
            *tangent = frame(normal);
        }
    }
}

impl Mesh {
    /// Add a copy of a vertex with another tangent; its index.
    fn copy(&mut self, vertex: u32, tangent: Vec4) -> u32 {
        fn again<T: Copy>(list: &mut Vec<T>, i: usize) {
            if let Some(&value) = list.get(i) {
                list.push(value);
            }
        }
        let i = vertex as usize;
        let copy = self.positions.len() as u32;
        again(&mut self.positions, i);
        again(&mut self.normals, i);
        again(&mut self.uvs, i);
        again(&mut self.own_atlas_uvs, i);
        for field in &mut self.fields {
            let again = field.of(i).to_vec();
            field.numbers.extend(again);
        }
        again(&mut self.joints, i);
        again(&mut self.weights, i);
        for morph in &mut self.morphs {
            again(&mut morph.positions, i);
            again(&mut morph.normals, i);
        }
        self.tangents.push(tangent);
        copy
    }
}

/// Some triangles of a mesh, as MikkTSpace asks for them.
struct Corners<'a> {
    mesh: &'a Mesh,
    faces: &'a [usize],
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[self.faces[face]][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }
    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.mesh.uvs[self.vertex(face, corner)].to_array()
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let [x, y, z, w] = space.unwrap_or_default().tangent_encoded();
        // MikkTSpace counts v upwards, glTF downwards: the bitangent turns round.
        self.tangents[3 * face + corner] = Vec4::new(x, y, z, -w);
    }
}
