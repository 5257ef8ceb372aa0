//! Eyes, nose and mouth. Centimetres, left half; the head faces +Z, the eyes lie at y = 0.

use glam::DVec3;

use super::noise::{bell, smoothstep};
use super::sdf::{Curve, Knot, capsule, carve, ellipsoid, knot, union};

/// The centre of the left eyeball, and the radius of the closed lids over it.
pub(super) const EYE: DVec3 = DVec3::new(3.2, -0.05, 7.15);
pub(super) const LID_RADIUS: f64 = 1.30;
/// Half the mouth's width.
pub(super) const MOUTH_HALF_WIDTH: f64 = 2.55;

/// The curves that the features follow.
pub(super) struct Face {
    brow: Curve,
    pub(super) lid_line: Curve,
    lid_crease: Curve,
    pouch: Curve,
    ala_groove: Curve,
    nasolabial: Curve,
}

/// A thin curve on the skin.
fn line(points: &[[f64; 3]]) -> Curve {
    let knots: Vec<Knot> = points.iter().map(|p| knot(p[0], p[1], p[2], 0.0)).collect();
    Curve::new(&knots)
}

impl Face {
    pub(super) fn new() -> Self {
        Self {
            brow: Curve::new(&[
                knot(0.0, 1.95, 8.20, 0.60),
                knot(1.4, 1.80, 8.30, 0.62),
                knot(3.0, 1.95, 7.95, 0.62),
                knot(4.4, 1.60, 6.95, 0.60),
                knot(5.15, 0.65, 5.7, 0.55),
                knot(5.25, -0.6, 4.7, 0.45),
            ]),
            lid_line: line(&[
                [1.70, -0.40, 7.98],
                [2.35, -0.62, 8.17],
                [3.2, -0.74, 8.25],
                [4.0, -0.64, 7.98],
                [4.6, -0.34, 7.25],
            ]),
            lid_crease: line(&[
                [1.75, 0.25, 8.0],
                [2.4, 0.62, 8.13],
                [3.3, 0.78, 8.15],
                [4.2, 0.52, 7.75],
                [4.7, 0.10, 7.1],
            ]),
            pouch: line(&[[1.7, -1.05, 8.26], [2.5, -1.62, 8.27], [3.5, -1.72, 8.15], [4.4, -1.35, 7.65]]),
            ala_groove: line(&[
                [1.15, -3.1, 10.4],
                [1.70, -3.35, 9.3],
                [1.95, -4.0, 8.9],
                [1.80, -4.65, 8.85],
            ]),
            nasolabial: line(&[[1.95, -3.7, 8.62], [2.5, -4.6, 8.42], [3.0, -5.7, 8.30], [3.35, -6.8, 7.97]]),
        }
    }

    /// Brow ridges and eye sockets on the skull `d`.
    pub(super) fn orbits(&self, mut d: f64, p: DVec3) -> f64 {
        d = self.brow.join(d, p, 2.6);
        let socket = ellipsoid(p, DVec3::new(3.05, 0.05, 9.55), DVec3::new(1.95, 1.15, 1.55));
        d = carve(d, socket, 1.5);
        // The hollow beside the root of the nose.
        let corner = ellipsoid(p, DVec3::new(1.75, 0.0, 9.5), DVec3::new(0.8, 1.0, 1.35));
        carve(d, corner, 0.7)
    }

    /// The closed lids over the eyeballs.
    pub(super) fn lids(&self, d: f64, p: DVec3) -> f64 {
        if p.distance(EYE) > 3.5 {
            return d;
        }
        let ball = ellipsoid(p, EYE, DVec3::new(LID_RADIUS * 1.12, LID_RADIUS * 0.98, LID_RADIUS));
        let mut d = union(d, ball, 0.9);
        // The upper lid overlaps the lower: a step as well as a groove.
        d += 0.13 * self.lid_line.bell(p, 0.11);
        d += 0.10 * self.lid_crease.bell(p, 0.15);
        d += 0.05 * self.pouch.bell(p, 0.28);
        d
    }

