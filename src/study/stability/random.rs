//! Random batches: mostly sound surfaces, with what breaks evaluators mixed in: zeros of either sign,
//! denormals, magnitudes over the whole range, parallel vectors, edges of cubes, parameters at bounds, texels
//! that are not finite.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::case::{Batch, EVERYTHING, FragmentInputs, Setting};
use super::lights::LightKind;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params, Scale};
use crate::scene::Loss;

/// Fragments in a batch.
pub const BATCH: usize = 256;

/// Weights are at most this; albedo, texels of normals and lengths of vectors are at most a hundredth of it:
/// with lights of 65504 and a normal that turns as steeply as it may, squares of derivatives stay below f32's
/// 3.4e38.
const LARGEST: f64 = 1e3;

/// Batch `index` of a search: the same for the same seed, whatever came before it.
#[must_use]
pub fn batch(seed: u64, index: u64, count: usize) -> Batch {
    let mut rng = StdRng::seed_from_u64(seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let setting = setting(&mut rng);
    let fragments = (0..count).map(|_| fragment(&mut rng)).collect();
    Batch { setting, fragments }
}

pub(super) fn one_of<T: Copy>(rng: &mut StdRng, all: &[T]) -> T {
    all[rng.random_range(0..all.len())]
}

fn setting(rng: &mut StdRng) -> Setting {
    let form = if rng.random_range(0..4) == 0 { Form::Listing } else { Form::Corrected };
    let effects = if rng.random() {
        EVERYTHING
    } else {
        let drawn: Effects = EVERYTHING.iter().filter(|_| rng.random()).collect();
        if drawn.has_any(&[Effect::Diffuse, Effect::Hilite, Effect::Reflection, Effect::SideSpecular]) {
            drawn
        } else {
            drawn.with(Effect::Diffuse)
        }
    };
    let mut params = Params::defaults(form);
    for param in Param::built_in() {
        let mut draw = || parameter(param, form, rng);
        let rgb = if param.info().rgb { [draw(), draw(), draw()] } else { [draw(); 3] };
        params.set_rgb(param, rgb);
    }
    Setting {
        setup: Setup::new(form, one_of(rng, &Silhouette::ALL), effects),
        params,
        lights: one_of(rng, &LightKind::OWN),
        loss: one_of(rng, &Loss::ALL),
    }
}

pub(super) fn parameter(param: Param, form: Form, rng: &mut StdRng) -> f64 {
    let info = param.info();
    let (lower, upper) = (info.lower.max(-LARGEST), info.upper.min(LARGEST.max(info.corrected)));
    let value = match rng.random_range(0..6) {
        0 | 1 => param.default(form),
        2 => one_of(rng, &[lower, upper]),
        3 if info.scale == Scale::Log => (rng.random_range(0.0..1.0) * (upper / lower).ln()).exp() * lower,
        3 | 4 => rng.random_range(0.0..=1.0) * (upper - lower).min(4.0) + lower.max(-2.0),
        _ => magnitude(rng, -30.0, 3.0),
    };
    value.clamp(lower, upper)
}

/// A number of either sign and of any size between powers of ten.
fn magnitude(rng: &mut StdRng, low: f64, high: f64) -> f64 {
    let size = 10_f64.powf(rng.random_range(low..=high));
    single(if rng.random() { size } else { -size })
}

/// The nearest number that an f32 holds.
fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// In [0, 1], with an inclination to both ends.
pub(super) fn share(rng: &mut StdRng) -> f64 {
    match rng.random_range(0..8) {
        0 => 0.0,
        1 => 1.0,
        2 => -0.0,
        3 => single(1.0 - f64::from(f32::EPSILON)),
        4 => magnitude(rng, -45.0, 0.0).abs(),
        _ => single(rng.random_range(0.0..=1.0)),
    }
}

pub(super) fn unit(rng: &mut StdRng) -> [f64; 3] {
    let v: [f64; 3] = std::array::from_fn(|_| rng.random_range(-1.0..=1.0));
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
    v.map(|x| single(x / length))
}

/// Onto an axis, an edge or a corner of the cube, or a last place beside it.
fn special(rng: &mut StdRng) -> [f64; 3] {
    let free = single(rng.random_range(-1.0..=1.0));
    let near = [0.0, -0.0, 1.0, -1.0, single(1.0 + 1.2e-7), single(1.0 - 6e-8), single(1e-40), free];
    std::array::from_fn(|_| one_of(rng, &near))
}

/// A vector of some length, or of none; `beside` is what it may be parallel to.
fn vector(rng: &mut StdRng, beside: [f64; 3]) -> [f64; 3] {
    match rng.random_range(0..16) {
        0 => [0.0; 3],
        1 => {
            let length = 10_f64.powf(rng.random_range(-42.0..=1.0));
            unit(rng).map(|x| single(x * length))
        }
        2 | 3 => special(rng),
        4 => beside,
        5 => beside.map(|x| -x),
        6 => {
            // Parallel but for a few last places.
            let slight = magnitude(rng, -8.0, -3.0);
            let aside = unit(rng);
            std::array::from_fn(|i| single(beside[i] + slight * aside[i]))
        }
        _ => unit(rng),
    }
}

fn texel(rng: &mut StdRng) -> [f64; 3] {
    match rng.random_range(0..16) {
        0 => [0.5; 3],
        1 => {
            let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.5, 1.0];
            std::array::from_fn(|_| one_of(rng, &odd))
        }
        2 => std::array::from_fn(|_| single(0.5 + magnitude(rng, -9.0, -1.0))),
        3 => std::array::from_fn(|_| magnitude(rng, -40.0, 1.0)),
        4 => [0.5, 0.5, 1.0],
        _ => [
            single(rng.random_range(0.0..=1.0)),
            single(rng.random_range(0.0..=1.0)),
            single(rng.random_range(0.5..=1.0)),
        ],
    }
}

