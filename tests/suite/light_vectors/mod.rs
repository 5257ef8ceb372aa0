//! The vectors of lights, lobes, the sky and light through thin parts (tests/vectors_light) on every evaluator: the planned
//! rules in each kind of number, the CPU engine with each instruction set, the engine on an adapter, and burn's tensors.
//!
//! - `table`: which files are compared on what: these tests' evaluators, and the table of the vectors' own page
//! - `cases`: cases of a file as stored samples, a pixel each; `evaluators`: all that make images of them
//! - `rules`, `engines`, `tensors`: how each does
//! - `lamps`, `lobes`, `scattered`, `sky`, `through`: the files

mod cases;
mod engines;
mod evaluators;
mod lamps;
mod lobes;
mod rules;
mod scattered;
mod sky;
mod table;
#[cfg(feature = "burn")]
mod tensors;
mod through;

use crate::common::vectors_light;
use crate::vectors::reader::Vectors;

pub(crate) fn read() -> Vectors {
    Vectors::read(&vectors_light())
}
