//! Studies of stability.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::damaged::sandbox_case;
use super::sandbox::{Ran, Sandbox};
use crate::added_term::FRESNEL;

/// Enough to try everything, and no more.
const SHORT: [&str; 7] = ["--no-gpu", "--cases", "500", "--pixels", "1000", "-o", "stable"];

fn study(sandbox: &Sandbox, threads: &str) -> Ran {
    let arguments = [&["stability", "scene.toml", "--seed", "3"], &SHORT[..]].concat();
    Ran::of(sandbox.command(&arguments).env("RAYON_NUM_THREADS", threads))
}

#[test]
fn a_scene_is_studied_on_every_evaluator_and_the_same_seed_gives_the_same_on_any_number_of_threads() {
    let sandbox = Sandbox::new();
    let ran = study(&sandbox, "1");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for word in ["facing", "65504 beside 0", "many pixels", "random search", "model f32: "] {
        assert!(ran.out.contains(word), "{word}: {ran:?}");
    }
    assert!(ran.err.contains("WERE NOT TRIED"), "{ran:?}");
    let report = sandbox.json("stable/stability.json");
    for engine in report["engines"].as_array().unwrap() {
        assert_eq!(engine["random"]["tried"], 500);
        assert!(engine["hard"].as_u64().unwrap() > 100 && engine["scene"]["tried"].as_u64().unwrap() > 1000);
    }
    let left = || ["stability.json", "new_cases.toml"].map(|name| sandbox.read(&format!("stable/{name}")));
    let first = left();
    let again = study(&sandbox, "4");
    assert!(left() == first && again.out == ran.out, "the same seed gave something else: {again:?}");
}

#[test]
fn a_failure_that_is_put_there_is_found_again_and_a_case_that_is_sound_passes() {
    let sandbox = Sandbox::new();
    let replay = |cases: &str| {
        sandbox.write("cases.toml", cases.as_bytes());
        sandbox.run(&[&["stability", "scene.toml", "--replay", "cases.toml"], &SHORT[..]].concat())
    };
    let rows = |report: &Value| -> Vec<Value> {
        let engines = report["engines"].as_array().unwrap();
        let case = |engine: &Value| {
            let cases = engine["cases"].as_array().unwrap();
            cases.iter().find(|case| case["name"] == "kept: put there").unwrap()["failure"].clone()
        };
        engines.iter().map(case).collect()
    };
    // The product of albedo and weight is beyond what an f32 holds: every number is sound, and no f32 is its colour.
    let ran = replay(&sandbox_case([2e38; 3], 1000.0));
    assert_eq!(ran.code, Some(1), "{ran:?}");
    for evaluator in ["model f32", "CPU engine"] {
        let told = format!("kept: put there: {evaluator}: red is inf; in f64 ");
        assert!(ran.err.contains(&told), "{told}: {ran:?}");
    }
    assert!(ran.out.contains("FAILED"), "{ran:?}");
    let report = sandbox.json("stable/stability.json");
    let failures = rows(&report);
    assert!(failures[0].is_null() && failures[1..].iter().all(Value::is_string), "{failures:?}");
    assert_eq!(report["failed"], 2);
    // The same case with numbers that an f32 can multiply.
    let ran = replay(&sandbox_case([0.5; 3], 1000.0));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = sandbox.json("stable/stability.json");
    assert!(rows(&report).iter().all(Value::is_null) && report["failed"] == 0, "{report}");
}

/// Sound but where its parameter is 0: the root's derivative has no end there.
const GLOW: &str = "\
// effect: glow, light without a source
// parameter: glow_spread = 0.5 in [0, 4]; how far it goes; a test
//
// gives: glow_part
// adds: glow
// cost: 6
fn glow_light(albedo: vec3f, glow_spread: f32) -> vec3f {
    return sqrt(glow_spread) * albedo;
}
";

#[test]
fn what_a_scenes_own_terms_declare_is_searched_and_the_one_that_breaks_is_named() {
    let sandbox = Sandbox::new();
    sandbox.write("fresnel.wgsl", FRESNEL.as_bytes());
    sandbox.write("glow.wgsl", GLOW.as_bytes());
    let sound = "\"reflection\", \"fresnel_reflection\"]\nterms = [\"fresnel.wgsl\"]";
    sandbox.edit("\"reflection\"]", sound);
    let declared = |name: &str| {
        let report = sandbox.json("stable/stability.json");
        let engine = report["engines"].as_array().unwrap().iter().find(|engine| engine["name"] == name);
        engine.unwrap()["declared"].clone()
    };
    let ran = study(&sandbox, "2");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.out.contains("\ndeclared parameters "), "{ran:?}");
    let tally = declared("CPU engine");
    assert!(tally["tried"].as_u64().unwrap() > 500 && tally["failed"] == 0, "{tally}");
    // f32 is not f64: a deviation of exactly 0 would mean that nothing was compared.
    assert!(tally["worst"]["deviation"].as_f64().unwrap() > 0.0, "{tally}");
    // What is no engine computes the paper's effects alone.
    assert_eq!(declared("model f32")["tried"], 0);

    let broken =
        "\"reflection\", \"fresnel_reflection\", \"glow\"]\nterms = [\"fresnel.wgsl\", \"glow.wgsl\"]";
    sandbox.edit(sound, broken);
    let ran = study(&sandbox, "2");
    assert_eq!(ran.code, Some(1), "{ran:?}");
    for words in [
        "declared parameters: CPU engine: at least ",
        "glow_spread = 0 of glow, Corrected, {\"glow\"}, ",
        "in f64 the gradient by glow_spread is ",
    ] {
        assert!(ran.err.contains(words), "{words}: {ran:?}");
    }
    // Of the sixty-four fragments with that value no gradient is answered for.
    assert!(declared("CPU engine")["failed"].as_u64().unwrap() >= 64);
}

