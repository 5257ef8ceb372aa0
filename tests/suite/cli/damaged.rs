//! Files that the program reads again, damaged: it refuses them with exit code 2 and one paragraph that names the file,
//! leaving everything as it was, or does its work and leaves whole files. The same damage every time.

use std::path::Path;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};

use super::sandbox::{Sandbox, TRUTH, mesh};
use crate::damage::tree::{json_text, toml_text, tree_damage};
use crate::damage::{Damage, damage};
use crate::fixtures::read_exr;
use crate::imported::metashape::metashape_file;
use crate::imported::opencv::{STORED, XML};

/// `count` values of a strategy, the same every time.
fn values<S: Strategy>(count: usize, strategy: &S) -> Vec<S::Value> {
    let mut runner = TestRunner::deterministic();
    (0..count).map(|_| strategy.new_tree(&mut runner).unwrap().current()).collect()
}

/// Damaged texts of a file that says `whole`: half of them in what they say, half in their letters.
fn texts(count: usize, whole: &Value, as_text: fn(&Value) -> Option<String>) -> Vec<Vec<u8>> {
    let text = as_text(whole).unwrap().into_bytes();
    let trees = values(count / 2, &tree_damage());
    let said =
        trees.iter().filter_map(|damage| as_text(&damage.apply(whole.clone()))).map(String::into_bytes);
    said.chain(bytes(count / 2, &text)).collect()
}

/// Damaged bytes of a file.
fn bytes(count: usize, whole: &[u8]) -> Vec<Vec<u8>> {
    let damages: Vec<Damage> = values(count, &damage());
    damages.iter().map(|damage| damage.apply(whole.to_vec())).collect()
}

fn toml_tree(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

/// Run the program on each of `damaged` in the place of `file`; what it writes is `output`, or below it. Some must be
/// refused, by the file's name.
fn check(sandbox: &Sandbox, file: &str, damaged: &[Vec<u8>], arguments: &[&str], output: &str) {
    let refused = check_named(sandbox, file, file, damaged, arguments, output);
    assert!(refused > 0, "{file}: nothing was refused");
}

/// The same; how many were refused, which has to say `named`.
pub(super) fn check_named(
    sandbox: &Sandbox,
    file: &str,
    named: &str,
    damaged: &[Vec<u8>],
    arguments: &[&str],
    output: &str,
) -> usize {
    let whole = sandbox.read(file);
    let kept = sandbox.path(output).exists().then(|| sandbox.files());
    let (mut refused, mut taken) = (0, 0);
    for bytes in damaged {
        sandbox.write(file, bytes);
        let before = sandbox.files();
        let ran = sandbox.run(arguments);
        let said = String::from_utf8_lossy(bytes).into_owned();
        assert!(!ran.err.contains("panicked"), "{said}\n{ran:?}");
        match ran.code {
            Some(2) => {
                refused += 1;
                ran.refused(&[named]);
                assert!(sandbox.files() == before, "refused, and files were left or changed:\n{said}");
            }
            Some(0 | 1) => {
                taken += 1;
                whole_files(sandbox, &said);
                // As it was before, for the next one.
                match &kept {
                    Some(files) => files
                        .iter()
                        .filter(|(path, _)| path.is_file())
                        .for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap()),
                    None => remove(&sandbox.path(output)),
                }
            }
            other => panic!("ended with {other:?}:\n{said}\n{ran:?}"),
        }
    }
    sandbox.write(file, &whole);
    println!("{file}: {refused} refused, {taken} taken of {}", damaged.len());
    refused
}

fn remove(path: &Path) {
    if path.is_dir() {
        std::fs::remove_dir_all(path).unwrap();
    } else if path.exists() {
        std::fs::remove_file(path).unwrap();
    }
}

/// Nothing half written, and no number that is none.
fn whole_files(sandbox: &Sandbox, said: &str) {
    for (path, bytes) in sandbox.files() {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(!name.starts_with(".skinfit-"), "{} is left of a file:\n{said}", path.display());
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("json") if path.ends_with("report.json") => {
                let report: Value =
                    serde_json::from_slice(&bytes).unwrap_or_else(|e| panic!("{name}: {e}\n{said}"));
                assert!(report["loss"]["end"].as_f64().is_some_and(f64::is_finite), "{report}\n{said}");
            }
            Some("toml") if name == "made.toml" => {
                let text = String::from_utf8(bytes).unwrap_or_else(|e| panic!("{name}: {e}\n{said}"));
                assert!(text.parse::<toml::Table>().is_ok(), "{text}\n{said}");
            }
            Some("exr") if ["merged.exr", "sky.exr"].contains(&name.as_str()) => {
                let finite = read_exr(&path).planes.values().flatten().all(|value| value.is_finite());
                assert!(finite, "{name}:\n{said}");
            }
            Some("html") => assert!(bytes.ends_with(b"</html>\n"), "{name}:\n{said}"),
            Some("png") => {
                assert!(image::load_from_memory(&bytes).is_ok() || path.ends_with("mask.png"), "{name}");
            }
            _ => {}
        }
    }
}

