//! One surface as finer and coarser meshes, for what depends on how long a mesh's edges are.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use glam::Vec3;

use crate::StudyError;
use crate::bake::VertexOcclusion;
use crate::bake::inward::FAR_LIGHT;
use crate::bake::rays::RayMesh;
use crate::bake::sky::{BENT_NORMAL, SKY_RATIO};
use crate::model::fields::Field;
use crate::prepare::PrepareError;
use crate::samples::{self, PosedSurface, SampleError, SurfaceBakes};
use crate::scene::Scene;
use crate::scene::mesh::{Mesh, PosedMesh, VertexField};
use crate::tradeoff::bench::{Bench, Evaluated};
use crate::tradeoff::settings::Settings;

/// A mesh in the world, cut finer or coarser, with the occlusion of its vertices.
pub(super) struct Remeshed {
    pub(super) mesh: PosedMesh,
    open: Option<Vec<f32>>,
}

impl Remeshed {
    /// The scene's own mesh.
    pub(super) fn of(bench: &Bench<'_>) -> Result<Self, StudyError> {
        let (scene, bakes) = (&bench.baked.scene, bench.baked.surface_bakes());
        let mut mesh = scene.mesh.pose();
        let vertices = mesh.positions.len();
        let open = samples::posed_occlusion(scene, &scene.mesh.morphs, vertices, bakes.occlusion);
        let fields = seen_of_sky(scene, &mesh, bakes).map_err(PrepareError::from)?;
        mesh.fields.extend(fields);
        // Of other triangles it would not be known which are skin.
        mesh.plain = None;
        Ok(Self { mesh, open: open.map_err(PrepareError::from)? })
    }

    /// Each triangle cut into four at the middles of its edges; the surface and its occlusion stay.
    pub(super) fn finer(&self) -> Self {
        let mut middles = HashMap::new();
        let (mut mesh, mut open) = (self.mesh.clone(), self.open.clone());
        let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (i, j) = (a as usize, b as usize);
                mesh.positions.push(0.5 * (mesh.positions[i] + mesh.positions[j]));
                mesh.normals.push((mesh.normals[i] + mesh.normals[j]).normalize_or_zero());
                if !mesh.tangents.is_empty() {
                    let sum = mesh.tangents[i].truncate() + mesh.tangents[j].truncate();
                    mesh.tangents.push(sum.normalize_or_zero().extend(mesh.tangents[i].w));
                }
                if !mesh.uvs.is_empty() {
                    mesh.uvs.push(0.5 * (mesh.uvs[i] + mesh.uvs[j]));
                }
                if !mesh.own_atlas_uvs.is_empty() {
                    mesh.own_atlas_uvs.push(0.5 * (mesh.own_atlas_uvs[i] + mesh.own_atlas_uvs[j]));
                }
                for of in &mut mesh.fields {
                    let between: Vec<f32> =
                        of.of(i).iter().zip(of.of(j)).map(|(x, y)| 0.5 * (x + y)).collect();
                    of.numbers.extend(between);
                }
                if let Some(open) = &mut open {
                    open.push(0.5 * (open[i] + open[j]));
                }
                mesh.positions.len() as u32 - 1
            })
        };
        for [a, b, c] in self.mesh.triangles.iter().copied() {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        mesh.triangles = triangles;
        Self { mesh, open }
    }

    /// A quarter of the triangles, with edges of twice the length: the shortest edges are pulled together, round after
    /// round. Vertices that stay are as they were. `None` where seams and borders, which stay too, leave too many of
    /// the edges as they are.
    pub(super) fn coarser(&self) -> Option<Self> {
        let target = self.mesh.triangles.len() / 4;
        let mut coarse = Self { mesh: self.mesh.clone(), open: self.open.clone() };
        loop {
            let count = coarse.mesh.triangles.len();
            coarse.mesh.triangles = pulled_together(&coarse.mesh, target);
            if coarse.mesh.triangles.len() <= target || coarse.mesh.triangles.len() == count {
                break;
            }
        }
        (coarse.edge() > LONGER * self.edge()).then_some(coarse)
    }

    /// The scene with this mesh and these settings, sampled.
    pub(super) fn evaluated(&self, bench: &Bench<'_>, settings: Settings) -> Result<Evaluated, StudyError> {
        let mut scene = bench.scene(settings);
        let PosedMesh { positions, normals, tangents, uvs, own_atlas_uvs, triangles, fields, plain, rest: _ } =
            self.mesh.clone();
        scene.mesh = Mesh {
            positions,
            normals,
            tangents,
            uvs,
            own_atlas_uvs,
            triangles,
            fields,
            plain,
            ..Mesh::default()
        };
        let occlusion = self.open.clone().map(|base| VertexOcclusion { base, morphs: Vec::new() });
        let bakes = SurfaceBakes { occlusion: occlusion.as_ref(), ..SurfaceBakes::default() };
        let samples = samples::sample_views(&scene, &self.mesh, bakes).map_err(PrepareError::from)?;
        Ok(Evaluated { scene, illumination: bench.baked.illumination.clone(), samples: Arc::new(samples) })
    }

    /// The median length of an edge.
    pub(super) fn edge(&self) -> f64 {
        let place = |i: u32| self.mesh.positions[i as usize];
        let mut lengths: Vec<f64> = self
            .mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| f64::from(place(a).distance(place(b))))
            .collect();
        let middle = lengths.len() / 2;
        if lengths.is_empty() { 0.0 } else { *lengths.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }
}