#[test]
fn files_that_hold_no_cases_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.write("other.toml", b"[[case]]\nnames = \"x\"\n");
    sandbox
        .run(&["stability", "scene.toml", "--replay", "other.toml"])
        .refused(&["other.toml: line 2: unknown key `names`. Did you mean `name`?"]);
    sandbox
        .run(&["stability", "scene.toml", "--replay", "none.toml"])
        .refused(&["none.toml: there is no such file"]);
}

#[test]
fn a_folder_that_cannot_be_had_is_refused_before_anything_is_studied() {
    let sandbox = Sandbox::new();
    sandbox.write("file", b"in the way");
    let study = ["stability", "scene.toml", "--no-gpu", "--cases", "1000000", "-o", "file"];
    sandbox.run(&study).refused(&["file: cannot be written", "Choose a folder"]);
    assert_eq!(sandbox.read("file"), b"in the way");
}

/// A row a raw file, the same of lights, and a row a hard case, as the study's page has them.
fn tables(results: &BTreeMap<String, Value>) -> [String; 3] {
    let number = |verdict: &Value, key: &str| verdict[key].as_f64().unwrap();
    let deviation = |x: f64| if x == 0.0 { "0".to_owned() } else { format!("{x:.1e}") };
    let engine = |file: &Value, name: &str| -> Option<Value> {
        file["engines"].as_array().unwrap().iter().find(|engine| engine["name"] == name).cloned()
    };
    let shown = ["model f32", "CPU engine", "shader rules", "GPU engine"];
    let cell = |search: Option<Value>| match search {
        None => "-".to_owned(),
        Some(search) => {
            let worst = &search["worst"];
            format!("{:.2} ({:.2})", number(worst, "deviation"), number(worst, "share_of_tolerance"))
        }
    };
    let mut searches = format!("| raw file | random cases | {} | failed |\n", shown.join(" | "));
    searches += &format!("|{}\n", " --- |".repeat(shown.len() + 3));
    for (name, file) in results {
        let random = |name| engine(file, name).map(|engine| engine["random"].clone());
        let cells: Vec<String> = shown.iter().map(|name| cell(random(name))).collect();
        let tried = random("model f32").unwrap()["tried"].clone();
        let failed = &file["failed"];
        searches += &format!("| [{name}](results/{name}) | {tried} | {} | {failed} |\n", cells.join(" | "));
    }
    let lit = ["CPU engine", "GPU engine"];
    let mut lights = format!("| raw file | fragments | {} |\n|{}\n", lit.join(" | "), " --- |".repeat(4));
    for (name, file) in results {
        let search = |name| engine(file, name).map(|engine| engine["lights"].clone());
        let tried = search("CPU engine").unwrap()["tried"].clone();
        let cells: Vec<String> = lit.iter().map(|name| cell(search(name))).collect();
        lights += &format!("| [{name}](results/{name}) | {tried} | {} |\n", cells.join(" | "));
    }
    // The same cases on every machine: the worst of its kind for each column.
    let columns: [(&str, &str, &str); 6] = [
        ("model f32", "model f32", ""),
        ("CPU engine", "CPU engine", ""),
        ("shader rules, llvmpipe", "shader rules", "llvmpipe"),
        ("shader rules, H100", "shader rules", "h100"),
        ("GPU engine, llvmpipe", "GPU engine", "llvmpipe"),
        ("GPU engine, H100", "GPU engine", "h100"),
    ];
    let titles: Vec<&str> = columns.iter().map(|column| column.0).collect();
    let mut cases = format!("| case | {} |\n|{}\n", titles.join(" | "), " --- |".repeat(columns.len() + 1));
    let first = results.values().next().unwrap();
    for case in first["engines"][0]["cases"].as_array().unwrap() {
        let worst = |(_, evaluator, file): (&str, &str, &str)| {
            let files = results.iter().filter(|(name, _)| name.starts_with(file));
            let engines = files.filter_map(|(_, results)| engine(results, evaluator));
            let found = engines.filter_map(|engine| {
                let cases = engine["cases"].as_array().unwrap();
                cases.iter().find(|other| other["name"] == case["name"]).map(|case| number(case, "deviation"))
            });
            found.reduce(f64::max).map_or_else(|| "-".to_owned(), deviation)
        };
        let cells = columns.map(worst).join(" | ");
        cases += &format!("| {} | {cells} |\n", case["name"].as_str().unwrap());
    }
    [searches, lights, cases]
}

#[test]
fn the_page_of_the_study_tells_all_that_its_raw_files_hold() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/stability");
    let files = std::fs::read_dir(folder.join("results")).unwrap().map(|entry| entry.unwrap().path());
    let json = files.filter(|path| path.extension().is_some_and(|ending| ending == "json"));
    let read = |path: PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap())
    };
    let results: BTreeMap<String, Value> = json.map(read).collect();
    let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
    for table in tables(&results) {
        // To mend it: put this in the place of the page's table.
        assert!(page.contains(&table), "experiments/stability/README.md does not hold\n\n{table}");
    }
    // Each seed that the page names has its file, and each file its line about what made it.
    let log = std::fs::read_to_string(folder.join("results/runs.csv")).unwrap();
    for name in results.keys() {
        assert!(log.lines().any(|line| line.starts_with(&format!("{name},"))), "runs.csv: {name}");
        assert_eq!(results[name]["seed"].to_string(), name.split(['-', '.']).nth(2).unwrap(), "{name}");
    }
    for seed in 0..4 {
        assert!(results.contains_key(&format!("cpu-1000000-{seed}.json")), "seed {seed}");
    }
}
