//! Fixed linear maps of tensors: sampling a map, averaging a pixel's samples, a cube's borders.
//!
//! The transpose is kept as its own list of rows, made once: the backward pass gathers as the forward pass does.
//! Nothing is added up by atomics, so the same numbers give the same bits every time.

use std::ops::Range;
use std::sync::Arc;

use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::NoCheckpointing;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::wgpu::{CubeBackend, CubeTensor};
use burn::backend::{Autodiff, Shape, TensorMetadata as _};
use burn::tensor::Tensor;
use wgpu::{Buffer, BufferUsages, CommandEncoderDescriptor, ComputePipeline};

use super::buffer::{check_shape, lend, plain, tracked};
use super::{SharedDevice, TensorError, pass};
use crate::gpu::Gpu;

/// A sparse matrix on the device; it is cheap to clone.
#[derive(Clone, Debug)]
pub struct Sparse(Arc<Matrix>);

#[derive(Debug)]
struct Matrix {
    shared: SharedDevice,
    pipeline: ComputePipeline,
    forwards: Rows,
    transposed: Rows,
}

/// Compressed rows: row r has the entries `starts[r]..starts[r + 1]`.
#[derive(Debug)]
struct Rows {
    count: usize,
    starts: Buffer,
    columns: Buffer,
    weights: Buffer,
}

/// The entries of a sparse matrix on the CPU, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Entries {
    /// How many columns there are.
    pub columns: usize,
    /// Where each row's entries start, and the end of the last.
    pub starts: Vec<u32>,
    /// Each entry's column.
    pub column: Vec<u32>,
    /// Each entry's weight.
    pub weight: Vec<f32>,
}

impl Entries {
    /// A matrix of that many columns and no rows.
    #[must_use]
    pub fn new(columns: usize) -> Self {
        Self { columns, starts: vec![0], column: Vec::new(), weight: Vec::new() }
    }

    /// Append a row; entries of weight 0 are left out.
    pub fn push_row(&mut self, entries: impl IntoIterator<Item = (u32, f32)>) {
        for (column, weight) in entries {
            if weight != 0.0 {
                self.column.push(column);
                self.weight.push(weight);
            }
        }
        self.starts.push(self.column.len() as u32);
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// A range of its rows.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let starts = &self.starts[rows.start..=rows.end];
        let first = starts[0];
        let entries = first as usize..starts[starts.len() - 1] as usize;
        Self {
            columns: self.columns,
            starts: starts.iter().map(|start| start - first).collect(),
            column: self.column[entries.clone()].to_vec(),
            weight: self.weight[entries].to_vec(),
        }
    }

    /// Rows and columns exchanged; a row's entries stand in the order of the old rows.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let mut starts = vec![0_u32; self.columns + 1];
        for &column in &self.column {
            starts[column as usize + 1] += 1;
        }
        for i in 0..self.columns {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let (mut column, mut weight) = (vec![0; self.column.len()], vec![0.0; self.column.len()]);
        for row in 0..self.rows() {
            for k in self.starts[row] as usize..self.starts[row + 1] as usize {
                let place = &mut next[self.column[k] as usize];
                column[*place as usize] = row as u32;
                weight[*place as usize] = self.weight[k];
                *place += 1;
            }
        }
        Self { columns: self.rows(), starts, column, weight }
    }

    /// The sum of the weights of each column: how much of it the rows see.
    #[must_use]
    pub fn column_sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.columns];
        for (&column, &weight) in self.column.iter().zip(&self.weight) {
            sums[column as usize] += f64::from(weight);
        }
        sums
    }
}

impl Sparse {
    /// The matrix of those entries, on the device.
    ///
    /// # Errors
    /// When the device does not take it.
    pub fn new(shared: &SharedDevice, entries: &Entries) -> Result<Self, TensorError> {
        let gpu = shared.gpu();
        let module = pass::module(gpu, "sparse", include_str!("sparse.wgsl"))?;
        let pipeline = pass::pipeline(gpu, &module, "cs_main")?;
        let forwards = Rows::new(gpu, entries)?;
        let transposed = Rows::new(gpu, &entries.transposed())?;
        Ok(Self(Arc::new(Matrix { shared: shared.clone(), pipeline, forwards, transposed })))
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.0.forwards.count
    }

