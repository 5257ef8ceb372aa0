//! `skinfit bake`: what a scene's effects ask to be baked, as files to look at.

mod stages;
mod vertices;

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use self::stages::Stages;
use super::run_folder::RunFolder;
use super::scene::{SceneArguments, parse_effects};
use super::{Exit, Refusal, say, tell, tell_warnings, unfinished};
use crate::bake::rays::RayMesh;
use crate::bake::{Illumination, VertexOcclusion};
use crate::model::cube::Cube;
use crate::model::effects::Effects;
use crate::model::params::{Param, Params};
use crate::output;
use crate::prepare::{Baked, PrepareOptions};
use crate::render::files::{ImageOptions, write_image};
use crate::render::image::Image;
use crate::samples::PosedSurface;

/// Bake what a scene's effects ask for into files: cube maps, and what rays find at vertices
#[derive(clap::Args)]
#[command(
    after_help = super::with_failure("Writes what the enabled effects ask for, and no more: irradiance.exr, lobe_<exponent>.exr, specular.exr (between two lobes), hilite.exr (each a column of the faces +X -X +Y -Y +Z -Z, with a .png to look at), occlusion.csv (a row a vertex: the open share of its hemisphere) and vertices.csv (a row a vertex, a column for each number of each field that rays find there: the sky that it sees, bent normals, light that the skin throws back, shadows, depths). With --stages also charts, stretch, light_map, level_1 and on, and how light map and levels move along each free parameter, light_map_by_<parameter> and so on, each as .exr and .png: texels of the UV atlas, stretch in the scene's unit a texel; and charts.csv (a row a vertex: the chart that it lies on). Beside them an empty .lock, which keeps two commands from writing there at once.\n\nExamples:\n  skinfit bake scene.toml -o baked\n  skinfit bake scene.toml -o baked --effects diffuse,occlusion\n  skinfit bake runs/a/scene.toml --params runs/a/params.toml -o baked", "the command was interrupted")
)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// The folder to write into; it is made if need be.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Effects to switch on, comma-separated, instead of the scene's.
    #[arg(long, value_name = "LIST", value_parser = parse_effects)]
    effects: Option<Effects>,
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
    let cubes = cubes(&baked.illumination, &baked.scene.params);
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
        Some(surface) if arguments.stages => Some(Stages::new(&baked, surface)?),
        _ => None,
    };
    if written > 0 || stages.is_some() {
        folder.keep_results();
    }
    let folder = folder.path();
    for (name, cube) in &cubes {
        write_cube(folder, name, cube)?;
    }
    if let Some(occlusion) = &baked.occlusion {
        output::write(&folder.join("occlusion.csv"), occlusion_csv(occlusion).as_bytes())?;
    }
    if let Some(vertices) = vertices {
        output::write(&folder.join("vertices.csv"), vertices.as_bytes())?;
    }
    for row in &baked.stats.rows {
        let from = if row.cached { "kept from an earlier run" } else { "baked" };
        say(&format!("{:>14}  {from}, {:.3} s", row.name, row.seconds))?;
    }
    if let Some(stages) = stages {
        let count = stages.write(folder)?;
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

/// The cubes that were baked, by the names of their files.
fn cubes<'a>(light: &'a Illumination, params: &Params) -> Vec<(String, Cow<'a, Cube<f32>>)> {
    let mut cubes = Vec::new();
    let mut add = |name: &str, cube| cubes.push((name.to_owned(), cube));
    if let Some(irradiance) = &light.irradiance {
        add("irradiance", Cow::Borrowed(irradiance));
    }
    if let Some(lobes) = &light.lobes {
        for (exponent, lobe) in lobes.exponents.iter().zip(&lobes.cubes) {
            add(&format!("lobe_{exponent}"), Cow::Borrowed(lobe));
        }
        // Between the stack's exponents, what shaders look up is none of its cubes.
        if lobes.cubes.len() > 1 {
            add("specular", Cow::Owned(lobes.at(params.scalar(Param::SpecularLobe)).0));
        }
    }
    if let Some(hilite) = &light.hilite {
        add("hilite", Cow::Borrowed(hilite));
    }
    cubes
}

/// The faces below each other, as EXR and as PNG.
fn write_cube(folder: &Path, name: &str, cube: &Cube<f32>) -> Result<(), Refusal> {
    let size = cube.size();
    let mut image = Image::new(size, 6 * size);
    for (at, (rgb, alpha)) in image.rgb.iter_mut().zip(&mut image.alpha).enumerate() {
        let [r, g, b, _] = cube.texel(at / (size * size), at % size, at / size % size);
        *rgb = [r, g, b];
        *alpha = 1.0;
    }
    for ending in ["exr", "png"] {
        write_image(&folder.join(format!("{name}.{ending}")), &image, &ImageOptions::default())?;
    }
    Ok(())
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
