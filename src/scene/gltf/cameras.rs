//! The cameras of a file's nodes, placed in the world.

use glam::{DMat4, DVec3};

use super::document::Document;
use crate::error::SceneError;
use crate::view::looking;

/// A perspective camera of the file. It looks along its node's -Z, and what is along +Y is upright.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FileCamera {
    /// Its node's name, else its own, else `camera_N` after its place in the file.
    pub name: String,
    /// Where it stands.
    pub eye: DVec3,
    /// World to camera, a rigid motion; `None` at a node that mirrors, shears or has no size.
    pub world_to_camera: Option<DMat4>,
    /// Vertical field of view, radians.
    pub fov_y: f64,
    /// Width over height, where the file says.
    pub aspect: Option<f64>,
}

impl Document {
    /// The perspective cameras of the scene's nodes, at the nodes' `time` as meshes are. Orthographic ones are left out.
    pub(crate) fn cameras(&self, time: Option<f64>) -> Result<Vec<FileCamera>, SceneError> {
        let nodes = self.nodes(time)?;
        let mut cameras = Vec::new();
        for &i in &nodes.in_scene {
            let node = &self.root.nodes[i];
            let Some(index) = node.camera else { continue };
            let camera = self.get(&self.root.cameras, index, "camera")?;
            let Some(lens) = &camera.perspective else { continue };
            let name = node.name.as_ref().or(camera.name.as_ref());
            let name = name.cloned().unwrap_or_else(|| format!("camera_{}", index.value()));
            let world_to_camera = without_scale(nodes.world[i]);
            let eye = nodes.world[i].w_axis.truncate();
            let aspect = lens.aspect_ratio.map(f64::from).filter(|aspect| *aspect > 0.0);
            cameras.push(FileCamera { name, eye, world_to_camera, fov_y: f64::from(lens.yfov), aspect });
        }
        Ok(cameras)
    }
}

/// The inverse of a node's placement without its scale, which says nothing of what a camera sees; `None` where an image
/// of it would be mirrored or sheared.
fn without_scale(world: DMat4) -> Option<DMat4> {
    let axes = [world.x_axis, world.y_axis, world.z_axis].map(|axis| axis.truncate().try_normalize());
    let [Some(x), Some(y), Some(z)] = axes else { return None };
    // The tolerance that a scene file's own matrix has.
    let across = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-3;
    if !(across(x, y) && across(y, z) && across(z, x)) || x.cross(y).dot(z) < 0.0 {
        return None;
    }
    // Orthonormal to the last digit, by what is seen: along -Z, upright along Y.
    Some(looking(world.w_axis.truncate(), -z, y))
}
