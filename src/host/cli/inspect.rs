//! `skinfit inspect`: what a mesh file holds, and a first scene file for it.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::columns::aligned;
use super::first_scene::FirstScene;
use super::{Exit, Refusal, say, tell};
use crate::scene::digits;
use crate::scene::inspect::{FilePicture, Material, MeshContents, MeshPart, Picture};

/// Say what is in a mesh file, and write a scene file that frames it
#[derive(clap::Args)]
#[command(
    after_help = "With -o a scene file is written that `render`, `view` and `fit` take: three cameras that frame the mesh, the file's own cameras, the maps of the material that has the most triangles, and a light (the panorama that is named, the file's own lights, or two lamps in their place). Name your targets in it. What the mesh file holds and skinfit does not read is listed last.\n\nExamples:\n  skinfit inspect head.glb\n  skinfit inspect head.glb -o head.toml --environment studio.exr && skinfit render head.toml -o pictures\n  skinfit inspect head.glb --json"
)]
pub(super) struct Arguments {
    /// The mesh: glTF 2.0, .glb or .gltf.
    file: PathBuf,
    /// Write this scene file, and beside it the pictures within the mesh file that it names as maps.
    #[arg(short, long, value_name = "SCENE")]
    output: Option<PathBuf>,
    /// The panorama that lights the scene: lat-long, EXR or Radiance HDR.
    #[arg(long, value_name = "FILE", requires = "output")]
    environment: Option<PathBuf>,
    /// Pixels along a side of the scene's images.
    #[arg(long, value_name = "PIXELS", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=16384))]
    size: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Refusal> {
    let (contents, warnings) = MeshContents::read(&arguments.file)?;
    warnings.iter().for_each(|warning| tell(&format!("warning: {warning}")));
    if let Some(scene) = &arguments.output {
        let first = FirstScene {
            environment: arguments.environment.as_deref(),
            views: Vec::new(),
            calibrated: None,
            size: arguments.size,
        };
        first.write(&contents, scene)?;
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&contents)?)?;
        return Ok(Exit::Done);
    }
    say(text(&contents).trim_end())?;
    if let Some(scene) = &arguments.output {
        say(&format!("\nwrote {}", scene.display()))?;
    }
    Ok(Exit::Done)
}

/// The contents, as people read them.
fn text(contents: &MeshContents) -> String {
    let mut out = String::new();
    let mut paragraph = |text: String| {
        if !text.is_empty() {
            let _ = writeln!(out, "{}", text.trim_end());
        }
    };
    let by = contents.generator.as_ref().map_or(String::new(), |name| format!(", written by {name}"));
    paragraph(format!("{}{by}", contents.file.display()));
    paragraph(place(contents));
    paragraph(format!("\n{}", parts(&contents.parts)));
    if !contents.materials.is_empty() {
        paragraph(format!("\n{}", materials(contents)));
    }
    paragraph(format!("\n{}", motions(contents)));
    paragraph(not_read(contents));
    out
}

fn place(contents: &MeshContents) -> String {
    let [least, most] = contents.bounds;
    let size: [f64; 3] = std::array::from_fn(|axis| most[axis] - least[axis]);
    let [width, height, depth] = size.map(|x| digits(x, 3));
    // To a hundredth of its size.
    let largest = size.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let unit = 10.0_f64.powf((largest.log10().floor() - 2.0).max(-300.0));
    let rounded = |x: f64| digits((x / unit).round() * unit, 3);
    let centre: [String; 3] = std::array::from_fn(|axis| rounded(0.5 * (least[axis] + most[axis])));
    format!("{width} wide (x), {height} high (y), {depth} deep (z); its middle is at [{}]", centre.join(", "))
}

fn parts(parts: &[MeshPart]) -> String {
    let head = ["mesh", "material", "vertices", "triangles", "has"].map(str::to_owned);
    let row = |part: &MeshPart| {
        let mut has = Vec::new();
        match part.uv_sets {
            0 => has.push("no texture coordinates".to_owned()),
            1 => has.push("texture coordinates".to_owned()),
            sets => has.push(format!("{sets} sets of texture coordinates")),
        }
        if part.tangents {
            has.push("tangents".to_owned());
        }
        if part.morph_targets > 0 {
            has.push(format!("{} morph targets", part.morph_targets));
        }
        if part.skinned {
            has.push("bones".to_owned());
        }
        let material = part.material.clone().unwrap_or_else(|| "-".to_owned());
        let (vertices, triangles) = (part.vertices.to_string(), part.triangles.to_string());
        [part.mesh.clone(), material, vertices, triangles, has.join(", ")]
    };
    aligned(&std::iter::once(head).chain(parts.iter().map(row)).collect::<Vec<_>>())
}

