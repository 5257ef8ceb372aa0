//! The order in which a mesh's triangles stand on the device: skin first, then what is drawn plainly, material by
//! material, of which what stops all light comes before what has holes or blends.

use std::ops::Range;

use crate::scene::mesh::Mesh;
use crate::scene::plain::PlainMaterial;

/// A mesh's triangles in the order of the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Triangles {
    /// Their places in the mesh.
    pub(super) order: Vec<u32>,
    /// Their vertices.
    pub(super) corners: Vec<[u32; 3]>,
    /// How many of them are skin.
    pub(super) skin: u32,
    /// How many, from the first on, stop all light.
    pub(super) blocking: u32,
    /// The others than skin: the place of a material, and its triangles.
    pub(super) plain: Vec<(u16, Range<u32>)>,
}

impl Triangles {
    /// Of a mesh; as they are where all of it is skin.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let count = mesh.triangles.len() as u32;
        let Some(parts) = &mesh.plain else {
            return Self {
                order: (0..count).collect(),
                corners: mesh.triangles.clone(),
                skin: count,
                blocking: count,
                plain: Vec::new(),
            };
        };
        let open =
            |material: u16| parts.materials.get(usize::from(material)).is_some_and(PlainMaterial::is_open);
        let material = |triangle: u32| parts.of_triangle[triangle as usize];
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_by_key(|&triangle| material(triangle).map(|of| (open(of), of)));
        let skin = order.partition_point(|&triangle| material(triangle).is_none());
        let blocking = order.partition_point(|&triangle| !material(triangle).is_some_and(open));
        let mut plain: Vec<(u16, Range<u32>)> = Vec::new();
        for (place, of) in (0_u32..).zip(&order).filter_map(|(place, &i)| Some((place, material(i)?))) {
            match plain.last_mut().filter(|(last, _)| *last == of) {
                Some((_, range)) => range.end = place + 1,
                None => plain.push((of, place..place + 1)),
            }
        }
        let corners = order.iter().map(|&triangle| mesh.triangles[triangle as usize]).collect();
        Self { order, corners, skin: skin as u32, blocking: blocking as u32, plain }
    }

    /// Corners of the others than skin, the first of these being 0: the place of a material, and its corners.
    pub(super) fn runs(&self) -> impl Iterator<Item = (u16, Range<u32>)> {
        let corner = |triangle: u32| 3 * (triangle - self.skin);
        self.plain.iter().map(move |(material, run)| (*material, corner(run.start)..corner(run.end)))
    }

    /// Those that are skin.
    pub(super) fn of_skin(&self) -> &[[u32; 3]] {
        &self.corners[..self.skin as usize]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::plain::{Alpha, PlainParts};

    #[test]
    fn skin_comes_first_and_what_light_passes_last() {
        let material = |alpha| PlainMaterial {
            name: String::new(),
            base_color: [1.0; 4],
            color_map: None,
            metallic: 0.0,
            roughness: 1.0,
            roughness_map: None,
            alpha,
            emission: [0.0; 3],
            emission_map: None,
        };
        let of_triangle = vec![Some(0), None, Some(1), Some(2), None, Some(0), Some(1)];
        let triangles: Vec<[u32; 3]> = (0..7).map(|i| [i; 3]).collect();
        let materials = vec![material(Alpha::Blend), material(Alpha::Opaque), material(Alpha::Mask(0.5))];
        let parts = PlainParts { of_triangle, materials, corner_colors: Vec::new() };
        let mesh = Mesh { triangles: triangles.clone(), plain: Some(Arc::new(parts)), ..Mesh::default() };
        let ordered = Triangles::of(&mesh);
        assert_eq!(ordered.order, [1, 4, 2, 6, 0, 5, 3]);
        assert_eq!(ordered.corners, [1, 4, 2, 6, 0, 5, 3].map(|i| [i; 3]));
        assert_eq!((ordered.skin, ordered.blocking), (2, 4));
        assert_eq!(ordered.plain, [(1, 2..4), (0, 4..6), (2, 6..7)]);
        assert_eq!(ordered.runs().collect::<Vec<_>>(), [(1, 0..6), (0, 6..12), (2, 12..15)]);
        let all = Triangles::of(&Mesh { triangles: triangles.clone(), ..Mesh::default() });
        assert_eq!((all.corners, all.skin, all.blocking), (triangles, 7, 7));
        assert!(all.plain.is_empty());
    }
}
