//! What is baked of an animation's frames: of each its own, or of fewer poses, and of frames between two by lines.

use std::path::Path;

use super::super::{Refusal, tell_warnings};
use super::frames::ROUNDING;
use crate::bake::{self, PoseBake, SkyLight};
use crate::scene::Scene;
use crate::scene::animation::Animation;
use crate::scene::mesh::Mesh;

/// Bakes of poses, as an animation goes on.
pub(super) struct ClipBakes<'a> {
    animation: &'a Animation,
    /// Poses a second; each frame's own without.
    rate: Option<f64>,
    cache: Option<&'a Path>,
    /// The environment's light, once one bake has it.
    light: Option<SkyLight>,
    /// Of the poses around the last frame, by their numbers.
    kept: Vec<(u64, PoseBake)>,
}

impl<'a> ClipBakes<'a> {
    pub(super) fn new(animation: &'a Animation, rate: Option<f64>, cache: Option<&'a Path>) -> Self {
        Self { animation, rate, cache, light: None, kept: Vec::new() }
    }

    /// The bake for `mesh`, which is the animation's at `time`.
    pub(super) fn at(&mut self, scene: &Scene, mesh: &Mesh, time: f64) -> Result<PoseBake, Refusal> {
        let Some(rate) = self.rate else { return Ok(self.baked(scene, mesh)) };
        let place = (time - self.animation.seconds.0).max(0.0) * rate;
        // What misses a pose by a rounding is that pose.
        let before = (place + ROUNDING).floor();
        let (from, to) = (self.time(rate, before as u64), self.time(rate, before as u64 + 1));
        let share = if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        let from = self.pose(scene, rate, before as u64)?;
        if share < ROUNDING {
            return Ok(from);
        }
        let to = self.pose(scene, rate, before as u64 + 1)?;
        if share > 1.0 - ROUNDING {
            return Ok(to);
        }
        Ok(from.between(&to, share as f32).unwrap_or(from))
    }

    /// When the pose of that number is; behind the last key all are at the last key.
    fn time(&self, rate: f64, number: u64) -> f64 {
        let (first, last) = self.animation.seconds;
        (first + number as f64 / rate).min(last)
    }

    /// The bake of the pose of that number.
    fn pose(&mut self, scene: &Scene, rate: f64, number: u64) -> Result<PoseBake, Refusal> {
        if let Some((_, bake)) = self.kept.iter().find(|(of, _)| *of == number) {
            return Ok(bake.clone());
        }
        let mesh = self.animation.mesh(self.time(rate, number))?;
        let bake = self.baked(scene, &mesh);
        // One frame needs two of them.
        if self.kept.len() == 2 {
            self.kept.remove(0);
        }
        self.kept.push((number, bake.clone()));
        Ok(bake)
    }

    fn baked(&mut self, scene: &Scene, mesh: &Mesh) -> PoseBake {
        let (bake, stats) = bake::bake_pose(scene, &mesh.pose(), self.light.as_ref(), self.cache);
        self.light = self.light.take().or_else(|| bake.sky.as_ref()?.light.clone());
        tell_warnings(&stats.warnings);
        bake
    }
}
