//! docs/accuracy.md and docs/rendering.md: what the tests measure on their way, and fits of noisy images.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage as _, read_first_rgba_layer_from_file};
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::{Value, json};

use crate::lab::{Lab, Result};
use crate::studies::number;

/// The tests that measure something that a page quotes.
const TESTS: [&str; 14] = [
    "bakes::",
    "samples::",
    "occlusion::",
    "meshes::",
    "built_in::",
    "lights::",
    "graphics::parity::",
    "graphics::fused::",
    "silhouettes::",
    "registration::",
    "cameras::",
    "imported::",
    "panorama::",
    "godot::",
];

/// The least and the greatest of what each test measured, by name.
pub(crate) fn tests(lab: &Lab) -> Result<Value> {
    let file = lab.scratch.path().join("measured");
    let mut command = match &lab.suite {
        Some(suite) => Command::new(suite),
        None => {
            let mut cargo = Command::new("cargo");
            cargo.args(["test", "--release", "--features", "burn", "--test", "suite", "--"]);
            cargo
        }
    };
    command.args(TESTS).env("SKINFIT_FIGURES", &file).env("SKINFIT_DATA", &lab.data);
    lab.run("the tests that measure", command, false)?;
    let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in std::fs::read_to_string(&file)?.lines() {
        let figure: Value = serde_json::from_str(line)?;
        found
            .entry(figure["name"].as_str().unwrap_or_default().to_owned())
            .or_default()
            .push(number(&figure["value"]));
    }
    let spans = found.into_iter().map(|(name, values)| {
        let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        (name, json!({ "least": least, "most": most, "count": values.len() }))
    });
    Ok(json!({ "measured": spans.collect::<serde_json::Map<_, _>>() }))
}

/// How often noise is drawn.
const DRAWS: u64 = 8;

/// A kind of noise.
#[derive(Clone, Copy)]
struct Noise {
    name: &'static str,
    /// The standard deviation at a pixel whose target is `x`, where the image's mean is `mean`.
    deviation: fn(x: f32, mean: f32) -> f32,
    /// The side of the squares of pixels that are off by as many deviations.
    alike: usize,
}

/// docs/accuracy.md: how far fits of noisy images are from the fit of the same images without noise, in standard
/// errors. (That fit is within some 10⁻⁷ of the truth, far less than a standard error with noise.)
pub(crate) fn noise(lab: &Lab) -> Result<Value> {
    let demo = lab.scratch.path().join("demo");
    lab.skinfit("the built-in scene", &["demo", &demo.display().to_string()], false)?;
    let scene = demo.join("scene.toml");
    let truth = lab.fit("without noise", Some(&scene), &[])?.0;
    let everywhere =
        Noise { name: "0.01 x mean radiance, everywhere", deviation: |_, mean| 0.01 * mean, alike: 1 };
    let relative = Noise { name: "0.01 x (target + 0.1)", deviation: |x, _| 0.01 * (x + 0.1), alike: 1 };
    let squares = Noise { name: "0.01 x mean radiance, alike over 8 x 8 pixels", alike: 8, ..everywhere };
    let mut rows = Vec::new();
    for (kind, loss) in
        [(everywhere, "l2"), (relative, "relative_l2"), (everywhere, "relative_l2"), (squares, "l2")]
    {
        let noise = kind.name;
        let (mut off, mut independent, mut bias) = (Vec::new(), Vec::new(), 0.0);
        for seed in 0..DRAWS {
            let targets = targets(lab, &demo, kind, seed)?;
            let targets: Vec<(&str, &str)> =
                targets.iter().map(|(key, file)| (*key, file.as_str())).collect();
            let noisy = lab.scene("noisy", &scene, &targets)?;
            let report =
                lab.fit(&format!("{noise}, {loss}, draw {seed}"), Some(&noisy), &["--loss", loss])?.0;
            let unknowns = report["unknowns"].as_array().cloned().unwrap_or_default();
            for (found, true_one) in unknowns.iter().zip(truth["unknowns"].as_array().into_iter().flatten()) {
                let distance = number(&found["value"]) - number(&true_one["value"]);
                off.push(distance / number(&found["std_error"]));
                independent.push(distance / number(&found["noise_error"]));
            }
            let weight = number(&report["params"]["base_weight"]["value"]);
            bias += (weight / number(&truth["params"]["base_weight"]["value"]) - 1.0) / DRAWS as f64;
        }
        let beyond = |errors: f64| off.iter().filter(|z| z.abs() > errors).count();
        let mean_square = |off: &[f64]| off.iter().map(|z| z * z).sum::<f64>() / off.len() as f64;
        rows.push(json!({
            "name": format!("{noise} {loss}"),
            "noise": noise,
            "loss": format!("`{loss}`"),
            "distances": off.len(),
            "mean_square": mean_square(&off),
            "mean_square_of_independent": mean_square(&independent),
            "beyond_1": beyond(1.0),
            "beyond_2": beyond(2.0),
            "beyond_3": beyond(3.0),
            "base_weight_bias": bias,
        }));
    }
    Ok(json!({ "draws": DRAWS, "rows": rows }))
}

/// Noisy copies of the demo's targets, as settings of its scene file.
fn targets(lab: &Lab, demo: &Path, noise: Noise, seed: u64) -> Result<Vec<(&'static str, String)>> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut settings = Vec::new();
    for (key, view) in
        [("view.0.target", "front"), ("view.1.target", "three_quarter"), ("view.2.target", "profile")]
    {
        let to = lab.scratch.path().join(format!("{view}.exr"));
        add_noise(&demo.join(format!("targets/{view}.exr")), &to, noise, &mut random)?;
        settings.push((key, format!("{:?}", to.display().to_string())));
    }
    Ok(settings)
}

/// `from` with normal noise, as `to`.
fn add_noise(from: &Path, to: &Path, noise: Noise, random: &mut StdRng) -> Result<()> {
    let image = read_first_rgba_layer_from_file(
        from,
        |size, _| vec![vec![[0.0_f32; 4]; size.width()]; size.height()],
        |rows, at, (r, g, b, a): (f32, f32, f32, f32)| rows[at.y()][at.x()] = [r, g, b, a],
    )?;
    let mut rows = image.layer_data.channel_data.pixels;
    let pixels = || rows.iter().flatten();
    let mean = pixels().flat_map(|p| &p[..3]).sum::<f32>() / (3.0 * pixels().map(|p| p[3]).sum::<f32>());
    let across = image.layer_data.size.width() / noise.alike + 2;
    let down = image.layer_data.size.height() / noise.alike + 2;
    let draws: Vec<[f32; 3]> = (0..across * down).map(|_| [0; 3].map(|_| normal(random))).collect();
    // Squares that no square of the estimate coincides with.
    let square = |at: usize, shift: usize| (at + shift % noise.alike) / noise.alike;
    for (y, row) in rows.iter_mut().enumerate() {
        for (x, pixel) in row.iter_mut().enumerate() {
            let [rgb @ .., alpha] = pixel;
            for (value, draw) in rgb.iter_mut().zip(draws[square(y, 5) * across + square(x, 3)]) {
                *value += *alpha * (noise.deviation)(*value, mean) * draw;
            }
        }
    }
    let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
        let [r, g, b, a] = rows[at.y()][at.x()];
        (r, g, b, a)
    });
    Ok(Image::from_channels(image.layer_data.size, channels).write().to_file(to)?)
}

/// A normal deviate (Box and Muller 1958).
fn normal(random: &mut StdRng) -> f32 {
    let (u, v): (f32, f32) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f32::consts::TAU * v).cos()
}