/// What the vertices see of the sky, which other vertices of the same surface have from them.
fn seen_of_sky(
    scene: &Scene,
    mesh: &PosedMesh,
    bakes: SurfaceBakes<'_>,
) -> Result<Vec<VertexField>, SampleError> {
    let rays = RayMesh::of(mesh);
    let surface = PosedSurface::new(scene, mesh, &rays, &scene.mesh.morphs, bakes)?;
    let of_sky = |field: &Field| {
        [SKY_RATIO, BENT_NORMAL].contains(&field.name()) || field.name().starts_with(FAR_LIGHT)
    };
    let fields = scene.needs().fields.iter().filter(of_sky);
    Ok(fields.map(|field| VertexField { field, numbers: surface.field_of_vertices(field) }).collect())
}

/// By how much edges must have become longer, of twice as long, for a mesh to count as the coarser one.
const LONGER: f64 = 1.5;
/// By how much a triangle may turn when an edge is pulled together, and away from its vertices' normals: the least
/// cosine.
const LEAST_COSINE: f32 = 0.3;

/// The triangles after one round: edges from the shortest on, no two of them neighbours, as long as more than
/// `target` triangles are left. A vertex moves onto its neighbour unless it lies on a seam or a border.
fn pulled_together(mesh: &PosedMesh, target: usize) -> Vec<[u32; 3]> {
    let surface = Surface::of(mesh);
    let mut triangles: Vec<Option<[u32; 3]>> = mesh.triangles.iter().copied().map(Some).collect();
    let mut left = triangles.len();
    let mut touched = vec![false; mesh.positions.len()];
    for (from, to) in surface.edges(mesh) {
        if left <= target {
            break;
        }
        let ring = surface.ring(mesh, from);
        if ring.iter().any(|&corner| touched[corner as usize]) || touched[surface.corner(from) as usize] {
            continue;
        }
        let Some(moved) = surface.moved(mesh, from, to) else { continue };
        for (at, triangle) in moved {
            left -= usize::from(triangle.is_none());
            triangles[at] = triangle;
        }
        ring.into_iter().chain([surface.corner(from)]).for_each(|corner| touched[corner as usize] = true);
    }
    triangles.into_iter().flatten().collect()
}

/// Which triangles meet where. A corner is a place; a seam has several vertices at one.
struct Surface {
    /// The corner of each vertex: the first vertex at its place.
    corners: Vec<u32>,
    /// The triangles around each corner.
    around: Vec<Vec<usize>>,
    /// Whether a corner's vertex may move: it is alone there, and surrounded by triangles.
    free: Vec<bool>,
}

impl Surface {
    fn of(mesh: &PosedMesh) -> Self {
        let mut first = HashMap::new();
        let place = |p: &Vec3| p.to_array().map(f32::to_bits);
        let corners: Vec<u32> = (mesh.positions.iter().zip(0..))
            .map(|(position, vertex)| *first.entry(place(position)).or_insert(vertex))
            .collect();
        let mut around = vec![Vec::new(); corners.len()];
        let mut alone: Vec<Option<u32>> = vec![None; corners.len()];
        let mut free = vec![true; corners.len()];
        let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for (at, triangle) in mesh.triangles.iter().enumerate() {
            for i in 0..3 {
                let (vertex, next) = (triangle[i], triangle[(i + 1) % 3]);
                let (corner, other) = (corners[vertex as usize], corners[next as usize]);
                around[corner as usize].push(at);
                free[corner as usize] &= *alone[corner as usize].get_or_insert(vertex) == vertex;
                *edges.entry([corner.min(other), corner.max(other)]).or_default() += 1;
            }
        }
        for (ends, _) in edges.into_iter().filter(|(_, triangles)| *triangles != 2) {
            ends.into_iter().for_each(|corner| free[corner as usize] = false);
        }
        Self { corners, around, free }
    }

