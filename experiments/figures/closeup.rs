//! docs/closeup.json, and the pictures beside it: skin at close range, path traced, fitted with light that scatters, and without.

use std::path::Path;

use exr::prelude::read_first_rgba_layer_from_file;
use image::imageops::{FilterType, crop_imm, replace, resize};
use image::{Rgb, RgbImage};
use serde_json::{Value, json};
use skinfit::render::tonemap::ToneMap;
use skinfit::report::plot::{Dot, Joined, Plot};

use crate::diffusion::{OTHERS, WITHOUT};
use crate::lab::{Lab, Result};

/// The best of docs/diffusion.json's choices close up.
const DIFFUSION: &str = r#"{ unblurred = "pixel", light_map_size = 1024, ambient_normal = "bumped" }"#;
/// What is shown: the view, and the square of it in pixels.
const SHOWN: [(&str, [u32; 3]); 3] =
    [("closeup", [120, 150, 130]), ("closeup", [190, 240, 130]), ("threequarter", [218, 150, 84])];
/// Pixels of each square's side, and between two.
const SIDE: u32 = 260;
const GAP: u32 = 6;

/// Across the edge of the nose's shadow on the cheek, from light to dark: rows that are averaged, and columns.
const ROWS: std::ops::Range<usize> = 205..215;
const COLUMNS: std::ops::Range<usize> = 138..184;
/// Pixels at either end that are taken for all light and all shadow.
const ENDS: usize = 8;
/// Millimetres a pixel on the cheek.
const MILLIMETRES: f64 = 0.18;

/// Of the path tracer's random walk in red, green and blue, in millimetres: what the scenes were rendered with.
const MEAN_FREE_PATHS: [f64; 3] = [3.7, 1.4, 0.7];

/// Linear radiance, row by row.
struct Shown {
    width: usize,
    pixels: Vec<[f32; 3]>,
}

/// The fits' figures, the profile across the shadow's edge, and how wide the edge is in each channel.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let full = lab.head_scene("studio", "full.toml");
    let with = lab.scene("scattered", &full, &[("diffusion", DIFFUSION)])?;
    let without = lab.scene("unscattered", &full, &[("model.effects", WITHOUT), ("fit.free", OTHERS)])?;
    let (mut columns, mut rows) = (vec![traced(lab)?], vec![("path traced".to_owned(), Value::Null)]);
    for (name, scene) in [("with diffusion", with), ("without", without)] {
        let (report, run) = lab.fit(name, Some(&scene), &[])?;
        rows.push((name.to_owned(), report["views"]["closeup"]["psnr"].clone()));
        columns.push(drawn(lab, &run)?);
    }
    pictures(&columns)?;
    let profiles: Vec<Vec<[f64; 3]>> = columns.iter().map(|views| profile(&views[0])).collect();
    plot(&rows.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), &profiles)?;
    let rows = rows.into_iter().zip(&profiles).map(|((name, psnr), profile)| {
        let [red, green, blue] = [0, 1, 2].map(|c| width(profile, c));
        json!({ "name": name, "psnr": psnr, "red": red, "green": green, "blue": blue, "profile": profile })
    });
    Ok(json!({ "rows": rows.collect::<Vec<_>>(), "mean_free_paths": MEAN_FREE_PATHS }))
}

fn read(path: &Path) -> Result<Shown> {
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| Shown { width: size.width(), pixels: vec![[0.0; 3]; size.area()] },
        |shown, place, (r, g, b, _): (f32, f32, f32, f32)| {
            shown.pixels[place.y() * shown.width + place.x()] = [r, g, b];
        },
    );
    Ok(image.map_err(|error| format!("{}: {error}", path.display()))?.layer_data.channel_data.pixels)
}

fn traced(lab: &Lab) -> Result<Vec<Shown>> {
    let of = |(view, _): &(&str, [u32; 3])| read(&lab.data.join(format!("targets/studio_{view}.exr")));
    SHOWN.iter().map(of).collect()
}

