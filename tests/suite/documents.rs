//! What the documents say of the program, where it can be checked.

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_page_of_parameters_holds_the_programs_table() {
    let run = Command::new(env!("CARGO_BIN_EXE_skinfit")).args(["params", "--format", "markdown"]).output();
    let table = String::from_utf8(run.unwrap().stdout).unwrap();
    assert!(table.lines().count() > 10, "{table}");
    let page = std::fs::read_to_string(root().join("docs/parameters.md")).unwrap();
    // To mend it: replace the page's table by what `skinfit params --format markdown` prints.
    assert!(page.ends_with(&table), "docs/parameters.md has drifted from the table in src/model/params.rs");
}

/// The project's pages.
fn pages() -> Vec<PathBuf> {
    let mut pages = Vec::new();
    for folder in [
        "",
        "data",
        "docs",
        "experiments",
        "experiments/ablation",
        "experiments/accuracy_vs_time",
        "experiments/bench",
        "experiments/network",
        "experiments/race",
        "experiments/scaling",
        "experiments/stability",
    ] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "md") {
                pages.push(path);
            }
        }
    }
    pages
}

#[test]
fn the_exit_codes_are_those_of_the_help_pages() {
    let page = std::fs::read_to_string(root().join("docs/scene-files.md")).unwrap();
    for arguments in [&["--help"][..], &["fit", "--help"]] {
        // Wide enough for a code a line.
        let run = Command::new(env!("CARGO_BIN_EXE_skinfit")).args(arguments).env("COLUMNS", "200").output();
        let help = String::from_utf8(run.unwrap().stdout).unwrap();
        let codes = help.lines().skip_while(|line| *line != "Exit codes:").skip(1);
        let codes: Vec<_> = codes.map_while(|line| line.trim().split_once("  ")).collect();
        assert_eq!(codes.len(), 3, "{help}");
        for (code, words) in codes {
            assert!(page.contains(&format!("\n| {code} | {words}")), "docs/scene-files.md: {code}: {words}");
        }
    }
}

#[test]
fn no_page_holds_a_placeholder() {
    // Names of a number or a date that is still to be filled in.
    let left_over = ["TODO", "FIXME", "XXX", "TBD", "???", "TIME", "DATE", "RESULT", "NUMBER", "VALUE"];
    let mut words = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        // Code and commands have their own capitals: variables, places of files.
        let prose: String = text.split("```").step_by(2).collect();
        let prose: Vec<&str> = prose.split('`').step_by(2).collect();
        for line in prose.iter().flat_map(|part| part.lines()).filter(|line| !line.starts_with("    ")) {
            words += line.split_whitespace().count();
            for word in line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_' && c != '?') {
                let capitals = !word.chars().any(|c| c.is_ascii_lowercase());
                let left = capitals && left_over.iter().any(|placeholder| word.contains(placeholder));
                assert!(!left, "{}: {word}: {line}", page.display());
            }
        }
    }
    assert!(words > 1000, "only {words} words were found");
}

#[test]
fn every_relative_link_of_a_page_leads_to_a_file() {
    let mut links = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            links += 1;
            assert!(page.with_file_name(file).exists(), "{}: {link}", page.display());
        }
    }
    assert!(links > 20, "only {links} links were found");
}
