//! The forward pass: the image of a view.

use rayon::prelude::*;

use super::{BLOCK, CHUNK, CpuEngine};
use crate::engine::Point;
use crate::engine::kernel::Rims;
use crate::engine::window;
use crate::model::params::Param;
use crate::samples::LANES;
use crate::with_simd;

impl CpuEngine {
    /// The image of view `index` at `point`: for each pixel slot the mean over its visible samples,
    /// colour and (where the haze is compared) alpha, times the view's gain.
    #[must_use]
    pub fn image(&self, index: usize, point: &Point) -> Vec<Vec<f32>> {
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&point.params, lobe.as_deref());
        let view = &self.views[index];
        let groups = view.samples.groups();
        let channels = self.plan.channels.len();
        let mut planes = vec![vec![0.0_f32; groups * LANES]; channels];
        let size = BLOCK * CHUNK * LANES;
        let mut parts: Vec<Vec<&mut [f32]>> =
            planes.iter_mut().map(|plane| plane.chunks_mut(size).collect()).collect();
        let mut by_chunk: Vec<Vec<&mut [f32]>> = Vec::new();
        for _ in 0..groups.div_ceil(BLOCK * CHUNK) {
            by_chunk.push(parts.iter_mut().map(|part| part.remove(0)).collect());
        }
        let gain = point.gains.get(index).copied().unwrap_or(1.0);
        by_chunk.par_iter_mut().enumerate().for_each_init(
            || (window::EMPTY, Rims::default()),
            |(scratch, rims), (chunk, outputs)| {
                with_simd!(self.level, simd => {
                    let kernel = self.kernel(simd, view, &kept.views[index], &point.params, lobe.as_deref(), gain);
                    for (k, group) in (chunk * BLOCK * CHUNK..groups.min((chunk + 1) * BLOCK * CHUNK)).enumerate() {
                        kernel.begin(group..group + 1, rims);
                        kernel.group::<false>(group, rims, scratch);
                        for (c, output) in outputs.iter_mut().enumerate() {
                            let row = window::row(scratch, window::residual(c));
                            for (out, value) in output[k * LANES..][..LANES].iter_mut().zip(row.iter()) {
                                *out = value * gain as f32;
                            }
                        }
                    }
                });
            },
        );
        planes
    }
}