fn materials(contents: &MeshContents) -> String {
    let head = ["material", "triangles", "alpha", "colour", "normals"].map(str::to_owned);
    let picture = |picture: &Option<Picture>| match picture {
        None => "-".to_owned(),
        Some(Picture { name, file, uv_set, .. }) => {
            let file = match file {
                FilePicture::Beside(path) => path.display().to_string(),
                FilePicture::Within { index, ending } => {
                    let name = name.clone().unwrap_or_else(|| format!("image {index}"));
                    format!("{name} ({ending}, within the file)")
                }
            };
            if *uv_set == 0 { file } else { format!("{file} by texture coordinates {uv_set}") }
        }
    };
    let row = |material: &Material| {
        let triangles = contents.triangles_of(&material.name).to_string();
        let (color, normal) = (picture(&material.color), picture(&material.normal));
        [material.name.clone(), triangles, material.alpha.to_owned(), color, normal]
    };
    aligned(&std::iter::once(head).chain(contents.materials.iter().map(row)).collect::<Vec<_>>())
}

fn motions(contents: &MeshContents) -> String {
    let mut lines = Vec::new();
    let mut list = |what: &str, names: Vec<String>| {
        lines
            .push(format!("{what}: {}", if names.is_empty() { "none".to_owned() } else { names.join(", ") }));
    };
    list("morph targets", contents.morph_targets.clone());
    list("bones", if contents.bones == 0 { vec![] } else { vec![contents.bones.to_string()] });
    let animations = contents.animations.iter().map(|animation| {
        let moved = match (animation.moves_nodes, animation.moves_morph_targets) {
            (true, true) => "nodes and morph targets",
            (false, true) => "morph targets",
            _ => "nodes",
        };
        format!("{} ({} s of {moved})", animation.name, digits(animation.seconds, 3))
    });
    list("animations", animations.collect());
    let cameras = contents.cameras.iter().map(|camera| {
        let eye = camera.eye.map(|x| digits(x, 3)).join(", ");
        let degrees = digits(camera.fov_y_degrees, 3);
        let mirrored =
            if camera.usable { "" } else { "; of no use: its node mirrors, shears or has no size" };
        format!("{} ({degrees} degrees from top to bottom, at [{eye}]{mirrored})", camera.name)
    });
    list("cameras", cameras.collect());
    list("lights", contents.lights.clone());
    lines.join("\n")
}

/// What the file holds and no scene can make use of.
fn not_read(contents: &MeshContents) -> String {
    let mut lines = Vec::new();
    if contents.materials.len() > 1 {
        lines.push("materials, unless the scene names which are skin ([mesh] skin)".to_owned());
    }
    if contents.materials.iter().any(|material| material.alpha != "opaque") {
        lines.push("alpha of materials that are skin: it is opaque".to_owned());
    }
    let skin = contents.largest_material().map(|material| &material.name);
    let mut others = contents.materials.iter().filter(|material| Some(&material.name) != skin);
    if others.any(|material| material.normal.is_some()) {
        lines.push("normal maps of materials that are not skin".to_owned());
    }
    if contents.materials.iter().any(|material| material.occlusion) {
        lines.push("occlusion pictures of materials".to_owned());
    }
    if contents.parts.iter().any(|part| part.vertex_colors) {
        lines.push("colours at vertices of skin".to_owned());
    }
    if contents.parts.iter().any(|part| part.uv_sets > 1) {
        lines.push(
            "texture coordinates but the sets that a part's first picture and `uv_set` in [diffusion] name"
                .to_owned(),
        );
    }
    lines.extend(contents.unread_extensions.iter().map(|extension| {
        let required = if extension.required { " (required)" } else { "" };
        format!("{}{required}", extension.name)
    }));
    if lines.is_empty() { String::new() } else { format!("\nnot read:\n  {}", lines.join("\n  ")) }
}
