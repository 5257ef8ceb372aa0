//! Sums over views: loss, gradient and normal equations, and how each tile of the images pulls.

use rayon::prelude::*;

use super::CpuEngine;
use super::pass::{ChannelColumns, Pass};
use super::streams::BATCH;
use super::sums::{CHUNK, Sums, pairwise};
use super::view_pass::with_scratch;
use crate::engine::gram::pair;
use crate::engine::pulls::{Gathered, Pulls};
use crate::engine::{BLOCK, Engine, NormalEquations, PassOutputs, Point};
use crate::with_simd;

impl CpuEngine {
    pub(super) fn pass(&self, point: &Point, wish: PassOutputs) -> NormalEquations {
        let channels = self.fitted.channels;
        let k = self.fitted.unknowns.len();
        let mut total = NormalEquations {
            loss: 0.0,
            residual: 0.0,
            weight: Engine::weight(self),
            count: self.weight.1 * channels as u64,
            jtr: vec![0.0; k],
            jtj: vec![0.0; k * k],
        };
        let Ok(ready) = self.ready(point) else {
            total.loss = f64::NAN;
            return total;
        };
        let pass = &*ready.pass;
        let every: Vec<usize> = (0..channels).collect();
        let of =
            if wish == PassOutputs::Loss { (&pass.value, &every[..]) } else { (&pass.moved, &pass.read[..]) };
        for view in 0..self.views.len() {
            let of_view = self.view_pass(of, &ready, point, view);
            let blocks: Vec<usize> = self.read_blocks(&self.views[view]).collect();
            let sums: Vec<Sums> = blocks
                .par_chunks(CHUNK)
                .map(|blocks| {
                    with_scratch(&of_view, |scratch| {
                        with_simd!(self.level, simd => {
                            of_view.chunk(simd, &pass.channels, blocks, wish, scratch)
                        })
                    })
                })
                .collect();
            self.add(view, pass, &pairwise(sums), wish, &mut total);
        }
        if total.weight > 0.0 {
            total.loss /= total.weight;
        }
        total
    }

    /// A pass that keeps the tiles of the images apart.
    pub(super) fn tiled_pulls(&self, point: &Point, widths: &[usize]) -> Option<Pulls> {
        let ready = self.ready(point).ok()?;
        let pass = &*ready.pass;
        let mut pulls = Pulls::default();
        for (index, (view, &width)) in self.views.iter().zip(widths).enumerate() {
            let of_view = self.view_pass((&pass.moved, &pass.read), &ready, point, index);
            let columns: Vec<Vec<Option<usize>>> = self.columns(index, pass);
            let groups = view.samples.groups();
            let blocks: Vec<usize> = self.read_blocks(view).collect();
            let parts = blocks.par_iter().map(|&block| {
                let mut gathered = Gathered::new(view, width, &columns, self.fitted.unknowns.len());
                let end = groups.min((block + 1) * BLOCK);
                with_scratch(&of_view, |scratch| {
                    for first in (block * BLOCK..end).step_by(BATCH) {
                        let count = BATCH.min(end - first);
                        let channels = &pass.channels;
                        with_simd!(self.level, simd => of_view.residuals(simd, channels, scratch, first, count));
                        for i in 0..count {
                            gathered.add(first + i, |c, column| of_view.row(scratch, &channels[c], (c, column), i));
                        }
                    }
                });
                gathered
            });
            let parts: Vec<Gathered<'_>> = parts.collect();
            pulls.add_view(index, width, parts);
        }
        Some(pulls)
    }

    /// For each channel the unknowns of its columns in a view; none of a gain that is held.
    fn columns(&self, view: usize, pass: &Pass) -> Vec<Vec<Option<usize>>> {
        let of = |(c, channel): (usize, &ChannelColumns)| {
            let gain = self.fitted.unknowns.iter().position(|unknown| unknown.is_gain_of(view, c));
            channel.unknowns.iter().map(|unknown| unknown.or(gain)).collect()
        };
        pass.channels.iter().enumerate().map(of).collect()
    }

    /// One view's packed sums into the full matrices.
    fn add(&self, view: usize, pass: &Pass, sums: &Sums, wish: PassOutputs, total: &mut NormalEquations) {
        let Some(loss) = sums.0.last() else { return };
        total.loss += loss;
        let k = self.fitted.unknowns.len();
        let mut base = 0;
        for unknown in self.columns(view, pass).iter().filter(|_| wish != PassOutputs::Loss) {
            let (columns, count) = (unknown.len(), unknown.len() + 1);
            // Of a gradient there is the last column alone.
            let entry =
                |i: usize, j: usize| if wish == PassOutputs::Gradient { i } else { pair(i, j, count) };
            for i in 0..columns {
                let Some(a) = unknown[i] else { continue };
                total.jtr[a] += sums.0[base + entry(i, columns)];
                for j in (i..columns).filter(|_| wish == PassOutputs::Normal) {
                    let Some(b) = unknown[j] else { continue };
                    let value = sums.0[base + entry(i, j)];
                    total.jtj[a * k + b] += value;
                    if a != b {
                        total.jtj[b * k + a] += value;
                    }
                }
            }
            total.residual += sums.0[base + entry(columns, columns)];
            base += if wish == PassOutputs::Gradient { count } else { count * (count + 1) / 2 };
        }
    }
}
