//! Five expressions, as smooth displacement fields of limited reach. Centimetres.

use glam::{DMat3, DVec3};

use super::face::Face;
use super::head::{Head, METRES};
use super::noise::{bell, smoothstep};

/// An expression's name and its field: the displacement at anatomical coordinates.
pub(super) struct Expression {
    pub(super) name: &'static str,
    field: fn(DVec3) -> DVec3,
}

/// Every expression, in the order of the file.
pub(super) const EXPRESSIONS: [Expression; 5] = [
    Expression { name: "smile", field: smile },
    Expression { name: "mouth_open", field: mouth_open },
    Expression { name: "brows_up", field: brows_up },
    Expression { name: "pucker", field: pucker },
    Expression { name: "frown", field: frown },
];

/// Displacements shorter than this (metres) are left out: a hundredth of a millimetre.
const LEAST: f64 = 1e-5;

impl Expression {
    /// What the expression adds to a position and its normal, metres; `None` where it does nothing.
    pub(super) fn deltas(&self, position: DVec3, normal: DVec3) -> Option<(DVec3, DVec3)> {
        let field = |metres: DVec3| (self.field)(Head::anatomical(metres)) * METRES;
        let moved = field(position);
        if moved.length() < LEAST {
            return None;
        }
        // Normals go with the inverse transpose of the deformation's Jacobian.
        let h = 1e-4;
        let slope = |axis: DVec3| (field(position + axis * h) - field(position - axis * h)) / (2.0 * h);
        let jacobian = DMat3::IDENTITY + DMat3::from_cols(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        let turned = (jacobian.inverse().transpose() * normal).normalize_or(normal);
        let turned = if turned.is_finite() { turned } else { normal };
        Some((moved, turned - normal))
    }
}

/// A bump of `push` around `centre` and, mirrored, on the other side.
fn both(p: DVec3, centre: DVec3, radii: DVec3, push: DVec3) -> DVec3 {
    let mirror = DVec3::new(-1.0, 1.0, 1.0);
    let bump = |side: DVec3| {
        let q = (p - centre * side) / radii;
        push * side * reach(q.length())
    };
    bump(DVec3::ONE) + bump(mirror)
}

/// A bell that ends: 1 at 0, 0 with level slope from 2.2 on.
fn reach(x: f64) -> f64 {
    bell(x, 0.85) * (1.0 - smoothstep(1.2, 2.2, x))
}

fn smile(p: DVec3) -> DVec3 {
    both(p, DVec3::new(2.5, -6.9, 8.6), DVec3::new(1.5, 1.4, 2.0), DVec3::new(0.55, 0.55, -0.35))
        + both(p, DVec3::new(3.9, -3.7, 7.4), DVec3::new(1.7, 1.5, 2.0), DVec3::new(0.15, 0.32, 0.22))
        + both(p, DVec3::new(3.2, -1.2, 8.3), DVec3::new(1.3, 0.6, 1.5), DVec3::new(0.0, 0.12, 0.05))
}

fn mouth_open(p: DVec3) -> DVec3 {
    let hinge = DVec3::new(0.0, -2.2, 0.6);
    let (line, depth) = Face::lip_line(p.x);
    // Sharp between the lips, soft in the cheeks.
    let soft = 0.10 + 0.9 * smoothstep(1.9, 4.5, p.x.abs()) * 2.2 + 0.8 * smoothstep(1.0, 4.0, depth - p.z);
    let below = smoothstep(soft, -soft, p.y - line + 0.4 * (soft - 0.1));
    let jaw =
        smoothstep(0.5, 5.0, p.z) * smoothstep(-15.5, -11.0, p.y) * (1.0 - smoothstep(5.0, 7.0, p.x.abs()));
    let turned = DMat3::from_rotation_x(5.5_f64.to_radians()) * (p - hinge) + hinge;
    let lips = bell(p.y - line, 0.16)
        * (1.0 - smoothstep(1.6, 2.6, p.x.abs()))
        * smoothstep(-1.2, -0.2, p.z - depth);
    (turned - p) * (below * jaw) - DVec3::Z * (0.8 * lips)
}

fn brows_up(p: DVec3) -> DVec3 {
    both(p, DVec3::new(2.9, 2.3, 8.4), DVec3::new(1.8, 1.3, 2.5), DVec3::new(0.0, 0.55, -0.04))
        + both(p, DVec3::new(1.6, 4.4, 8.8), DVec3::new(2.2, 1.6, 2.5), DVec3::new(0.0, 0.25, 0.02))
        + both(p, DVec3::new(3.2, 0.9, 8.4), DVec3::new(1.3, 0.6, 1.5), DVec3::new(0.0, 0.14, 0.0))
}

fn pucker(p: DVec3) -> DVec3 {
    let (line, depth) = Face::lip_line(p.x);
    let near = reach(DVec3::new(p.x / 2.4, (p.y - line) / 1.5, (p.z - depth) / 2.2).length());
    DVec3::new(-0.36 * p.x, -0.10 * (p.y - line), 0.55) * near
}

fn frown(p: DVec3) -> DVec3 {
    both(p, DVec3::new(1.5, 2.0, 9.0), DVec3::new(1.4, 1.1, 2.0), DVec3::new(-0.32, -0.36, 0.10))
        + both(p, DVec3::new(3.4, 2.2, 8.3), DVec3::new(1.4, 1.0, 2.0), DVec3::new(-0.12, -0.18, 0.04))
        + both(p, DVec3::new(2.5, -7.1, 8.6), DVec3::new(1.2, 1.2, 2.0), DVec3::new(0.05, -0.42, -0.05))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_move_their_own_part_and_nothing_far_away() {
        let crown = DVec3::new(0.0, 0.11, 0.0);
        let shoulder = DVec3::new(0.15, -0.21, 0.0);
        for expression in &EXPRESSIONS {
            for far in [crown, shoulder] {
                assert!(expression.deltas(far, DVec3::Y).is_none(), "{}", expression.name);
            }
        }
        let of = |name: &str, at: DVec3| {
            let expression = EXPRESSIONS.iter().find(|e| e.name == name).unwrap();
            expression.deltas(at * METRES, DVec3::Z).map_or(DVec3::ZERO, |deltas| deltas.0)
        };
        let corner = DVec3::new(2.5, -6.9, 8.8);
        assert!(of("smile", corner).y > 0.003 && of("frown", corner).y < -0.003);
        assert!(of("smile", corner).x > 0.0 && of("smile", corner * DVec3::new(-1.0, 1.0, 1.0)).x < 0.0);
        assert!(of("mouth_open", DVec3::new(0.0, -10.0, 9.8)).y < -0.004);
        assert!(of("mouth_open", DVec3::new(0.0, -4.0, 11.5)).length() < 1e-4);
        assert!(of("brows_up", DVec3::new(2.9, 2.3, 8.8)).y > 0.004);
        assert!(of("pucker", DVec3::new(0.0, -6.9, 10.4)).z > 0.004);
    }
}
