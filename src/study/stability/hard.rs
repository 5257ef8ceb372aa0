//! The hard cases of MODEL 7, a declaration each: what is hard, the numbers, and what must hold.

use super::case::{Batch, FragmentInputs, Setting, VertexInputs};
use super::lights::LightKind;
use crate::model::cube::face_direction;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::params::Param;

/// What must hold beyond finite numbers that agree with f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Holds {
    /// Each fragment's colour is this.
    Value([f64; 4]),
    /// Each fragment's colour is 0 to the bit.
    Zero,
    /// No colour depends on this parameter: the derivative is 0 to the bit.
    Flat(Param),
    /// Of each so many fragments, all have the first one's colour.
    Alike(usize),
}

/// A named case of fragments.
pub struct HardCase {
    /// Its name in tables.
    pub name: &'static str,
    /// What is hard about it.
    pub hard: &'static str,
    /// The fragments.
    pub batch: Batch,
    /// What must hold.
    pub holds: Vec<Holds>,
}

/// A named case of a vertex.
pub struct HardFrame {
    /// Its name in tables.
    pub name: &'static str,
    /// The vertex.
    pub vertex: VertexInputs,
}

const ORDINARY: FragmentInputs = FragmentInputs::ORDINARY;
/// The normal map says nothing: n is the smooth normal.
const FLAT: FragmentInputs = FragmentInputs { texel: [0.5, 0.5, 1.0], ..ORDINARY };

/// Looked at from the front, so that -V is (0, 0, 1).
const FACING: FragmentInputs = FragmentInputs { view: [0.0, 0.0, -1.0], ..FLAT };

fn with(change: impl FnOnce(&mut Setting)) -> Setting {
    let mut setting = Setting::ordinary();
    change(&mut setting);
    setting
}

fn only(effects: &[Effect]) -> Setting {
    with(|s| s.setup.effects = Effects::of(effects))
}

fn case(
    name: &'static str,
    hard: &'static str,
    setting: Setting,
    fragments: Vec<FragmentInputs>,
    holds: &[Holds],
) -> HardCase {
    HardCase { name, hard, batch: Batch { setting, fragments }, holds: holds.to_vec() }
}

/// Exponents from bound to bound.
const EXPONENTS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 16.0];

/// Every case of fragments.
#[must_use]
pub fn cases() -> Vec<HardCase> {
    let mut all = rims();
    all.extend(normals());
    all.extend(lookups());
    all.extend(bounds());
    all
}

fn rims() -> Vec<HardCase> {
    let rim = |silhouette: f64| vec![FragmentInputs { silhouette, ..ORDINARY }];
    let at = |exponent: f64| {
        let mut setting = only(&[Effect::Hilite, Effect::Diffuse, Effect::Rim]);
        setting.params.set(Param::RimExponent, exponent);
        setting
    };
    // Without a base nothing but the rim is left.
    let bare = |exponent: f64| {
        let mut setting = at(exponent);
        setting.params.set(Param::BaseWeight, 0.0);
        setting
    };
    let mut all = Vec::new();
    for exponent in EXPONENTS {
        all.push(case(
            "facing",
            "S.z = 0 has no logarithm: rim = 0, and no derivative by the exponent",
            bare(exponent),
            [0.0, -0.0].into_iter().flat_map(rim).collect(),
            &[Holds::Zero, Holds::Flat(Param::RimExponent)],
        ));
        all.push(case(
            "grazing",
            "S.z = 1: rim = 1 for any exponent, and no derivative by it",
            at(exponent),
            rim(1.0),
            &[Holds::Flat(Param::RimExponent)],
        ));
        all.push(case(
            "nearly facing",
            "S.z down to where f32 ends: its power under- and its slope overflows",
            with(|s| {
                s.params.set(Param::RimExponent, exponent);
                s.setup.silhouette = Silhouette::Bumped;
            }),
            [1e-3, 1e-6, 1e-7, 1e-10].map(nearly_facing).to_vec(),
            &[],
        ));
        all.push(case(
            "vanishing S.z",
            "numbers around the smallest normal f32",
            at(exponent),
            [1e-30, 1.2e-38, 1.1e-38, 1e-40, 1e-45].into_iter().flat_map(rim).collect(),
            &[],
        ));
    }
    all.push(case(
        "seen edge-on",
        "|N.V| has a corner at 0: the derivative there is 0",
        with(|s| {
            s.setup.silhouette = Silhouette::Bumped;
            s.setup.effects = Effects::of(&[Effect::Hilite, Effect::NormalMap]);
        }),
        vec![FragmentInputs { texel: [0.75, 0.5, 1.0], view: [0.0, 1.0, 0.0], ..ORDINARY }],
        &[Holds::Flat(Param::NormalStrength)],
    ));
    all
}

