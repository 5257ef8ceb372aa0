//! Squares of pictures side by side: a column a picture, a row a place.

use std::path::Path;

use exr::prelude::read_first_rgba_layer_from_file;
use image::imageops::{FilterType, crop_imm, replace, resize};
use image::{Rgb, RgbImage};
use skinfit::render::tonemap::ToneMap;

use crate::lab::{Lab, Result};

/// A view, and left, top and side of a square of it in pixels.
pub(crate) type Place = (&'static str, [u32; 3]);

/// Pixels of each square's side, and between two.
const SIDE: u32 = 260;
const GAP: u32 = 6;

/// Linear radiance, row by row.
pub(crate) struct Shown {
    pub(crate) width: usize,
    pub(crate) pixels: Vec<[f32; 3]>,
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

/// The targets of a scene of the scanned head, a picture a place.
pub(crate) fn traced(lab: &Lab, scene: &str, places: &[Place]) -> Result<Vec<Shown>> {
    let of = |(view, _): &Place| read(&lab.data.join(format!("targets/{scene}_{view}.exr")));
    places.iter().map(of).collect()
}

/// What a fit draws, a picture a place.
pub(crate) fn drawn(lab: &Lab, run: &Path, places: &[Place]) -> Result<Vec<Shown>> {
    let of = |(view, _): &Place| {
        let image = run.join(format!("{view}.exr")).display().to_string();
        let [scene, params] = ["scene.toml", "params.toml"].map(|name| run.join(name).display().to_string());
        let draw = ["render", &scene, "--params", &params, "--view", view, "--engine", "cpu", "-o", &image];
        lab.skinfit(&format!("{view} of {}", run.display()), &draw, false)?;
        read(Path::new(&image))
    };
    places.iter().map(of).collect()
}

/// Write the squares as a PNG `file`, all tone mapped alike.
pub(crate) fn side_by_side(columns: &[Vec<Shown>], places: &[Place], file: &str) -> Result<()> {
    let [across, down] = [columns.len(), places.len()].map(|count| count as u32 * (SIDE + GAP) - GAP);
    let mut all = RgbImage::from_pixel(across, down, Rgb([24; 3]));
    for (i, views) in columns.iter().enumerate() {
        for (k, (shown, (_, [x, y, side]))) in views.iter().zip(places).enumerate() {
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
    Ok(all.save(file)?)
}
