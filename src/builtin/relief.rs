//! What is finer than the mesh: pores, wrinkles and creases, as a height field and as normals.

use glam::DVec3;

use super::atlas::Atlas;
use super::head::{Head, METRES};
use super::landmarks::Spot;
use super::noise::{bell, fractal, gradient_noise, nearest_feature, smoothstep};
use super::texels::Place;

/// Over how far slopes are measured, metres: about a texel on the face.
const SPAN: f64 = 3e-4;

/// Height of the skin's relief above the mesh, metres.
fn height(spot: &Spot) -> f64 {
    // In centimetres until the end.
    let mut h = 0.0030 * fractal(spot.p * 3.0, 2, 101);
    let smooth = 1.0 - 0.8 * spot.lips;
    let coarse = 0.55 + 0.8 * spot.near(1.2, -3.2, 10.0, 2.4) + 0.4 * spot.near(0.0, 4.0, 9.0, 3.0);
    let pore = nearest_feature(spot.p * 6.5, 103);
    h -= 0.0055 * coarse * smooth * smoothstep(0.42, 0.10, pore.distance);
    // The lattice of fine furrows between pores.
    h -= 0.0022 * smooth * smoothstep(0.14, 0.0, pore.second - pore.distance);
    (h + wrinkles(spot)) * METRES
}

fn wrinkles(spot: &Spot) -> f64 {
    let (p, half) = (spot.p, spot.half);
    let mut h = 0.0;
    if p.y > 2.2 && p.y < 8.0 && p.z > 4.0 {
        // Forehead: bowed lines that waver and fade towards the temples.
        let across = smoothstep(5.0, 2.0, half.x);
        for (line, depth) in [(3.5, 0.007), (4.5, 0.010), (5.6, 0.006)] {
            let y = line + 0.25 * bell(half.x - 2.4, 1.2) + 0.16 * gradient_noise(p * 0.7, line as u32);
            h -= depth * across * bell(p.y - y, 0.11) * (0.8 + 0.5 * gradient_noise(p * 0.9, 7));
        }
    }
    if p.z > 5.0 && p.y.abs() < 3.0 {
        // Crow's feet, as rays from the outer corner of the eye; and one furrow beside the glabella.
        let (dx, dy) = (half.x - 4.7, half.y + 0.15);
        let angle = dy.atan2(dx);
        let fan = smoothstep(0.2, 0.7, dx.hypot(dy))
            * smoothstep(1.9, 1.0, dx.hypot(dy))
            * smoothstep(-0.1, 0.3, dx);
        let wobble = 0.8 * gradient_noise(p * 1.2, 111);
        h -= 0.012 * fan * (0.5 + 0.5 * (angle * 9.0 + wobble).cos()).powi(4);
        h -= 0.016 * bell(half.x - 0.75, 0.07) * bell(p.y - 1.9, 0.5);
        // Fine folds of the lids, along them.
        h -= 0.005 * spot.eye * (0.5 + 0.5 * (14.0 * half.distance(super::face::EYE - DVec3::Y * 3.0)).cos());
    }
    if spot.lips > 0.0 {
        let ripple =
            gradient_noise(DVec3::new(p.x * 7.5 + 0.6 * gradient_noise(p * 2.0, 121), p.y * 0.8, 0.0), 122);
        h -= 0.016 * spot.lips * smoothstep(0.05, 0.5, ripple);
    }
    if p.y < -11.0 && p.y > -18.5 && p.z > -2.0 {
        for (line, depth) in [(-13.4, 0.008), (-16.2, 0.009)] {
            let y = line + 0.06 * half.x * half.x * 0.5 + 0.25 * gradient_noise(p * 0.5, 131);
            h -= depth * bell(p.y - y, 0.16) * smoothstep(5.5, 3.0, half.x);
        }
    }
    h
}

/// The tangent-space normal (+Y towards the top of the image, as stored in [0, 1]) at a place.
pub(super) fn normal(head: &Head, atlas: &Atlas, place: &Place) -> [f64; 3] {
    let corners = atlas.triangles[place.triangle].map(|v| atlas.tangents[v as usize]);
    let blended: DVec3 = (0..3)
        .map(|k| {
            DVec3::new(corners[k][0].into(), corners[k][1].into(), corners[k][2].into()) * place.weights[k]
        })
        .sum();
    let n = place.normal;
    let t = (blended - n * n.dot(blended)).normalize_or(n.any_orthonormal_vector());
    let b = n.cross(t) * f64::from(corners[0][3]);
    let spot = Spot::new(head, place.position);
    let here = height(&spot);
    let slope = |along: DVec3| (height(&spot.beside(place.position + along * SPAN)) - here) / SPAN;
    let bumped = DVec3::new(-slope(t), -slope(b), 1.0).normalize();
    (bumped * 0.5 + 0.5).to_array()
}