/// V is `angle` off -N.
fn nearly_facing(angle: f64) -> FragmentInputs {
    let view = [f64::from(angle.sin() as f32), 0.0, f64::from(-angle.cos() as f32)];
    FragmentInputs { view, ..ORDINARY }
}

fn normals() -> Vec<HardCase> {
    let texel = |texel: [f64; 3]| FragmentInputs { texel, ..FLAT };
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    // N of no length, and the same seen with -V in its place.
    let bare = FragmentInputs { tangent: [0.0; 3], bitangent: [0.0; 3], normal: [0.0; 3], ..FACING };
    let strengths = [0.0, 1.0, 4.0];
    let mut all = Vec::new();
    for strength in strengths {
        let setting = || with(|s| s.params.set(Param::NormalStrength, strength));
        all.push(case(
            "texel that decodes to nothing",
            "(1/2, 1/2, 1/2) is no direction: the smooth normal, and nothing of the map",
            setting(),
            vec![FLAT, texel([0.5; 3])],
            &[Holds::Alike(2), Holds::Flat(Param::NormalStrength)],
        ));
        all.push(case(
            "texel that is not finite",
            "NaN or infinity in a normal map that no reader refused: the smooth normal",
            setting(),
            vec![
                FLAT,
                texel([nan, 0.5, 1.0]),
                texel([0.5, 0.5, nan]),
                texel([0.5, inf, 1.0]),
                texel([nan, nan, nan]),
                texel([-inf, inf, nan]),
            ],
            &[Holds::Alike(6), Holds::Flat(Param::NormalStrength)],
        ));
        all.push(case(
            "no tangent frame",
            "N, T and B of no length: -V stands in",
            setting(),
            vec![FACING, bare, FragmentInputs { normal: [-0.0; 3], texel: [0.75, 0.25, 0.75], ..bare }],
            &[Holds::Alike(3)],
        ));
        all.push(case(
            "nearly no tangent frame",
            "vectors so short that their squares vanish",
            setting(),
            [1e-12, 1e-19, 1e-25, 1e-36, 2e-37, 5e-38, 1e-42]
                .map(|length| FragmentInputs {
                    tangent: [length, 0.0, 0.0],
                    bitangent: [0.0, length, 0.0],
                    normal: [0.0, 0.0, length],
                    ..ORDINARY
                })
                .to_vec(),
            &[],
        ));
    }
    all.push(case(
        "normal that cancels",
        "base and bump of opposite directions leave nothing: the smooth normal",
        with(|_| {}),
        vec![
            FragmentInputs { texel: [0.5, 0.5, 1.0], ..FLAT },
            FragmentInputs { texel: [1.0, 0.5, 1.0], tangent: [0.0, 0.0, -1.0], ..FLAT },
        ],
        &[Holds::Alike(2), Holds::Flat(Param::NormalStrength)],
    ));
    all.push(case(
        "normal that all but cancels",
        "what is left is rounding, and turns wildly with the map's strength",
        with(|s| s.setup.silhouette = Silhouette::Bumped),
        vec![
            FragmentInputs { texel: [1.0, 0.5, 1.0], tangent: [1e-7, 0.0, -1.0], ..ORDINARY },
            FragmentInputs { texel: [1.0, 0.5, 1.0], tangent: [1e-4, 1e-5, -1.0], ..ORDINARY },
            FragmentInputs { texel: [1.0, 1.0, 0.500_000_06], ..ORDINARY },
        ],
        &[],
    ));
    all.push(case(
        "eye on the surface",
        "V of no length: straight ahead, -Z",
        with(|_| {}),
        vec![
            FACING,
            FragmentInputs { view: [0.0; 3], ..FACING },
            FragmentInputs { view: [-0.0; 3], ..FACING },
        ],
        &[Holds::Alike(3)],
    ));
    for silhouette in Silhouette::ALL {
        all.push(case(
            "the listing as printed",
            "normals and views are used as they are interpolated: of any length, or of none",
            with(|s| {
                s.setup.form = Form::Listing;
                s.setup.silhouette = silhouette;
            }),
            vec![
                ORDINARY,
                texel([0.0; 3]),
                texel([1.0; 3]),
                texel([nan, 0.5, 1.0]),
                bare,
                FragmentInputs { view: [0.0; 3], ..ORDINARY },
                FragmentInputs { normal: [0.0, 0.0, 1e-30], ..ORDINARY },
            ],
            &[],
        ));
    }
    all
}

