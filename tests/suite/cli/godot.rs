//! An engine draws what a fit exports: shader, material, cubes and maps, put together as docs/engines.md says. The engine is
//! Debian's Godot 3, which draws by Mesa's software driver, in a display without a screen.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};
use skinfit::prepare::{Baked, PrepareOptions};

use super::engines::half;
use super::sandbox::Sandbox;
use crate::fixtures::{Planes, read_exr};
use crate::materials::{godots_code, replaced};

/// Pixels along a picture's side.
const SIZE: usize = 128;

/// Words of Godot 4 in Godot 3.2. All else but the struct is drawn as it is exported.
const WORDS: [(&str, &str); 6] = [
    // Built-in values were renamed; the mesh is not scaled, so that its normals turn as it does.
    ("MODEL_NORMAL_MATRIX", "mat3(WORLD_MATRIX)"),
    ("MODEL_MATRIX", "WORLD_MATRIX"),
    ("CAMERA_POSITION_WORLD", "CAMERA_MATRIX[3].xyz"),
    // Filter and wrapping belong to the texture: draw.gd sets the same.
    (" : source_color, filter_linear, repeat_enable", " : hint_albedo"),
    (" : filter_linear, repeat_enable", ""),
    (" : filter_linear", ""),
];

/// Faults that a shader could have, each of which has to show: what is replaced, and by what.
const FAULTS: [(&str, &str, &str); 4] = [
    ("undecoded", " : hint_albedo", ""),
    ("mirrored", "_cube, n_in_environment", "_cube, n_in_environment * vec3(1.0, 1.0, -1.0)"),
    ("left_handed", "skin_bitangent = normalize(", "skin_bitangent = -normalize("),
    ("unoccluded", "UV2.x", "1.0"),
];

/// How far a pixel may be off, relative to the mean radiance. llvmpipe decodes sRGB by a cubic that is off by up to 0.0023
/// (Mesa's `lp_bld_format_srgb.c`), which light, weights and the mean make about five times as much; pictures, and cubes before
/// their lookup, are half floats.
const TOLERANCE: f32 = 0.02;

#[test]
fn godot_draws_what_the_renderer_draws() {
    if std::env::var_os("SKINFIT_NO_ENGINE_TESTS").is_some() {
        crate::common::not_checked("SKINFIT_NO_ENGINE_TESTS is set, so no engine drew what is exported");
        return;
    }
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let fitted = ["run/scene.toml", "--params", "run/params.toml"];
    sandbox.run(&[&["bake"], &fitted[..], &["-o", "project", "--cubes", "dds"]].concat()).done();
    let export = ["export", "run/params.toml", "--to", "godot"];
    let shader = sandbox.run(&export).done().out;
    let material = sandbox.run(&[&export[..], &["--material", "res://skin.gdshaderinc"]].concat()).done().out;
    let code = in_godot_3(&material, &shader);
    for map in ["color", "normal", "specular", "attenuator"] {
        let name = format!("{map}.png");
        sandbox.write(&format!("project/{name}"), &sandbox.read(&name));
    }

    let mut shaders = BTreeMap::from([("exported", code.clone())]);
    shaders.extend(FAULTS.map(|(name, from, to)| (name, replaced(&code, from, to))));
    let mut job = job(&sandbox, &material, &shaders);
    let project = sandbox.path("project");
    drawn(&project, &job).unwrap_or_else(|error| panic!("{error}\n{code}"));
    for view in ["front", "side"] {
        let (file, size) = (format!("{view}.exr"), format!("{SIZE}x{SIZE}"));
        let own = ["--view", view, "--size", &size, "--engine", "cpu", "--antialias", "none", "-o", &file];
        sandbox.run(&[&["render"], &fitted[..], &own].concat()).done();
        let reference = read_exr(&sandbox.path(&file));
        let error = |shader: &str| error(&reference, &picture(&project.join(format!("{shader}_{view}.bin"))));
        let found = error("exported");
        crate::figures::measured("godot", found);
        assert!(found < TOLERANCE, "{view}: {found}");
        for (name, ..) in FAULTS {
            assert!(error(name) > TOLERANCE, "{view}: what is {name} does not show");
        }
    }

    // What its compiler takes means something: it does not take everything.
    job["shaders"] = json!({ "misspelt": replaced(&code, "= skinfit_shade(", "= skinfit_shde(") });
    let error = drawn(&project, &job).unwrap_err();
    assert!(error.contains("SHADER ERROR"), "{error}");
}

