//! How thick the mesh is below each vertex, along -N: what light that comes through is weakened by (MODEL 11).
//!
//! Rays go inward within a cone about -N, cosine-distributed, and each tells how far below the surface the far side lies
//! where it leaves: of a slab all tell its thickness, whatever the cone. What is kept is the mean of the *inverses*. A ray
//! that leaves by a hole of the mesh and meets nothing then counts as one without end, and one that runs along a nostril or
//! into the mouth no more than its share, where in a plain mean either would hide all thin parts around it. Light, too, comes
//! by the short ways: exp(-d / l) is convex in d. Cards of hair and lashes do not count: their roots lie below the skin.

use glam::{DVec3, Vec3A};

use super::interreflection::Nearest;
use super::vertex_rays::{Rays, VertexRays};
use super::wide_bvh::NOTHING;
use crate::progress;
use crate::scene::mesh::PosedMesh;

/// The field of it in samples, in millimetres.
pub const THICKNESS: &str = "thickness";

/// Rays a vertex: the mean of 64 stratified rays is within some hundredths of that of many.
const RAYS: u32 = 64;
/// The sine of the cone's half angle, 30 degrees: wider than the facets of a scan, narrow enough that its rays leave by the
/// same far side.
const WIDEST: f32 = 0.5;

/// The mean of 1 over the thickness below each vertex, in units of the scene; 0 where nothing lies below.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexThickness {
    /// At rest, one a vertex.
    pub base: Vec<f32>,
    /// What each morph target at weight 1 adds, as many as the mesh has targets; empty for one that neither the scene nor
    /// its animation gives a weight.
    pub morphs: Vec<Vec<f32>>,
}

impl VertexThickness {
    /// The thickness of each vertex with the morph targets at `weights`, in units of the scene; infinite where nothing lies
    /// below. Targets beyond the list count nothing.
    #[must_use]
    pub fn posed(&self, weights: &[f32]) -> Vec<f32> {
        let mut inverse = self.base.clone();
        for (delta, &weight) in self.morphs.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            inverse.iter_mut().zip(delta).for_each(|(inverse, delta)| *inverse += weight * delta);
        }
        let thickness = |inverse: f32| if inverse > 0.0 { 1.0 / inverse } else { f32::INFINITY };
        inverse.into_iter().map(thickness).collect()
    }
}

/// The thickness below each vertex at rest, and what each of `morphs` targets adds. `pose` gives the mesh with the targets
/// at the listed weights. All cores; the same for any number of threads.
///
/// Vertices that coincide in every pose and share a normal get one value. The rays depend on the rest position alone, so
/// that a target adds nothing where it changes nothing.
#[must_use]
pub fn bake_thickness(pose: &(dyn Fn(&[f32]) -> PosedMesh + Sync), morphs: usize) -> VertexThickness {
    let solid = |weights: &[f32]| pose(weights).without_open();
    let vertices = VertexRays::inward(&solid, morphs, RAYS, WIDEST);
    let bar = progress::bar("thickness", (vertices.len() * (1 + morphs)) as u64);
    let inverse = |mesh: &PosedMesh, i: usize, rays: &Rays, found: &[Nearest]| {
        bar.inc(1);
        let inward = -Vec3A::from(mesh.normals[vertices.vertex(i)]).normalize_or_zero();
        mean_inverse(mesh, inward, rays, found)
    };
    let at_rest = vertices.at_rest(|i, rays, found: Vec<Nearest>| {
        let inverse = inverse(&vertices.rest, i, rays, &found);
        (inverse, found)
    });
    let (rest, found): (Vec<f32>, Vec<Vec<Nearest>>) = at_rest.into_iter().unzip();
    let base = vertices.spread(&rest, 1);
    let target = |target: &PosedMesh| -> Vec<f32> {
        let moved = vertices.morphed(target, &found, |i, rays, found| inverse(target, i, rays, &found));
        vertices.spread(&moved, 1).iter().zip(&base).map(|(moved, base)| moved - base).collect()
    };
    let morphs = vertices.targets.iter().map(target).collect();
    bar.finish_and_clear();
    VertexThickness { base, morphs }
}

