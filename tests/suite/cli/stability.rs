//! Studies of stability.

use super::sandbox::{Ran, Sandbox};

/// Enough to try everything, and no more.
const SHORT: [&str; 7] = ["--no-gpu", "--cases", "1500", "--pixels", "1000", "-o", "stable"];

fn study(sandbox: &Sandbox, threads: &str, seed: &str) -> Ran {
    let arguments = [&["stability", "scene.toml", "--seed", seed], &SHORT[..]].concat();
    Ran::of(sandbox.command(&arguments).env("RAYON_NUM_THREADS", threads))
}

#[test]
fn a_scene_is_studied_on_every_evaluator_and_the_same_seed_gives_the_same_on_any_number_of_threads() {
    let sandbox = Sandbox::new();
    let ran = study(&sandbox, "1", "3");
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for word in ["facing", "65504 beside 0", "many pixels", "random search", "model f32: "] {
        assert!(ran.out.contains(word), "{word}: {ran:?}");
    }
    assert!(ran.err.contains("WERE NOT TRIED"), "{ran:?}");
    let report = sandbox.json("stable/stability.json");
    for engine in report["engines"].as_array().unwrap() {
        assert_eq!(engine["random"]["tried"], 1500);
        assert!(engine["hard"].as_u64().unwrap() > 100 && engine["scene"]["tried"].as_u64().unwrap() > 1000);
    }
    let left = || ["stability.json", "new_cases.toml"].map(|name| sandbox.read(&format!("stable/{name}")));
    let first = left();
    let again = study(&sandbox, "4", "3");
    assert!(left() == first && again.out == ran.out, "the same seed gave something else: {again:?}");
    study(&sandbox, "4", "4");
    assert!(left() != first);
}

#[test]
fn cases_of_a_file_are_tried_again_and_other_files_are_refused() {
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
