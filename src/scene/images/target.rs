//! Images to be matched, and their masks.

use std::path::Path;

use super::response::Response;
use super::space::Space;
use super::{Image, open_exr, read, read_colors, read_with};
use crate::error::{SceneError, Warnings, warn};
use crate::model::params::LARGEST;
use crate::view::{Clip, Target};

/// The largest number of a target: what is matched to it, and the squares of errors, stay in the range of f32.
const BRIGHTEST: f32 = LARGEST as f32;

/// What a view says of its target.
#[derive(Clone, Copy, Default)]
pub(crate) struct Seen<'a> {
    /// What each pixel counts.
    pub mask: Option<&'a Path>,
    /// The camera's response, in the place of the curves that the file names.
    pub response: Option<&'a Response>,
}

/// A target of `size`: linear radiance, premultiplied by coverage.
///
/// EXR and HDR are taken as they are (EXR is premultiplied by convention). Codes of 8 or 16 bits are
/// decoded, multiplied by their straight alpha, and may be clipped at both ends. Where a profile has other
/// primaries than Rec.709 (P3, Adobe RGB, Rec.2020) its channels are mixed, so that a clipped code bounds no
/// channel any more: pixels that have one do not count.
pub(crate) fn target(
    path: &Path,
    Seen { mask, response }: Seen<'_>,
    size: (u32, u32),
    warnings: &mut Warnings,
) -> Result<Target, SceneError> {
    let mut image = read_colors(path, Some(size), warnings)?;
    if let Some(response) = response {
        if image.code.is_none() {
            return Err(SceneError::new(
                path,
                "holds light itself, and its view gives it a camera's response",
                "Leave `response` out of the view",
            ));
        }
        image.space = Some(Space::with_curves(image.space, response.curves()));
    }
    let mixed = image.space.as_ref().is_some_and(Space::mixes);
    let clipped_at = image.code.filter(|_| !mixed).map(|code| {
        // Half a code from either end: what rounds to the end may lie beyond it.
        let at = |half: f64| image.light(half / f64::from(code)).map(|light| light as f32);
        let (low, high) = (at(0.5), at(f64::from(code) - 0.5));
        // Curves of three channels may differ: nearest to the ends.
        Clip { low: low.into_iter().fold(f32::MAX, f32::min), high: high.into_iter().fold(0.0, f32::max) }
    });
    let lost = lost(&image, clipped_at);
    image.linearize();
    if let Some(i) = image.rgb.iter().position(|rgb| rgb.iter().any(|x| x.abs() > BRIGHTEST)) {
        let (x, y) = (i % size.0 as usize, i / size.0 as usize);
        return Err(SceneError::new(
            path,
            format!(
                "has {:?} at pixel ({x}, {y}): errors beyond {BRIGHTEST:e} have no square in 32 bits",
                image.rgb[i]
            ),
            "Scale the target, and the environment's intensity with it",
        ));
    }
    let alpha = image.alpha.take().map(|alpha| clamp(alpha, "coverage", path, warnings));
    if let (Some(_), Some(alpha)) = (image.code, &alpha) {
        for (rgb, a) in image.rgb.iter_mut().zip(alpha) {
            *rgb = rgb.map(|value| value * a);
        }
    }
    let mut mask = mask.map(|mask| read_mask(mask, size, warnings)).transpose()?;
    if lost.contains(&true) {
        let counts = mask.get_or_insert_with(|| vec![1.0; lost.len()]);
        counts.iter_mut().zip(&lost).filter(|(_, lost)| **lost).for_each(|(counts, _)| *counts = 0.0);
    }
    Ok(Target { rgb: image.rgb, alpha, haze: None, mask, clipped_at })
}

/// Pixels with a clipped code of which nothing is known any more: of mixed channels every one, else where the light of the
/// channel's end does not lie beyond the clip. Empty where there is none.
fn lost(image: &Image, clip: Option<Clip>) -> Vec<bool> {
    if image.code.is_none() {
        return Vec::new();
    }
    let (dark, bright) = (image.light(0.0), image.light(1.0));
    let told = |c: usize| match clip {
        Some(Clip { low, high }) => [dark[c] as f32 <= low, bright[c] as f32 >= high],
        None => [false; 2],
    };
    let [red, green, blue] = [0, 1, 2].map(told);
    let ends = [red, green, blue];
    if ends.as_flattened().iter().all(|told| *told) {
        return Vec::new();
    }
    // Codes are shares of the highest one.
    let is_lost = |rgb: &[f32; 3]| {
        rgb.iter().zip(ends).any(|(&code, [low, high])| (code <= 0.0 && !low) || (code >= 1.0 && !high))
    };
    image.rgb.iter().map(is_lost).collect()
}

/// The haze of a target of `size`: an EXR's channel `haze.Y`, or the Y of an image that has no colours; linear,
/// premultiplied by the target's coverage.
pub(crate) fn haze(path: &Path, target: &Target, size: (u32, u32)) -> Result<Vec<f32>, SceneError> {
    if target.clipped_at.is_some() {
        return Err(SceneError::new(
            path,
            "is the haze of a target of 8 or 16 bits, which is compared one-sided where it is clipped",
            "Give the target as EXR or HDR too, or leave the haze out",
        ));
    }
    let image = read_with(path, Some(size), |opened| match opened.bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => open_exr::decode_haze(opened),
        _ => Err(opened.error(
            "is no EXR file, and the haze is a number without bounds",
            "Save it as an EXR with the channel haze.Y",
        )),
    })?;
    let haze: Vec<f32> = image.rgb.iter().map(|rgb| rgb[0]).collect();
    if let Some(i) = haze.iter().position(|x| x.abs() > BRIGHTEST) {
        let (x, y) = (i % size.0 as usize, i / size.0 as usize);
        return Err(SceneError::new(
            path,
            format!(
                "has {:?} at pixel ({x}, {y}): errors beyond {BRIGHTEST:e} have no square in 32 bits",
                haze[i]
            ),
            "Scale the haze, and the environment's intensity with it",
        ));
    }
    Ok(haze)
}

/// The first channel of a mask: what each pixel counts. A mask that counts nothing is refused.
fn read_mask(path: &Path, size: (u32, u32), warnings: &mut Warnings) -> Result<Vec<f32>, SceneError> {
    let Image { rgb, .. } = read(path, Some(size))?;
    let mask = clamp(rgb.iter().map(|rgb| rgb[0]).collect(), "weight", path, warnings);
    if mask.iter().all(|&weight| weight == 0.0) {
        return Err(SceneError::new(
            path,
            "is an empty mask: no pixel is above 0, so nothing would be compared",
            "Paint white what counts, or leave the mask out",
        ));
    }
    Ok(mask)
}

/// Values in [0, 1]; others are clamped, and counted where they are off by more than rounding.
fn clamp(mut values: Vec<f32>, what: &str, path: &Path, warnings: &mut Warnings) -> Vec<f32> {
    // Filters and half floats leave coverages a little above 1.
    let off = values.iter().filter(|value| !(-1e-3..=1.001).contains(*value)).count();
    if off > 0 {
        warn(warnings, path, format!("{off} pixels have a {what} outside [0, 1]: clamped"));
    }
    values.iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
    values
}
