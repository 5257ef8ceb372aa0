//! `skinfit bake`: what a scene's effects ask to be baked, as files to look at.

mod cubes;
mod vertices;

use std::fmt::Write as _;
use std::path::PathBuf;

use self::cubes::{Kind, parse_kind};
use super::run_folder::RunFolder;
use super::scene::{SceneArguments, parse_effects};
use super::stages::{Stages, free_of};
use super::{Exit, Refusal, say, tell, tell_warnings, unfinished};
use crate::bake::VertexOcclusion;
use crate::bake::rays::RayMesh;
use crate::export::vertices::vertex_streams;
use crate::model::effects::Effects;
use crate::output;
use crate::prepare::{Baked, PrepareOptions};
use crate::samples::{PosedSurface, atlas_of};
use crate::scene::streams::mesh_with_streams;
use crate::shader::term::library;

/// Bake what a scene's effects ask for into files: cube maps, and what rays find at vertices
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("Writes what the enabled effects ask for, and no more: irradiance.exr, lobe_<exponent>.exr, specular.exr (between two lobes), hilite.exr, reflected.exr and glossy.exr (each a column of the faces +X -X +Y -Y +Z -Z, with a .png to look at; with --cubes ktx2 or dds the same names with that ending, and lobe_stack and reflected_stack, which are arrays of all cubes that were baked for a lobe), occlusion.csv (a row a vertex: the open share of its hemisphere) and vertices.csv (a row a vertex, a column for each number of each field that rays find there: the sky that it sees, bent normals, light that the skin throws back, shadows, depths). With --glb also vertices.glb: the mesh file as it is, pictures within, with the open share as the attribute _OCCLUSION, and every field as that of its name in capitals; of what is baked for morph targets, these have what they add. With --stages also charts, stretch, light_map, level_1 and on, and how light map and levels move along each free parameter, light_map_by_<parameter> and so on, each as .exr and .png: texels of the UV atlas, stretch in the scene's unit a texel; and charts.csv (a row a vertex: the chart that it lies on). Beside them an empty .lock, which keeps two commands from writing there at once.\n\nExamples:\n  skinfit bake scene.toml -o baked\n  skinfit bake scene.toml -o baked --effects diffuse,occlusion\n  skinfit bake scene.toml -o baked --cubes exr,ktx2 --glb\n  skinfit bake runs/a/scene.toml --params runs/a/params.toml -o baked", "the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What cubes are written as, comma-separated: exr, a picture of the faces, with a .png to look at; ktx2 and dds, cube
    /// textures of half floats.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "exr", value_parser = parse_kind)]
    cubes: Vec<Kind>,
    /// Effects to switch on, comma-separated, instead of the scene's.
    #[arg(long, value_name = "LIST", value_parser = parse_effects)]
    effects: Option<Effects>,
    /// Also the mesh file with what is baked of its vertices as attributes: vertices.glb.
    #[arg(long)]
    glb: bool,
    /// Also the stages of texture-space diffusion in the UV atlas, which the effect `diffusion` makes.
    #[arg(long)]
    stages: bool,
    /// Parameters of an earlier fit: the specular cube is that of its lobe.
    #[arg(long, value_name = "FILE")]
    params: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    unfinished::install();
    let mut folder = RunFolder::of_files(&arguments.output)?;
    let (path, _scratch) = arguments.scene.path()?;
    let options = PrepareOptions {
        effects: arguments.effects,
        params: arguments.params.clone(),
        cache: arguments.scene.cache(),
        ..PrepareOptions::default()
    };
    let baked = Baked::new(&path, &options)?;
    tell_warnings(&baked.warnings);
    let mut cubes = cubes::baked(&baked.illumination, &baked.scene);
    cubes.retain(|cube| cube.is_written(&arguments.cubes));
    let scene = &*baked.scene;
    // What rays find at vertices and in texels is of one posed surface.
    let posed = (arguments.stages || vertices::are_asked_for(scene)).then(|| {
        let mesh = scene.mesh.pose();
        let rays = RayMesh::of(&mesh);
        (mesh, rays)
    });
    let surface = match &posed {
        Some((mesh, rays)) => {
            Some(PosedSurface::new(scene, mesh, rays, &scene.mesh.morphs, baked.surface_bakes())?)
        }
        None => None,
    };
    let vertices = surface.as_ref().and_then(|surface| vertices::table(scene, surface));
    let written = cubes.len() + usize::from(baked.occlusion.is_some()) + usize::from(vertices.is_some());
    // Before anything is written: it may be refused.
    let stages = match &surface {
        Some(surface) if arguments.stages => Some(stages(&baked, surface)?),
        _ => None,
    };
    let streams = match arguments.glb {
        true => vertex_streams(scene, baked.surface_bakes(), surface.as_ref()),
        false => Vec::new(),
    };
    let mesh = (!streams.is_empty()).then(|| mesh_with_streams(scene, &streams)).transpose()?;
    let written = written + usize::from(mesh.is_some());
    if written > 0 || stages.is_some() {
        folder.keep_results();
    }
    let folder = folder.path();
    for cube in &cubes {
        cube.write(folder, &arguments.cubes)?;
    }
    if let Some(occlusion) = &baked.occlusion {
        output::write(&folder.join("occlusion.csv"), occlusion_csv(occlusion).as_bytes())?;
    }
    if let Some(vertices) = vertices {
        output::write(&folder.join("vertices.csv"), vertices.as_bytes())?;
    }
    match &mesh {
        Some(mesh) => output::write(&folder.join("vertices.glb"), mesh)?,
        None if arguments.glb => tell("nothing is baked of vertices; vertices.glb was not written."),
        None => {}
    }
    for row in &baked.stats.rows {
        let from = if row.cached { "kept from an earlier run" } else { "baked" };
        say(&format!("{:>14}  {from}, {:.3} s", row.name, row.seconds))?;
    }
    if let Some(stages) = stages {
        let count = stages.write(folder, &scene.mesh)?;
        say(&format!("wrote {count} stages of diffusion to {}", folder.display()))?;
    }
    match written {
        0 if arguments.stages => {}
        0 => tell("the enabled effects ask for no bake; nothing was written."),
        1 => say(&format!("wrote 1 bake to {}", folder.display()))?,
        _ => say(&format!("wrote {written} bakes to {}", folder.display()))?,
    }
    Ok(Exit::Done)
}

