//! The vertex stage (listing 3-3) of meshes: what morphs and bones make of a vertex.

use super::real::Real;
use super::vector::{V3, add, cross, dot, normalize_or, scale, scale_add, select, sub};

/// A vertex at rest, as it stands in the vertex buffer; of any length where unit length is meant.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<R> {
    /// Position.
    pub position: V3<R>,
    /// Normal N.
    pub normal: V3<R>,
    /// Tangent T.
    pub tangent: V3<R>,
    /// Tangent's w: bitangent = w cross(N, T).
    pub handedness: R,
    /// Open share of the hemisphere o (the listing's `normal.w`).
    pub occlusion: R,
}

/// What one morph target adds to a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Delta<R> {
    /// The target's weight.
    pub weight: R,
    /// Position delta at weight 1.
    pub position: V3<R>,
    /// Normal delta at weight 1.
    pub normal: V3<R>,
    /// Occlusion delta at weight 1 (the listing's `normalMorph.w`).
    pub occlusion: R,
}

/// A bone: an affine map, with what it does to normals.
#[derive(Clone, Copy, Debug)]
pub struct Bone<R> {
    linear: [V3<R>; 3],
    translation: V3<R>,
    normal: [V3<R>; 3],
}

impl<R: Real> Bone<R> {
    /// The bone of a matrix whose three upper rows act on column vectors.
    ///
    /// Normals go through the upper 3x3, as listed. Where it scales unevenly or shears they go
    /// through its inverse transpose, times det^(2/3): for an even scale that is the upper 3x3
    /// itself, so that bones of either kind blend with equal say.
    pub fn new(rows: [[R; 4]; 3]) -> Self {
        let linear = rows.map(|row| [row[0], row[1], row[2]]);
        let [a, b, c] = linear;
        let one = a[0].lit(1.0);
        let (aa, bb, cc) = (dot(a, a), dot(b, b), dot(c, c));
        let mean = (aa + bb + cc) * one.lit(1.0 / 3.0);
        let stretch = (aa - mean).abs().max((bb - mean).abs()).max((cc - mean).abs());
        let shear = dot(a, b).abs().max(dot(b, c).abs()).max(dot(c, a).abs());
        // Files hold rotations to about 1e-6; at 1e-4 of the squared scale both ways agree to 1e-4.
        let uneven = stretch.max(shear).ge(mean * one.lit(1e-4));
        let cofactors = [cross(b, c), cross(c, a), cross(a, b)];
        let det = dot(a, cofactors[0]);
        let regular = det.abs().ge(one.lit(1e-37));
        let use_inverse = R::and(uneven, regular);
        let size = R::select(use_inverse, det.abs(), one);
        // inverse transpose x |det|^(2/3) = cofactors x sign(det) |det|^(-1/3)
        let factor = (size.log2() * one.lit(-1.0 / 3.0)).exp2();
        let factor = R::select(det.lt(one.lit(0.0)), -factor, factor);
        let normal =
            std::array::from_fn(|i| select::<R>(use_inverse, scale(factor, cofactors[i]), linear[i]));
        Self { linear, translation: rows.map(|row| row[3]), normal }
    }

    /// The three rows of the affine map, and those of what it does to normals.
    pub fn rows(&self) -> ([[R; 4]; 3], [V3<R>; 3]) {
        let row = |i: usize| {
            let [x, y, z] = self.linear[i];
            [x, y, z, self.translation[i]]
        };
        ([row(0), row(1), row(2)], self.normal)
    }
}

/// A vertex in the world: its frame is of unit vectors, though after skinning not exactly
/// orthogonal (as in the listing, where T is made orthogonal to N before the bones).
#[derive(Clone, Copy, Debug)]
pub struct Surface<R> {
    /// World position.
    pub position: V3<R>,
    /// Unit normal N.
    pub normal: V3<R>,
    /// Unit tangent T.
    pub tangent: V3<R>,
    /// Unit bitangent B = w cross(N, T).
    pub bitangent: V3<R>,
    /// Open share of the hemisphere; unclamped, as listed.
    pub occlusion: R,
}