/// The material's shader with what it includes, in Godot 3.2's language.
fn in_godot_3(material: &str, shader: &str) -> String {
    let (code, _) = godots_code(material);
    let code = replaced(&code, "#include \"res://skin.gdshaderinc\"", shader);
    let respelt = |code: String, (from, to): &(&str, &str)| {
        assert!(code.contains(from), "{from} is not there: {code}");
        code.replace(from, to)
    };
    without_struct(&WORDS.iter().fold(code, respelt))
}

/// Godot 3.2 has no structs: a parameter or variable for each field, `at_eye` for `at.eye`.
fn without_struct(code: &str) -> String {
    let (before, rest) = code.split_once("struct SkinfitSurface {\n").unwrap();
    let (fields, after) = rest.split_once("};\n").unwrap();
    let fields = fields.lines().map(|line| line.trim().trim_end_matches(';').split_once(' ').unwrap());
    let fields: Vec<(&str, &str)> = fields.collect();
    let parameters: Vec<String> = fields.iter().map(|(kind, name)| format!("{kind} at_{name}")).collect();
    let variables: String = parameters.iter().map(|parameter| format!("    {parameter};\n")).collect();
    let arguments: Vec<String> = fields.iter().map(|(_, name)| format!("at_{name}")).collect();
    let code =
        replaced(&[before, after].concat(), "(SkinfitSurface at)", &format!("({})", parameters.join(", ")));
    let code = replaced(&code, "    SkinfitSurface at;\n", &variables);
    let code = replaced(&code, "skinfit_shade(at)", &format!("skinfit_shade({})", arguments.join(", ")));
    fields.iter().fold(code, |code, (_, name)| code.replace(&format!("at.{name}"), &format!("at_{name}")))
}

/// What draw.gd is to draw: the scene's mesh as it stands, with its numbers of vertices, in the scene's views.
fn job(sandbox: &Sandbox, material: &str, shaders: &BTreeMap<&str, String>) -> Value {
    let options = PrepareOptions { cache: Some(sandbox.cache().to_owned()), ..PrepareOptions::default() };
    let baked = Baked::new(&sandbox.path("run/scene.toml"), &options).unwrap();
    let (mesh, open) = (baked.scene.mesh.pose(), &baked.occlusion.as_ref().unwrap().base);
    let vertex = |i: usize| {
        let (place, normal) = (mesh.positions[i].to_array(), mesh.normals[i].to_array());
        let (tangent, uv) = (mesh.tangents[i].to_array(), mesh.uvs[i].to_array());
        [&place[..], &normal, &tangent, &uv, &[open[i]]].concat()
    };
    let vertices: Vec<Vec<f32>> = (0..mesh.positions.len()).map(vertex).collect();
    let views = baked.scene.views.iter().map(|view| {
        let rows = view.camera.world_to_camera.transpose().to_cols_array();
        let place = json!({ "fov": view.camera.fov_y.to_degrees(), "world_to_camera": rows });
        (view.name.clone(), place)
    });
    json!({
        "size": SIZE, "shaders": shaders, "views": views.collect::<BTreeMap<_, _>>(),
        "vertices": vertices, "triangles": mesh.triangles,
        "cubes": bound(material, "Cubemap"), "maps": bound(material, "Texture2D"),
    })
}

