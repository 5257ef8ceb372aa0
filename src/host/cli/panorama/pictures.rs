//! Photographs and pictures of radiance, as files.

use std::path::Path;

use image::{DynamicImage, ImageReader};
use skinfit_panorama::merge::Exposure;
use skinfit_panorama::picture::Picture;

use crate::cli::{Refusal, tell};
use crate::render::files::{ImageOptions, write_exr};
use crate::render::image::Image;
use crate::scene::images;

/// No photograph above this many pixels is read.
const MOST_PIXELS: u64 = 1 << 28;

/// A photograph's codes, taken with that exposure.
pub(super) fn exposure(path: &Path, seconds: f64) -> Result<Exposure, Refusal> {
    let refuse = |what: String| {
        Refusal::new(format!("{}: {what}. Give photographs as PNG or JPEG, of 8 or 16 bits.", path.display()))
    };
    let open = || ImageReader::open(path)?.with_guessed_format();
    let reader = open().map_err(|error| refuse(format!("cannot be read: {error}")))?;
    let (width, height) = open()
        .map_err(|error| refuse(format!("cannot be read: {error}")))?
        .into_dimensions()
        .map_err(|error| refuse(format!("is no picture: {error}")))?;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(refuse(format!(
            "is {width} x {height} pixels, more than the {MOST_PIXELS} that are read"
        )));
    }
    let image = reader
        .decode()
        .map_err(|error| refuse(format!("is no picture: {}", one_line(&error.to_string()))))?;
    let (codes, most) = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            return Err(refuse("holds radiance, which is merged already".to_owned()));
        }
        deep @ (DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)) => {
            (deep.into_rgb16().pixels().map(|pixel| pixel.0).collect(), u16::MAX)
        }
        other => (other.into_rgb8().pixels().map(|pixel| pixel.0.map(u16::from)).collect(), 255),
    };
    Ok(Exposure { width: width as usize, height: height as usize, codes, most, seconds })
}

fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ").trim_end_matches('.').to_owned()
}

/// A picture of radiance: EXR or HDR; PNG and JPEG are read by their profile, or as sRGB.
pub(super) fn radiance(path: &Path) -> Result<Picture, Refusal> {
    let mut warnings = Vec::new();
    let map = images::color_map(path, &mut warnings)?;
    warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
    Ok(Picture { width: map.width, height: map.height, texels: map.texels })
}

/// Write a picture as EXR.
pub(super) fn write(path: &Path, picture: &Picture) -> Result<(), Refusal> {
    let mut image = Image::new(picture.width, picture.height);
    image.rgb.clone_from(&picture.texels);
    image.alpha.fill(1.0);
    Ok(write_exr(path, &image, &ImageOptions::default())?)
}

/// Refuse another ending than EXR's before anything is computed.
pub(super) fn check_output(path: &Path) -> Result<(), Refusal> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr")) {
        return Ok(());
    }
    Err(Refusal::new(format!("{}: is not called .exr. Radiance is written as EXR.", path.display())))
}
