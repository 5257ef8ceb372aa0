//! Photographs and pictures of radiance, as files.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use skinfit_panorama::merge::Exposure;
use skinfit_panorama::picture::Picture;

use crate::cli::{Refusal, tell};
use crate::render::files::{ImageOptions, write_exr};
use crate::render::image::Image;
use crate::scene::images::{self, Codes};

/// Primaries whose matrices differ by no more are the same: as profiles of one space do.
const SAME_PRIMARIES: f64 = 1e-3;

/// A photograph's codes, taken with that exposure.
pub(super) fn exposure(path: &Path, seconds: f64) -> Result<Exposure, Refusal> {
    let Codes { width, height, rgb, most } = images::codes(path)?;
    Ok(Exposure { width, height, codes: rgb, most, seconds })
}

/// From the primaries that photographs' profiles name to Rec.709's, where they are others: the curve of their codes is the
/// response's to say. Of one camera they are the same.
pub(super) fn primaries(photographs: &[PathBuf]) -> Result<Option<DMat3>, Refusal> {
    let mut warnings = Vec::new();
    let each = photographs.iter().map(|path| images::to_rec709(path, &mut warnings));
    let each: Vec<Option<DMat3>> = each.collect::<Result<_, _>>()?;
    warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
    let matrix = |found: &Option<DMat3>| found.unwrap_or(DMat3::IDENTITY);
    let first = each.first().copied().flatten();
    let other = each.iter().position(|own| !matrix(own).abs_diff_eq(matrix(&first), SAME_PRIMARIES));
    match other {
        None => Ok(first),
        Some(i) => Err(Refusal::new(format!(
            "{}: its colour profile has other primaries than that of {}. Give photographs of one camera and one profile.",
            photographs[i].display(),
            photographs[0].display()
        ))),
    }
}

/// Radiance by other primaries.
pub(super) fn mix(picture: &mut Picture, matrix: DMat3) {
    for texel in &mut picture.texels {
        let mixed = matrix * DVec3::from(texel.map(f64::from));
        // Beyond f32 it stays at the largest number.
        *texel = mixed.to_array().map(|x| x.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32);
    }
}

/// Where a file is or would be, whatever way leads there.
pub(super) fn place(path: &Path) -> PathBuf {
    let within = |path: &Path| {
        let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        let folder = folder.canonicalize().or_else(|_| std::path::absolute(folder));
        folder.unwrap_or_default().join(path.file_name().unwrap_or_default())
    };
    path.canonicalize().unwrap_or_else(|_| within(path))
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
