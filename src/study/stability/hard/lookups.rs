//! Lookups on the edges and corners of cubes, and of the brightest light beside darkness.

use super::{FLAT, HardCase, Holds, case, only, with};
use crate::model::cube::face_direction;
use crate::model::effects::Effect;
use crate::model::params::Param;
use crate::stability::case::FragmentInputs;
use crate::stability::lights::LightKind;

pub(super) fn lookups() -> Vec<HardCase> {
    let towards = |normal: [f64; 3]| FragmentInputs { normal, ..FLAT };
    let mut all = Vec::new();
    for light in LightKind::OWN {
        for (name, hard, directions) in [
            ("edge of a cube", "two faces meet: the seamless blend, equal from both sides", edges()),
            ("corner of a cube", "three faces meet: the seamless blend, equal from each side", corners()),
            ("along an axis", "the minor axes are 0, of either sign", axes()),
        ] {
            let setting = with(|s| {
                s.lights = light;
                s.params.set(Param::EnvironmentRotation, 0.0);
            });
            all.push(case(name, hard, setting, directions.into_iter().flatten().map(towards).collect(), &[]));
        }
        // Seen by the diffuse term alone, so that both sides must show the same light.
        let mut setting = only(&[Effect::Diffuse, Effect::NormalMap]);
        setting.lights = light;
        setting.params.set(Param::EnvironmentRotation, 0.0);
        let around = edges().into_iter().chain(corners()).flatten();
        let name = "both sides of an edge";
        let hard = "a step of one last place across an edge or a corner shows no seam";
        all.push(case(name, hard, setting, around.map(towards).collect(), &[Holds::Alike(3)]));
    }
    // Between texel (1, 1) of face +Z, which is dark, and its bright right neighbour: the border lies at s = 0.
    let mut halfway = only(&[Effect::Diffuse, Effect::NormalMap]);
    halfway.lights = LightKind::Glaring;
    halfway.params.set(Param::EnvironmentRotation, 0.0);
    let white = |normal| FragmentInputs { albedo: [1.0; 3], ..towards(normal) };
    let half = [32752.0, 32752.0, 32752.0, 0.0];
    all.push(case(
        "65504 beside 0",
        "the largest half float beside darkness: the exact blend in f32",
        halfway,
        vec![white([0.0, 0.25, 1.0]), white([0.0, -0.25, 1.0]), white([0.25, 0.0, 1.0])],
        &[Holds::Value(half)],
    ));
    all
}

/// A direction on an edge or corner, and its neighbours in f32 on either side.
fn around(d: [f64; 3]) -> [[f64; 3]; 3] {
    // Towards the first axis of the two (or three) that are as long.
    let nudged = |steps: i32| {
        let mut moved = d;
        let bits = (d[0].abs() as f32).to_bits() as i32 + steps;
        moved[0] = f64::from(f32::from_bits(bits as u32)).copysign(d[0]);
        moved
    };
    [d, nudged(1), nudged(-1)]
}

fn edges() -> Vec<[[f64; 3]; 3]> {
    let mut all = Vec::new();
    for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        all.push(around([a, b, 0.375]));
        all.push(around([a, 0.375, b]));
        // Here the first axis is not among the two: the neighbours lie along the edge.
        all.push(around([0.375, a, b]));
    }
    all
}

fn corners() -> Vec<[[f64; 3]; 3]> {
    let signs = [1.0, -1.0];
    let all = signs.into_iter().flat_map(|a| signs.map(|b| signs.map(|c| around([a, b, c]))));
    all.flatten().collect()
}

fn axes() -> Vec<[[f64; 3]; 3]> {
    (0..6)
        .map(|face| {
            let d = face_direction(face, 0.0, 0.0);
            [d.map(|x| x + 0.0), d.map(|x| if x == 0.0 { -0.0 } else { x }), d.map(|x| x * 1e-20)]
        })
        .collect()
}
