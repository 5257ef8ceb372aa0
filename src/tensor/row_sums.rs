//! Sums of many rows of numbers, in a fixed tree: the same bits every time.

use wgpu::{Buffer, BufferUsages, CommandEncoder, ComputePipeline};

use super::buffer::TensorBuffer;
use super::pass;
use crate::gpu::{Gpu, GpuError};

/// The pass that adds sixty-four rows.
#[derive(Debug)]
pub(super) struct RowSums(ComputePipeline);

impl RowSums {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let module = pass::module(gpu, "sums of rows", include_str!("row_sums.wgsl"))?;
        Ok(Self(pass::pipeline(gpu, &module, "cs_main")?))
    }

    /// Add up `rows` rows of `columns` numbers.
    pub(super) fn add_up(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        given: &Buffer,
        (mut rows, columns): (usize, usize),
        result: &TensorBuffer,
    ) -> Result<(), GpuError> {
        let mut given = given.clone();
        loop {
            let left = rows.div_ceil(64).max(1);
            let sums = gpu.scratch("sums of rows", 4 * (left * columns).max(1) as u64)?;
            let size = [rows as u32, columns as u32];
            let size = gpu.buffer("size", bytemuck::cast_slice(&size), BufferUsages::UNIFORM);
            let last = left == 1;
            let output = if last { result.binding() } else { sums.as_entire_binding() };
            let resources = vec![(0, size.as_entire_binding()), (1, given.as_entire_binding()), (2, output)];
            pass::dispatch(gpu, encoder, &self.0, &[resources], (64 * left * columns) as u64);
            if last {
                return Ok(());
            }
            (rows, given) = (left, sums);
        }
    }
}
