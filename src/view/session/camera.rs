//! The camera, turned about the mesh.

use glam::{DMat4, DVec3};

use crate::scene::view::Camera;

/// How a camera is turned away from a view's; the default leaves it there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Radians about the world's vertical axis.
    pub yaw: f64,
    /// Radians about the camera's own horizontal axis.
    pub pitch: f64,
    /// Factor on the distance from the middle of the mesh.
    pub distance: f64,
}

impl Default for Orbit {
    fn default() -> Self {
        Self { yaw: 0.0, pitch: 0.0, distance: 1.0 }
    }
}

impl Orbit {
    /// Turn by `yaw` and `pitch`, in radians, and multiply the distance by `distance`.
    pub fn turn(&mut self, yaw: f64, pitch: f64, distance: f64) {
        self.yaw += yaw;
        self.pitch = (self.pitch + pitch).clamp(-1.5, 1.5);
        self.distance = (self.distance * distance).clamp(0.05, 20.0);
    }

    /// A view's camera, turned about `centre`.
    #[must_use]
    pub fn turned(&self, camera: &Camera, centre: DVec3) -> Camera {
        if *self == Self::default() {
            return *camera;
        }
        let about = |turn: DMat4, centre: DVec3| {
            DMat4::from_translation(centre) * turn * DMat4::from_translation(-centre)
        };
        let view = camera.world_to_camera * about(DMat4::from_rotation_y(self.yaw), centre);
        let middle = view.transform_point3(centre);
        let away = DMat4::from_translation(DVec3::new(0.0, 0.0, middle.z * (self.distance - 1.0)));
        Camera { world_to_camera: away * about(DMat4::from_rotation_x(self.pitch), middle) * view, ..*camera }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_mesh_stays_where_it_is_seen() {
        let turned = DMat4::from_rotation_x(0.4) * DMat4::from_rotation_y(-0.2);
        let world_to_camera = DMat4::from_translation(DVec3::new(0.1, -0.3, -5.0)) * turned;
        let camera = Camera::pinhole(world_to_camera, 0.6, [64, 48]);
        let centre = DVec3::new(0.2, -0.1, 0.3);
        let (x, y, depth) = camera.project(centre);
        let turned = Orbit { yaw: 0.7, pitch: -0.3, distance: 1.0 }.turned(&camera, centre);
        // Roundings of a few products of matrices.
        let (u, v, there) = turned.project(centre);
        assert!((x - u).abs() < 1e-9 && (y - v).abs() < 1e-9 && (depth - there).abs() < 1e-9);
        let far = Orbit { distance: 2.0, ..Orbit::default() }.turned(&camera, centre);
        assert!((far.project(centre).2 - 2.0 * depth).abs() < 1e-9);
        assert_eq!(Orbit::default().turned(&camera, centre), camera);
    }
}
