//! The engine on the processor: all cores, SIMD, and the same sums for any number of threads.

pub use super::planned::PlannedEngine as CpuEngine;