fn drawn(lab: &Lab, run: &Path) -> Result<Vec<Shown>> {
    let of = |(view, _): &(&str, [u32; 3])| {
        let image = run.join(format!("{view}.exr")).display().to_string();
        let [scene, params] = ["scene.toml", "params.toml"].map(|name| run.join(name).display().to_string());
        let draw = ["render", &scene, "--params", &params, "--view", view, "--engine", "cpu", "-o", &image];
        lab.skinfit(&format!("{view} of {}", run.display()), &draw, false)?;
        read(Path::new(&image))
    };
    SHOWN.iter().map(of).collect()
}

/// Squares side by side: a column an image, a row a place.
fn pictures(columns: &[Vec<Shown>]) -> Result<()> {
    let [across, down] = [columns.len(), SHOWN.len()].map(|count| count as u32 * (SIDE + GAP) - GAP);
    let mut all = RgbImage::from_pixel(across, down, Rgb([24; 3]));
    for (i, views) in columns.iter().enumerate() {
        for (k, (shown, (_, [x, y, side]))) in views.iter().zip(&SHOWN).enumerate() {
            let pixel = |column: u32, row: u32| {
                let linear = shown.pixels[row as usize * shown.width + column as usize];
                Rgb(ToneMap::default().encode_bytes(linear))
            };
            let height = (shown.pixels.len() / shown.width) as u32;
            let image = RgbImage::from_fn(shown.width as u32, height, pixel);
            let square = crop_imm(&image, *x, *y, *side, *side).to_image();
            let square = resize(&square, SIDE, SIDE, FilterType::CatmullRom);
            let [left, top] = [i, k].map(|place| place as i64 * i64::from(SIDE + GAP));
            replace(&mut all, &square, left, top);
        }
    }
    Ok(all.save("docs/images/closeup.png")?)
}

/// Mean radiance of the rows, pixel by pixel.
fn profile(shown: &Shown) -> Vec<[f64; 3]> {
    let mean = |column: usize| {
        let of =
            |c: usize| ROWS.map(|row| f64::from(shown.pixels[row * shown.width + column][c])).sum::<f64>();
        [0, 1, 2].map(|c| of(c) / ROWS.len() as f64)
    };
    COLUMNS.map(mean).collect()
}

/// From a quarter of the way between shadow and light to three quarters, in millimetres.
fn width(profile: &[[f64; 3]], c: usize) -> f64 {
    let mean = |part: &[[f64; 3]]| part.iter().map(|rgb| rgb[c]).sum::<f64>() / part.len() as f64;
    let (light, dark) = (mean(&profile[..ENDS]), mean(&profile[profile.len() - ENDS..]));
    // The last place that is as light, so that a mole before the edge is none.
    let crossing = |share: f64| {
        let level = dark + share * (light - dark);
        let k = (0..profile.len() - 1).rev().find(|&k| profile[k][c] >= level && profile[k + 1][c] < level);
        k.map_or(f64::NAN, |k| k as f64 + (profile[k][c] - level) / (profile[k][c] - profile[k + 1][c]))
    };
    MILLIMETRES * (crossing(0.25) - crossing(0.75))
}

fn plot(names: &[&str], profiles: &[Vec<[f64; 3]>]) -> Result<()> {
    let mut dots = Vec::new();
    for (i, profile) in profiles.iter().enumerate() {
        for (k, rgb) in profile.iter().enumerate() {
            // Blue is as green is, only narrower: six curves are enough to read.
            for (c, y) in rgb[..2].iter().copied().enumerate() {
                let x = MILLIMETRES * k as f64;
                let title = format!("{}: {x:.2} mm, {y:.3}", names[i]);
                dots.push(Dot { x, y, label: String::new(), title, series: 2 * i + c, front: true });
            }
        }
    }
    let series = names.iter().flat_map(|name| ["red", "green"].map(|c| format!("{name}, {c}"))).collect();
    let (x, y) = ("millimetres across the shadow's edge", "radiance");
    let plot = Plot { x, y, log_x: false, dots, series, joined: Joined::Series };
    Ok(std::fs::write("docs/images/terminator.svg", plot.file())?)
}