fn lookups() -> Vec<HardCase> {
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

fn bounds() -> Vec<HardCase> {
    let closed = FragmentInputs { occlusion: 0.0, silhouette: 0.75, ..ORDINARY };
    let mut all = vec![
        case(
            "nothing open",
            "o = 0 at full occlusion: diffuse light, rim and hilite are 0 to the bit",
            only(&[Effect::Diffuse, Effect::NormalMap, Effect::Rim, Effect::Occlusion, Effect::Hilite]),
            vec![closed],
            &[Holds::Zero],
        ),
        case(
            "nothing open under a key light",
            "the key light goes by its own formula",
            only(&[Effect::Diffuse, Effect::NormalMap, Effect::Occlusion, Effect::Hilite, Effect::KeyLight]),
            vec![closed, FragmentInputs { occlusion: -0.0, ..closed }],
            &[],
        ),
    ];
    for param in Param::all() {
        let info = param.info();
        let bounds = [(info.lower, -1e3), (info.upper, 1e3)];
        for value in bounds.map(|(bound, far)| if bound.is_finite() { bound } else { far }) {
            for silhouette in [Silhouette::Fragment, Silhouette::Bumped] {
                all.push(case(
                    "parameter at a bound",
                    "each parameter at either bound (or far out, where there is none)",
                    with(|s| {
                        s.params.set(param, value);
                        s.setup.silhouette = silhouette;
                    }),
                    vec![ORDINARY, FACING, closed, FragmentInputs { silhouette: 0.0, ..ORDINARY }],
                    &[],
                ));
            }
        }
    }
    all
}

/// Every case of vertices: N, T or both without a direction, parallel, or not finite.
#[must_use]
pub fn frames() -> Vec<HardFrame> {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let (x, z) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let frame = |name, normal, tangent| {
        [1.0, -1.0].map(|handedness| HardFrame { name, vertex: VertexInputs { normal, tangent, handedness } })
    };
    [
        frame("vertex without N and T", [0.0; 3], [0.0; 3]),
        frame("vertex without N", [0.0; 3], x),
        frame("vertex without T", z, [0.0; 3]),
        frame("vertex without T", [0.0, 0.0, -1.0], [0.0; 3]),
        frame("vertex whose T is N", z, z),
        frame("vertex whose T is N", x, [-1.0, 0.0, 0.0]),
        frame("vertex whose T is all but N", z, [1e-20, 0.0, -3.0]),
        frame("vertex of tiny vectors", [0.0, 1e-30, 1e-30], [1e-36, 0.0, 0.0]),
        frame("vertex of denormals", [0.0, 0.0, 1e-40], [1e-42, 0.0, 0.0]),
        frame("vertex of huge vectors", [0.0, 1e30, 1e30], [1e37, 0.0, 0.0]),
        frame("vertex that is not finite", [nan, 0.0, 0.0], [inf, 0.0, 0.0]),
    ]
    .into_iter()
    .flatten()
    .collect()
}
