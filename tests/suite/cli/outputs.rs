//! Output that cannot be written: exit code 2, and nothing half-written.

use super::sandbox::{Ran, Sandbox};

#[test]
fn paths_that_cannot_be_written() {
    let sandbox = Sandbox::new();
    sandbox.write("file", b"in the way");
    sandbox.run(&["bake", "scene.toml", "-o", "warm"]).done();
    let before = sandbox.files();
    let rows: &[(&[&str], &[&str])] = &[
        (&["fit", "scene.toml", "-o", "file"], &["file: cannot be written", "Choose a folder"]),
        (&["fit", "scene.toml", "-o", "file/run"], &["file/run: cannot be written", "Choose a folder"]),
        (
            &["render", "--engine", "cpu", "scene.toml", "-o", "file/a.exr"],
            &["file/a.exr: cannot be written"],
        ),
        (
            &["render", "--engine", "cpu", "scene.toml", "-o", "file/a.png"],
            &["file/a.png: cannot be written"],
        ),
        (&["bake", "scene.toml", "-o", "file/baked"], &["file/baked: cannot be written", "Choose a folder"]),
        (&["demo", "file"], &["file: is a file", "Name another place"]),
        (&["render", "scene.toml", "-o", "a.tiff"], &["a.tiff: ", ".exr or .png"]),
        (&["render", "scene.toml", "-o", "a"], &["a: ", ".exr or .png"]),
        (&["render", "scene.toml", "-o", "a.png", "--layers"], &["a.png: a PNG holds no layers", ".exr"]),
    ];
    for (arguments, words) in rows {
        sandbox.run(arguments).refused(words);
        assert!(sandbox.files() == before, "{arguments:?}: something changed");
    }
}

/// Devices and the process' files take no new ones, not even from root.
#[cfg(target_os = "linux")]
#[test]
fn places_where_nothing_can_be_made() {
    let sandbox = Sandbox::new();
    for place in ["/dev/full/run", "/proc/run"] {
        sandbox.fit(place, &[]).refused(&[&format!("{place}: cannot be written"), "Choose a folder"]);
        let image = format!("{place}/a.exr");
        sandbox
            .run(&["render", "--engine", "cpu", "scene.toml", "-o", &image])
            .refused(&[&format!("{image}: cannot be written")]);
    }
}

/// A limit on the size of files stands for a disk that is full: the write fails half-way.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_leaves_no_halves() {
    let sandbox = Sandbox::new();
    sandbox.fit("run", &[]).done();
    let before = sandbox.files();
    // 512-byte blocks; without the signal, which would end the program before it can say so.
    let limited = |arguments: &str| {
        let program = env!("CARGO_BIN_EXE_skinfit");
        let script = format!("trap '' XFSZ; ulimit -f 4; exec '{program}' {arguments}");
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &script]).current_dir(sandbox.path("")).env("SKINFIT_CACHE", sandbox.cache());
        Ran::of(&mut command)
    };
    limited("render --engine cpu scene.toml --layers -o new.exr")
        .refused(&["new.exr: cannot be written", "has room"]);
    limited("render --engine cpu scene.toml -o targets/front.exr")
        .refused(&["targets/front.exr: cannot be written"]);
    assert!(sandbox.files() == before);
    limited("fit scene.toml -o run").refused(&["run/", ": cannot be written", "has room"]);
    let after = sandbox.files();
    assert!(before.keys().eq(after.keys()), "files were left");
    for (path, bytes) in &after {
        // What was written again is whole: here, the same.
        let same = before[path] == *bytes || path.ends_with("run/state.json");
        assert!(same, "{} is not what it was", path.display());
    }
    serde_json::from_slice::<serde_json::Value>(&sandbox.read("run/state.json")).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_on_a_full_disk_is_said() {
    let sandbox = Sandbox::new();
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for arguments in [&["params"][..], &["fit", "scene.toml", "-o", "run", "--json"]] {
        let ran = Ran::of(sandbox.command(arguments).stdout(full()));
        ran.refused(&["standard output cannot be written"]);
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let sandbox = Sandbox::new();
    for arguments in [
        &["params"][..],
        &["params", "--format", "json"],
        &["--help"],
        &["fit", "--help"],
        &["fit", "scene.toml", "-o", "run"],
        &["fit", "scene.toml", "-o", "run", "--json"],
        &["render", "--engine", "cpu", "scene.toml", "-o", "a.exr"],
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let ran = Ran::of(sandbox.command(arguments).stdout(writer));
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{arguments:?}");
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let ran = Ran::of(sandbox.command(arguments).stderr(writer));
        assert_eq!(ran.code, Some(0), "{arguments:?}");
        // Refusals whom nobody hears are refusals still.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let ran = Ran::of(sandbox.command(&["fit", "nowhere.toml"]).stderr(writer));
        assert_eq!(ran.code, Some(2));
    }
}
