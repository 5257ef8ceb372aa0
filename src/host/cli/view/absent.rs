//! What stands in where the program is built without a window.

use super::Arguments;
use crate::cli::{Exit, Refusal};

/// How to get one.
pub(in crate::cli) fn run(_: &Arguments) -> Result<Exit, Refusal> {
    Err(Refusal::new(
        "this program was built without its window. Build it with `cargo build --release --features view`, or run \
         `cargo run --release --features view -- view`.",
    ))
}
