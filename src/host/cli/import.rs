//! `skinfit import`: cameras that another program solved, as a scene file.

use std::path::{Path, PathBuf};

use super::first_scene::FirstScene;
use super::{Exit, Refusal, say, tell};
use crate::scene::import::{ImportedView, colmap, transforms};
use crate::scene::inspect::MeshContents;

/// Write a scene file with the cameras that another program solved or placed
#[derive(clap::Args)]
#[command(
    after_help = "The mesh has to stand where the cameras were solved: in COLMAP's own coordinates, or those that transforms.json is of. Each picture becomes a view with its camera, lens and all, and is its target where --images says where they are (the pictures as they were taken: samples go along the rays of the lens). `skinfit fit` then says of each target whether its silhouette lies where the mesh is, if it has an alpha.\n\nExamples:\n  skinfit import colmap sparse/0 --mesh head.glb --images images -o scene.toml\n  skinfit import transforms transforms.json --mesh head.glb --images . -o scene.toml --environment studio.exr"
)]
pub(super) struct Arguments {
    /// Where the cameras come from: a COLMAP sparse model (text or binary), or a transforms.json.
    #[arg(value_parser = ["colmap", "transforms"])]
    kind: String,
    /// The folder of the model, or the file.
    from: PathBuf,
    /// The mesh: glTF 2.0, .glb or .gltf.
    #[arg(long, value_name = "FILE")]
    mesh: PathBuf,
    /// The folder in which the pictures lie that the cameras took.
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// The panorama that lights the scene: lat-long, EXR or Radiance HDR.
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// The scene file to write.
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let from = &arguments.from;
    let views = if arguments.kind == "colmap" { colmap::read(from)? } else { transforms::read(from)? };
    if views.is_empty() {
        return Err(Refusal::new(format!("{}: has no cameras. Name a model of some.", from.display())));
    }
    let (contents, warnings) = MeshContents::read(&arguments.mesh)?;
    warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
    let count = views.len();
    let with_target = |view: ImportedView| {
        let target = arguments.images.as_deref().map(|folder| target(folder, &view)).transpose()?;
        Ok::<_, Refusal>((view, target))
    };
    let views = views.into_iter().map(with_target).collect::<Result<_, _>>()?;
    FirstScene { environment: arguments.environment.as_deref(), views, size: 0 }
        .write(&contents, &arguments.output)?;
    let views = if count == 1 { "view" } else { "views" };
    say(&format!("wrote {}: {count} {views}", arguments.output.display()))?;
    Ok(Exit::Done)
}

/// The picture of a view, in the folder of pictures.
fn target(folder: &Path, view: &ImportedView) -> Result<PathBuf, Refusal> {
    let file = folder.join(&view.picture);
    // transforms.json of Blender's own exporter leaves the ending out.
    let endings = ["png", "exr", "jpg", "jpeg", "hdr"].map(|ending| file.with_extension(ending));
    let tried =
        std::iter::once(file.clone()).chain(endings.into_iter().filter(|_| file.extension().is_none()));
    tried.into_iter().find(|file| file.is_file()).ok_or_else(|| {
        Refusal::new(format!(
            "{}: is not there. Name the folder of the pictures with --images, or leave it out.",
            file.display()
        ))
    })
}
