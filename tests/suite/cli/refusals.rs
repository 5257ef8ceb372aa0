//! Bad input, one case a row: exit code 2, one paragraph that names file, place, fault and remedy, and
//! nothing left behind.

use super::sandbox::{Ran, Sandbox};

/// What is done to the scene's folder, and what the refusal must say.
pub(super) struct Case<'a> {
    pub(super) what: &'a str,
    pub(super) arguments: &'a [&'a str],
    pub(super) spoil: &'a dyn Fn(&Sandbox),
    pub(super) words: &'a [&'a str],
}

pub(super) const FIT: &[&str] = &["fit", "scene.toml", "-o", "deep/run"];

pub(super) fn check(cases: &[Case<'_>]) {
    for case in cases {
        let sandbox = Sandbox::new();
        (case.spoil)(&sandbox);
        let before = sandbox.files();
        eprintln!("{}:", case.what);
        let Ran { err, .. } = sandbox.run(case.arguments).refused(case.words);
        eprintln!("    {}", err.trim_end());
        let after = sandbox.files();
        let (before, after): (Vec<_>, Vec<_>) = (before.keys().collect(), after.keys().collect());
        assert_eq!(before, after, "{}: files were left", case.what);
    }
}

/// Cases that change the scene file's text alone: what, from, to, words.
fn check_edits(edits: &[(&str, &str, &str, &[&str])]) {
    for &(what, from, to, words) in edits {
        let words = [&["scene.toml: line "], words].concat();
        check(&[Case { what, arguments: FIT, spoil: &|sandbox| sandbox.edit(from, to), words: &words }]);
    }
}

#[test]
fn scene_files_that_say_what_there_is_not() {
    check_edits(&[
        ("no TOML", "[mesh]", "[mesh", &["line 2", "toml.io"]),
        (
            "unknown key",
            "file = \"mesh.glb\"",
            "flie = 1",
            &["line 3: unknown key `flie`. Did you mean `file`?"],
        ),
        ("unknown table", "[quality]", "[qualty]", &["unknown key `qualty`. Did you mean `quality`?"]),
        ("missing key", "fov_y_degrees = 35.0", "", &["line 18", "the key `fov_y_degrees` is missing"]),
        (
            "unknown parameter",
            "hilite = 0.7",
            "hilit = 0.7",
            &["line 16: unknown parameter `hilit`. Did you mean"],
        ),
        (
            "unknown free",
            "\"rim_weight\"",
            "\"rim_wait\"",
            &["unknown parameter `rim_wait`. Did you mean `rim_weight`?"],
        ),
        (
            "unknown effect",
            "\"occlusion\"",
            "\"oclusion\"",
            &["unknown effect `oclusion`. Did you mean `occlusion`?"],
        ),
        (
            "unknown loss",
            "relative_l2",
            "relative_l1",
            &["unknown loss `relative_l1`. Did you mean `relative_l2`?"],
        ),
        (
            "unknown form",
            "\"corrected\"",
            "\"listings\"",
            &["unknown form `listings`. Did you mean `listing`?"],
        ),
        ("unknown silhouette", "\"fragment\"", "\"bump\"", &["unknown silhouette `bump`", "bumped"]),
        (
            "out of bounds",
            "hilite = 0.7",
            "hilite = -0.7",
            &["hilite = -0.7 is out of bounds", "[0, 1000000000]"],
        ),
        ("not finite", "hilite = 0.7", "hilite = nan", &["line 16", "hilite = NaN", "finite number"]),
        ("wrong type", "width = 32", "width = \"wide\"", &["invalid type", "expected a whole number"]),
        ("a fraction of a pixel", "width = 32", "width = 32.5", &["expected a whole number"]),
        ("no pixels", "width = 32", "width = 0", &["width = 0 is out of bounds", "[1, 16384]"]),
        ("a triple where one is wanted", "hilite = 0.7", "occlusion = [1, 0, 1]", &["takes one value"]),
    ]);
}

#[test]
fn cameras_that_are_none() {
    let identity = "[1,0,0,0, 0,1,0,0, 0,0,1,-4, 0,0,0,1]";
    let remedy = "Give 16 finite numbers, row by row";
    check_edits(&[
        ("NaN", identity, "[nan,0,0,0, 0,1,0,0, 0,0,1,-4, 0,0,0,1]", &["NaN at row 0, column 0", remedy]),
        (
            "infinity",
            identity,
            "[1,0,0,0, 0,1,0,0, 0,0,1,-inf, 0,0,0,1]",
            &["-inf at row 2, column 3", remedy],
        ),
        ("singular", identity, "[1,0,0,0, 0,0,0,0, 0,0,1,-4, 0,0,0,1]", &["not orthonormal", remedy]),
        ("all zero", identity, "[0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,0]", &["not orthonormal", remedy]),
        ("too short", identity, "[1,0,0]", &["has 3 numbers instead of 16", remedy]),
        ("by columns", identity, "[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,-4,1]", &["stored by columns?"]),
        (
            "field of view",
            "fov_y_degrees = 35.0",
            "fov_y_degrees = inf",
            &["fov_y_degrees = inf", "below 180"],
        ),
        ("two of one name", "name = \"side\"", "name = \"front\"", &["two views are named `front`"]),
        ("a name for no file", "name = \"side\"", "name = \"../side\"", &["cannot be part of a file name"]),
    ]);
    let away = |sandbox: &Sandbox| sandbox.edit("0,0,1,-4", "0,0,1,4");
    check(&[Case {
        what: "sees nothing",
        arguments: FIT,
        spoil: &away,
        words: &["scene.toml: view \"front\": no pixel shows the mesh", "check world_to_camera"],
    }]);
}

#[test]
fn scenes_that_are_not_there_or_lack_what_is_asked_for() {
    let case = |what, arguments, spoil, words| Case { what, arguments, spoil, words };
    check(&[
        case(
            "no scene",
            &["fit", "nowhere.toml", "-o", "run"],
            &|_| {},
            &["nowhere.toml: there is no such file", "Correct"],
        ),
        case(
            "a folder",
            &["fit", ".", "-o", "run"],
            &|_| {},
            &["is a folder. Name the scene file in it, ./scene.toml"],
        ),
        case("another folder", &["fit", "targets", "-o", "run"], &|_| {}, &["targets: is not a file"]),
        case(
            "a picture",
            &["fit", "color.png", "-o", "run"],
            &|_| {},
            &["color.png: line 1: is not text in UTF-8"],
        ),
        case(
            "no mesh",
            FIT,
            &|d| d.remove("mesh.glb"),
            &["mesh.glb: there is no such file", "relative to that file"],
        ),
        case("no map", FIT, &|d| d.remove("normal.png"), &["normal.png: there is no such file"]),
        case("no environment", FIT, &|d| d.remove("env.exr"), &["env.exr: there is no such file"]),
        case(
            "no target file",
            FIT,
            &|d| d.remove("targets/side.exr"),
            &["targets/side.exr: there is no such file"],
        ),
        case(
            "no environment named",
            FIT,
            &|d| d.edit("[environment]\nfile = \"env.exr\"\n", ""),
            &["scene.toml: has no [environment]", "Add [environment]"],
        ),
        case(
            "no targets",
            FIT,
            &|d| {
                ["front", "side"].iter().for_each(|v| d.edit(&format!("target = \"targets/{v}.exr\"\n"), ""));
            },
            &["scene.toml: no view names a target", "Add target ="],
        ),
        case(
            "no views",
            FIT,
            &|d| d.write("scene.toml", b"[mesh]\nfile = \"mesh.glb\"\n"),
            &["scene.toml: has no view. Add a [[view]]"],
        ),
        case(
            "unknown view",
            &["render", "scene.toml", "--view", "frnt", "-o", "a.exr"],
            &|_| {},
            &["scene.toml: there is no view `frnt`. Did you mean `front`? Known: front, side."],
        ),
    ]);
}
