//! `skinfit import`: cameras that another program solved, as a scene file.

use std::path::{Path, PathBuf};

use super::first_scene::FirstScene;
use super::{Exit, Refusal, say, tell};
use crate::scene::error::SceneError;
use crate::scene::import::{ImportedView, colmap, metashape, opencv, picture_file, transforms};
use crate::scene::inspect::MeshContents;
use crate::scene::view::Camera;

/// Write a scene file with the cameras that another program solved or placed
#[derive(clap::Args)]
#[command(
    after_help = "The mesh has to stand where the cameras were solved: in COLMAP's own coordinates, those that transforms.json is of, or Metashape's (its mesh, exported in local coordinates). Each picture becomes a view with its camera, lens and all, and is its target where --images says where they are (the pictures as they were taken: samples go along the rays of the lens). `skinfit fit` then says of each target whether its silhouette lies where the mesh is, if it has an alpha. A calibration by OpenCV or ROS has no pose: its one view frames the mesh, and you say where the camera stood.\n\nExamples:\n  skinfit import colmap sparse/0 --mesh head.glb --images images -o scene.toml\n  skinfit import transforms transforms.json --mesh head.glb --images . -o scene.toml --environment studio.exr\n  skinfit import metashape cameras.xml --mesh head.glb --images photos -o scene.toml\n  skinfit import opencv camera.yml --mesh head.glb -o scene.toml"
)]
pub(super) struct Arguments {
    /// Where the cameras come from: a COLMAP sparse model (text or binary), a transforms.json, Metashape's camera file (XML),
    /// or a calibration by OpenCV or ROS (YAML or XML).
    kind: Kind,
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

/// Whose cameras.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Kind {
    Colmap,
    Transforms,
    Metashape,
    Opencv,
}

impl Kind {
    /// The cameras that stand somewhere, or one that does not; a picture's size may be asked for.
    fn read(
        self,
        from: &Path,
        images: Option<&Path>,
    ) -> Result<(Vec<ImportedView>, Option<Camera>), SceneError> {
        match self {
            Self::Colmap => Ok((colmap::read(from)?, None)),
            Self::Transforms => Ok((transforms::read(from, images)?, None)),
            Self::Metashape => Ok((metashape::read(from)?, None)),
            Self::Opencv => Ok((Vec::new(), Some(opencv::read(from)?))),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let from = &arguments.from;
    let (views, calibrated) = arguments.kind.read(from, arguments.images.as_deref())?;
    if calibrated.is_some() && arguments.images.is_some() {
        let from = from.display();
        return Err(Refusal::new(format!("{from}: a calibration names no pictures. Leave --images out.")));
    }
    if views.is_empty() && calibrated.is_none() {
        return Err(Refusal::new(format!("{}: has no cameras. Name a model of some.", from.display())));
    }
    let (contents, warnings) = MeshContents::read(&arguments.mesh)?;
    warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
    let count = views.len() + usize::from(calibrated.is_some());
    let with_target = |view: ImportedView| {
        let target = arguments.images.as_deref().map(|folder| target(folder, &view)).transpose()?;
        Ok::<_, Refusal>((view, target))
    };
    let views = views.into_iter().map(with_target).collect::<Result<_, _>>()?;
    FirstScene { environment: arguments.environment.as_deref(), views, calibrated, size: 0 }
        .write(&contents, &arguments.output)?;
    let views = if count == 1 { "view" } else { "views" };
    say(&format!("wrote {}: {count} {views}", arguments.output.display()))?;
    Ok(Exit::Done)
}

/// The picture of a view, in the folder of pictures.
fn target(folder: &Path, view: &ImportedView) -> Result<PathBuf, Refusal> {
    picture_file(folder, &view.picture).ok_or_else(|| {
        Refusal::new(format!(
            "{}: is not there. Name the folder of the pictures with --images, or leave it out.",
            folder.join(&view.picture).display()
        ))
    })
}
