//! Cameras that another program solved or placed, as views of a scene file.
//!
//! - [`colmap`]: COLMAP's sparse models, as text or binary
//! - [`transforms`]: `transforms.json`, as instant-ngp, nerfstudio and exporters for Blender and Metashape write it

pub mod colmap;
pub mod transforms;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DMat3, DMat4};

use super::error::SceneError;
use super::lens::{Distortion, Lens};
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

    /// What no camera has.
    fn problem(&self) -> Option<String> {
        let Self { size, focal, centre, .. } = self;
        let sound = |length: &f64| length.is_finite() && *length > 0.0;
        if size.contains(&0) {
            return Some(format!("an image of {} x {} pixels", size[0], size[1]));
        }
        if !focal.iter().all(sound) {
            return Some(format!("the focal lengths {} and {}", focal[0], focal[1]));
        }
        (!centre.iter().all(|place| place.is_finite())).then(|| "a centre that is not finite".to_owned())
    }
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
