//! The borders of the workspace's members: who may depend on what, and who knows of the command line.

use std::path::{Path, PathBuf};

/// All that a program that uses the library may have.
const LIBRARY: [&str; 13] = [
    "base", "rules", "scene", "builtin", "sampling", "core", "gpu", "tensor", "report", "study", "panorama",
    "view", "page",
];
/// Those that know of no graphics interface.
const CPU: [&str; 6] = ["base", "rules", "scene", "builtin", "sampling", "core"];

fn member(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(name)
}

/// The dependencies that a member's manifest names, those of targets and of tests among them.
fn dependencies(name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(member(name).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = text.parse().unwrap();
    let mut found = Vec::new();
    let mut add = |table: &toml::Table| {
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let named = table.get(kind).and_then(toml::Value::as_table);
            found.extend(named.into_iter().flat_map(toml::Table::keys).cloned());
        }
    };
    add(&manifest);
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    targets.into_iter().flat_map(toml::Table::values).filter_map(toml::Value::as_table).for_each(add);
    assert!(found.len() > 2, "{name}: {found:?}");
    found
}

#[test]
fn members_depend_on_those_before_them_alone() {
    // As the data flows: each may use those that stand before it.
    let order = [
        "base", "rules", "scene", "builtin", "sampling", "core", "gpu", "tensor", "report", "study", "view",
        "page", "host", "python",
    ];
    for (place, name) in order.iter().enumerate() {
        let found = dependencies(name);
        for after in &order[place..] {
            assert!(!found.contains(&format!("skinfit-{after}")), "{name} depends on {after}");
        }
    }
    let manifest = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let listed = manifest["workspace"]["members"].as_array().unwrap().iter();
    let mut listed: Vec<&str> =
        listed.map(|path| path.as_str().unwrap().trim_start_matches("src/")).collect();
    let mut known: Vec<&str> = order.into_iter().chain(["panorama"]).collect();
    listed.sort_unstable();
    known.sort_unstable();
    assert_eq!(listed, known, "a member that no border is known of");
    // The model knows of no files; the head that the program makes is a scene like others, of which none is baked or sampled there.
    for (name, other) in [("rules", "base"), ("sampling", "builtin")] {
        assert!(!dependencies(name).contains(&format!("skinfit-{other}")), "{name} depends on {other}");
    }
    // Arrays in and out.
    let of_panorama = dependencies("panorama");
    assert!(!of_panorama.iter().any(|found| found.starts_with("skinfit")), "{of_panorama:?}");
    // The tensors are an addition that nothing else needs.
    for name in ["report", "study"] {
        assert!(!dependencies(name).contains(&"skinfit-tensor".to_owned()), "{name} depends on tensor");
    }
}

#[test]
fn the_library_has_no_command_line_signals_or_progress_bars() {
    for name in LIBRARY {
        for host in ["clap", "ctrlc", "indicatif", "nix"] {
            assert!(!dependencies(name).contains(&host.to_owned()), "{name} depends on {host}");
        }
    }
    for (name, waits) in CPU.iter().flat_map(|name| [(name, "wgpu"), (name, "pollster")]) {
        assert!(!dependencies(name).contains(&waits.to_owned()), "{name} depends on {waits}");
    }
    for name in ["base", "rules", "scene", "builtin", "sampling", "core", "gpu", "report", "study", "host"] {
        let found = dependencies(name);
        assert!(!found.iter().any(|found| found.starts_with("burn")), "{name} depends on burn");
    }
}

/// Every Rust file below a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn the_core_and_what_it_stands_on_wait_for_nothing() {
    let mut files = Vec::new();
    CPU.iter().for_each(|name| sources(&member(name), &mut files));
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        for wait in ["thread::sleep", "thread::park", "Condvar", ".recv()", "block_on"] {
            assert!(!text.contains(wait), "{} waits by {wait}", path.display());
        }
    }
}

/// Whether a line of code holds the name of an option, as `--resume`.
fn names_an_option(line: &str) -> bool {
    let code = line.trim_start();
    // Comments are for those who read the code.
    !code.starts_with("//")
        && code.split("--").skip(1).any(|after| after.starts_with(|first: char| first.is_ascii_lowercase()))
}

#[test]
fn the_library_does_not_speak_of_options() {
    let mut files = Vec::new();
    LIBRARY.iter().for_each(|name| sources(&member(name), &mut files));
    // An export tells its reader which command writes what it reads.
    files.retain(|path| !path.starts_with(member("core/export")));
    assert!(files.len() > 500, "{} files", files.len());
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let found = text.lines().enumerate().find(|(_, line)| names_an_option(line));
        assert!(found.is_none(), "{}: {found:?}", path.display());
    }
    assert!(names_an_option("    #[error(\"go on with --resume.\")]"));
}
