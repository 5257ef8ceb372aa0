//! The pass that keeps apart what each tile of the images adds to J^T r.

use rayon::prelude::*;

use super::{BLOCK, CHUNK, CpuEngine};
use crate::engine::kernel::Rims;
use crate::engine::pulls::{Gathered, Pulls};
use crate::engine::{Point, Unknown, window};
use crate::model::params::Param;
use crate::with_simd;

impl CpuEngine {
    /// As [`Objective::pulls`](crate::engine::Objective::pulls).
    pub(super) fn kernel_pulls(&self, point: &Point, widths: &[usize]) -> Pulls {
        let lobe = self.lobe(point.params.scalar(Param::SpecularLobe));
        let kept = self.kept(&point.params, lobe.as_deref());
        let mut pulls = Pulls::default();
        for (index, (view, &width)) in self.views.iter().zip(widths).enumerate() {
            let gain = point.gains.get(index).copied().unwrap_or(1.0);
            let own = self.unknowns.iter().position(|u| *u == Unknown::Gain(index));
            let columns = |unknowns: &[Option<usize>]| unknowns.iter().map(|u| u.or(own)).collect();
            let columns: Vec<Vec<Option<usize>>> =
                self.plan.channels.iter().map(|channel| columns(&channel.unknowns)).collect();
            let groups = view.samples.groups();
            let blocks: Vec<usize> = self.read_blocks(view).collect();
            let parts = blocks.par_chunks(CHUNK).map_init(
                || (window::EMPTY, Rims::default()),
                |(scratch, rims), blocks| {
                    let mut gathered = Gathered::new(view, width, &columns, self.unknowns.len());
                    with_simd!(self.level, simd => {
                        let kernel = self.kernel(simd, view, &kept.views[index], &point.params, lobe.as_deref(), gain);
                        for &block in blocks {
                            let run = block * BLOCK..groups.min((block + 1) * BLOCK);
                            kernel.begin(run.clone(), rims);
                            for group in run {
                                kernel.group::<true>(group, rims, scratch);
                                let _ = kernel.weigh::<true>(group, scratch);
                                gathered.add(group, |channel, column| {
                                    *window::row(scratch, self.plan.channels[channel].rows[column])
                                });
                            }
                        }
                    });
                    gathered
                },
            );
            let parts: Vec<Gathered<'_>> = parts.collect();
            pulls.add_view(index, width, parts);
        }
        pulls
    }
}
