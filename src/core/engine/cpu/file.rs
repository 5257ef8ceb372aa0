//! What the machine computes in: registers, and the columns of outputs.
//!
//! A register's rows stand together, so that a tape's file stays in the nearest cache.

use super::program::Bound;
use super::streams::Column;
use crate::engine::part::RowCell;
use crate::samples::LANES;
use crate::samples::rows::Row;

/// Rows of a register: enough for dispatch to cost little, few enough for registers to stay in the nearest cache.
pub(super) const WIDTH: usize = 4;

/// The rows of a register.
pub(super) type Rows = [RowCell; WIDTH];

/// Registers, the numbers that all samples share, each in all lanes, and the outputs.
#[derive(Debug, Default)]
pub(super) struct File {
    pub(super) registers: Vec<Rows>,
    pub(super) uniforms: Vec<Row>,
    pub(super) columns: Vec<Column>,
    /// The register for what nobody reads.
    pub(super) nobody: usize,
}

impl File {
    /// Have room for a tape (and for what nobody reads), and its uniform numbers in place.
    pub(super) fn prepare(&mut self, bound: &Bound<'_>) {
        if !bound.program.is_compiled(bound.level) {
            let code = bound.program.code();
            self.uniforms.clear();
            self.uniforms.extend(bound.uniforms.iter().map(|&value| Row::of([value; LANES])));
            self.nobody = code.registers;
            self.registers.resize_with(code.registers + 1, Rows::default);
            for &(register, uniform) in &code.filled {
                self.registers[register].iter().for_each(|cell| cell.set(*self.uniforms[uniform]));
            }
        }
        let outputs = bound.program.tape.outputs.len();
        self.columns.resize_with(outputs, Column::default);
    }

    /// The rows of each output.
    pub(super) fn columns(&self) -> &[Column] {
        &self.columns
    }
}