    /// How many columns there are.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.0.transposed.count
    }

    /// The matrix times `x`, \[columns, channels\]; the result, \[rows, channels\], is differentiable in it.
    ///
    /// # Errors
    /// When `x` has another shape, or is not on the device.
    pub fn apply(&self, x: Tensor<2>) -> Result<Tensor<2>, TensorError> {
        const WHAT: &str = "what the sparse matrix is applied to";
        if !x.is_autodiff() {
            let product = self.0.multiply(plain(WHAT, x)?, false)?;
            return Ok(Tensor::from_primitive::<CubeBackend>(product));
        }
        let x = tracked(WHAT, x)?;
        let prepared = Transposed.prepare::<NoCheckpointing>([x.node()]).compute_bound().stateful();
        let product = self.0.multiply(x.into_primitive(), false)?;
        let product = match prepared {
            OpsKind::Tracked(ops) => ops.finish(self.clone(), product),
            OpsKind::UnTracked(ops) => ops.finish(product),
        };
        Ok(Tensor::from_primitive::<Autodiff<CubeBackend>>(product))
    }
}

/// The adjoint of a matrix is its transpose.
#[derive(Debug)]
struct Transposed;

impl Backward<CubeBackend, 1> for Transposed {
    type State = Sparse;

    fn backward(self, ops: Ops<Sparse, 1>, gradients: &mut Gradients, _: &mut Checkpointer) {
        let [parent] = ops.parents;
        let adjoint = gradients.consume::<CubeBackend>(&ops.node);
        if let Some(node) = parent {
            let matrix = ops.state.0;
            let (device, channels) = (adjoint.device.clone(), channels(&adjoint));
            let gradient = matrix.multiply(adjoint, true);
            let shape = Shape::new([matrix.transposed.count, channels]);
            let gradient = super::or_zeros(matrix.shared.gpu(), gradient, shape, &device);
            gradients.register::<CubeBackend>(node.id, gradient);
        }
    }
}

fn channels(tensor: &CubeTensor) -> usize {
    tensor.shape().iter().nth(1).copied().unwrap_or(1)
}

impl Matrix {
    fn multiply(&self, x: CubeTensor, transposed: bool) -> Result<CubeTensor, TensorError> {
        let (rows, columns) = if transposed {
            (&self.transposed, self.forwards.count)
        } else {
            (&self.forwards, self.transposed.count)
        };
        let channels = channels(&x);
        check_shape("what the sparse matrix is applied to", &x, &[columns, channels])?;
        let gpu = self.shared.gpu();
        let (given, mut product) = lend(gpu, vec![("the factor", x)], &[Shape::new([rows.count, channels])])?;
        let product = product.remove(0);
        let size = gpu.buffer(
            "size",
            bytemuck::cast_slice(&[rows.count as u32, channels as u32]),
            BufferUsages::UNIFORM,
        );
        let mut encoder =
            gpu.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("sparse") });
        let resources = vec![
            (0, size.as_entire_binding()),
            (1, rows.starts.as_entire_binding()),
            (2, rows.columns.as_entire_binding()),
            (3, rows.weights.as_entire_binding()),
            (4, given[0].binding()),
            (5, product.binding()),
        ];
        pass::dispatch(gpu, &mut encoder, &self.pipeline, &[resources], (rows.count * channels) as u64);
        gpu.queue.submit([encoder.finish()]);
        gpu.check()?;
        Ok(product.into_tensor())
    }
}

impl Rows {
    fn new(gpu: &Gpu, entries: &Entries) -> Result<Self, TensorError> {
        // A buffer of nothing cannot be bound.
        let padded = |list: &[u32]| if list.is_empty() { vec![0] } else { list.to_vec() };
        let weights = if entries.weight.is_empty() { vec![0.0] } else { entries.weight.clone() };
        let made = Self {
            count: entries.rows(),
            starts: gpu.storage("rows of a sparse matrix", bytemuck::cast_slice(&entries.starts))?,
            columns: gpu
                .storage("columns of a sparse matrix", bytemuck::cast_slice(&padded(&entries.column)))?,
            weights: gpu.storage("weights of a sparse matrix", bytemuck::cast_slice(&weights))?,
        };
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transpose_has_each_entry_once_and_twice_is_the_matrix_itself() {
        let mut entries = Entries::new(4);
        entries.push_row([(2, 0.5), (0, 0.25)]);
        entries.push_row([]);
        entries.push_row([(2, 1.0), (3, 0.0)]);
        let transposed = entries.transposed();
        assert_eq!(transposed.starts, [0, 1, 1, 3, 3]);
        assert_eq!(transposed.column, [0, 0, 2]);
        assert_eq!(transposed.weight, [0.25, 0.5, 1.0]);
        assert_eq!((transposed.columns, transposed.rows()), (3, 4));
        assert_eq!(transposed.transposed().column_sums(), entries.column_sums());
        assert_eq!(entries.column_sums(), [0.25, 0.0, 1.5, 0.0]);
    }
}
