//! experiments/accuracy_vs_time/blurs.json, and docs/images/blurs.png: where on the face blurs along the atlas' axes differ from
//! Gaussians by distance over the surface.

use std::path::Path;

use image::{Rgb, RgbImage};
use serde_json::{Map, Value, json};
use skinfit::report::pictures::magma;

use crate::lab::{Choice, Lab, Result};
use crate::squares::{Shown, coloured, cut, laid_out, read, toned};

/// Of the scanned head's scenes that in which they differ most.
const SCENE: &str = "studio";
const VIEW: &str = "front";

/// What the others are measured against.
const SURFACE: Choice = ("surface", &[("diffusion", "{ method = \"surface\" }")]);
const CHOICES: [Choice; 4] = [
    ("as the scene has it", &[]),
    ("`taps = \"full\"`", &[("diffusion", "{ taps = \"full\" }")]),
    ("`seams = \"joined\"`", &[("diffusion", "{ seams = \"joined\" }")]),
    ("`light_map_size = 256`", &[("diffusion", "{ light_map_size = 256 }")]),
];

/// What the picture shows of the view, by left, top and side: the head, and eyes to mouth.
const SQUARES: [[u32; 3]; 2] = [[66, 36, 246], [118, 136, 130]];
/// Parts of the face in the view: left, top, width and height of what holds each.
const PARTS: [(&str, &[[usize; 4]]); 5] = [
    ("lids", &[[118, 142, 132, 38]]),
    ("nose", &[[164, 180, 48, 40]]),
    ("mouth", &[[158, 224, 70, 38]]),
    ("ears", &[[86, 152, 24, 70], [258, 150, 32, 74]]),
    ("forehead", &[[130, 60, 120, 70]]),
];

/// The brightest colour stands for so much, in percent of the reference's root mean square.
const MOST: f64 = 5.0;
/// Pixels at the foot of each square in which the scale stands, from 0 on the left to [`MOST`].
const SCALE: u32 = 8;

/// What a choice makes of the view, and the reference of it.
type Pair<'a> = (&'a Shown, &'a Shown);

/// A row a choice: how far its view is off, whole and by parts, in percent.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let (_, run) = lab.fit(SCENE, Some(&lab.head_scene(SCENE, "full.toml")), &[])?;
    let params = run.join("params.toml");
    let surface = made(lab, SURFACE, &params)?;
    let mut columns = vec![squares(&toned(&surface))];
    let mut rows = Vec::new();
    for choice in CHOICES {
        let found = made(lab, choice, &params)?;
        let view = (&found, &surface);
        rows.push(row(choice.0, view));
        columns.push(squares(&heat(view)).into_iter().map(with_scale).collect());
    }
    laid_out(&columns, "docs/images/blurs.png")?;
    Ok(json!({ "most": MOST, "rows": rows }))
}

fn row(name: &str, view: Pair<'_>) -> Value {
    let part = |(name, places): (&str, &[[usize; 4]])| {
        let off = percent(view, |x, y| places.iter().any(|place| holds(*place, x, y)));
        (name.to_owned(), off.into())
    };
    json!({
        "name": name,
        "view": percent(view, |_, _| true),
        "parts": PARTS.into_iter().map(part).collect::<Map<String, Value>>(),
    })
}

/// What a choice makes of the view at the constants of a fit.
fn made(lab: &Lab, (name, settings): Choice, params: &Path) -> Result<Shown> {
    let scene = lab.scene(name, &lab.head_scene(SCENE, "full.toml"), settings)?;
    let image = scene.with_extension("exr");
    let [scene, params, output] = [&scene, params, &image].map(|path| path.display().to_string());
    let arguments = ["render", &scene, "--params", &params, "--view", VIEW, "--engine", "cpu", "-o", &output];
    lab.skinfit(&format!("render, {name}"), &arguments, false)?;
    read(&image)
}

/// Whether a pixel lies in left, top, width and height.
fn holds([left, top, width, height]: [usize; 4], x: usize, y: usize) -> bool {
    (left..left + width).contains(&x) && (top..top + height).contains(&y)
}

/// The root mean square difference among the pixels that are meant, in percent of the reference's there.
fn percent((found, reference): Pair<'_>, meant: impl Fn(usize, usize) -> bool) -> f64 {
    let (mut misfit, mut energy) = (0.0, 0.0);
    for (i, (got, want)) in found.pixels.iter().zip(&reference.pixels).enumerate() {
        if meant(i % reference.width, i / reference.width) {
            misfit += difference(*got, *want);
            energy += difference(*want, [0.0; 3]);
        }
    }
    100.0 * (misfit / energy).sqrt()
}

/// The sum of squared differences.
fn difference(a: [f32; 3], b: [f32; 3]) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum()
}

/// The difference pixel by pixel, as a share of [`MOST`] in magma; black where the reference shows nothing.
fn heat((found, reference): Pair<'_>) -> RgbImage {
    let energies =
        reference.pixels.iter().map(|rgb| difference(*rgb, [0.0; 3])).filter(|energy| *energy > 0.0);
    let (count, sum) = energies.fold((0.0, 0.0), |(count, sum), energy| (count + 1.0, sum + energy));
    let most = MOST / 100.0 * f64::sqrt(sum / count);
    coloured(reference, |i| magma((difference(found.pixels[i], reference.pixels[i]).sqrt() / most) as f32))
}

/// The squares of the view.
fn squares(view: &RgbImage) -> Vec<RgbImage> {
    SQUARES.into_iter().map(|square| cut(view, square)).collect()
}

/// A square with the colours from 0 to [`MOST`] at its foot.
fn with_scale(mut square: RgbImage) -> RgbImage {
    let (width, height) = square.dimensions();
    for (x, y) in (0..width).flat_map(|x| (height - SCALE..height).map(move |y| (x, y))) {
        square.put_pixel(x, y, Rgb(magma(x as f32 / (width - 1) as f32)));
    }
    square
}
