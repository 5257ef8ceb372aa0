//! What is looked at first.

use std::path::PathBuf;

use crate::opened::Reading;
use crate::paint::Engine;

/// What a window or a page begins with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// The scenes, which share one skin.
    pub scenes: Vec<Reading>,
    /// A fit of them, at whose end the sliders stand.
    pub fitted: Option<Run>,
    /// Another, to be compared.
    pub other: Option<Run>,
    /// Where fits are left.
    pub run: PathBuf,
    /// What draws.
    pub engine: Engine,
}

/// What a fit has left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// The constants, as `params.toml`.
    pub params: PathBuf,
    /// What is known of these, and how good they are, as `report.json`.
    pub report: Option<PathBuf>,
}
