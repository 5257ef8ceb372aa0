//! Tapes and what runs them: a function that was compiled ahead, or the code of the machine.

use std::sync::OnceLock;

use super::ahead;
use super::code::Code;
use super::streams::{BATCH, SHORT_BATCH, StreamOf};
use crate::model::cube::Cube;
use crate::program::tape::Tape;
use crate::simd::Level;

/// A tape, and what runs it.
#[derive(Debug)]
pub(super) struct Program {
    pub(super) tape: Tape,
    /// A function that was compiled ahead, by its place.
    pub(super) compiled: Option<usize>,
    /// What the machine runs, made when it first does.
    code: OnceLock<Code>,
}

impl Program {
    /// `ahead`: the tape is of a plan that is compiled ahead.
    pub(super) fn new(tape: Tape, ahead: bool) -> Self {
        let compiled = if ahead { ahead::find(&tape) } else { None };
        Self { tape, compiled, code: OnceLock::new() }
    }

    /// Whether a function that was compiled ahead runs it with the instructions of `level`.
    pub(super) fn is_compiled(&self, level: Level) -> bool {
        self.compiled.is_some() && ahead::compiled_for(level)
    }

    pub(super) fn code(&self) -> &Code {
        self.code.get_or_init(|| Code::new(&self.tape))
    }
}

/// A tape with all that is the same for the records of a pass.
#[derive(Debug)]
pub(super) struct Bound<'a> {
    pub(super) program: &'a Program,
    /// The instructions that run it.
    pub(super) level: Level,
    /// For each field, the stream that holds it and its row there.
    pub(super) loads: &'a [(StreamOf, usize)],
    pub(super) cubes: Vec<&'a Cube<f32>>,
    pub(super) uniforms: Vec<f32>,
}

impl Bound<'_> {
    /// How many records it is run for at once.
    pub(super) fn batch(&self) -> usize {
        // The machine reads its instructions once a batch.
        if self.cubes.is_empty() && self.program.is_compiled(self.level) { SHORT_BATCH } else { BATCH }
    }
}
