//! What engines take at once: cubes as textures, and a C program that reads both a header and a cube.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use skinfit::model::cube::Cube;
use skinfit::model::effects::{Effect, Effects, Form, Silhouette};
use skinfit::model::evaluate::Setup;
use skinfit::model::fragment::Fragment;
use skinfit::model::params::{Param, Params};
use skinfit::prepare::{Baked, PrepareOptions};

use super::sandbox::Sandbox;
use crate::by_rules::{Cubes, Fragments, Wanted};
use crate::fixtures::read_exr;

/// A half as a number, by the definition of IEEE 754 binary16; no infinities are written.
pub(super) fn half(bytes: &[u8]) -> f32 {
    let bits = u16::from_le_bytes([bytes[0], bytes[1]]);
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => fraction * 2_f32.powi(-24),
        _ => (1.0 + fraction / 1024.0) * 2_f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

pub(super) fn word(file: &[u8], at: usize) -> usize {
    u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize
}

/// Side, cubes and texels of a file of either kind.
fn texture(file: &[u8]) -> (usize, usize, &[u8]) {
    match &file[..4] {
        b"DDS " => (word(file, 16), word(file, 140), &file[148..]),
        _ => (word(file, 20), word(file, 32).max(1), &file[word(file, 80)..]),
    }
}

#[test]
fn cubes_are_written_as_textures_that_hold_what_the_pictures_hold() {
    let sandbox = Sandbox::new();
    // Its lobe lies between two that are baked.
    let bake = ["bake", "scene.toml", "--params", "truth.toml", "-o", "baked", "--cubes", "exr,ktx2,dds"];
    sandbox.run(&bake).done();
    for name in ["irradiance", "specular", "hilite"] {
        let picture = read_exr(&sandbox.path(&format!("baked/{name}.exr"))).rgb(["R", "G", "B"]);
        for ending in ["ktx2", "dds"] {
            let file = sandbox.read(&format!("baked/{name}.{ending}"));
            let (size, cubes, texels) = texture(&file);
            assert_eq!(
                (6 * size * size, cubes, texels.len()),
                (picture.len(), 1, 8 * picture.len()),
                "{name}"
            );
            for (texel, want) in texels.chunks(8).zip(&picture) {
                for c in 0..3 {
                    let (got, want) = (half(&texel[2 * c..]), want[c]);
                    // Halves are rounded to 11 bits.
                    assert!(
                        (got - want).abs() <= want.abs() * 2_f32.powi(-11),
                        "{name}.{ending}: {got} {want}"
                    );
                }
            }
        }
    }
    // The lobes around that one, as an array.
    let lobes = std::fs::read_dir(sandbox.path("baked")).unwrap();
    let names = lobes.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let lobes = names.filter(|name| name.starts_with("lobe_") && name.ends_with(".exr")).count();
    assert!(lobes > 1);
    for ending in ["ktx2", "dds"] {
        assert_eq!(texture(&sandbox.read(&format!("baked/lobe_stack.{ending}"))).1, lobes);
    }
    assert!(!sandbox.path("baked/lobe_stack.exr").exists());
    // Each as it is asked for.
    sandbox.run(&["bake", "scene.toml", "-o", "textures", "--cubes", "dds"]).done();
    assert!(sandbox.path("textures/hilite.dds").is_file() && !sandbox.path("textures/hilite.exr").exists());
    assert!(sandbox.read("textures/hilite.dds") == sandbox.read("baked/hilite.dds"));
}

#[test]
fn light_beyond_halves_is_told_and_other_kinds_of_file_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.write_exr("env.exr", 32, 16, |_, _| [1e5, 1.0, 1.0]);
    let bake = |more: &[&str]| {
        sandbox.run(&[&["bake", "scene.toml", "--effects", "diffuse", "-o", "baked"], more].concat())
    };
    let ran = bake(&["--cubes", "ktx2"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.err.contains("irradiance.ktx2: 384 numbers are beyond what half floats hold"), "{ran:?}");
    let ran = bake(&[]);
    assert!(ran.code == Some(0) && !ran.err.contains("half floats"), "{ran:?}");
    let ran = bake(&["--cubes", "ktx"]);
    assert!(ran.code == Some(2) && ran.err.contains("Did you mean `ktx2`?"), "{ran:?}");
}

/// Fragments all around, on edges and corners of the cube too: unit normal, open share, 1 - |N.V|.
fn fragments() -> Vec<[f64; 5]> {
    let steps = [-1.0, -0.96, -0.4, 0.03, 0.7, 1.0];
    let mut found = Vec::new();
    for (i, x) in steps.into_iter().enumerate() {
        for (j, y) in steps.into_iter().enumerate() {
            for (k, z) in steps.into_iter().enumerate() {
                let length = f64::hypot(f64::hypot(x, y), z);
                let [open, silhouette] = [0.2 + 0.15 * i as f64, 0.1 + 0.15 * ((j + k) % 6) as f64];
                found.push([x / length, y / length, z / length, open, silhouette]);
            }
        }
    }
    found
}

/// The same by the rules, of the cube as it was baked.
fn by_rules(cube: &Cube<f32>, params: &Params, fragments: &[[f64; 5]]) -> Vec<[f64; 3]> {
    let effects = Effects::of(&[Effect::Diffuse, Effect::Occlusion, Effect::Rim]);
    let setup = Setup::new(Form::Corrected, Silhouette::Fragment, effects);
    let cube = cube.map(|texel| texel.map(f64::from));
    let others = || cube.clone();
    let cubes =
        Cubes { irradiance: others(), specular: others(), specular_slope: others(), hilite: others() };
    let rules = Fragments::new(setup, &cubes, params, &Wanted::default(), 0.0_f64);
    let shade = |&[x, y, z, occlusion, silhouette]: &[f64; 5]| {
        let fragment = Fragment {
            base: [x, y, z],
            bump: [0.0; 3],
            normal: [x, y, z],
            view: [-x, -y, -z],
            occlusion,
            silhouette,
            dapple: 1.0,
            albedo: [1.0; 3],
            specular: 1.0,
            attenuator: 1.0,
        };
        let [r, g, b, _] = rules.shade(|input| fragment.number(&input.name, input.component).unwrap()).rgba;
        [r, g, b]
    };
    fragments.iter().map(shade).collect()
}

/// What the C program prints for fragments.
fn by_c(program: &Path, cube: &Path, fragments: &[[f64; 5]]) -> Vec<[f64; 3]> {
    let mut child =
        Command::new(program).arg(cube).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let lines = fragments.iter().map(|f| f.map(|x| x.to_string()).join(" ") + "\n").collect::<String>();
    let mut input = child.stdin.take().unwrap();
    // Beside the reading, so that neither waits for the other's full pipe.
    let writer = std::thread::spawn(move || input.write_all(lines.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let numbers = |line: &str| line.split(' ').map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
    text.lines().map(|line| numbers(line).try_into().unwrap()).collect()
}

#[test]
fn a_c_program_makes_of_header_and_cube_what_the_rules_make() {
    let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
    // Rust links by it, so it is there; another name is told by CC.
    assert!(Command::new(&compiler).arg("--version").output().is_ok(), "{} does not run", compiler.display());
    let sandbox = Sandbox::new();
    let export = ["export", "truth.toml", "--scene", "scene.toml", "--to", "c", "-o", "skin.h"];
    sandbox.run(&export).done();
    sandbox.run(&["bake", "scene.toml", "-o", "baked", "--cubes", "ktx2,dds"]).done();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/engine_c/main.c");
    let program = sandbox.path("engine_c");
    let mut compile = Command::new(&compiler);
    compile.args(["-std=c99", "-Wall", "-Wextra", "-I"]).arg(sandbox.path(".")).arg(source);
    let compiled = compile.args(["-lm", "-o"]).arg(&program).output().unwrap();
    let said = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success() && said.is_empty(), "{said}");

    let options = PrepareOptions { cache: Some(sandbox.cache().to_owned()), ..PrepareOptions::default() };
    let baked = Baked::new(&sandbox.path("scene.toml"), &options).unwrap();
    let mut params = Params::defaults(Form::Corrected);
    let constants = [("base_weight", 0.8), ("rim_weight", 0.9), ("rim_exponent", 3.0), ("occlusion", 0.7)];
    for (name, value) in constants {
        params.set(Param::from_name(name).unwrap(), value);
    }
    let fragments = fragments();
    let wanted = by_rules(baked.illumination.irradiance.as_ref().unwrap(), &params, &fragments);
    assert!(wanted.iter().any(|light| (light[0] - light[2]).abs() > 0.01), "the cube is one grey");
    for ending in ["ktx2", "dds"] {
        let got = by_c(&program, &sandbox.path(&format!("baked/irradiance.{ending}")), &fragments);
        assert_eq!(got.len(), wanted.len());
        for ((got, want), fragment) in got.iter().zip(&wanted).zip(&fragments) {
            for c in 0..3 {
                // Texels are halves, rounded to 11 bits, and of one sign; the header's constants are floats, which
                // adds some 1e-7, and the cube's corners are means of halves.
                let most = want[c] * (2_f64.powi(-11) + 1e-6);
                assert!((got[c] - want[c]).abs() <= most, "{ending}: {fragment:?}: {got:?} {want:?}");
            }
        }
    }
    // A file that is no cube is refused.
    let refused = Command::new(&program).arg(sandbox.path("env.exr")).output().unwrap();
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
}