#[test]
fn constants() {
    let sandbox = Sandbox::new();
    sandbox.write("p.toml", TRUTH.as_bytes());
    let whole = toml_tree(&format!("{TRUTH}[gains]\nside = 1.5\n"));
    let damaged = texts(30, &whole, toml_text);
    let fit = ["fit", "scene.toml", "--params", "p.toml", "-o", "run", "--max-iterations", "1"];
    check(&sandbox, "p.toml", &damaged, &fit, "run");
    let render = ["render", "scene.toml", "--engine", "cpu", "--params", "p.toml", "-o", "a.exr"];
    check(&sandbox, "p.toml", &damaged, &render, "a.exr");
    check(
        &sandbox,
        "p.toml",
        &damaged,
        &["export", "p.toml", "--to", "c", "-o", "a.h", "--scene", "scene.toml"],
        "a.h",
    );
}

#[test]
fn states() {
    let sandbox = Sandbox::new();
    assert_eq!(sandbox.fit("run", &["--max-iterations", "1", "--engine", "cpu"]).code, Some(1));
    let whole = sandbox.json("run/state.json");
    let damaged = texts(40, &whole, |tree| Some(json_text(tree)));
    let resume = ["fit", "scene.toml", "-o", "run", "--resume", "--engine", "cpu", "--max-iterations", "3"];
    check(&sandbox, "run/state.json", &damaged, &resume, "run");
}

#[test]
fn cameras_of_other_programs() {
    let sandbox = Sandbox::new();
    let import = |program: &'static str, file: &'static str| {
        ["import", program, file, "--mesh", "mesh.glb", "--environment", "env.exr", "-o", "made.toml"]
    };
    let transforms = json!({
        "camera_angle_x": 0.6, "w": 32, "h": 32,
        "frames": [{"file_path": "front", "transform_matrix": [
            [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 4.0], [0.0, 0.0, 0.0, 1.0],
        ]}],
    });
    sandbox.write("transforms.json", transforms.to_string().as_bytes());
    let damaged = texts(40, &transforms, |tree| Some(json_text(tree)));
    check(&sandbox, "transforms.json", &damaged, &import("transforms", "transforms.json"), "made.toml");
    for (program, file, whole) in [
        ("metashape", "cameras.xml", metashape_file()),
        ("opencv", "camera.yml", STORED.to_owned()),
        ("opencv", "camera.xml", XML.to_owned()),
    ] {
        sandbox.write(file, whole.as_bytes());
        check(&sandbox, file, &bytes(40, whole.as_bytes()), &import(program, file), "made.toml");
    }
}

#[test]
fn shots_of_a_panorama() {
    let sandbox = Sandbox::new();
    for name in ["a.exr", "b.exr"] {
        sandbox.write_exr(name, 32, 32, |x, y| [0.5 + 0.01 * x as f32, 0.5, 0.5 + 0.01 * y as f32]);
    }
    let shot = |name: &str, towards: &str| {
        format!(
            "[[shot]]\nfile = \"{name}\"\nlens = \"equidistant\"\ncentre = [16, 16]\nradius = 15.5\n\
             field_of_view_degrees = 200\ntowards = {towards}\nup = [0, 1, 0]\n"
        )
    };
    let whole = shot("a.exr", "[0, 0, -1]") + &shot("b.exr", "[0, 0, 1]");
    sandbox.write("shots.toml", whole.as_bytes());
    let stitch = ["panorama", "stitch", "shots.toml", "-o", "sky.exr", "--width", "32"];
    check(&sandbox, "shots.toml", &texts(60, &toml_tree(&whole), toml_text), &stitch, "sky.exr");
}

#[test]
fn plans_and_results() {
    let sandbox = Sandbox::new();
    let plan = json!({
        "command": "fit", "scene": "scene.toml", "results": "out", "settings": {"max_iterations": 1},
        "axis": [{"key": "fit.loss", "values": ["l2", "huber"]}],
    });
    let plan_text = toml_text(&plan).unwrap();
    sandbox.write("plan.toml", plan_text.as_bytes());
    let damaged = texts(24, &plan, toml_text);
    check(&sandbox, "plan.toml", &damaged, &["sweep", "plan.toml", "--list"], "out");
    sandbox.write("plan.toml", plan_text.replace("max_iterations = 1", "seed = 1").as_bytes());
    sandbox.run(&["sweep", "plan.toml"]).done();
    let result = std::fs::read_dir(sandbox.path("out")).unwrap().map(|entry| entry.unwrap().file_name());
    let name =
        result.map(|name| name.into_string().unwrap()).find(|name| name.starts_with("job-0001")).unwrap();
    let file = format!("out/{name}");
    let damaged = texts(40, &sandbox.json(&file), |tree| Some(json_text(tree)));
    for output in ["all.csv", "all.json"] {
        // A refusal names the result's file or the folder that it disagrees with.
        let whole = sandbox.read(&file);
        for bytes in &damaged {
            sandbox.write(&file, bytes);
            let ran = sandbox.run(&["collect", "out", "-o", output]);
            match ran.code {
                Some(2) => {
                    ran.refused(&["out"]);
                    assert!(!sandbox.path(output).exists());
                }
                Some(0 | 1) => {
                    whole_files(&sandbox, "");
                    remove(&sandbox.path(output));
                }
                other => panic!("{other:?}: {ran:?}"),
            }
        }
        sandbox.write(&file, &whole);
    }
}

