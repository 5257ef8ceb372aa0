//! Normals, texels and views of no length, of hardly any, or not finite.

use super::{FACING, FLAT, HardCase, Holds, ORDINARY, case, with};
use crate::model::effects::{Form, Silhouette};
use crate::model::params::Param;
use crate::stability::case::FragmentInputs;

pub(super) fn normals() -> Vec<HardCase> {
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
    all.push(case(
        "texel of the listing that is no direction",
        "black or not finite: the smooth normal, which (0, 0, 1) is as printed, and nothing of the map",
        with(|s| s.setup.form = Form::Listing),
        vec![texel([0.0, 0.0, 1.0]), texel([0.0; 3]), texel([nan, 0.5, 1.0]), texel([0.5, 0.5, inf])],
        &[Holds::Alike(4), Holds::Flat(Param::NormalStrength)],
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
