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
const TESTS: [&str; 7] = [
    "bakes::",
    "samples::",
    "occlusion::",
    "meshes::",
    "built_in::",
    "graphics::parity::",
    "graphics::fused::",
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

/// The noise's standard deviation at a pixel whose target is `x`, where the image's mean is `mean`.
type Deviation = fn(x: f32, mean: f32) -> f32;

/// docs/accuracy.md: how far fits of noisy images are from the fit of the same images without noise, in standard
/// errors. (That fit is within some 10⁻⁷ of the truth, far less than a standard error with noise.)
pub(crate) fn noise(lab: &Lab) -> Result<Value> {
    let demo = lab.scratch.path().join("demo");
    lab.skinfit("the built-in scene", &["demo", &demo.display().to_string()], false)?;
    let scene = demo.join("scene.toml");
    let truth = lab.fit("without noise", Some(&scene), &[])?.0;
    let everywhere: Deviation = |_, mean| 0.01 * mean;
    let relative: Deviation = |x, _| 0.01 * (x * x + 0.01).sqrt();
    let mut rows = Vec::new();
    for (noise, deviation, loss) in [
        ("0.01 x mean radiance, everywhere", everywhere, "l2"),
        ("0.01 x √(target² + 0.01)", relative, "relative_l2"),
        ("0.01 x mean radiance, everywhere", everywhere, "relative_l2"),
    ] {
        let (mut off, mut bias) = (Vec::new(), 0.0);
        for seed in 0..DRAWS {
            let targets = targets(lab, &demo, deviation, seed)?;
            let targets: Vec<(&str, &str)> =
                targets.iter().map(|(key, file)| (*key, file.as_str())).collect();
            let noisy = lab.scene("noisy", &scene, &targets)?;
            let report =
                lab.fit(&format!("{noise}, {loss}, draw {seed}"), Some(&noisy), &["--loss", loss])?.0;
            let unknowns = report["unknowns"].as_array().cloned().unwrap_or_default();
            for (found, true_one) in unknowns.iter().zip(truth["unknowns"].as_array().into_iter().flatten()) {
                off.push(
                    (number(&found["value"]) - number(&true_one["value"])) / number(&found["std_error"]),
                );
            }
            let weight = number(&report["params"]["base_weight"]["value"]);
            bias += (weight / number(&truth["params"]["base_weight"]["value"]) - 1.0) / DRAWS as f64;
        }
        let beyond = |errors: f64| off.iter().filter(|z| z.abs() > errors).count();
        rows.push(json!({
            "name": format!("{noise} {loss}"),
            "noise": noise,
            "loss": format!("`{loss}`"),
            "distances": off.len(),
            "mean_square": off.iter().map(|z| z * z).sum::<f64>() / off.len() as f64,
            "beyond_1": beyond(1.0),
            "beyond_2": beyond(2.0),
            "beyond_3": beyond(3.0),
            "base_weight_bias": bias,
        }));
    }
    Ok(json!({ "draws": DRAWS, "rows": rows }))
}

/// Noisy copies of the demo's targets, as settings of its scene file.
fn targets(lab: &Lab, demo: &Path, deviation: Deviation, seed: u64) -> Result<Vec<(&'static str, String)>> {
    let mut random = StdRng::seed_from_u64(seed);
    let mut settings = Vec::new();
    for (key, view) in
        [("view.0.target", "front"), ("view.1.target", "three_quarter"), ("view.2.target", "profile")]
    {
        let to = lab.scratch.path().join(format!("{view}.exr"));
        add_noise(&demo.join(format!("targets/{view}.exr")), &to, deviation, &mut random)?;
        settings.push((key, format!("{:?}", to.display().to_string())));
    }
    Ok(settings)
}

/// `from` with normal noise, as `to`.
fn add_noise(from: &Path, to: &Path, deviation: Deviation, random: &mut StdRng) -> Result<()> {
    let image = read_first_rgba_layer_from_file(
        from,
        |size, _| vec![vec![[0.0_f32; 4]; size.width()]; size.height()],
        |rows, at, (r, g, b, a): (f32, f32, f32, f32)| rows[at.y()][at.x()] = [r, g, b, a],
    )?;
    let mut rows = image.layer_data.channel_data.pixels;
    let pixels = || rows.iter().flatten();
    let mean = pixels().flat_map(|p| &p[..3]).sum::<f32>() / (3.0 * pixels().map(|p| p[3]).sum::<f32>());
    for pixel in rows.iter_mut().flatten() {
        let [rgb @ .., alpha] = pixel;
        for x in rgb {
            *x += *alpha * deviation(*x, mean) * normal(random);
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