    /// The nose on the face `d`.
    pub(super) fn nose(&self, mut d: f64, p: DVec3) -> f64 {
        if p.distance(DVec3::new(0.0, -2.4, 10.0)) > 6.5 {
            return d;
        }
        let root = knot(0.0, 1.3, 8.45, 0.75);
        let hump = knot(0.0, -1.2, 9.70, 0.64);
        let supratip = knot(0.0, -3.3, 11.05, 0.70);
        let bridge = union(capsule(p, root, hump), capsule(p, hump, supratip), 0.5);
        // The side walls: two planes' worth of flesh from the bridge to the cheeks.
        let wall = capsule(p, knot(0.45, -0.4, 8.55, 0.62), knot(0.75, -3.35, 9.85, 0.85));
        d = union(d, union(bridge, wall, 0.9), 1.1);
        let tip = ellipsoid(p, DVec3::new(0.0, -3.55, 11.15), DVec3::new(0.82, 0.68, 0.80));
        let lobe = ellipsoid(p, DVec3::new(0.42, -3.62, 11.15), DVec3::new(0.58, 0.60, 0.68));
        d = union(d, union(tip, lobe, 0.4), 0.85);
        let ala = ellipsoid(p, DVec3::new(1.25, -3.95, 10.05), DVec3::new(0.58, 0.66, 1.0));
        d = union(d, ala, 0.75);
        let columella = capsule(p, knot(0.0, -4.52, 9.15, 0.46), knot(0.0, -3.85, 11.0, 0.38));
        d = union(d, columella, 0.5);
        let nostril = capsule(p, knot(0.76, -4.85, 10.20, 0.29), knot(0.50, -4.62, 10.85, 0.22));
        d = carve(d, nostril, 0.3);
        let inner = capsule(p, knot(0.74, -4.7, 10.2, 0.26), knot(0.8, -3.9, 9.9, 0.25));
        d = carve(d, inner, 0.25);
        d + 0.09 * self.ala_groove.bell(p, 0.2)
    }

    /// Where the lips meet, at x: height, and depth on the muzzle.
    pub(super) fn lip_line(x: f64) -> (f64, f64) {
        let t = (x / MOUTH_HALF_WIDTH).clamp(-1.25, 1.25);
        // A slight bow: down at the middle, up, and down again at the corners.
        let y = -6.82 + 0.10 * (1.0 - (-8.0 * t * t).exp()) - 0.16 * t * t;
        (y, 10.12 - 1.75 * t * t)
    }

    /// Muzzle, lips and philtrum on the face `d`.
    pub(super) fn mouth(&self, mut d: f64, p: DVec3) -> f64 {
        if p.distance(DVec3::new(0.0, -7.0, 9.0)) > 6.5 {
            return d;
        }
        let muzzle = ellipsoid(p, DVec3::new(0.0, -6.7, 7.35), DVec3::new(3.5, 2.75, 2.65));
        d = union(d, muzzle, 1.4);
        d += 0.10 * self.nasolabial.bell(p, 0.5);
        let t = (p.x / MOUTH_HALF_WIDTH).abs();
        let taper = (1.0 - t * t).max(0.0).sqrt();
        let (y, z) = Self::lip_line(p.x);
        // Beyond the corners the tubes shrink to points.
        let beyond = (p.x.abs() - MOUTH_HALF_WIDTH).max(0.0);
        let slope = 1.0 / (1.0 + (3.5 * t / MOUTH_HALF_WIDTH).powi(2)).sqrt();
        let bow = 0.10 * bell(p.x.abs() - 0.62, 0.35) - 0.02;
        let roll = |height: f64, depth: f64, tall: f64, thick: f64| {
            let dy = (p.y - (y + height)) / tall;
            let dz = (p.z - (z + depth)) / thick;
            ((dy * dy + dz * dz + (beyond / 0.12).powi(2)).sqrt() - 1.0) * tall.min(thick) * slope.max(0.6)
        };
        let upper = roll((0.42 + bow) * taper, -0.06, 0.50 * taper + 0.05, 0.58 * taper + 0.06);
        let lower = roll(-0.56 * taper, -0.14, 0.62 * taper + 0.05, 0.70 * taper + 0.06);
        d = union(d, upper, 0.35);
        d = union(d, lower, 0.40);
        // The seam between the lips, deepest at the corners.
        let seam = (p.y - y).hypot((p.z - z - 0.25).min(0.0) * 0.3).hypot(beyond * 1.5);
        d += (0.15 * (1.0 - smoothstep(0.75, 1.08, t)) + 0.10 * bell(t - 0.98, 0.07)) * bell(seam, 0.13);
        // Philtrum: a groove with two ridges from the septum to the bow.
        let high = bell(p.y + 5.35, 0.5) * bell(p.z - 10.5, 1.2);
        d += high * (0.12 * bell(p.x, 0.26) - 0.05 * bell(p.x.abs() - 0.55, 0.22));
        // The hollow between lower lip and chin.
        let fold = DVec3::new(p.x * 0.55, p.y + 8.65 - 0.10 * p.x * p.x, 0.0).length();
        d + 0.34 * bell(fold, 0.5) * bell(p.z - 9.5, 1.6)
    }
}
