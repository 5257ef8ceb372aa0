//! Which frames are rendered: one, a turn around the mesh, or an animation; and their files.

use std::path::{Path, PathBuf};

use glam::{DMat4, DVec3};

use crate::scene::mesh::Mesh;
use crate::scene::view::Camera;

/// One image of a sequence.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) camera: Camera,
    /// Seconds into the animation; `None`: the scene's own pose.
    pub(super) time: Option<f64>,
    pub(super) path: PathBuf,
}

/// The single frame of `camera`.
pub(super) fn still(camera: Camera, output: &Path) -> Vec<Frame> {
    vec![Frame { camera, time: None, path: output.to_owned() }]
}

/// `count` frames of a whole turn of the camera about the vertical axis through the mesh.
pub(super) fn turntable(camera: &Camera, mesh: &Mesh, count: u32, output: &Path) -> Vec<Frame> {
    let axis = middle(mesh);
    let frame = |i: u32| {
        let turn = std::f64::consts::TAU * f64::from(i) / f64::from(count);
        let about_axis =
            DMat4::from_translation(axis) * DMat4::from_rotation_y(-turn) * DMat4::from_translation(-axis);
        let camera = Camera { world_to_camera: camera.world_to_camera * about_axis, ..*camera };
        Frame { camera, time: None, path: numbered(output, i, count) }
    };
    (0..count).map(frame).collect()
}

/// `count` frames of the animation from its first key to its last, evenly.
pub(super) fn animation(camera: &Camera, (first, last): (f64, f64), count: u32, output: &Path) -> Vec<Frame> {
    let frame = |i: u32| {
        let share = f64::from(i) / f64::from((count - 1).max(1));
        let time = Some(first + share * (last - first));
        Frame { camera: *camera, time, path: numbered(output, i, count) }
    };
    (0..count).map(frame).collect()
}

/// The middle of the mesh's bounding box as it stands.
fn middle(mesh: &Mesh) -> DVec3 {
    let posed = mesh.pose().positions;
    let low = posed.iter().copied().reduce(glam::Vec3::min).unwrap_or_default();
    let high = posed.iter().copied().reduce(glam::Vec3::max).unwrap_or_default();
    0.5 * (low.as_dvec3() + high.as_dvec3())
}

/// `turn.png` as `turn.0007.png`.
fn numbered(output: &Path, i: u32, count: u32) -> PathBuf {
    let digits = (count.max(1) - 1).to_string().len().max(4);
    let stem = output.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = output.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    output.with_file_name(format!("{stem}.{i:0digits$}.{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_turn_keeps_the_distance_and_begins_where_the_camera_stands() {
        let positions = vec![Vec3::new(1.0, 0.0, 2.0), Vec3::new(3.0, 4.0, 4.0)];
        let mesh = Mesh { normals: vec![Vec3::Y; 2], positions, ..Mesh::default() };
        let world_to_camera = DMat4::from_translation(DVec3::new(-2.0, -1.0, -9.0));
        let camera = Camera::pinhole(world_to_camera, 0.5, [4, 4]);
        let frames = turntable(&camera, &mesh, 4, Path::new("a/turn.png"));
        assert_eq!(frames[0].camera, camera);
        // From +Z a quarter turn leads to +X: the axis is at (2, 3), the eye 6 away from it.
        let eye = frames[1].camera.eye();
        assert!((eye - DVec3::new(8.0, 1.0, 3.0)).length() < 1e-12, "{eye}");
        assert_eq!(frames[1].path, Path::new("a/turn.0001.png"));
    }
}
