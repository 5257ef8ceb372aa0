//! Scenes to try: every number is one of f32, so that evaluators that store 32 bits are given the same.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::cube::Cube;
use super::fragment::{Constants, Form, Inputs, Lights, NAMES, Silhouette, Surface, Variant};
use super::losses::Loss;
use super::scene::{At, Pixel, Sample, Scene, Unknown, View};
use super::{V3, dot, scaled, sum, unit};

fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// Smooth light, so that neighbouring texels differ by some tenths.
fn cube(size: usize, phase: f64) -> Cube {
    Cube::of_directions(size, |[x, y, z]| {
        let wave = |k: f64| single(0.8 + 0.5 * (k * x + phase).sin() * (2.0 * y).cos() + 0.2 * (k * z).cos());
        [wave(1.0), wave(1.6), wave(2.2), wave(2.9)]
    })
}

fn lights() -> Lights {
    let lobes = [16.0, 32.0, 64.0].into_iter().zip([0.7, 1.2, 1.9]);
    Lights {
        irradiance: cube(6, 0.3),
        lobes: lobes.map(|(exponent, phase)| (exponent, cube(8, phase))).collect(),
        hilite: cube(8, 2.1),
    }
}

/// A point away from every default, its lobe between the cubes.
pub(super) fn point(gains: usize) -> At {
    let constants = Constants {
        base_weight: [0.9, 0.8, 1.1],
        rim_weight: [0.9, 0.45, 0.3],
        rim_exponent: [2.6; 3],
        hilite: [0.7, 0.6, 0.5],
        reflection: [0.2, 0.3, 0.25],
        side_specular: [0.6, 0.7, 0.9],
        occlusion: [0.8; 3],
        normal_strength: [1.3; 3],
        specular_lobe: [40.0; 3],
        environment_rotation: [20.0; 3],
        haze_weight: [0.5; 3],
        key_azimuth: [30.0; 3],
        key_elevation: [35.0; 3],
        key_color: [0.5, 0.4, 0.3],
    };
    At { constants, gains: [[1.0; 3], [1.2, 1.1, 1.3], [0.7; 3]][..gains].to_vec() }
}

/// Every constant tied to one value, and the gains of all views but the first.
pub(super) fn tied(gains: usize) -> Vec<Unknown> {
    NAMES.iter().map(|&(name, _)| Unknown::Tied(name)).chain((1..gains).map(Unknown::Gain)).collect()
}

/// Every constant, those that may with a value a channel, and each channel of the same gains.
pub(super) fn by_channel(gains: usize) -> Vec<Unknown> {
    let columns = NAMES.iter().flat_map(|&(name, rgb)| match rgb {
        true => [0, 1, 2].map(|c| Unknown::Channel(name, c)).to_vec(),
        false => vec![Unknown::Tied(name)],
    });
    let gains = (1..gains).flat_map(|view| [0, 1, 2].map(|c| Unknown::ChannelGain(view, c)));
    columns.chain(gains).collect()
}

fn direction(rng: &mut StdRng) -> V3 {
    loop {
        let v: V3 = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        if (0.1..1.0).contains(&dot(v, v)) {
            return unit(v).unwrap();
        }
    }
}

/// A surface; some are wholly occluded, at the rim, facing, without dapple or bump.
fn surface(rng: &mut StdRng, form: Form, silhouette: Silhouette) -> Surface {
    let normal = direction(rng);
    let across = direction(rng);
    let tangent = unit(sum(across, scaled(-dot(across, normal), normal))).unwrap();
    let [n, t] = [normal, tangent];
    let bitangent = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
    let view = direction(rng);
    let special = |rng: &mut StdRng, extreme: f64| {
        if rng.random_range(0..12) == 0 { extreme } else { rng.random_range(0.02..1.0) }
    };
    let lean = if rng.random_range(0..12) == 0 { 0.5 } else { 1.0 };
    let texel = [0.5 + lean * (rng.random_range(0.2..0.8) - 0.5), rng.random_range(0.2..0.8), 0.95];
    let z = match silhouette {
        Silhouette::Fragment => 1.0 - dot(normal, view).abs().min(1.0),
        _ if rng.random_range(0..12) == 0 => 1.0,
        _ => special(rng, 0.0),
    };
    let inputs = Inputs {
        texel,
        frame: [tangent, bitangent, normal],
        view,
        open: special(rng, 0.0),
        silhouette: z,
        dapple: special(rng, 0.0),
        albedo: std::array::from_fn(|_| rng.random_range(0.1..0.9)),
        specular: special(rng, 0.0),
        attenuator: special(rng, 0.0),
    };
    let f = inputs.surface(form);
    // S.z where it is 0 and 1 as well, each at a corner of its own.
    let corner_silhouettes = [z, special(rng, 0.0), special(rng, 1.0)];
    let (u, v) = (rng.random_range(0.0..1.0_f64), rng.random_range(0.0..1.0_f64));
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let shares = [1.0 - u - v, u, v];
    Surface {
        base: f.base.map(single),
        bump: f.bump.map(single),
        normal: f.normal.map(single),
        view: f.view.map(single),
        open: single(f.open),
        silhouette: single(f.silhouette),
        corners: [corner_silhouettes, shares].map(|numbers| numbers.map(single)),
        dapple: single(f.dapple),
        albedo: f.albedo.map(single),
        specular: single(f.specular),
        attenuator: single(f.attenuator),
    }
}

/// [`scene_as`] of the first version.
pub(super) fn scene(form: Form, silhouette: Silhouette, loss: Loss, most: usize, seed: u64) -> Scene {
    scene_as(Variant::default(), (form, silhouette), loss, most, seed)
}

/// A scene of several views whose pixels have one to `most` samples. Targets are the image at [`point`], off by 0.02 to
/// 0.1 either way: on both sides of Huber's threshold, and far from where SMAPE's weight turns an f32's rounding
/// of the residual into a large share of itself.
pub(super) fn scene_as(
    variant: Variant,
    (form, silhouette): (Form, Silhouette),
    loss: Loss,
    most: usize,
    seed: u64,
) -> Scene {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut pixel = |i: usize| {
        let count = rng.random_range(1..=most);
        let sample = |rng: &mut StdRng| Sample {
            share: single(1.0 / count as f64),
            surface: surface(rng, form, silhouette),
        };
        let samples = (0..count).map(|_| sample(&mut rng)).collect();
        let weight = if i % 16 == 5 { 0.0 } else { single(rng.random_range(0.1..1.0)) };
        Pixel { samples, target: [0.0; 4], weight }
    };
    let views =
        [64, 32].map(|pixels| View { pixels: (0..pixels).map(&mut pixel).collect(), clip: None }).to_vec();
    let mut scene = Scene { form, silhouette, variant, loss, lights: lights(), views };
    let image = scene.image(&point(2));
    for (view, image) in scene.views.iter_mut().zip(&image) {
        for (pixel, shown) in view.pixels.iter_mut().zip(image) {
            pixel.target =
                shown.map(|x| single(x + rng.random_range(0.02..0.1) * [-1.0, 1.0][rng.random_range(0..2)]));
        }
        // The brightest and the darkest twentieth or so are clipped.
        let mut all: Vec<f64> = view.pixels.iter().flat_map(|pixel| pixel.target).collect();
        all.sort_by(f64::total_cmp);
        view.clip = Some([all[all.len() / 20], all[all.len() - all.len() / 20]]);
    }
    scene
}
