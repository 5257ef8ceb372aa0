//! `transforms.json`: a camera-to-world matrix a picture, in OpenGL's axes, as instant-ngp and nerfstudio have it.

use std::path::{Path, PathBuf};

use glam::{DMat3, DMat4, DVec4};

use super::{ImportedView, Intrinsics, Names, brown, damaged, picture_file, side};
use crate::cameras::turns_alone;
use crate::error::{SceneError, read_bytes};
use crate::images::size_of;
use crate::lens::Distortion;

/// No such file above this many bytes is read.
const MOST_BYTES: u64 = 1 << 30;

/// A camera's numbers; a frame may have its own.
#[derive(Clone, Debug, Default, serde::Deserialize)]
struct Numbers {
    camera_model: Option<String>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    #[serde(default)]
    is_fisheye: bool,
}

#[derive(serde::Deserialize)]
struct File {
    #[serde(flatten)]
    all: Numbers,
    frames: Vec<Frame>,
}

#[derive(serde::Deserialize)]
struct Frame {
    file_path: PathBuf,
    transform_matrix: [[f64; 4]; 4],
    #[serde(flatten)]
    own: Numbers,
}

/// The views of the file, in its order. Pictures whose size the file does not tell, as Blender's does not, are looked for in
/// the folder `images` and beside the file.
///
/// # Errors
/// When it is damaged, a camera has distortion of a kind that scenes do not know, or a size is not known.
pub fn read(path: &Path, images: Option<&Path>) -> Result<Vec<ImportedView>, SceneError> {
    let bytes = read_bytes(path, MOST_BYTES)?;
    let file: File = serde_json::from_slice(&bytes).map_err(|error| {
        damaged(path, format!("line {}", error.line()), format!("is no transforms.json: {error}"))
    })?;
    let mut names = Names::new();
    let view = |(i, frame): (usize, Frame)| {
        let place = format!("frame {i}");
        let rows = frame.transform_matrix.as_flattened();
        let matrix = DMat4::from_cols_array(rows.try_into().unwrap_or(&[0.0; 16])).transpose();
        let motion = matrix.is_finite().then_some(()).ok_or("is not finite");
        let affine = || match (matrix.row(3) - DVec4::W).abs().max_element() <= 1e-9 {
            true => Ok(()),
            false => Err("has a last row other than 0, 0, 0, 1 (is it stored by columns?)"),
        };
        if let Err(what) = motion.and_then(|()| affine()).and_then(|()| turns_alone(DMat3::from_mat4(matrix)))
        {
            return Err(damaged(path, place, format!("has a transform_matrix that {what}")));
        }
        let known = given(&frame.own, &file.all, |n| n.w).zip(given(&frame.own, &file.all, |n| n.h));
        let size = match known {
            Some((width, height)) => [width, height],
            None => picture_size(path, &place, images, &frame.file_path)?,
        };
        let intrinsics = intrinsics(path, &place, &frame.own, &file.all, size)?;
        let camera = intrinsics.placed(matrix.inverse());
        Ok(ImportedView { name: names.of(&frame.file_path), camera, picture: frame.file_path })
    };
    file.frames.into_iter().enumerate().map(view).collect()
}

/// A frame's number, where it has one, over that of all.
fn given(own: &Numbers, all: &Numbers, number: fn(&Numbers) -> Option<f64>) -> Option<f64> {
    number(own).or_else(|| number(all))
}

/// The size of a frame's picture, by the picture itself.
fn picture_size(
    path: &Path,
    place: &str,
    images: Option<&Path>,
    picture: &Path,
) -> Result<[f64; 2], SceneError> {
    let beside = path.parent().unwrap_or(Path::new(""));
    let file = images.into_iter().chain([beside]).find_map(|folder| picture_file(folder, picture));
    let file = file.ok_or_else(|| {
        let what = format!("has no w and h, and its picture {} is not there either", picture.display());
        let remedy = "Add the width and height of the pictures to the file, as w and h, or name their folder";
        SceneError::new(path, what, remedy).at(place)
    })?;
    Ok(size_of(&file)?.map(f64::from))
}

/// A frame's numbers, where it has some, over those of all.
fn intrinsics(
    path: &Path,
    place: &str,
    own: &Numbers,
    all: &Numbers,
    [width, height]: [f64; 2],
) -> Result<Intrinsics, SceneError> {
    let given = |number: fn(&Numbers) -> Option<f64>| given(own, all, number);
    let of_angle = |angle: Option<f64>, pixels: f64| angle.map(|angle| 0.5 * pixels / (0.5 * angle).tan());
    let across = given(|n| n.fl_x).or_else(|| of_angle(given(|n| n.camera_angle_x), width));
    let down = given(|n| n.fl_y).or_else(|| of_angle(given(|n| n.camera_angle_y), height));
    let (Some(fx), Some(fy)) = (across.or(down), down.or(across)) else {
        return Err(damaged(path, place, "has no fl_x and no camera_angle_x, and neither has the file"));
    };
    let coefficient = |number: fn(&Numbers) -> Option<f64>| given(number).unwrap_or(0.0);
    let k = [coefficient(|n| n.k1), coefficient(|n| n.k2), coefficient(|n| n.k3), coefficient(|n| n.k4)];
    let p = [coefficient(|n| n.p1), coefficient(|n| n.p2)];
    if k.iter().chain(&p).any(|x| !x.is_finite()) {
        return Err(damaged(path, place, "has a coefficient that is not finite"));
    }
    let model = own.camera_model.as_deref().or(all.camera_model.as_deref()).unwrap_or("OPENCV");
    let fisheye = own.is_fisheye || all.is_fisheye || model == "OPENCV_FISHEYE";
    let distortion = match model {
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV_FISHEYE"
            if fisheye =>
        {
            Some(Distortion::Fisheye { k })
        }
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" if k[3] == 0.0 => {
            let [k1, k2, k3, _] = k;
            brown([k1, k2, k3], p)
        }
        _ => {
            let what = format!("has the camera model {model}, whose distortion no scene knows");
            return Err(SceneError::new(path, what, "Undistort the images first").at(place));
        }
    };
    let centre = [given(|n| n.cx).unwrap_or(0.5 * width), given(|n| n.cy).unwrap_or(0.5 * height)];
    Intrinsics { size: [side(width), side(height)], focal: [fx, fy], centre, distortion }.checked(path, place)
}
