//! A shot as a panorama sees it: which point of its picture shows a direction of the world, and how deep inside.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::Shot;

/// Pixels along a border that a bicubic value reaches beyond: they show what is outside the image circle.
const REACH: f64 = 2.0;

/// A shot, turned.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) shot: &'a Shot,
    world_to_camera: DMat3,
    pixels_per_radian: f64,
}

impl<'a> View<'a> {
    pub(super) fn new(shot: &'a Shot, orientation: DQuat) -> Self {
        let world_to_camera = DMat3::from_quat(orientation.conjugate());
        Self { shot, world_to_camera, pixels_per_radian: shot.lens.pixels_per_radian() }
    }

    /// The point of the picture that shows a unit direction of the world, and how far it is from the nearest border of
    /// the lens or the picture, radians; `None` outside.
    pub(super) fn look(&self, direction: DVec3) -> Option<(DVec2, f64)> {
        let in_camera = self.world_to_camera * direction;
        let reach = REACH / self.pixels_per_radian;
        let depth = self.shot.lens.depth(in_camera) - reach;
        if depth <= 0.0 {
            return None;
        }
        let point = self.shot.lens.point(in_camera)?;
        let picture = &self.shot.picture;
        let edge = point.min(DVec2::new(picture.width as f64, picture.height as f64) - point).min_element();
        let depth = depth.min(edge / self.pixels_per_radian - reach);
        (depth > 0.0).then_some((point, depth))
    }

    /// The angle of a pixel in the middle of the picture, radians.
    pub(super) fn pixel_angle(&self) -> f64 {
        1.0 / self.pixels_per_radian
    }
}
