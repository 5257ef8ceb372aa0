//! Lights, their mirror images and the sky where they are hard: directions that graze or are none, lobes and reflectances
//! at their bounds, darkness.

use crate::model::transmission::FARTHEST;
use crate::stability::case::FragmentInputs;

/// A named case of lights.
pub struct HardLight {
    /// Its name in tables; several may have one.
    pub name: &'static str,
    /// What is hard about it.
    pub hard: &'static str,
    /// What is shaded.
    pub(in crate::stability) places: Vec<Place>,
    /// Parameters that are not at their defaults, by their identifiers.
    pub(in crate::stability) params: Vec<(&'static str, f64)>,
    /// What the environment is.
    pub(in crate::stability) sky: Sky,
}

/// What is around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::stability) enum Sky {
    /// Smooth waves around 1.
    Wavy,
    /// 1 everywhere.
    Constant,
    /// 0 everywhere.
    Dark,
    /// Texels of 65504 beside texels of 0.
    Glaring,
}

/// A point of the surface, and what samples hold of lights and sky there.
#[derive(Clone, Copy, Debug)]
pub(in crate::stability) struct Place {
    pub(in crate::stability) surface: FragmentInputs,
    /// Towards each lamp: a unit vector, or none.
    toward: [f64; 3],
    /// Irradiance of each lamp, square to its direction.
    arriving: f32,
    /// The share of lamps, sky and lobe that is seen; whatever else samples hold is the same number.
    seen: f32,
    /// The length of the bent normal.
    agreement: f32,
    /// How far light has come inside, in millimetres.
    depth: f32,
}

impl Place {
    /// What samples hold of a field, by its name.
    pub(in crate::stability) fn field(&self, name: &str) -> [f32; 3] {
        let ends = |ends: &[&str]| ends.iter().any(|end| name.ends_with(end));
        match name {
            "bent_normal" => self.surface.normal.map(|x| self.agreement * x as f32),
            "lobe_nodes" => [0.2, 0.4, 0.8],
            "thickness" => [self.depth; 3],
            _ if ends(&["_toward"]) => self.toward.map(|x| x as f32),
            _ if ends(&["_arriving"]) => [self.arriving; 3],
            _ if ends(&["_depth"]) => [self.depth; 3],
            _ => [self.seen; 3],
        }
    }
}

/// A smooth point seen at an angle under light from aside.
const LIT: Place = Place {
    surface: FragmentInputs { texel: [0.5, 0.5, 1.0], ..FragmentInputs::ORDINARY },
    toward: [0.6, 0.0, 0.8],
    arriving: 2.0,
    seen: 0.5,
    agreement: 0.75,
    depth: 1.0,
};

fn toward(toward: [f64; 3]) -> Place {
    Place { toward, ..LIT }
}

fn seen_along(view: [f64; 3], toward: [f64; 3]) -> Place {
    Place { surface: FragmentInputs { view, ..LIT.surface }, toward, ..LIT }
}

fn case(name: &'static str, hard: &'static str, places: &[Place]) -> HardLight {
    HardLight { name, hard, places: places.to_vec(), params: Vec::new(), sky: Sky::Wavy }
}

/// Every case of lights.
#[must_use]
pub fn lights() -> Vec<HardLight> {
    let (level, under) = ([1.0, 0.0, 0.0], [1.0, 0.0, -1e-7]);
    let above = [[1.0, 0.0, 1e-7], [1.0, 0.0, 1e-30], [1.0, 0.0, 1e-42]];
    let grazing = above.map(|[x, y, z]| [x, y, -z]);
    let mut all = vec![
        case(
            "light that grazes",
            "N.L is 0, or all but 0 on either side",
            &[level, under, above[0], above[1], above[2]].map(toward),
        ),
        case(
            "view that grazes",
            "N.V is 0, or all but 0: what is divided by it vanishes with it",
            &[level, grazing[0], grazing[1], grazing[2]].map(|view| seen_along(view, LIT.toward)),
        ),
        case(
            "light and view that graze",
            "both vanish",
            &[level, grazing[0], grazing[1], grazing[2]].map(|view| seen_along(view, above[0])),
        ),
        case(
            "light opposite to the eye",
            "H = L + V has no direction",
            &[seen_along([0.6, 0.0, 0.8], [0.6, 0.0, 0.8]), seen_along([1.0, 0.0, 0.0], [1.0, 0.0, 0.0])],
        ),
        case(
            "light at the eye, and where it mirrors",
            "H is the normal, or V: cosines of exactly 1",
            &[
                seen_along([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]),
                seen_along([0.6, 0.0, -0.8], [-0.6, 0.0, 0.8]),
                seen_along([0.6, 0.0, -0.8], [0.6, 0.0, 0.8]),
            ],
        ),
        case("light on the surface", "it comes from no direction", &[toward([0.0; 3])]),
        case(
            "light that brings nothing, or a glare",
            "0, a denormal, 65504",
            &[0.0, 1e-40, 65504.0].map(|arriving| Place { arriving, ..LIT }),
        ),
        case(
            "nothing seen of lights and sky",
            "all is hidden, and what is open has no mean direction",
            &[
                Place { seen: 0.0, agreement: 0.0, ..LIT },
                Place { agreement: 0.0, ..LIT },
                Place { seen: 0.0, ..LIT },
                Place { seen: 1.0, agreement: 1.0, ..LIT },
            ],
        ),
        case(
            "light through nothing, and through what has no end",
            "thickness and depth of 0, and beyond all reach",
            &[0.0, 1e-30, FARTHEST as f32, f32::INFINITY].map(|depth| Place { depth, ..LIT }),
        ),
    ];
    let bounds: [&[(&'static str, [f64; 2])]; 4] = [
        &[("roughness", [0.05, 1.0])],
        &[("gloss", [0.0, 0.9])],
        // Beyond the bounds of fits: a mirror's.
        &[("f0", [0.0, 1.0]), ("f0_floor", [0.0, 1.0])],
        &[("fresnel_loss", [0.0, 1.0])],
    ];
    let places = [
        LIT,
        toward(above[0]),
        seen_along(grazing[0], LIT.toward),
        seen_along([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]),
    ];
    for params in bounds {
        for end in 0..2 {
            let params = params.iter().map(|(name, ends)| (*name, ends[end])).collect();
            let name = "lobes and reflectances at their bounds";
            let hard = "roughness, gloss, f0 and its floor, the diffuse light that is left";
            all.push(HardLight { params, ..case(name, hard, &places) });
        }
    }
    for sky in [Sky::Constant, Sky::Dark, Sky::Glaring] {
        let name = "an environment of one constant, of none, of a glare";
        all.push(HardLight { sky, ..case(name, "1 or 0 everywhere; 65504 beside 0", &places) });
    }
    all
}