/// The file that a material gives each uniform of a kind.
fn bound(material: &str, kind: &str) -> BTreeMap<String, String> {
    let resources = material.lines().filter_map(|line| line.strip_prefix("[ext_resource type=\""));
    let mut files = BTreeMap::new();
    for resource in resources {
        let [of, _, path, _, id, _] = resource.split('"').collect::<Vec<_>>()[..] else {
            panic!("{resource}")
        };
        if of == kind {
            files.insert(format!("ExtResource(\"{id}\")"), path.strip_prefix("res://").unwrap().to_owned());
        }
    }
    let values =
        material.lines().filter_map(|line| line.strip_prefix("shader_parameter/")?.split_once(" = "));
    values.filter_map(|(name, id)| Some((name.to_owned(), files.get(id)?.clone()))).collect()
}

/// Have the engine do a job in a project's folder; what it complained of, if anything.
fn drawn(project: &Path, job: &Value) -> Result<(), String> {
    std::fs::write(project.join("project.godot"), "config_version=4\n").unwrap();
    std::fs::write(project.join("draw.gd"), include_str!("godot/draw.gd")).unwrap();
    std::fs::write(project.join("job.json"), job.to_string()).unwrap();
    let display = Display::open();
    let mut engine = Command::new("godot3-runner");
    engine.args(["--path", ".", "--script", "draw.gd", "--resolution", "64x64"]);
    engine.args(["--video-driver", "GLES3", "--audio-driver", "Dummy"]).current_dir(project);
    // It keeps a folder for each user, and complains of a language that has no name.
    engine.env("DISPLAY", &display.name).env("HOME", project).env("LANG", "en_US.UTF-8");
    // By itself Mesa filters maps of bytes in bytes.
    engine.env("LIBGL_ALWAYS_SOFTWARE", "1").env("GALLIVM_PERF", "nopt,no_aos_sampling");
    let output = engine
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{}", missing("godot3-runner", &error)));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() && !said.contains("ERROR") { Ok(()) } else { Err(said) }
}

/// A program that is not there is a failure: a picture that was not drawn is not right.
fn missing(program: &str, error: &std::io::Error) -> String {
    format!(
        "{program} cannot be run: {error}. It comes with tests/run; SKINFIT_NO_ENGINE_TESTS=1 leaves this test out."
    )
}

/// A display without a screen; it ends with its handle.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn open() -> Self {
        let mut server = Command::new("Xvfb");
        server.args(["-displayfd", "1", "-screen", "0", "64x64x24", "-nolisten", "tcp"]);
        server.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut server = server.spawn().unwrap_or_else(|error| panic!("{}", missing("Xvfb", &error)));
        // Once it is ready, it says which display was free.
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Self { server, name: format!(":{}", number.trim()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Asked to, it takes its lock file along.
        let _ = Command::new("kill").arg(self.server.id().to_string()).status();
        let _ = self.server.wait();
    }
}

/// A picture of the engine's: four half floats a pixel.
fn picture(path: &Path) -> Vec<[f32; 4]> {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert_eq!(bytes.len(), 8 * SIZE * SIZE, "{} has no half floats", path.display());
    bytes.chunks(8).map(|pixel| [0, 2, 4, 6].map(|at| half(&pixel[at..]))).collect()
}

/// How far a pixel is off at most, relative to the mean radiance.
fn error(reference: &Planes, picture: &[[f32; 4]]) -> f32 {
    let (rgb, alpha) = (reference.rgb(["R", "G", "B"]), &reference.planes["A"]);
    let (mut both, mut one) = (Vec::new(), 0);
    for (i, pixel) in picture.iter().enumerate() {
        match (alpha[i] == 1.0, pixel[3] > 0.5) {
            (true, true) => both.push(i),
            (false, false) => {}
            _ => one += 1,
        }
    }
    // Where an edge goes through a pixel's centre, a ray and a rasteriser may see different things.
    assert!(both.len() > 5000 && one < 5, "{} pixels are covered, {one} of one alone", both.len());
    let mean = both.iter().flat_map(|&i| rgb[i]).sum::<f32>() / (3 * both.len()) as f32;
    let off = |&i: &usize| (0..3).map(|c| (rgb[i][c] - picture[i][c]).abs()).fold(0.0, f32::max);
    both.iter().map(off).fold(0.0, f32::max) / mean
}