    fn corner(&self, vertex: u32) -> u32 {
        self.corners[vertex as usize]
    }

    /// Edges from a vertex that may move, the shortest first.
    fn edges(&self, mesh: &PosedMesh) -> Vec<(u32, u32)> {
        let place = |vertex: u32| mesh.positions[vertex as usize];
        let both_ways =
            |t: &[u32; 3]| [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)].map(|(i, j)| (t[i], t[j]));
        let mut edges: Vec<(f32, u32, u32)> = (mesh.triangles.iter().flat_map(both_ways))
            .filter(|&(from, _)| self.free[self.corner(from) as usize])
            .map(|(from, to)| (place(from).distance_squared(place(to)), from, to))
            .collect();
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        edges.dedup();
        edges.into_iter().map(|(_, from, to)| (from, to)).collect()
    }

    /// The corners around a vertex.
    fn ring(&self, mesh: &PosedMesh, vertex: u32) -> BTreeSet<u32> {
        let own = self.corner(vertex);
        let around = self.around[own as usize].iter().flat_map(|&at| mesh.triangles[at]);
        around.map(|vertex| self.corner(vertex)).filter(|&corner| corner != own).collect()
    }

    /// What becomes of the triangles around `from` when it moves onto `to`; `None` where one of them would turn
    /// over, or the surface would touch itself.
    fn moved(&self, mesh: &PosedMesh, from: u32, to: u32) -> Option<Vec<(usize, Option<[u32; 3]>)>> {
        let common = self.ring(mesh, from).intersection(&self.ring(mesh, to)).count();
        let across = |triangle: [u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let faced = |triangle: [u32; 3]| -> Vec3 {
            triangle.map(|vertex| mesh.normals[vertex as usize]).into_iter().sum::<Vec3>().normalize_or_zero()
        };
        let mut moved = Vec::new();
        for &at in &self.around[self.corner(from) as usize] {
            let old = mesh.triangles[at];
            if old.contains(&to) {
                moved.push((at, None));
                continue;
            }
            let new = old.map(|vertex| if vertex == from { to } else { vertex });
            // Neither all at once nor round after round.
            if across(new).dot(across(old)).min(across(new).dot(faced(new))) < LEAST_COSINE {
                return None;
            }
            moved.push((at, Some(new)));
        }
        let gone = moved.iter().filter(|(_, triangle)| triangle.is_none()).count();
        (common == 2 && gone == 2).then_some(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of triangles of about the same size.
    fn ball() -> PosedMesh {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z];
        let positions = vec![x, -x, y, -y, z, -z];
        let triangles =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let mesh = PosedMesh { normals: positions.clone(), positions, triangles, ..PosedMesh::default() };
        let mut ball = Remeshed { mesh, open: None };
        for _ in 0..4 {
            ball = ball.finer();
            ball.mesh.positions.iter_mut().for_each(|p| *p = p.normalize());
        }
        ball.mesh
    }

    #[test]
    fn a_coarser_ball_is_closed_and_has_a_quarter_of_the_triangles_and_edges_twice_as_long() {
        let fine = Remeshed { mesh: ball(), open: None };
        let coarse = fine.coarser().unwrap();
        let (before, after) = (fine.mesh.triangles.len(), coarse.mesh.triangles.len());
        assert!(after <= before / 4 && after > before / 5, "{before} {after}");
        // Triangles are not all alike: the median is near to twice.
        assert!((1.6..2.4).contains(&(coarse.edge() / fine.edge())), "{} {}", coarse.edge(), fine.edge());
        let mut edges: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for [a, b, c] in coarse.mesh.triangles.iter().copied() {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *edges.entry([p.min(q), p.max(q)]).or_default() += if p < q { 1 } else { -1 };
            }
            let [p, q, r] = [a, b, c].map(|vertex| coarse.mesh.positions[vertex as usize]);
            assert!((q - p).cross(r - p).dot(p + q + r) > 0.0, "a triangle turned over");
        }
        assert!(edges.values().all(|&sum| sum == 0), "each edge once in either direction");
    }

    #[test]
    fn seams_and_borders_stay() {
        let mut half = ball();
        half.triangles.retain(|t| t.iter().all(|&vertex| half.positions[vertex as usize].z >= -1e-6));
        let on_border = |mesh: &PosedMesh| -> BTreeSet<u32> {
            let vertices = mesh.triangles.iter().flatten().copied();
            vertices.filter(|&vertex| mesh.positions[vertex as usize].z.abs() < 1e-6).collect()
        };
        let before = on_border(&half);
        let coarse = Remeshed { mesh: half, open: None }.coarser().unwrap();
        assert_eq!(on_border(&coarse.mesh), before);
    }
}