/// Morph, make T orthogonal to N, skin and re-normalise. Without `bones` (pairs of weight and bone;
/// the weights should sum to 1) the vertex is in the world already.
///
/// Vectors without a direction are replaced by a fixed frame: N by +Z, T by [`perpendicular`].
#[inline]
pub fn deform<'a, R: Real + 'a>(
    vertex: &Vertex<R>,
    deltas: impl IntoIterator<Item = Delta<R>>,
    bones: impl IntoIterator<Item = (R, &'a Bone<R>)>,
) -> Surface<R> {
    let Vertex { mut position, mut normal, tangent, handedness, mut occlusion } = *vertex;
    for delta in deltas {
        position = scale_add(delta.weight, delta.position, position);
        normal = scale_add(delta.weight, delta.normal, normal);
        occlusion = delta.weight.mul_add(delta.occlusion, occlusion);
    }
    let zero = occlusion.lit(0.0);
    let (normal, _) = normalize_or(normal, [zero, zero, zero.lit(1.0)]);
    let tangent = orthogonal(tangent, normal);
    let mut bones = bones.into_iter().peekable();
    let (position, normal, tangent) = if bones.peek().is_some() {
        skin(position, normal, tangent, bones)
    } else {
        (position, normal, tangent)
    };
    let (tangent, bitangent) = frame(normal, tangent, handedness);
    Surface { position, normal, tangent, bitangent, occlusion }
}

/// The weighted bones' maps of a position, a normal and a tangent.
#[inline]
fn skin<'a, R: Real + 'a>(
    position: V3<R>,
    normal: V3<R>,
    tangent: V3<R>,
    bones: impl Iterator<Item = (R, &'a Bone<R>)>,
) -> (V3<R>, V3<R>, V3<R>) {
    let apply = |m: &[V3<R>; 3], v: V3<R>| [dot(m[0], v), dot(m[1], v), dot(m[2], v)];
    let mut sums = [[position[0].lit(0.0); 3]; 3];
    for (weight, bone) in bones {
        let x = add(apply(&bone.linear, position), bone.translation);
        sums[0] = scale_add(weight, x, sums[0]);
        sums[1] = scale_add(weight, apply(&bone.normal, normal), sums[1]);
        sums[2] = scale_add(weight, apply(&bone.linear, tangent), sums[2]);
    }
    let (n, _) = normalize_or(sums[1], normal);
    let (t, _) = normalize_or(sums[2], perpendicular(n));
    (sums[0], n, t)
}

/// The unit part of `tangent` orthogonal to the unit `normal` (Gram-Schmidt), or [`perpendicular`]
/// where there is none.
#[inline]
pub fn orthogonal<R: Real>(tangent: V3<R>, normal: V3<R>) -> V3<R> {
    let fallback = perpendicular(normal);
    let (unit, _) = normalize_or(tangent, fallback);
    let rest = sub(unit, scale(dot(unit, normal), normal));
    // What is left of a parallel tangent is rounding, some 1e-7 in f32.
    let ok = dot(rest, rest).ge(normal[0].lit(1e-12));
    normalize_or(select::<R>(ok, rest, fallback), fallback).0
}

/// T, and the unit B = w cross(N, T); where N and T are parallel T gives way to [`perpendicular`].
#[inline]
fn frame<R: Real>(normal: V3<R>, tangent: V3<R>, handedness: R) -> (V3<R>, V3<R>) {
    let across = cross(normal, tangent);
    let ok = dot(across, across).ge(handedness.lit(1e-12));
    let tangent = select::<R>(ok, tangent, perpendicular(normal));
    let across = select::<R>(ok, across, cross(normal, tangent));
    let (across, _) = normalize_or(across, tangent);
    (tangent, scale(handedness, across))
}

/// One unit vector orthogonal to the unit vector `n`, the same on every evaluator (Duff et al.,
/// "Building an Orthonormal Basis, Revisited", JCGT 2017).
#[inline]
pub fn perpendicular<R: Real>(n: V3<R>) -> V3<R> {
    let one = n[0].lit(1.0);
    let sign = R::select(n[2].ge(one.lit(0.0)), one, -one);
    let a = -one / (sign + n[2]);
    [(sign * n[0] * n[0]).mul_add(a, one), sign * n[0] * n[1] * a, -(sign * n[0])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(normal: V3<f64>, tangent: V3<f64>) -> Vertex<f64> {
        Vertex { position: [0.0; 3], normal, tangent, handedness: 1.0, occlusion: 1.0 }
    }

    fn deltas() -> [Delta<f64>; 0] {
        []
    }

    #[test]
    fn degenerate_frames_become_unit_orthogonal_ones() {
        let up = [0.0, 1.0, 0.0];
        for (normal, tangent) in [
            ([0.0; 3], [0.0; 3]),
            (up, [0.0; 3]),
            (up, up),
            (up, [1e-20, -3.0, 0.0]),
            ([0.0, 0.0, -1.0], [0.0; 3]),
            ([f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]),
        ] {
            let s = deform(&vertex(normal, tangent), deltas(), []);
            for (a, b) in [(s.normal, s.tangent), (s.tangent, s.bitangent), (s.bitangent, s.normal)] {
                // A few roundings of f64.
                assert!((dot(a, a) - 1.0).abs() < 1e-14 && dot(a, b).abs() < 1e-14, "{normal:?} {tangent:?}");
            }
        }
    }

    #[test]
    fn a_flattened_bone_leaves_finite_unit_vectors() {
        let flat = Bone::new([[0.0; 4]; 3]);
        let s = deform(&vertex([0.0, 0.0, 2.0], [1.0, 0.0, 0.0]), deltas(), [(1.0, &flat)]);
        assert_eq!((s.normal, s.position), ([0.0, 0.0, 1.0], [0.0; 3]));
        assert!((dot(s.tangent, s.tangent) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn normals_stay_perpendicular_to_a_surface_that_a_bone_stretches() {
        let bone = Bone::new([[3.0, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -0.5, 0.0]]);
        let (normal, tangent) = ([0.6, 0.8, 0.0], [0.8, -0.6, 0.0]);
        let s = deform(&vertex(normal, tangent), deltas(), [(1.0, &bone)]);
        // A few roundings of f64 at most, through a logarithm.
        assert!(dot(s.normal, s.tangent).abs() < 1e-14);
    }

    #[test]
    fn an_evenly_scaled_bone_treats_normals_as_listed_on_both_sides_of_the_threshold() {
        for stretch in [1.0, 1.0 + 4e-5, 1.0 + 6e-5] {
            let bone =
                Bone::new([[0.0, -7.0, 0.0, 0.0], [7.0 * stretch, 0.0, 0.0, 0.0], [0.0, 0.0, 7.0, 0.0]]);
            for (row, linear) in bone.normal.iter().zip(&bone.linear) {
                for (n, l) in row.iter().zip(linear) {
                    // The inverse transpose differs by twice the stretch.
                    assert!((n - l).abs() < 7.0 * 2e-4, "{stretch}");
                }
            }
        }
    }
}
