//! Calibrations as OpenCV's `FileStorage` (YAML or XML) and ROS (`camera_info`) write them: a lens, without a pose.
//!
//! - `entries`: what both kinds of files come to; `yaml`, `xml`: their readers
//!
//! OpenCV counts pixels from the middle of the upper left one (its chessboard corners and `projectPoints` do), and scenes
//! from that pixel's corner: half a pixel is added to both coordinates of the centre.

mod entries;
mod xml;
mod yaml;

use std::path::Path;

use glam::DMat4;

use self::entries::Entries;
use super::{Intrinsics, brown, damaged, side};
use crate::error::{SceneError, read_bytes};
use crate::lens::Distortion;
use crate::view::Camera;

/// No such file above this many bytes is read: it holds some dozens of numbers, and the corners that they were found with.
const MOST_BYTES: u64 = 1 << 26;
/// How many coefficients OpenCV's model has (`calibrateCamera`); beyond the fifth, scenes have none.
const COUNTS: [usize; 6] = [0, 4, 5, 8, 12, 14];
/// Names of the same things: by OpenCV's samples, by ROS' files and by its messages.
const MATRIX: [&str; 5] = ["camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "k"];
const COEFFICIENTS: [&str; 8] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "dist_coeff",
    "distCoeffs",
    "D",
    "d",
];
const WIDTH: [&str; 3] = ["image_width", "image_Width", "width"];
const HEIGHT: [&str; 3] = ["image_height", "image_Height", "height"];
const SIZE: [&str; 2] = ["image_size", "imageSize"];

/// The camera of a calibration; it stands in the origin and looks along its own -Z, as nothing else is known of it.
///
/// # Errors
/// When the file is damaged, or its distortion is of a kind that scenes do not know.
pub fn read(path: &Path) -> Result<Camera, SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    let text = std::str::from_utf8(&bytes).map_err(|_| damaged(path, "its text", "is not UTF-8"))?;
    let text = text.trim_start_matches('\u{feff}');
    let entries = if text.trim_start().starts_with('<') {
        xml::entries(path, text)?
    } else {
        yaml::entries(path, text)?
    };
    intrinsics(&entries).map(|intrinsics| intrinsics.placed(DMat4::IDENTITY))
}

fn intrinsics(entries: &Entries<'_>) -> Result<Intrinsics, SceneError> {
    let (place, matrix) = entries.matrix(&MATRIX)?.ok_or_else(|| {
        let what = "has no camera_matrix, so it is no calibration by OpenCV";
        SceneError::new(entries.path, what, "Name a file of cv::FileStorage, or ROS' camera_info")
    })?;
    let [fx, skew, cx, zero, fy, cy, ..] = match <[f64; 9]>::try_from(matrix) {
        Ok(matrix) if matrix[6..] == [0.0, 0.0, 1.0] => matrix,
        _ => return Err(damaged(entries.path, place, "is no camera matrix of 3 x 3 numbers")),
    };
    if skew != 0.0 || zero != 0.0 {
        let what = "has skew between its axes, which no scene's lens has";
        return Err(SceneError::new(entries.path, what, "Calibrate without skew").at(place));
    }
    check_uncut(entries)?;
    let (sizes, [width, height]) = size(entries)?;
    let centre = [cx + 0.5, cy + 0.5];
    let size = [side(width), side(height)];
    let distortion = distortion(entries)?;
    // Where the size is of no image, its own place is told.
    let at = if size.contains(&0) { sizes } else { place };
    Intrinsics { size, focal: [fx, fy], centre, distortion }.checked(entries.path, &at)
}

