//! A camera and its seven unknowns, each in pixels.

use glam::{DMat4, DQuat, DVec3};

use crate::scene::mesh::PosedMesh;
use crate::scene::view::Camera;

/// How many a camera has: a turn about three axes, a shift along three, and the focal length.
pub(super) const COUNT: usize = 7;
/// Which of them is the focal length, and which the shift along the view: both scale the image.
pub(super) const FOCAL: usize = 6;
pub(super) const ALONG: usize = 5;

/// What a camera's unknowns are measured by. A step of 1 of any moves what is at the mesh's border by about a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixels {
    /// The mesh's middle, in the camera.
    middle: DVec3,
    /// Of each unknown, how much of it moves the image by a pixel: radians, units of length, and a logarithm.
    unit: [f64; COUNT],
}

impl Pixels {
    /// For a camera that has some of the mesh in its image; `None` otherwise.
    pub(super) fn new(camera: &Camera, mesh: &PosedMesh) -> Option<Self> {
        // Of what is in the image: a body may go on behind the camera.
        let shown = |p: &DVec3| {
            let (x, y, depth) = camera.project(*p);
            depth > 0.0
                && (0.0..=f64::from(camera.width)).contains(&x)
                && (0.0..=f64::from(camera.height)).contains(&y)
        };
        let ends = mesh.positions.iter().map(|p| p.as_dvec3()).filter(shown);
        let least = ends.clone().reduce(DVec3::min)?;
        let most = ends.reduce(DVec3::max)?;
        let middle = camera.world_to_camera.transform_point3(0.5 * (least + most));
        let radius = 0.5 * (most - least).length();
        let depth = -middle.z;
        let focal = 0.5 * f64::from(camera.height) / (0.5 * camera.fov_y).tan();
        if depth <= 0.0 || radius <= 0.0 {
            return None;
        }
        // What of the mesh is in the image reaches at most to the image's corner.
        let across = f64::from(camera.width).hypot(f64::from(camera.height));
        let border = (radius * focal / depth).min(0.5 * across).max(1.0);
        let turn = 1.0 / border;
        let shift = depth / focal;
        Some(Self { middle, unit: [turn, turn, turn, shift, shift, depth / border, 1.0 / border] })
    }

    /// The camera moved by `by` along each unknown, in pixels.
    pub(super) fn moved(&self, camera: &Camera, by: &[f64; COUNT]) -> Camera {
        let by: [f64; COUNT] = std::array::from_fn(|i| by[i] * self.unit[i]);
        let turn = DQuat::from_scaled_axis(DVec3::new(by[0], by[1], by[2]));
        let shift = DVec3::new(by[3], by[4], by[ALONG]);
        // About the mesh's middle, in the camera.
        let about = DMat4::from_translation(self.middle + shift)
            * DMat4::from_quat(turn)
            * DMat4::from_translation(-self.middle);
        let tangent = (0.5 * camera.fov_y).tan() * by[FOCAL].exp();
        Camera { world_to_camera: about * camera.world_to_camera, fov_y: 2.0 * tangent.atan(), ..*camera }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_step_of_one_is_about_a_pixel_and_cameras_stay_rigid() {
        let corners = [[-1., -1., -1.], [1., 1., 1.], [-1., 1., -1.], [1., -1., 1.]].map(Vec3::from_array);
        let mesh = PosedMesh { positions: corners.to_vec(), ..PosedMesh::default() };
        let world_to_camera =
            DMat4::from_translation(DVec3::new(0.2, 0.1, -9.0)) * DMat4::from_rotation_y(0.3);
        let camera = Camera::pinhole(world_to_camera, 0.4, [200, 160]);
        let pixels = Pixels::new(&camera, &mesh).unwrap();
        for unknown in 0..COUNT {
            let mut by = [0.0; COUNT];
            by[unknown] = 1.0;
            let moved = pixels.moved(&camera, &by);
            let rotation = glam::DMat3::from_mat4(moved.world_to_camera);
            let error = rotation.transpose() * rotation - glam::DMat3::IDENTITY;
            // Some roundings of f64.
            assert!(error.to_cols_array().iter().all(|x| x.abs() < 1e-14));
            let moves = corners.map(|corner| {
                let ((x, y, _), (u, v, _)) =
                    (camera.project(corner.as_dvec3()), moved.project(corner.as_dvec3()));
                (x - u).hypot(y - v)
            });
            let most = moves.into_iter().fold(0.0, f64::max);
            // A turn moves what is beside its axis more than what is on it.
            assert!((0.4..1.6).contains(&most), "unknown {unknown}: {moves:?}");
        }
    }
}
