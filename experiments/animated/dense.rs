//! The mesh cut finer: its longest edges at their middles, until there are as many vertices as are wanted.

use std::collections::{BTreeSet, HashMap};

use skinfit::bake::VertexOcclusion;
use skinfit::scene::mesh::Mesh;

/// A mesh, with what its vertices have beside it.
pub(crate) struct Dense {
    /// The mesh; of its own bones nothing is kept.
    pub(crate) mesh: Mesh,
    /// How far up the bones each vertex lies, from 0 to 1.
    pub(crate) along: Vec<f32>,
    /// Ambient occlusion, where it is baked.
    pub(crate) occlusion: Option<VertexOcclusion>,
}

/// An edge of the surface: the vertices of its ends, once for each side of a seam.
struct Edge {
    length: f32,
    sides: BTreeSet<[u32; 2]>,
}

impl Dense {
    /// Cut until there are at least `wanted` vertices; the surface stays as it is.
    pub(crate) fn cut(&mut self, wanted: usize) -> Result<(), String> {
        while self.mesh.positions.len() < wanted {
            let before = self.mesh.positions.len();
            self.cut_longest(wanted);
            if self.mesh.positions.len() == before {
                return Err("the mesh has no edges that can be cut".to_owned());
            }
        }
        Ok(())
    }

    /// Cut each edge once, the longest first, as long as vertices are missing.
    fn cut_longest(&mut self, wanted: usize) {
        let mut middles = HashMap::new();
        for edge in self.edges() {
            if self.mesh.positions.len() >= wanted {
                break;
            }
            // Both sides of a seam, or it would open where the mesh bends.
            for [a, b] in edge.sides {
                middles.insert([a, b], self.add_middle(a as usize, b as usize));
            }
        }
        let middle = |a: u32, b: u32| middles.get(&[a.min(b), a.max(b)]).copied();
        let cut = |&[a, b, c]: &[u32; 3]| parts([a, b, c], [middle(a, b), middle(b, c), middle(c, a)]);
        self.mesh.triangles = self.mesh.triangles.iter().flat_map(cut).collect();
    }

    /// The surface's edges, the longest first.
    fn edges(&self) -> Vec<Edge> {
        let mesh = &self.mesh;
        let mut first = HashMap::new();
        // + 0.0 makes -0 and 0 the same place.
        let place = |p: &glam::Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
        let corners: Vec<u32> = (mesh.positions.iter().zip(0..))
            .map(|(position, vertex)| *first.entry(place(position)).or_insert(vertex))
            .collect();
        let mut edges: HashMap<[u32; 2], Edge> = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let (from, to) = (corners[a as usize], corners[b as usize]);
                if from == to {
                    continue;
                }
                let length = mesh.positions[a as usize].distance_squared(mesh.positions[b as usize]);
                let edge = edges.entry([from.min(to), from.max(to)]);
                let edge = edge.or_insert_with(|| Edge { length, sides: BTreeSet::new() });
                edge.sides.insert([a.min(b), a.max(b)]);
            }
        }
        let mut edges: Vec<([u32; 2], Edge)> = edges.into_iter().collect();
        // The same every time, whatever the order of the table.
        edges.sort_by(|(p, a), (q, b)| b.length.total_cmp(&a.length).then(p.cmp(q)));
        edges.into_iter().map(|(_, edge)| edge).collect()
    }

    /// Add a vertex half way between two; its index.
    fn add_middle(&mut self, a: usize, b: usize) -> u32 {
        let Self { mesh, along, occlusion } = self;
        mesh.positions.push(0.5 * (mesh.positions[a] + mesh.positions[b]));
        mesh.normals.push((mesh.normals[a] + mesh.normals[b]).normalize_or(mesh.normals[a]));
        if let (Some(&s), Some(&t)) = (mesh.tangents.get(a), mesh.tangents.get(b)) {
            let sum = s.truncate() + t.truncate();
            mesh.tangents.push(sum.normalize_or(s.truncate()).extend(s.w));
        }
        if let (Some(&s), Some(&t)) = (mesh.uvs.get(a), mesh.uvs.get(b)) {
            mesh.uvs.push(0.5 * (s + t));
        }
        for morph in &mut mesh.morphs {
            for deltas in [&mut morph.positions, &mut morph.normals] {
                if let (Some(&s), Some(&t)) = (deltas.get(a), deltas.get(b)) {
                    deltas.push(0.5 * (s + t));
                }
            }
        }
        along.push(0.5 * (along[a] + along[b]));
        if let Some(VertexOcclusion { base, morphs }) = occlusion {
            for open in std::iter::once(base).chain(morphs) {
                if let (Some(&s), Some(&t)) = (open.get(a), open.get(b)) {
                    open.push(0.5 * (s + t));
                }
            }
        }
        mesh.positions.len() as u32 - 1
    }
}

/// What becomes of a triangle with such middles of its edges a-b, b-c and c-a.
fn parts([a, b, c]: [u32; 3], middles: [Option<u32>; 3]) -> Vec<[u32; 3]> {
    match middles {
        [None, None, None] => vec![[a, b, c]],
        [Some(ab), None, None] => vec![[a, ab, c], [ab, b, c]],
        [Some(ab), Some(bc), None] => vec![[ab, b, bc], [a, ab, bc], [a, bc, c]],
        [Some(ab), Some(bc), Some(ca)] => vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]],
        // Turned until those that are cut come first.
        [ab, bc, ca] => parts([b, c, a], [bc, ca, ab]),
    }
}