/// Width and height, and where they stand.
fn size(entries: &Entries<'_>) -> Result<(String, [f64; 2]), SceneError> {
    if let Some((place, pixels)) = entries.numbers(&SIZE)? {
        let pixels = <[f64; 2]>::try_from(pixels);
        return match pixels {
            Ok(pixels) => Ok((place, pixels)),
            Err(_) => Err(damaged(entries.path, place, "is no width and height")),
        };
    }
    match (entries.number(&WIDTH)?, entries.number(&HEIGHT)?) {
        (Some((place, width)), Some((_, height))) => Ok((place, [width, height])),
        _ => Err(SceneError::new(
            entries.path,
            "does not say how large its images are",
            "Add image_width and image_height, in pixels",
        )),
    }
}

/// Refuse a camera that gives a part of its image, or pixels taken together, of which the matrix is not.
fn check_uncut(entries: &Entries<'_>) -> Result<(), SceneError> {
    let whole: [(&str, &[f64]); 4] = [
        ("binning_x", &[0.0, 1.0]),
        ("binning_y", &[0.0, 1.0]),
        ("roi.x_offset", &[0.0]),
        ("roi.y_offset", &[0.0]),
    ];
    for (name, none) in whole {
        if let Some((place, _)) = entries.number(&[name])?.filter(|(_, number)| !none.contains(number)) {
            let what = "cuts or bins the image that the matrix is of";
            return Err(SceneError::new(entries.path, what, "Calibrate the image as it is").at(place));
        }
    }
    Ok(())
}

fn distortion(entries: &Entries<'_>) -> Result<Option<Distortion>, SceneError> {
    let absent = || ("its coefficients".to_owned(), Vec::new());
    let (place, mut k) = match entries.matrix(&COEFFICIENTS)? {
        Some(found) => found,
        // A file that ends before its numbers has no pinhole.
        None => match entries.announced(&COEFFICIENTS).or_else(|| model_of(entries)) {
            Some(place) => return Err(damaged(entries.path, place, "announces coefficients, and has none")),
            None => absent(),
        },
    };
    let foreign = |what: String| {
        let remedy = "Calibrate with k1, k2, p1, p2 and k3 alone, or undistort the pictures";
        SceneError::new(entries.path, what, remedy).at(place.clone())
    };
    if fisheye(entries)? {
        return match *k {
            [k1, k2, k3, k4] => Ok(Some(Distortion::Fisheye { k: [k1, k2, k3, k4] })),
            _ => Err(damaged(entries.path, place, "has no four coefficients, as a fisheye's are")),
        };
    }
    if !COUNTS.contains(&k.len()) {
        let what = format!("has {} coefficients, and OpenCV's models have 4, 5, 8, 12 or 14", k.len());
        return Err(damaged(entries.path, place, what));
    }
    if entries.number(&["xi"])?.is_some_and(|(_, xi)| xi != 0.0) {
        return Err(foreign("is of cv::omnidir, which has a mirror".to_owned()));
    }
    if k.iter().skip(5).any(|k| *k != 0.0) {
        return Err(foreign(format!("has {} coefficients, and scenes' lenses have five", k.len())));
    }
    k.resize(5, 0.0);
    Ok(brown([k[0], k[1], k[4]], [k[2], k[3]]))
}

/// Where a distortion has a name.
fn model_of(entries: &Entries<'_>) -> Option<String> {
    entries.word("distortion_model").filter(|(_, model)| !model.is_empty()).map(|(place, _)| place)
}

/// Whether the model is that of cv::fisheye.
fn fisheye(entries: &Entries<'_>) -> Result<bool, SceneError> {
    if entries.number(&["fisheye_model"])?.is_some_and(|(_, flag)| flag != 0.0) {
        return Ok(true);
    }
    let Some((place, model)) = entries.word("distortion_model") else { return Ok(false) };
    match model {
        // An empty one is of a camera without distortion.
        "" | "plumb_bob" | "rational_polynomial" => Ok(false),
        "equidistant" | "fisheye" => Ok(true),
        other => {
            let what = format!("has the distortion model {other:?}, which no scene knows");
            Err(SceneError::new(entries.path, what, "Calibrate with plumb_bob or equidistant").at(place))
        }
    }
}
