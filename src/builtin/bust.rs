//! Neck, shoulders and chest. Centimetres, left half.

use glam::DVec3;

use super::sdf::{Curve, Knot, capsule, ellipsoid, knot, union};

/// How far below the eyes the bust is cut off.
const FLOOR: f64 = 24.0;

/// The muscles and bones that show through the skin of the neck.
pub(super) struct Bust {
    sternomastoid: Curve,
    clavicle: Curve,
    trapezius: [Knot; 4],
}

impl Bust {
    pub(super) fn new() -> Self {
        Self {
            sternomastoid: Curve::new(&[
                knot(4.9, -4.0, -2.2, 0.8),
                knot(4.1, -9.0, -0.9, 0.9),
                knot(3.0, -14.0, 2.1, 0.8),
                knot(1.9, -18.4, 3.9, 0.62),
                knot(1.1, -20.8, 4.5, 0.5),
            ]),
            clavicle: Curve::new(&[
                knot(1.4, -21.4, 4.4, 0.7),
                knot(5.5, -21.2, 3.7, 0.55),
                knot(10.0, -20.8, 1.7, 0.5),
                knot(15.5, -20.6, -1.4, 0.6),
            ]),
            trapezius: [
                knot(1.5, -3.5, -4.2, 1.4),
                knot(2.6, -11.0, -5.0, 2.3),
                knot(6.2, -16.8, -4.7, 2.4),
                knot(16.0, -20.9, -3.2, 2.2),
            ],
        }
    }

    /// The neck alone, from the skull's base to the chest.
    pub(super) fn neck(&self, p: DVec3) -> f64 {
        let axis_z = -1.35 + 0.10 * (p.y + 12.0);
        let q = DVec3::new(p.x / 1.0, p.y, (p.z - axis_z) / 1.08);
        let column = capsule(q, knot(0.0, -5.0, 0.0, 4.7), knot(0.0, -24.0, 0.0, 5.3));
        let larynx = ellipsoid(p, DVec3::new(0.0, -14.6, 4.15), DVec3::new(1.3, 1.9, 0.95));
        let throat = ellipsoid(p, DVec3::new(0.0, -15.5, 2.8), DVec3::new(2.0, 5.0, 1.6));
        let mut d = column;
        for pair in self.trapezius.windows(2) {
            d = union(d, capsule(p, pair[0], pair[1]), 2.6);
        }
        let d = union(d, union(larynx, throat, 1.2), 2.0);
        self.sternomastoid.join(d, p, 1.8)
    }

    /// Shoulders and chest.
    pub(super) fn shoulders(&self, p: DVec3) -> f64 {
        let chest = ellipsoid(p, DVec3::new(0.0, -29.5, -1.0), DVec3::new(18.0, 10.6, 8.4));
        let deltoid = ellipsoid(p, DVec3::new(17.0, -24.2, -2.8), DVec3::new(4.6, 5.4, 4.8));
        let back = ellipsoid(p, DVec3::new(4.5, -25.0, -6.5), DVec3::new(9.0, 8.0, 4.6));
        let mut d = union(chest, deltoid, 4.0);
        d = union(d, back, 3.5);
        self.clavicle.join(d, p, 2.6)
    }

    /// What is kept of the body: the inside of an upright oval cylinder above a floor.
    pub(super) fn pedestal(p: DVec3) -> f64 {
        let (a, b) = (18.5, 12.5);
        let wall = ((p.x / a).hypot((p.z + 1.5) / b) - 1.0) * b;
        -union(-wall, p.y + FLOOR, 1.0)
    }
}
