//! The renderer's frame rate with a mesh as dense as *Dawn*'s, animated: its pose computed, uploaded and drawn each frame.
//! `cargo run --release --example animated -- FOLDER -o row.json`; see README.md beside this file.

mod dense;
mod folder;
mod play;
mod rig;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use serde_json::{Value, json};
use skinfit::bake::VertexOcclusion;
use skinfit::gpu::upload::Content;
use skinfit::gpu::{Choice, Gpu, RenderOptions, Renderer};
use skinfit::prepare::{Baked, ClipOcclusion, Loaded, PrepareOptions, Views};
use skinfit::render::antialias::Antialias;
use skinfit::render::image::MAX_PIXELS;
use skinfit::render::shading::Shading;
use skinfit::scene::animation::Animation;
use skinfit::scene::view::Camera;
use skinfit::shader::Budget;

use dense::Dense;
use play::{Apart, Player, Reference};
use rig::{BONES, Rig, SECONDS, TARGETS};

#[derive(Parser)]
struct Arguments {
    /// The folder that the animated scene is written into: mesh, scene file, pictures.
    folder: PathBuf,
    /// What was measured, as JSON.
    #[arg(short, long)]
    output: PathBuf,
    /// The built-in scene's file [default: made in the folder for temporary files].
    #[arg(long)]
    scene: Option<PathBuf>,
    /// Vertices of the mesh at least; the built-in scene's own are not made fewer.
    #[arg(long, default_value_t = 180_000, value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    vertices: u32,
    /// Image size.
    #[arg(long, default_value_t = 1280, value_parser = clap::value_parser!(u32).range(1..=16384))]
    width: u32,
    /// Image size.
    #[arg(long, default_value_t = 720, value_parser = clap::value_parser!(u32).range(1..=16384))]
    height: u32,
    /// Frames of the clip, whose median time is taken.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Only write the scene and read it again.
    #[arg(long)]
    no_draw: bool,
}

/// Accuracies that are timed, and how far 99 of 100 pixels inside the outline may be from the CPU engine's, relative to
/// its mean radiance. Hardware snaps corners to 1/256 of a sample, and so reads maps beside where the ray hits; where it
/// filters, too, it has 8 bits of fraction, and draws into 16 bits. The renderer's tests have the same bounds, that of
/// `paper` with a little left for pictures of another size.
const ACCURACIES: [(&str, Budget, f32); 2] = [("exact", Budget::Exact, 5e-3), ("paper", Budget::Paper, 2e-2)];
/// How far the player's bones and weights may be from those that the core reads: both round to 32 bits at the end.
const POSE: f32 = 1e-5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    if arguments.width as usize * arguments.height as usize > MAX_PIXELS {
        return Err(format!("--width times --height: at most {MAX_PIXELS} pixels").into());
    }
    // Nothing is made where nothing could be drawn.
    let gpu = if arguments.no_draw { None } else { Some(Gpu::open(&Choice::default())?) };
    let scene = match &arguments.scene {
        Some(scene) => scene.clone(),
        None => skinfit::built_in_scene(&std::env::temp_dir().join("skinfit-library"))?,
    };
    let dense = made(&arguments, &scene)?;
    let rig = Rig::new(&dense.mesh, &dense.along)?;
    let file = folder::write(&arguments.folder, &scene, &dense.mesh, &dense.along, &rig)?;
    let loaded = Loaded::read(&file, &options(Some(ClipOcclusion::Frames)))?;
    let mesh = &loaded.scene.mesh;
    let found = (mesh.positions.len(), mesh.triangles.len(), mesh.bones.len(), mesh.morphs.len());
    let written = (dense.mesh.positions.len(), dense.mesh.triangles.len(), BONES, TARGETS);
    if found != written {
        return Err(format!("{}: {written:?} were written, {found:?} are read", file.display()).into());
    }
    let mut row = json!({
        "vertices": found.0,
        "triangles": found.1,
        "bones": found.2,
        "morph_targets": found.3,
        "clip_seconds": SECONDS,
    });
    let failed = match &gpu {
        Some(gpu) => drawn(&arguments, gpu, loaded, (dense.occlusion, &rig), &mut row)?,
        None => Vec::new(),
    };
    let text = serde_json::to_string_pretty(&row)? + "\n";
    skinfit::output::write(&arguments.output, text.as_bytes())?;
    print!("{text}");
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ").into()) }
}

fn options(clip: Option<ClipOcclusion>) -> PrepareOptions {
    PrepareOptions {
        views: Views::First,
        cache: Some(skinfit::bake::cache::default_folder()),
        time: Some(0.0),
        clip,
        ..PrepareOptions::default()
    }
}