/// The stages of a scene's diffusion, of the surface at rest.
///
/// # Errors
/// When the scene has no diffusion, or its mesh no atlas for it.
fn stages(baked: &Baked, surface: &PosedSurface<'_>) -> Result<Stages, Refusal> {
    let scene = &*baked.scene;
    let none = || {
        Refusal::new(format!(
            "{}: --stages shows what texture-space diffusion makes, which is off. Enable the effect `diffusion`, or leave \
             --stages out.",
            scene.path.display()
        ))
    };
    let scatters = library::scatters(scene.effects);
    let atlas = atlas_of(scene, surface)?.filter(|_| scatters).ok_or_else(none)?;
    Ok(Stages::new(baked, &atlas, &scene.params, &free_of(baked))?)
}

/// A column for each morph target that has a weight; the others are not baked.
pub(super) fn occlusion_csv(occlusion: &VertexOcclusion) -> String {
    let mut text = "vertex,open".to_owned();
    let baked = || occlusion.morphs.iter().enumerate().filter(|(_, set)| !set.is_empty());
    for (morph, _) in baked() {
        let _ = write!(text, ",morph_{morph}");
    }
    text.push('\n');
    for (vertex, open) in occlusion.base.iter().enumerate() {
        let _ = write!(text, "{vertex},{open}");
        for (_, set) in baked() {
            let _ = write!(text, ",{}", set[vertex]);
        }
        text.push('\n');
    }
    text
}