#[test]
fn cases_to_be_tried_again() {
    let sandbox = Sandbox::new();
    let whole = sandbox_case([0.75, 0.5, 0.375], 1.0);
    // A study takes seconds: only what is refused is tried here, the rest by `damage::tables`.
    let mut damaged: Vec<Vec<u8>> = Vec::new();
    for (from, to) in [
        ("form", "from"),
        ("\"corrected\"", "\"correct\""),
        ("\"wavy\"", "\"waves\""),
        ("\"diffuse\"", "\"difuse\""),
        ("base_weight = [1.0, 1.0, 1.0]", "base_weight = [nan, 1.0, 1.0]"),
        ("base_weight = [1.0, 1.0, 1.0]", "base_weight = [-1.0, 1.0, 1.0]"),
        ("base_weight = [1.0, 1.0, 1.0]", "base_weight = [1.0, 1.0]"),
        ("occlusion = 0.75", "occlusion = 1e39"),
        ("occlusion = 0.75", "occlusion = nan"),
        ("[[case.fragment]]", "[[case.fragments]]"),
        ("[[case]]", "[case]"),
    ] {
        assert!(whole.contains(from), "{from}: {whole}");
        damaged.push(whole.replacen(from, to, 1).into_bytes());
    }
    damaged.push(whole.split_once("[[case.fragment]]").unwrap().0.as_bytes().to_vec());
    damaged.push(b"\xff\xfe".to_vec());
    sandbox.write("cases.toml", whole.as_bytes());
    for bytes in damaged {
        sandbox.write("cases.toml", &bytes);
        let before = sandbox.files();
        let study = ["stability", "scene.toml", "--replay", "cases.toml", "--no-gpu", "-o", "stable"];
        sandbox.run(&study).refused(&["cases.toml"]);
        assert!(sandbox.files() == before, "{}", String::from_utf8_lossy(&bytes));
    }
}

/// A file of one case, whose surface has that albedo under that base weight.
pub(super) fn sandbox_case(albedo: [f64; 3], base_weight: f64) -> String {
    format!(
        "[[case]]\nname = \"put there\"\nform = \"corrected\"\nsilhouette = \"fragment\"\neffects = [\"diffuse\"]\n\
         lights = \"wavy\"\nloss = \"l2\"\n[case.params]\nbase_weight = [{base_weight:?}, {base_weight:?}, {base_weight:?}]\n\
         [[case.fragment]]\ntexel = [0.5, 0.5, 1.0]\ntangent = [1.0, 0.0, 0.0]\nbitangent = [0.0, 1.0, 0.0]\n\
         normal = [0.0, 0.0, 1.0]\nview = [0.0, 0.0, -1.0]\nocclusion = 0.75\nsilhouette = 0.25\ndapple = 0.5\n\
         albedo = {albedo:?}\nspecular = 0.5\nattenuator = 0.75\n"
    )
}

#[test]
fn buffers_beside_a_mesh_and_masks() {
    let sandbox = Sandbox::new();
    let glb = mesh(|_, _| {});
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let bin = glb[28 + length..].to_vec();
    json["buffers"] = json!([{"uri": "mesh.bin", "byteLength": bin.len()}]);
    sandbox.write("mesh.gltf", json.to_string().as_bytes());
    sandbox.write("mesh.bin", &bin);
    sandbox.edit("mesh.glb", "mesh.gltf");
    sandbox.write_grey("mask.exr", 32, 32);
    sandbox.edit("target = \"targets/front.exr\"", "target = \"targets/front.exr\"\nmask = \"mask.exr\"");
    let fit = ["fit", "scene.toml", "-o", "run", "--max-iterations", "1", "--no-cache"];
    let mut damaged = bytes(12, &bin);
    damaged.push(bin[..bin.len() / 2].to_vec());
    damaged.push(Vec::new());
    let mut spoilt = bin.clone();
    spoilt[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    damaged.push(spoilt);
    for bytes in damaged {
        sandbox.write("mesh.bin", &bytes);
        let before = sandbox.files();
        let ran = sandbox.run(&fit);
        if ran.code == Some(2) {
            // What a buffer holds wrongly is told of the mesh that it belongs to.
            ran.refused(&["mesh."]);
            assert!(sandbox.files() == before);
        } else {
            assert!(matches!(ran.code, Some(0 | 1)), "{ran:?}");
            whole_files(&sandbox, "");
            remove(&sandbox.path("run"));
        }
    }
    sandbox.write("mesh.bin", &bin);
    let mask = sandbox.read("mask.exr");
    let mut damaged = bytes(14, &mask);
    damaged.push(mask[..mask.len() / 2].to_vec());
    check(&sandbox, "mask.exr", &damaged, &fit, "run");
}
