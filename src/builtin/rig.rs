//! Bones, their weights, and the nod.

use glam::{DQuat, DVec3};

use super::head::Head;
use super::noise::smoothstep;

/// A bone: its name and where it turns, metres.
pub(super) struct Bone {
    pub(super) name: &'static str,
    pub(super) pivot: DVec3,
}

/// The bones, each the parent of the next.
pub(super) const BONES: [Bone; 3] = [
    Bone { name: "root", pivot: DVec3::new(0.0, -0.215, -0.020) },
    Bone { name: "neck", pivot: DVec3::new(0.0, -0.135, -0.030) },
    Bone { name: "skull", pivot: DVec3::new(0.0, -0.045, -0.012) },
];

/// The bones' weights at a place (metres), summing to 1: joints root, neck, skull and a spare.
pub(super) fn weights(metres: DVec3) -> [f32; 4] {
    let p = Head::anatomical(metres);
    // The jaw hangs on the skull, so the border rises from the chin to the nape.
    let skull = smoothstep(-10.8, -5.8, p.y + 0.5 * p.z.max(-2.0));
    let neck = smoothstep(-20.5, -13.0, p.y + 0.15 * p.z) * (1.0 - skull);
    let (neck, skull) = (neck as f32, skull as f32);
    [(1.0 - neck - skull).max(0.0), neck, skull, 0.0]
}

/// One key of the nod.
pub(super) struct Key {
    /// Seconds.
    pub(super) time: f32,
    /// The rotations of neck and skull.
    pub(super) turns: [DQuat; 2],
    /// The expressions' weights.
    pub(super) expressions: [f32; 5],
}

/// The nod: down with a frown, up with raised brows, and back with a smile.
pub(super) fn nod() -> [Key; 5] {
    let key = |time, neck: f64, skull: f64, expressions| Key {
        time,
        turns: [neck, skull].map(|degrees| DQuat::from_rotation_x(degrees.to_radians())),
        expressions,
    };
    [
        key(0.0, 0.0, 0.0, [0.0; 5]),
        key(0.5, 6.0, 11.0, [0.0, 0.0, 0.0, 0.0, 0.6]),
        key(1.0, 0.0, 0.0, [0.2, 0.3, 0.2, 0.0, 0.0]),
        key(1.5, -4.0, -8.0, [0.6, 0.0, 0.8, 0.0, 0.0]),
        key(2.0, 0.0, 0.0, [0.0; 5]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jaw_hangs_on_the_skull_and_the_shoulders_stay() {
        let chin = weights(DVec3::new(0.0, -0.105, 0.09));
        let shoulder = weights(DVec3::new(0.15, -0.21, -0.03));
        let throat = weights(DVec3::new(0.0, -0.14, 0.04));
        assert!(chin[2] > 0.8, "{chin:?}");
        assert!(shoulder[0] > 0.95, "{shoulder:?}");
        assert!(throat[1] > 0.5, "{throat:?}");
    }
}
