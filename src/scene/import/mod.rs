//! Cameras that another program solved or placed, as views of a scene file.
//!
//! - [`colmap`]: COLMAP's sparse models, as text or binary
//! - [`metashape`]: what Agisoft Metashape exports
//! - [`opencv`]: calibrations by OpenCV and ROS, which have no pose
//! - [`transforms`]: `transforms.json`, as instant-ngp, nerfstudio and exporters for Blender and Metashape write it

pub mod colmap;
pub mod metashape;
pub mod opencv;
pub mod transforms;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DMat3, DMat4};

use super::cameras::{LARGEST_COEFFICIENT, LARGEST_SIDE, MOST_RATIO, NARROWEST_FOV, first_unlit};
use super::error::SceneError;
use super::lens::{Distortion, Lens};
use super::numbers::short;
use super::view::Camera;

/// A camera and the picture that it took.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedView {
    /// A name for the view, unique among them.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// The picture, as its source names it.
    pub picture: PathBuf,
}

/// Endings of pictures' files, which some programs leave out.
const ENDINGS: [&str; 8] = ["png", "exr", "jpg", "jpeg", "hdr", "PNG", "JPG", "JPEG"];

/// The file of a picture in `folder`. transforms.json of Blender's own exporter leaves the ending out, and so do Metashape's
/// labels, of files as cameras name them.
#[must_use]
pub fn picture_file(folder: &Path, picture: &Path) -> Option<PathBuf> {
    let file = folder.join(picture);
    // A label may have a full stop, and no ending behind it.
    let ended = |ending: &str| {
        let mut name = file.clone().into_os_string();
        name.push(".");
        name.push(ending);
        PathBuf::from(name)
    };
    let named = !picture.as_os_str().is_empty();
    let with_ending = ENDINGS.into_iter().filter(|_| named).map(ended);
    std::iter::once(file.clone()).chain(with_ending).find(|file| file.is_file())
}

/// A camera's numbers as programs of this kind have them: pixels, from the image's upper left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Intrinsics {
    size: [u32; 2],
    focal: [f64; 2],
    centre: [f64; 2],
    distortion: Option<Distortion>,
}

impl Intrinsics {
    /// The camera that stands as `world_to_camera` has it.
    fn placed(&self, world_to_camera: DMat4) -> Camera {
        let Self { size: [width, height], focal: [fx, fy], centre: [cx, cy], distortion } = *self;
        let (w, h) = (f64::from(width), f64::from(height));
        let lens = Lens { centre: [cx - 0.5 * w, cy - 0.5 * h], ratio: fx / fy, distortion };
        Camera { world_to_camera, fov_y: 2.0 * (0.5 * h / fy).atan(), width, height, lens }
    }

    /// The same, unless it is of no camera, or of none that a view may have.
    fn checked(self, path: &Path, place: &str) -> Result<Self, SceneError> {
        let [width, height] = self.size;
        if i64::from(width.max(height)) > LARGEST_SIDE {
            let what = format!("has an image of {width} x {height} pixels");
            let remedy = format!(
                "A view has at most {LARGEST_SIDE} along a side: scale the pictures down and solve anew"
            );
            return Err(SceneError::new(path, what, remedy).at(place));
        }
        if let Some(problem) = self.problem() {
            return Err(damaged(path, place, format!("has {problem}")));
        }
        // No scene with it could be read.
        if let Some((x, y)) = first_unlit(&self.placed(DMat4::IDENTITY)) {
            let what = format!(
                "has a lens that folds its image over, or sees 89 degrees from its axis, at pixel ({x}, {y})"
            );
            let remedy =
                "Check its coefficients and the image's size, or undistort the pictures and solve anew";
            return Err(SceneError::new(path, what, remedy).at(place));
        }
        Ok(self)
    }

    /// What no camera has.
    fn problem(&self) -> Option<String> {
        let Self { size, focal: [fx, fy], centre: [cx, cy], distortion } = *self;
        let [width, height] = size.map(f64::from);
        if size.contains(&0) {
            return Some(format!("an image of {width} x {height} pixels"));
        }
        // As views' own bounds are.
        let longest = 0.5 * height / (0.5 * NARROWEST_FOV.to_radians()).tan();
        let sound = fy > 0.0 && fy <= longest && (fy / MOST_RATIO..=fy * MOST_RATIO).contains(&fx);
        if !sound {
            return Some(format!("the focal lengths {} and {}", short(fx), short(fy)));
        }
        let within = |place: f64, pixels: f64| (-2.0 * pixels..=3.0 * pixels).contains(&place);
        if !(within(cx, width) && within(cy, height)) {
            return Some(format!("its axis at pixel ({}, {})", short(cx), short(cy)));
        }
        let coefficients = match distortion {
            None => [0.0; 5],
            Some(Distortion::Brown { k: [k1, k2, k3], p: [p1, p2] }) => [k1, k2, k3, p1, p2],
            Some(Distortion::Fisheye { k: [k1, k2, k3, k4] }) => [k1, k2, k3, k4, 0.0],
        };
        let far = coefficients.into_iter().find(|k| k.is_nan() || k.abs() > LARGEST_COEFFICIENT);
        far.map(|k| format!("the coefficient {}", short(k)))
    }
}

/// A number of pixels along a side: 0, which no image has, where it is not a whole one.
fn side(pixels: f64) -> u32 {
    if pixels.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&pixels) { pixels as u32 } else { 0 }
}

/// Brown's distortion; none where all of its numbers are 0.
fn brown(k: [f64; 3], p: [f64; 2]) -> Option<Distortion> {
    (k != [0.0; 3] || p != [0.0; 2]).then_some(Distortion::Brown { k, p })
}

/// From a camera that looks along its +Z, with +Y down, to one that looks along its -Z, with +Y up.
fn turned_over(world_to_camera: DMat4) -> DMat4 {
    DMat4::from_mat3(DMat3::from_diagonal(glam::DVec3::new(1.0, -1.0, -1.0))) * world_to_camera
}

/// Names for views after their pictures' files: what may be in a file name, each once.
struct Names(BTreeSet<String>);

impl Names {
    fn new() -> Self {
        Self(BTreeSet::new())
    }

    fn of(&mut self, picture: &Path) -> String {
        let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
        let safe = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-') { c } else { '_' };
        // Room for a number.
        let mut name: String = stem.chars().take(56).map(safe).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphanumeric()) {
            name = format!("view_{name}");
        }
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let all = std::iter::once(name.clone()).chain(numbered);
        let free = all.into_iter().find(|name| !self.0.contains(&name.to_lowercase())).unwrap_or(name);
        self.0.insert(free.to_lowercase());
        free
    }
}

/// An error in a file of cameras.
fn damaged(path: &Path, place: impl Into<String>, what: impl Into<String>) -> SceneError {
    SceneError::new(path, what, "The file is damaged or of another kind: export it anew").at(place)
}
