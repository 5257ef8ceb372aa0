//! Triangles without an area, and normals that a file leaves out.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::mesh::Mesh;

/// Drop triangles that have no area at rest nor in any morph target; of each, whether it stays.
///
/// A triangle that a morph opens (between closed lips, say) is kept.
pub(super) fn drop_degenerate(mesh: &mut Mesh) -> Vec<bool> {
    let (positions, morphs) = (&mesh.positions, &mesh.morphs);
    let stays = |triangle: &[u32; 3]| {
        let rest = triangle.map(|v| positions[v as usize].as_dvec3());
        has_area(rest)
            || morphs.iter().any(|morph| {
                let delta = triangle.map(|v| morph.positions[v as usize].as_dvec3());
                has_area(std::array::from_fn(|i| rest[i] + delta[i]))
            })
    };
    let kept: Vec<bool> = mesh.triangles.iter().map(stays).collect();
    let mut each = kept.iter();
    mesh.triangles.retain(|_| each.next() != Some(&false));
    kept
}

fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let longest = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
    // Corners are known to f32: a height below 1e-9 of the base is none.
    ab.cross(-ca).length() > 1e-9 * longest
}

/// Give every vertex without a normal the mean of its triangles' normals, weighted by their angle
/// there (Thürmer and Wüthrich 1998). Vertices at one place share theirs, so that UV seams do not
/// show.
pub(super) fn complete(mesh: &mut Mesh) {
    if mesh.normals.iter().all(|n| *n != Vec3::ZERO) {
        return;
    }
    // + 0.0 makes -0 and 0 the same place.
    let place = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let mut sums: HashMap<[u32; 3], DVec3> = HashMap::new();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners.map(|p: Vec3| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for i in 0..3 {
            let [here, next, last] = [0, 1, 2].map(|k| corners[(i + k) % 3].as_dvec3());
            let angle = (next - here).normalize_or_zero().angle_between((last - here).normalize_or_zero());
            if angle.is_finite() {
                *sums.entry(place(corners[i])).or_default() += normal * angle;
            }
        }
    }
    for (normal, &position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        if *normal == Vec3::ZERO {
            let sum = sums.get(&place(position)).copied().unwrap_or_default();
            // What no triangle decides points up; the vertex stage would do the same.
            *normal = sum.try_normalize().unwrap_or(DVec3::Z).as_vec3();
        }
    }
}
