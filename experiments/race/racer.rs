//! Both engines, as the race drives them.

use skinfit::engine::cpu::CpuEngine;
use skinfit::engine::gpu::GpuEngine;
use skinfit::engine::{Engine, Point};

/// An engine over one view.
pub(crate) trait Racer: Engine {
    /// The image, in the engine's own memory; the CPU's is `planes`, which an earlier one has left.
    fn forward(&self, point: &Point, planes: &mut Vec<Vec<f32>>);
    /// The image, for the host.
    fn image_planes(&self, point: &Point) -> Vec<Vec<f32>>;
    /// What it ran on.
    fn version(&self) -> String;
}

impl Racer for CpuEngine {
    fn forward(&self, point: &Point, planes: &mut Vec<Vec<f32>>) {
        self.image_into(0, point, planes);
        std::hint::black_box(planes);
    }
    fn image_planes(&self, point: &Point) -> Vec<Vec<f32>> {
        self.image(0, point)
    }
    fn version(&self) -> String {
        "rustc, f32 lanes".to_owned()
    }
}

impl Racer for GpuEngine {
    fn forward(&self, point: &Point, _: &mut Vec<Vec<f32>>) {
        // A device that fails says so in the passes.
        let _ = self.shade(point);
    }
    fn image_planes(&self, point: &Point) -> Vec<Vec<f32>> {
        self.image(0, point).unwrap_or_default()
    }
    fn version(&self) -> String {
        self.adapter().to_owned()
    }
}