/// The mean of 1 over how far along `inward` each ray leaves the mesh; 0 of one that does not.
fn mean_inverse(mesh: &PosedMesh, inward: Vec3A, rays: &Rays, found: &[Nearest]) -> f32 {
    let of = |(direction, &triangle): (&Vec3A, &Nearest)| {
        let (o, d) = (rays.origin.as_dvec3(), direction.as_dvec3());
        Some(1.0 / (distance(mesh, triangle, o, d)? * d.dot(inward.as_dvec3())))
    };
    let met = rays.directions.iter().zip(found).filter(|(_, found)| **found != NOTHING);
    let sum: f64 = met.filter_map(of).filter(|inverse| inverse.is_finite()).sum();
    (sum / found.len().max(1) as f64) as f32
}

/// How far along the unit vector `d` from `origin` the plane of a triangle lies; none of one without an area, or along it.
pub(crate) fn distance(mesh: &PosedMesh, triangle: u32, origin: DVec3, d: DVec3) -> Option<f64> {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.positions[i as usize].as_dvec3());
    let normal = (b - a).cross(c - a);
    let distance = (a - origin).dot(normal) / d.dot(normal);
    distance.is_finite().then_some(distance)
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, vec3};

    use super::*;

    /// A sheet across z at `z`, 20 wide, whose normal is +z or -z.
    fn sheet(mesh: &mut PosedMesh, z: f32, up: f32) {
        let first = mesh.positions.len() as u32;
        for (x, y) in [(-10.0, -10.0), (10.0, -10.0), (-10.0, 10.0), (10.0, 10.0), (0.0, 0.0)] {
            mesh.positions.push(vec3(x, y, z));
            mesh.normals.push(up * Vec3::Z);
        }
        for [a, b] in [[0, 1], [1, 3], [3, 2], [2, 0]] {
            mesh.triangles.push([first + a, first + b, first + 4]);
        }
    }

    /// Two sheets `thick` apart, facing away from one another; the middles are vertices 4 and 9.
    fn slab(thick: f32) -> PosedMesh {
        let mut mesh = PosedMesh::default();
        sheet(&mut mesh, 0.0, -1.0);
        sheet(&mut mesh, thick, 1.0);
        mesh
    }

    #[test]
    fn a_slab_is_as_thick_as_it_is_and_a_target_adds_what_it_changes() {
        let pose = |weights: &[f32]| slab(0.5 + weights.first().copied().unwrap_or(0.0));
        let baked = bake_thickness(&pose, 1);
        for (weights, thick) in [(&[0.0][..], 0.5), (&[1.0], 1.5), (&[], 0.5)] {
            for vertex in [4, 9] {
                let found = baked.posed(weights)[vertex];
                // Rays start a hundred-thousandth of the mesh's diagonal of 28 below the surface.
                assert!((found - thick).abs() < 5e-4, "{found} {thick}");
            }
        }
    }

    #[test]
    fn a_sheet_without_a_far_side_has_no_end_and_nothing_is_baked_of_nothing() {
        let mut mesh = PosedMesh::default();
        sheet(&mut mesh, 0.0, 1.0);
        let baked = bake_thickness(&|_| mesh.clone(), 0);
        assert!(baked.posed(&[]).iter().all(|thick| *thick == f32::INFINITY));
        assert_eq!(bake_thickness(&|_| PosedMesh::default(), 0), VertexThickness::default());
        // A vertex without a normal has no inside.
        mesh.normals[4] = Vec3::ZERO;
        assert_eq!(bake_thickness(&|_| mesh.clone(), 0).posed(&[])[4], f32::INFINITY);
    }
}
