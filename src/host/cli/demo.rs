//! `skinfit demo`: the built-in scene as ordinary files.

use std::path::PathBuf;

use super::{Exit, Refusal, say};
use crate::demo;

/// Write the built-in scene as ordinary files to copy from
#[derive(clap::Args)]
#[command(
    after_help = "The targets are rendered by the model with constants that `skinfit fit` should find again.\n\nExample:\n  skinfit demo my-scene && skinfit fit my-scene/scene.toml -o runs/mine"
)]
pub(super) struct Arguments {
    /// The folder to write into; it is made if need be.
    folder: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    if arguments.folder.is_file() {
        return Err(Refusal::new(format!(
            "{}: is a file, and the scene needs a folder. Name another place; the folder is made if need be.",
            arguments.folder.display()
        )));
    }
    let there = arguments.folder.join("scene.toml");
    if there.exists() {
        return Err(Refusal::new(format!(
            "{}: is there already and may hold your changes. Choose another folder, or remove the file first.",
            there.display()
        )));
    }
    let scene = demo::write_scene(&arguments.folder, None)?;
    say(&format!("wrote {}", scene.display()))?;
    Ok(Exit::Done)
}
