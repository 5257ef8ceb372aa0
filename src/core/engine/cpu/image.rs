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
    /// colour and (where the haze is compared) alpha, times the view's gain. A plane a channel.
    #[must_use]
    pub fn image(&self, index: usize, point: &Point) -> Vec<Vec<f32>> {
        let mut planes = Vec::new();
        self.image_into(index, point, &mut planes);
        planes
    }

    /// As [`Self::image`], into the planes of an earlier image: memory that is new costs more than the pass.
    pub fn image_into(&self, index: usize, point: &Point, planes: &mut Vec<Vec<f32>>) {
        if let Some(Ok(planned)) = &self.planned {
            return planned.image_into(index, point, planes);
        }
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&point.params, lobe.as_deref());
        let view = &self.views[index];
        let groups = view.samples.groups();
        planes.resize_with(self.plan.channels.len(), Vec::new);
        planes.iter_mut().for_each(|plane| plane.resize(groups * LANES, 0.0));
        let gain = point.gains.get(index).copied().unwrap_or(1.0);
        by_chunk(planes).par_iter_mut().enumerate().for_each_init(
            || (window::EMPTY, Rims::default()),
            |(scratch, rims), (chunk, outputs)| {
                with_simd!(self.level, simd => {
                    let kernel = self.kernel(simd, view, &kept.views[index], &point.params, lobe.as_deref(), gain);
                    let run = chunk * GROUPS..groups.min((chunk + 1) * GROUPS);
                    kernel.begin(run.clone(), rims);
                    for (k, group) in run.enumerate() {
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
    }
}

/// Groups of a chunk.
const GROUPS: usize = BLOCK * CHUNK;

/// Of each chunk the parts of all planes.
pub(in crate::engine) fn by_chunk(planes: &mut [Vec<f32>]) -> Vec<Vec<&mut [f32]>> {
    let mut chunks: Vec<Vec<&mut [f32]>> = Vec::new();
    for plane in planes {
        let parts = plane.chunks_mut(GROUPS * LANES);
        chunks.resize_with(parts.len(), Vec::new);
        chunks.iter_mut().zip(parts).for_each(|(chunk, part)| chunk.push(part));
    }
    chunks
}
