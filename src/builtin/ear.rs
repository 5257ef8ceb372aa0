//! The left ear, in a frame of its own: x from front to back, y up, z outward from the head.

use glam::{DMat3, DVec3};

use super::sdf::{Curve, carve, ellipsoid, knot, union};

/// Where the ear sits: its frame's origin, at the mouth of the ear canal. Centimetres.
const ORIGIN: DVec3 = DVec3::new(7.05, -1.75, -0.35);
/// How far the ear's top leans back, and how far its back edge stands off the head. Degrees.
const LEAN: f64 = 11.0;
const FLARE: f64 = 27.0;

/// The ear's parts.
pub(super) struct Ear {
    to_local: DMat3,
    helix: Curve,
    antihelix: Curve,
    crus: Curve,
}

impl Ear {
    pub(super) fn new() -> Self {
        let (lean, flare) = (LEAN.to_radians(), FLARE.to_radians());
        // Columns: the local axes in the head's frame, before the lean about the outward axis.
        let back = DVec3::new(flare.sin(), 0.0, -flare.cos());
        let out = DVec3::new(flare.cos(), 0.0, flare.sin());
        let up = DVec3::Y * lean.cos() + back * lean.sin();
        let back = back * lean.cos() - DVec3::Y * lean.sin();
        Self {
            to_local: DMat3::from_cols(back, up, out).transpose(),
            // From its root in the concha, round the top and down the back edge into the lobe.
            helix: Curve::new(&[
                knot(0.70, 0.05, -0.45, 0.20),
                knot(0.10, 0.30, -0.02, 0.26),
                knot(-0.30, 0.95, 0.20, 0.25),
                knot(-0.15, 1.95, 0.30, 0.27),
                knot(0.45, 2.85, 0.38, 0.29),
                knot(1.35, 3.15, 0.45, 0.30),
                knot(2.20, 2.75, 0.50, 0.29),
                knot(2.62, 1.85, 0.50, 0.27),
                knot(2.58, 0.75, 0.44, 0.25),
                knot(2.22, -0.30, 0.36, 0.24),
                knot(1.70, -1.20, 0.26, 0.26),
                knot(1.15, -1.95, 0.16, 0.34),
            ]),
            // From the fork under the helix, down around the bowl to the antitragus.
            antihelix: Curve::new(&[
                knot(0.45, 2.05, 0.10, 0.20),
                knot(1.15, 1.75, 0.26, 0.26),
                knot(1.66, 1.15, 0.36, 0.27),
                knot(1.72, 0.30, 0.36, 0.25),
                knot(1.45, -0.48, 0.32, 0.24),
                knot(0.85, -0.95, 0.30, 0.26),
                knot(0.52, -0.98, 0.26, 0.20),
            ]),
            crus: Curve::new(&[
                knot(1.50, 2.62, 0.26, 0.16),
                knot(1.62, 2.05, 0.30, 0.22),
                knot(1.66, 1.15, 0.34, 0.25),
            ]),
        }
    }

    /// Ear coordinates of a point of the head's (left) half.
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        self.to_local * (p - ORIGIN)
    }

    /// How much a direction of the head's (left) half points out of the ear's bowl.
    pub(super) fn outward(&self, direction: DVec3) -> f64 {
        (self.to_local * direction).z
    }

    /// A distance that is never more than that to the ear.
    pub(super) fn bound(&self, p: DVec3) -> f64 {
        (self.local(p) - DVec3::new(1.1, 0.6, 0.1)).length() - 3.6
    }

    /// The ear, joined to the head whose distance is `head`.
    pub(super) fn join(&self, head: f64, p: DVec3) -> f64 {
        let bound = self.bound(p);
        if bound > head + 1.0 && bound > 1.0 {
            return head;
        }
        let q = self.local(p);
        // The plate: an egg, thin, dished, standing on the head by a wedge under the concha.
        let wider = 1.0 + 0.10 * (q.y - 0.6);
        let dish = 0.28 * ((q.x - 1.15) / 1.4).powi(2) + 0.06 * ((q.y - 0.6) / 2.0).powi(2);
        let flat = DVec3::new((q.x - 1.15) / wider.max(0.6) + 1.15, q.y, q.z - dish);
        let plate = ellipsoid(flat, DVec3::new(1.12, 0.55, -0.06), DVec3::new(1.52, 2.72, 0.34));
        let root = ellipsoid(q, DVec3::new(0.75, 0.25, -0.75), DVec3::new(0.95, 1.9, 0.85));
        let mut d = union(plate, root, 0.5);
        d = union(d, ellipsoid(q, DVec3::new(0.72, -2.18, 0.06), DVec3::new(0.68, 0.72, 0.30)), 0.45);
        // The bowl, the groove between the two rims, and the hollow of the fork.
        d = carve(d, ellipsoid(q, DVec3::new(0.78, 0.05, 0.42), DVec3::new(0.78, 1.00, 0.85)), 0.25);
        d = carve(d, ellipsoid(q, DVec3::new(0.95, 1.95, 0.66), DVec3::new(0.95, 0.75, 0.46)), 0.2);
        d = union(d, self.antihelix.tube(q), 0.28);
        d = union(d, self.crus.tube(q), 0.25);
        d = union(d, self.helix.tube(q), 0.2);
        // The flap in front of the canal.
        d = union(d, ellipsoid(q, DVec3::new(-0.12, -0.18, 0.12), DVec3::new(0.34, 0.52, 0.42)), 0.3);
        union(head, d, 0.45)
    }
}
