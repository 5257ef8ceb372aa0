//! A stack of cubes over a BRDF's roughness: the environment as it mirrors it, before Fresnel.

use std::ops::RangeInclusive;

use super::lobes::{LobeStack, knots};
use crate::model::cube::Cube;
use crate::specular::SpecularModel;

/// Cubes of E_r for roughnesses that fall geometrically (MODEL 9); alpha is the luminance.
///
/// Between them runs the curve of [`LobeStack`] in the lobe's sharpness, which as a Phong exponent is inverse to the square
/// of its width: m^-2 for kelemen, m^-4 for ggx.
#[derive(Clone, Debug)]
pub struct ReflectedStack {
    /// The BRDF.
    pub model: SpecularModel,
    /// The cubes; in the place of exponents the sharpness.
    pub stack: LobeStack,
}

/// The power of m that the sharpness is.
const fn power(model: SpecularModel) -> i32 {
    match model {
        SpecularModel::Kelemen => -2,
        SpecularModel::Ggx => -4,
    }
}

/// The roughness of a lobe of that sharpness.
fn roughness(model: SpecularModel, sharpness: f64) -> f64 {
    sharpness.powf(1.0 / f64::from(power(model)))
}

impl ReflectedStack {
    /// The cubes that [`Self::at`] needs anywhere in `range`, `per_octave` for each doubling of the sharpness; `cube` makes
    /// one for a roughness. None is sharper than 2048 (ggx: m = 0.149): its lobe would be narrower than the cells of
    /// what is filtered.
    #[must_use]
    pub fn new(
        model: SpecularModel,
        range: &RangeInclusive<f64>,
        per_octave: u32,
        cube: impl FnMut(f64) -> Cube<f32>,
    ) -> Self {
        let sharpness = |m: &f64| m.clamp(1e-3, 1.0).powi(power(model));
        let exponents = knots(&(sharpness(range.end())..=sharpness(range.start())), per_octave);
        let cubes = exponents.iter().map(|&s| roughness(model, s)).map(cube).collect();
        Self { model, stack: LobeStack { exponents, cubes } }
    }

    /// The roughness of each cube.
    #[must_use]
    pub fn roughnesses(&self) -> Vec<f64> {
        self.stack.exponents.iter().map(|&sharpness| roughness(self.model, sharpness)).collect()
    }