pub(super) fn fragment(rng: &mut StdRng) -> FragmentInputs {
    let normal = vector(rng, [0.0, 0.0, 1.0]);
    let tangent = vector(rng, normal);
    let bitangent = vector(rng, tangent);
    let view = vector(rng, normal);
    let albedo: [f64; 3] = std::array::from_fn(|_| match rng.random_range(0..8) {
        0 => magnitude(rng, -40.0, 1.0).abs(),
        _ => share(rng),
    });
    let dapple = match rng.random_range(0..4) {
        0 => -share(rng),
        _ => share(rng),
    };
    FragmentInputs {
        texel: texel(rng),
        tangent,
        bitangent,
        normal,
        view,
        occlusion: share(rng),
        silhouette: share(rng).abs(),
        dapple,
        albedo,
        specular: share(rng),
        attenuator: share(rng),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_draws_the_same_and_another_seed_something_else() {
        let text = |seed, index| format!("{:?}", batch(seed, index, 64));
        assert_eq!(text(7, 3), text(7, 3));
        assert_ne!(text(7, 3), text(8, 3));
        assert_ne!(text(7, 3), text(7, 4));
    }

    #[test]
    fn everything_but_texels_is_finite_within_bounds_and_held_by_an_f32() {
        for index in 0..20 {
            let Batch { setting, fragments } = batch(1, index, 64);
            for param in Param::built_in() {
                let info = param.info();
                let inside = |x: f64| (info.lower..=info.upper).contains(&x) && x.is_finite();
                assert!(setting.params.rgb(param).into_iter().all(inside), "{}", info.name);
            }
            for mut fragment in fragments {
                for (i, x) in fragment.numbers_mut().into_iter().enumerate() {
                    let sound = x.is_finite() && f64::from(*x as f32) == *x;
                    assert!(sound || i < 3, "number {i}: {x}");
                }
            }
        }
    }
}
