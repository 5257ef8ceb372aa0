//! What vertices gather of one another, through the cache.
//!
//! A file holds a count of shares and how much of the hemisphere meets the mesh for each vertex, and the shares of all: 32 bits
//! each, whole numbers by their bits.

use std::path::Path;

use super::baker::posed_key;
use super::cache::{self, Found, Key};
use super::interreflection::{Albedo, Gather, VertexGather};
use super::vertex_rays::VertexRays;
use crate::scene::mesh::PosedMesh;

const KIND: &str = "gather";

/// The most numbers that are kept, a quarter of a gigabyte, so that no mesh fills a disk: some twenty times what one of
/// ten thousand vertices has.
const MOST: usize = 1 << 26;

impl VertexGather {
    /// As [`Self::new`], or from the bakes of `folder`, where it is then kept. What cannot be read is made anew and what cannot
    /// be written is not kept, in silence: samples have nobody to tell.
    #[must_use]
    pub fn kept(mesh: &PosedMesh, rays: u32, albedo: &Albedo<'_>, folder: Option<&Path>) -> Self {
        let Some(folder) = folder else { return Self::new(mesh, rays, albedo) };
        let (key, _) = posed_key(Key::new(KIND).with(&[rays]), &|_| mesh.clone(), 0);
        let key = albedo.key(key, mesh);
        if let Found::Floats(floats) = cache::read(folder, KIND, &key, None) {
            let vertices = VertexRays::new(&|_| mesh.clone(), 0, rays);
            if let Some(gathers) = decode(&floats, vertices.len()) {
                return Self { vertices, gathers };
            }
        }
        let made = Self::new(mesh, rays, albedo);
        let shares: usize = made.gathers.iter().map(|gather| gather.shares.len()).sum();
        if 2 * made.gathers.len() + 4 * shares <= MOST {
            let _ = cache::write(folder, KIND, &key, &encode(&made.gathers));
        }
        made
    }
}

fn encode(gathers: &[Gather]) -> Vec<f32> {
    let heads = gathers.iter().flat_map(|gather| [f32::from_bits(gather.shares.len() as u32), gather.met]);
    let shares = gathers.iter().flat_map(|gather| &gather.shares);
    heads.chain(shares.flat_map(|&(slot, [r, g, b])| [f32::from_bits(slot), r, g, b])).collect()
}

/// `None` where the numbers are not those of `vertices` vertices.
fn decode(floats: &[f32], vertices: usize) -> Option<Vec<Gather>> {
    let (heads, shares) = floats.split_at_checked(2 * vertices)?;
    let mut shares = shares.as_chunks::<4>().0;
    let mut gathers = Vec::with_capacity(vertices);
    for &[count, met] in heads.as_chunks().0 {
        let own;
        (own, shares) = shares.split_at_checked(count.to_bits() as usize)?;
        let share = |&[slot, r, g, b]: &[f32; 4]| (slot.to_bits(), [r, g, b]);
        gathers.push(Gather { shares: own.iter().map(share).collect(), met });
    }
    let within =
        gathers.iter().flat_map(|gather| &gather.shares).all(|(slot, _)| (*slot as usize) < vertices);
    (shares.is_empty() && within).then_some(gathers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gather(shares: &[(u32, [f32; 3])], met: f32) -> Gather {
        Gather { shares: shares.to_vec(), met }
    }

    /// A wedge whose two sides see one another.
    fn wedge() -> PosedMesh {
        let corner = |x: f32, y: f32, z: f32| glam::Vec3::new(x, y, z);
        let positions =
            vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 0.0, 1.0), corner(0.0, 1.0, 0.0)];
        let normals =
            vec![corner(1.0, 1.0, 0.0).normalize(), glam::Vec3::Y, corner(1.0, 1.0, 0.0), glam::Vec3::X];
        PosedMesh { positions, normals, triangles: vec![[0, 2, 1], [0, 3, 2]], ..PosedMesh::default() }
    }

    #[test]
    fn what_vertices_gather_is_read_again_where_all_is_the_same_and_made_anew_where_anything_differs() {
        let folder = tempfile::tempdir().unwrap();
        let (mesh, white) = (wedge(), Albedo { map: None });
        let bits = |gather: &VertexGather| -> Vec<u32> {
            encode(&gather.gathers).iter().map(|x| x.to_bits()).collect()
        };
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let kept = |mesh: &PosedMesh, rays| VertexGather::kept(mesh, rays, &white, Some(folder.path()));
        let new = VertexGather::new(&mesh, 64, &white);
        assert!(new.gathers.iter().any(|gather| gather.met > 0.0), "nothing is met");
        assert_eq!((bits(&kept(&mesh, 64)), files()), (bits(&new), 1));
        // What the file says is what comes back.
        let (key, _) = posed_key(Key::new(KIND).with(&[64_u32]), &|_| mesh.clone(), 0);
        let key = white.key(key, &mesh);
        let other: Vec<Gather> = new.gathers.iter().map(|of| gather(&of.shares, 0.75)).collect();
        cache::write(folder.path(), KIND, &key, &encode(&other)).unwrap();
        assert!(kept(&mesh, 64).gathers.iter().all(|gather| gather.met == 0.75));
        // A damaged one is made anew.
        let path = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(bits(&kept(&mesh, 64)), bits(&new));
        assert_eq!((bits(&kept(&mesh, 64)), files()), (bits(&new), 1));
        // Each of these is another bake.
        kept(&mesh, 32);
        let mut moved = mesh.clone();
        moved.positions[3].y = 0.5;
        kept(&moved, 64);
        let map = crate::scene::maps::Map { width: 1, height: 1, texels: vec![[0.5; 3]] };
        let _ = VertexGather::kept(&mesh, 64, &Albedo { map: Some(&map) }, Some(folder.path()));
        assert_eq!(files(), 4);
        assert_eq!(bits(&VertexGather::kept(&mesh, 64, &white, None)), bits(&new));
    }

    #[test]
    fn what_is_kept_comes_back_to_the_bit_and_nothing_else_does() {
        // Numbers of vertices whose bits are those of no number, too.
        let gathers = [
            gather(&[(0, [0.25, -0.0, f32::MIN_POSITIVE]), (2, [1.0, 2.0, 3.0])], 0.5),
            gather(&[], 0.0),
            gather(&[(1, [0.1, 0.2, 0.3])], 1.0),
        ];
        let floats = encode(&gathers);
        let found = decode(&floats, 3).unwrap();
        let bits = |gathers: &[Gather]| encode(gathers).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&gathers));
        assert!(decode(&floats, 2).is_none() && decode(&floats[..floats.len() - 4], 3).is_none());
        let beyond = encode(&[gather(&[(1, [0.0; 3])], 0.0)]);
        assert!(decode(&beyond, 1).is_none());
    }
}
