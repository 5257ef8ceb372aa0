//! The whole head as one signed distance: skull, jaw and cheeks here; features in their own files.
//!
//! Anatomical coordinates are centimetres with the eyes at y = 0 and the ear canals at z = 0; the
//! measures follow the means of adult heads (Farkas, *Anthropometry of the Head and Face*, 1994):
//! 23 cm from chin to crown, 15 wide, 19.5 long, pupils 6.4 apart.

use glam::DVec3;

use super::bust::Bust;
use super::ear::Ear;
use super::face::Face;
use super::sdf::{Curve, carve, ellipsoid, knot, smooth_abs, union};

/// Metres in a unit of the anatomical coordinates.
pub(super) const METRES: f64 = 0.01;

/// The head's parts, their curves prepared.
pub(super) struct Head {
    pub(super) face: Face,
    pub(super) ear: Ear,
    bust: Bust,
    jaw: Curve,
    arch: Curve,
}

impl Head {
    pub(super) fn new() -> Self {
        Self {
            face: Face::new(),
            ear: Ear::new(),
            bust: Bust::new(),
            jaw: Curve::new(&[
                knot(5.2, -2.2, 0.6, 0.8),
                knot(4.75, -5.5, 0.8, 0.9),
                knot(4.1, -7.8, 2.0, 1.0),
                knot(2.9, -9.4, 4.9, 1.05),
                knot(1.5, -10.1, 7.2, 1.05),
                knot(0.0, -10.2, 8.0, 1.05),
            ]),
            arch: Curve::new(&[
                knot(4.1, -2.2, 6.6, 0.9),
                knot(5.0, -1.9, 5.0, 0.75),
                knot(5.65, -1.5, 2.9, 0.5),
                knot(5.95, -1.4, 0.6, 0.4),
            ]),
        }
    }

    /// Anatomical coordinates of a point in metres: centimetres, a little asymmetry undone (no face
    /// is its own mirror image: the nose leans, one brow and one corner of the mouth sit higher).
    pub(super) fn anatomical(metres: DVec3) -> DVec3 {
        let p = metres / METRES;
        let low = (-((p.y + 5.0) / 6.0).powi(2)).exp();
        let front = 1.0 / (1.0 + (-(p.z - 5.0) / 1.5).exp());
        DVec3::new(
            p.x - 0.10 * low * front - 0.03,
            p.y + 0.018 * p.x * front + 0.02 * (p.x * 0.9).sin() * front,
            p.z + 0.012 * p.x,
        )
    }

    /// Signed distance in metres at a point in metres.
    pub(super) fn distance(&self, metres: DVec3) -> f64 {
        self.anatomical_distance(Self::anatomical(metres)) * METRES
    }

    /// Signed distance at anatomical coordinates.
    pub(super) fn anatomical_distance(&self, full: DVec3) -> f64 {
        let p = DVec3::new(smooth_abs(full.x, 0.12), full.y, full.z);
        self.ear.join(self.without_ears(p), p)
    }

    /// The left half without its ear.
    pub(super) fn without_ears(&self, p: DVec3) -> f64 {
        let mut d = self.skull(p);
        d = self.face.orbits(d, p);
        if p.y < 4.0 {
            d = self.jaw_and_cheeks(d, p);
        }
        if p.y < 3.0 {
            d = union(d, self.bust.neck(p), 1.8);
        }
        if p.y < -9.0 {
            d = union(d, self.bust.shoulders(p), 2.2);
            d = carve(d, -Bust::pedestal(p), 1.2);
        }
        // Each part is left out where it cannot reach.
        d = self.face.mouth(d, p);
        d = self.face.nose(d, p);
        self.face.lids(d, p)
    }

    fn skull(&self, p: DVec3) -> f64 {
        let vault = ellipsoid(p, DVec3::new(0.0, 3.3, -1.2), DVec3::new(7.5, 7.9, 8.7));
        let forehead = ellipsoid(p, DVec3::new(0.0, 3.3, 1.9), DVec3::new(6.3, 6.2, 7.3));
        let base = ellipsoid(p, DVec3::new(0.0, -1.2, -2.8), DVec3::new(6.3, 5.2, 6.0));
        union(union(vault, forehead, 2.5), base, 2.5)
    }

    fn jaw_and_cheeks(&self, mut d: f64, p: DVec3) -> f64 {
        let midface = ellipsoid(p, DVec3::new(0.0, -3.2, 3.4), DVec3::new(5.7, 6.0, 5.5));
        let lower = ellipsoid(p, DVec3::new(0.0, -7.2, 4.3), DVec3::new(4.5, 3.8, 4.6));
        d = union(d, union(midface, lower, 2.0), 1.6);
        d = self.jaw.join(d, p, 2.6);
        d = self.arch.join(d, p, 2.4);
        let masseter = ellipsoid(p, DVec3::new(3.7, -5.0, 2.7), DVec3::new(1.5, 3.6, 2.8));
        d = union(d, masseter, 2.2);
        let cheek = ellipsoid(p, DVec3::new(3.4, -3.0, 6.3), DVec3::new(1.8, 1.8, 1.7));
        d = union(d, cheek, 2.4);
        let chin = ellipsoid(p, DVec3::new(0.0, -10.15, 8.55), DVec3::new(1.75, 1.25, 1.30));
        union(d, chin, 1.3)
    }
}
