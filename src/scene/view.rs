//! Cameras and targets.

use glam::{DMat3, DMat4, DVec3, DVec4};

use super::lens::Lens;

/// One view of the scene.
#[derive(Clone, Debug)]
pub struct View {
    /// Its name, unique in the scene; names files and report rows.
    pub name: String,
    /// Its camera.
    pub camera: Camera,
    /// The image to be matched.
    pub target: Option<Target>,
    /// What pictures of it show behind the mesh.
    pub background: Background,
}

/// What pictures show behind the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// Nothing: pictures end at the silhouette.
    #[default]
    None,
    /// The environment, as the camera sees it.
    Environment,
    /// One colour: linear radiance, Rec.709.
    Color([f64; 3]),
}

/// A perspective camera that looks down its own -Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// World to camera, acting on column vectors; a rigid motion.
    pub world_to_camera: DMat4,
    /// Vertical field of view of a pinhole of its focal length, radians.
    pub fov_y: f64,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// How it is no pinhole in the middle of its image.
    pub lens: Lens,
}

impl Camera {
    /// A pinhole in the middle of its image; the vertical field of view is in radians.
    #[must_use]
    pub fn pinhole(world_to_camera: DMat4, fov_y: f64, [width, height]: [u32; 2]) -> Self {
        Self { world_to_camera, fov_y, width, height, lens: Lens::default() }
    }

    /// The eye in the world.
    #[must_use]
    pub fn eye(&self) -> DVec3 {
        self.world_to_camera.inverse().w_axis.truncate()
    }

    /// The unit direction in the world through the image point (x, y), in pixels from the top left
    /// corner; a pixel's centre is at half numbers.
    #[must_use]
    #[inline]
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let [right, down] = self.image_plane(x, y).unwrap_or_else(|place| place);
        let local = DVec4::new(right, -down, -1.0, 0.0);
        (self.world_to_camera.inverse() * local).truncate().normalize()
    }

    /// Where on the image plane, one in front of the eye, the light comes from that meets an image point: to the right and
    /// down.
    ///
    /// # Errors
    /// Where no light meets it, as the lens bends it: the place of a pinhole.
    #[inline]
    pub fn image_plane(&self, x: f64, y: f64) -> Result<[f64; 2], [f64; 2]> {
        let tangent = (0.5 * self.fov_y).tan();
        let aspect = f64::from(self.width) / f64::from(self.height);
        let [cx, cy] = self.lens.centre;
        let ndc_x = 2.0 * (x - cx) / f64::from(self.width) - 1.0;
        let ndc_y = 2.0 * (y - cy) / f64::from(self.height) - 1.0;
        let place = [ndc_x * tangent * aspect / self.lens.ratio, ndc_y * tangent];
        self.lens.undistorted(place).ok_or(place)
    }

    /// The image point, in pixels, and the distance along the camera's axis of a world point.
    #[must_use]
    #[inline]
    pub fn project(&self, point: DVec3) -> (f64, f64, f64) {
        let p = self.world_to_camera.transform_point3(point);
        let depth = -p.z;
        let tangent = (0.5 * self.fov_y).tan();
        let aspect = f64::from(self.width) / f64::from(self.height);
        let [right, down] = self.lens.distorted([p.x / depth, -p.y / depth]).0;
        let ndc_x = right * self.lens.ratio / (tangent * aspect);
        let ndc_y = down / tangent;
        let [cx, cy] = self.lens.centre;
        (
            0.5 * (ndc_x + 1.0) * f64::from(self.width) + cx,
            0.5 * (ndc_y + 1.0) * f64::from(self.height) + cy,
            depth,
        )
    }
}

/// World to camera of one that stands at `eye` and looks along a unit vector; what is along `up`, which is across it, is
/// upright in its image.
pub(super) fn looking(eye: DVec3, along: DVec3, up: DVec3) -> DMat4 {
    let right = along.cross(up).normalize();
    let rows = DMat3::from_cols(right, right.cross(along), -along).transpose();
    DMat4::from_mat3_translation(rows, rows * -eye)
}

/// An image to be matched, at the camera's size.
#[derive(Clone, Debug)]
pub struct Target {
    /// Linear radiance, premultiplied by coverage, row by row from the top.
    pub rgb: Vec<[f32; 3]>,
    /// Coverage in [0, 1]; `None` when the file has no alpha: then only pixels that the mesh covers
    /// fully are compared.
    pub alpha: Option<Vec<f32>>,
    /// The haze (`haze_weight` dapple a E_s(R).a), premultiplied by coverage, row by row from the top; `None`:
    /// none is compared.
    pub haze: Option<Vec<f32>>,
    /// What each pixel counts, in [0, 1]; `None`: 1 everywhere.
    pub mask: Option<Vec<f32>>,
    /// Whether the file holds 8-bit values, of which 0 and 255 may be clipped: there the residual
    /// is one-sided.
    pub clipped_at: Option<Clip>,
}

/// The linear values at and beyond which a target is clipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// At or below this, only too bright a model counts.
    pub low: f32,
    /// At or above this, only too dark a model counts.
    pub high: f32,
}