/// The built-in mesh, cut finer; with its occlusion where it is drawn.
fn made(arguments: &Arguments, scene: &Path) -> Result<Dense, Box<dyn Error>> {
    let mut loaded = Loaded::read(scene, &options(Some(ClipOcclusion::Targets)))?;
    let mesh = &mut loaded.scene.mesh;
    let whole = mesh.morphs.len() == TARGETS && mesh.plain.is_none() && mesh.fields.is_empty();
    let whole = whole && !mesh.tangents.is_empty() && !mesh.uvs.is_empty();
    if !whole || mesh.morphs.iter().any(|morph| morph.normals.is_empty()) {
        let wanted =
            format!("{TARGETS} morph targets with normals, tangents and texture coordinates, all of it skin");
        return Err(format!("{}: a mesh is wanted with {wanted}: the built-in one", scene.display()).into());
    }
    // The clip moves every target, and occlusion follows it.
    mesh.morphs.iter_mut().for_each(|morph| morph.animated = true);
    let along = rig::along(mesh)?;
    let mesh = mesh.clone();
    let occlusion = if arguments.no_draw { None } else { loaded.bake()?.occlusion };
    let occlusion = occlusion.map(Arc::unwrap_or_clone);
    let mut dense = Dense { mesh, along, occlusion };
    dense.cut(arguments.vertices as usize)?;
    Ok(dense)
}

/// Time the clip and hold some of its frames against the CPU engine's, with each accuracy; what was too far off, in words.
fn drawn(
    arguments: &Arguments,
    gpu: &Gpu,
    loaded: Loaded,
    (occlusion, rig): (Option<VertexOcclusion>, &Rig),
    row: &mut Value,
) -> Result<Vec<String>, Box<dyn Error>> {
    let (width, height) = (arguments.width, arguments.height);
    // Its vertices' occlusion is cut finer with them, so that light alone is left to bake.
    let baked = Baked { occlusion: occlusion.map(Arc::new), ..loaded.bake()? };
    let view = baked.scene.views.first().ok_or("the scene has no view")?;
    let camera = Camera { width, height, ..view.camera };
    let animation = Animation::open(&baked.scene)?.ok_or("the scene that was written has no animation")?;
    let (mesh, gain, frames) = (
        baked.scene.mesh.clone(),
        baked.gains.first().copied().unwrap_or_default(),
        arguments.frames as usize,
    );
    let mut player = Player { rig, mesh, camera, gain, frames };
    let references = player.references(&baked, &animation)?;
    let (mut rows, mut failed) = (Vec::new(), Vec::new());
    for (name, budget, most) in ACCURACIES {
        let options = RenderOptions {
            antialias: Antialias::Grid(1),
            shading: Shading::default(),
            budget,
            timed: false,
            animated: true,
        };
        let mut renderer = Renderer::new(gpu, Content::of(&baked), options)?;
        renderer.set_background(view.background);
        let mut timed = player.timed(gpu, &mut renderer)?;
        // Timed at a sample a pixel, compared at the scene's: what the tests' bounds are of.
        renderer.set_grid(baked.scene.quality.samples_per_axis);
        let mut agreement = Vec::new();
        for Reference { frame, image: reference, pose_apart } in &references {
            let image = player.image(&mut renderer, *frame)?;
            let apart = Apart::of(reference, &image).ok_or("an image shows nothing to compare")?;
            if apart.inside > most {
                failed.push(format!(
                    "{name}, frame {frame}: {} from the CPU engine, above {most}",
                    apart.inside
                ));
            }
            agreement.push(json!({
                "frame": frame, "seconds": player.time(*frame), "pose_apart": pose_apart,
                "max": apart.most, "mean": apart.mean, "inside_99": apart.inside,
            }));
        }
        timed["accuracy"] = json!(name);
        timed["uploaded_bytes"] = json!(renderer.uploaded_bytes());
        timed["tolerance"] = json!(most);
        timed["agreement"] = json!(agreement);
        rows.push(timed);
    }
    for Reference { frame, pose_apart, .. } in &references {
        if *pose_apart > POSE || pose_apart.is_nan() {
            failed.push(format!("frame {frame}: the pose is {pose_apart} from the core's, above {POSE}"));
        }
    }
    row["width"] = json!(width);
    row["height"] = json!(height);
    row["frames"] = json!(frames);
    row["adapter"] = json!(gpu.name());
    row["software"] = json!(gpu.is_software());
    row["rows"] = json!(rows);
    Ok(failed)
}