    /// The cube at a roughness and its derivative by it; constant beyond the stack's ends.
    #[must_use]
    pub fn at(&self, m: f64) -> (Cube<f32>, Cube<f32>) {
        let m = m.clamp(1e-3, 1.0);
        let power = power(self.model);
        let (value, slope) = self.stack.at(m.powi(power));
        let rate = f64::from(power) * m.powi(power - 1);
        (value, slope.map(|texel| texel.map(|x| (f64::from(x) * rate) as f32)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::prefilter::{Prefilter, radial_by_brute_force};
    use super::super::radial::Radial;
    use super::*;
    use crate::model::cube::texel_direction;

    /// A room with a window: uneven light of a wide range.
    fn room(size: usize) -> Cube<f64> {
        Cube::from_fn(size, |face, column, row| {
            let d = texel_direction(face, column, row, size);
            let window = if d[1] > 0.6 && d[0] > 0.1 { 9.0 } else { 0.0 };
            [1.0 + 0.5 * d[0], 0.4 + window, 1.2 - d[1] * d[2], 0.0]
        })
    }

    #[test]
    fn the_fast_filter_meets_brute_force_and_a_constant_stays_itself() {
        let (cube, even) = (room(16), Cube::from_fn(16, |_, _, _| [0.7, 1.0, 3.0, 0.0]));
        let fine = Cube::from_fn(64, |face, column, row| cube.texel(face, column / 4, row / 4));
        let (room, even) = (Prefilter::new(&fine), Prefilter::new(&even));
        for model in SpecularModel::ALL {
            for m in [0.2, 0.35, 0.7, 1.0] {
                let radial = Radial::Brdf(model, m);
                let (got, constant) = (room.radial(4, radial, |_| {}), even.radial(4, radial, |_| {}));
                for i in (0..96).step_by(29) {
                    let (face, column, row) = (i / 16, i % 4, i / 4 % 4);
                    assert_eq!(constant.texel(face, column, row)[..3], [0.7, 1.0, 3.0]);
                    let r = texel_direction(face, column, row, 4);
                    let want = radial_by_brute_force(&cube, r, radial, 12);
                    for c in 0..3 {
                        let error = (f64::from(got.texel(face, column, row)[c]) - want[c]).abs();
                        // Of a mean radiance of 1.5: cells' tolerance of 1e-4 each, and lobes of 0.04 radians over
                        // cells of 0.02.
                        assert!(error < 3e-3, "{model:?} {m} {i}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn beside_a_bright_texel_and_far_off_tiles_meet_brute_force() {
        let sun = (2, 80, 46);
        let lit = |f, c, r| if (f, c, r) == sun { [1e3; 4] } else { [0.5; 4] };
        let cube = Cube::from_fn(128, lit);
        let prefilter = Prefilter::new(&cube);
        for m in [0.25, 0.35, 0.7] {
            let radial = Radial::Brdf(SpecularModel::Ggx, m);
            let got = prefilter.radial(64, radial, |_| {});
            // At the sun, across the edges of its tile, and on other faces, where it stands at the horizon.
            let places = [
                (2, 40, 23),
                (2, 39, 24),
                (2, 47, 23),
                (2, 48, 31),
                (2, 0, 0),
                (0, 32, 1),
                (4, 33, 60),
                (1, 9, 3),
            ];
            for (face, column, row) in places {
                let r = texel_direction(face, column, row, 64);
                let want = radial_by_brute_force(&cube, r, radial, 3)[1];
                let error = (f64::from(got.texel(face, column, row)[1]) - want).abs();
                // Lobes of 0.06 radians over cells of 0.012, of a texel that is 2000 times as bright.
                assert!(error < 0.01 * want + 5e-4, "{m} {face} {column} {row}: {error} of {want}");
            }
        }
    }

    #[test]
    fn the_sharpest_lobes_yield_finite_light() {
        for size in [1, 2, 16, 64] {
            let prefilter = Prefilter::new(&room(size));
            for model in SpecularModel::ALL {
                for m in [0.05, 0.149, 1.0] {
                    let cube = prefilter.radial(3, Radial::Brdf(model, m), |_| {});
                    for i in 0..54 {
                        let texel = cube.texel(i / 9, i % 3, i / 3 % 3);
                        assert!(texel.iter().all(|x| x.is_finite() && *x >= 0.0), "{size} {model:?} {m}");
                    }
                }
            }
        }
    }

    #[test]
    fn between_its_cubes_a_stack_is_near_the_filter_and_its_slope_is_its_own() {
        let prefilter = Prefilter::new(&room(64));
        for (model, range) in [(SpecularModel::Kelemen, 0.1..=1.0), (SpecularModel::Ggx, 0.25..=1.0)] {
            let filtered = |m: f64| prefilter.radial(4, Radial::Brdf(model, m), |_| {});
            let stack = ReflectedStack::new(model, &range, 1, filtered);
            for m in [0.27, 0.4, 0.55, 0.8] {
                let h = 1e-3;
                let (value, slope) = stack.at(m);
                let (above, below) = (stack.at(m + h).0, stack.at(m - h).0);
                let want = filtered(m);
                for i in 0..96 {
                    let texel = |cube: &Cube<f32>| f64::from(cube.texel(i / 16, i % 4, i / 4 % 4)[1]);
                    // Of a window of 9 beside 0.4.
                    let off = (texel(&value) - texel(&want)).abs();
                    assert!(off < 0.1, "{model:?} {m} {i}: {off}");
                    let by = (texel(&above) - texel(&below)) / (2.0 * h);
                    // Values of up to 9 in f32 over a step of 2e-3, and the third derivative times h^2.
                    assert!((texel(&slope) - by).abs() < 5e-3, "{model:?} {m} {i}: {} {by}", texel(&slope));
                }
            }
        }
    }

    #[test]
    fn one_roughness_asks_for_the_cubes_around_it_and_beyond_the_ends_nothing_moves() {
        let make = |model, range| {
            ReflectedStack::new(model, &range, 1, |m| Cube::from_fn(1, |_, _, _| [m as f32; 4]))
        };
        assert_eq!(make(SpecularModel::Kelemen, 0.5..=0.5).stack.cubes.len(), 1);
        assert_eq!(make(SpecularModel::Kelemen, 0.35..=0.35).stack.cubes.len(), 4);
        assert_eq!(make(SpecularModel::Kelemen, 0.05..=1.0).stack.exponents.last(), Some(&1024.0));
        let ggx = make(SpecularModel::Ggx, 0.05..=1.0);
        assert_eq!(ggx.stack.exponents.last(), Some(&2048.0));
        let (value, slope) = ggx.at(0.05);
        assert_eq!((value.texel(0, 0, 0)[0], slope.texel(0, 0, 0)[0]), (2048_f32.powf(-0.25), 0.0));
    }
}
