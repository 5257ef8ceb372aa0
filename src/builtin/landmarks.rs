//! Where on the face paint and relief go. Anatomical coordinates: centimetres.

use glam::DVec3;

use super::face::{EYE, Face, MOUTH_HALF_WIDTH};
use super::head::Head;
use super::noise::{bell, smoothstep};
use super::sdf::{Curve, knot};

/// The eyebrow's course on the left side; its radius is half its width.
pub(super) fn eyebrow() -> Curve {
    Curve::new(&[
        knot(0.95, 1.55, 9.3, 0.34),
        knot(1.9, 1.95, 9.2, 0.36),
        knot(3.2, 2.30, 8.9, 0.30),
        knot(4.3, 2.05, 8.1, 0.20),
        knot(5.1, 1.45, 7.2, 0.08),
    ])
}

/// A place on the skin, with what the painters ask about it.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// Anatomical coordinates.
    pub(super) p: DVec3,
    /// The same, mirrored to the left half.
    pub(super) half: DVec3,
    /// How much of the red of the lips, in [0, 1].
    pub(super) lips: f64,
    /// Height above the line between the lips.
    pub(super) above_lip_line: f64,
    /// How much ear, in [0, 1].
    pub(super) ear: f64,
    /// How much of the field where a beard grows.
    pub(super) beard: f64,
    /// How much of the field where the head's hair grows.
    pub(super) scalp: f64,
    /// How near the closed eye.
    pub(super) eye: f64,
}

impl Spot {
    pub(super) fn new(head: &Head, metres: DVec3) -> Self {
        let p = Head::anatomical(metres);
        let half = DVec3::new(p.x.abs(), p.y, p.z);
        let above_lip_line = p.y - Face::lip_line(p.x).0;
        let ear =
            if head.ear.bound(half) < 0.3 { smoothstep(0.05, 0.5, head.without_ears(half)) } else { 0.0 };
        Self {
            p,
            half,
            lips: lips(p, above_lip_line),
            above_lip_line,
            ear,
            beard: beard(half) * (1.0 - ear),
            scalp: scalp(half) * (1.0 - ear),
            eye: bell(half.distance(EYE) - 1.2, 0.45),
        }
    }

    /// A spot close by, at which the soft fields are taken to be the same.
    pub(super) fn beside(&self, metres: DVec3) -> Self {
        let p = Head::anatomical(metres);
        let half = DVec3::new(p.x.abs(), p.y, p.z);
        Self { p, half, ..*self }
    }

    /// A soft ball of influence around a landmark of the left half.
    pub(super) fn near(&self, x: f64, y: f64, z: f64, reach: f64) -> f64 {
        bell(self.half.distance(DVec3::new(x, y, z)), reach)
    }
}

/// The red of the lips: between a bow above and an arc below.
fn lips(p: DVec3, above: f64) -> f64 {
    let t = p.x / (MOUTH_HALF_WIDTH * 1.02);
    if t.abs() >= 1.0 || p.z < 7.5 {
        return 0.0;
    }
    let taper = (1.0 - t * t).sqrt();
    let bow = 0.14 * bell(p.x.abs() - 0.55, 0.32) - 0.06 * bell(p.x, 0.25);
    let upper = (0.66 + bow) * taper.powf(1.3);
    let lower = 0.98 * taper;
    let edge = 0.09;
    let inside = if above > 0.0 { upper - above } else { lower + above };
    smoothstep(-edge, edge, inside) * smoothstep(1.0, 0.9, t.abs())
}

/// Jaw, chin, upper lip and the throat's top.
fn beard(h: DVec3) -> f64 {
    // The border runs from the sideburns down the cheek to the corner of the nose.
    let border = -2.6 - 0.52 * (h.z - 1.0).clamp(0.0, 6.0) + 1.0 * smoothstep(7.6, 9.6, h.z);
    let below = smoothstep(border + 0.7, border - 0.9, h.y);
    let throat = smoothstep(-14.5, -11.5, h.y);
    let front = smoothstep(-0.4, 1.6, h.z);
    below * throat * front
}

/// The hair's field: above the hairline, behind the temples, down to the nape.
fn scalp(h: DVec3) -> f64 {
    let hairline = 6.6 + 0.9 * bell(h.x - 3.6, 1.1) - 0.06 * h.x * h.x;
    let top = smoothstep(-0.5, 0.7, h.y - hairline) * smoothstep(9.5, 8.0, h.z);
    let temple = 2.4 - 0.45 * (h.y - 2.0).clamp(-4.0, 4.0).abs();
    let side = smoothstep(temple, temple - 0.9, h.z) * smoothstep(-7.2, -5.2, h.y + 0.35 * h.z);
    top.max(side)
}
