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

/// The colours of an EXR file.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn read(path: &Path) -> Result<Shown> {
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
    let square = |(shown, (_, square)): (&Shown, &Place)| cut(&toned(shown), *square);
    let column = |views: &Vec<Shown>| views.iter().zip(places).map(square).collect();
    laid_out(&columns.iter().map(column).collect::<Vec<_>>(), file)
}

/// As a screen shows it.
pub(crate) fn toned(shown: &Shown) -> RgbImage {
    coloured(shown, |i| ToneMap::default().encode_bytes(shown.pixels[i]))
}

/// An image of the same size, of a colour a pixel.
pub(crate) fn coloured(shown: &Shown, colour: impl Fn(usize) -> [u8; 3]) -> RgbImage {
    let pixel = |column: u32, row: u32| Rgb(colour(row as usize * shown.width + column as usize));
    RgbImage::from_fn(shown.width as u32, (shown.pixels.len() / shown.width) as u32, pixel)
}

/// A square of an image, by left, top and side, as large as all are laid out.
pub(crate) fn cut(image: &RgbImage, [left, top, side]: [u32; 3]) -> RgbImage {
    resize(&crop_imm(image, left, top, side, side).to_image(), SIDE, SIDE, FilterType::CatmullRom)
}

/// Write squares as a PNG `file`, column by column.
pub(crate) fn laid_out(columns: &[Vec<RgbImage>], file: &str) -> Result<()> {
    let rows = columns.iter().map(Vec::len).max().unwrap_or_default();
    let [across, down] = [columns.len(), rows].map(|count| count as u32 * (SIDE + GAP) - GAP);
    let mut all = RgbImage::from_pixel(across, down, Rgb([24; 3]));
    for (i, column) in columns.iter().enumerate() {
        for (k, square) in column.iter().enumerate() {
            let [left, top] = [i, k].map(|place| place as i64 * i64::from(SIDE + GAP));
            replace(&mut all, square, left, top);
        }
    }
    Ok(all.save(file)?)
}
