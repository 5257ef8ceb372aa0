//! What the documents say of the program, where it can be checked.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use skinfit::model::choices::Choices;
use skinfit::model::effects::Effect;
use skinfit::model::readings::Form;
use skinfit::shader::rule::LIBRARY;
use skinfit::shader::term::register;
use skinfit::shader::{Facts, Resource};

use crate::every_effect::every_effect;

#[path = "../../experiments/figures/pages.rs"]
mod pages;
#[path = "../../experiments/figures/strays.rs"]
mod strays;

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
    assert!(page.starts_with("# Parameters\n"), "the page says nothing before its table");
    assert!(
        page.ends_with(&table),
        "docs/parameters.md has drifted from the table in src/rules/model/params.rs"
    );
}

#[test]
fn every_effect_stands_in_the_pages_that_list_them() {
    let [model, scenes] = ["docs/model.md", "docs/scene-files.md"]
        .map(|page| std::fs::read_to_string(root().join(page)).unwrap());
    let switched = |effect: &Effect| effect.info().within.is_none();
    for effect in every_effect().into_iter().filter(switched) {
        let name = effect.name();
        assert!(
            model.contains(&format!("\n| `{name}` | ")),
            "docs/model.md does not say what `{name}` asks for"
        );
        assert!(scenes.contains(&format!("`{name}`")), "docs/scene-files.md does not know `{name}`");
    }
}

#[test]
fn the_rules_that_the_page_of_shaders_shows_are_rules() {
    let page = std::fs::read_to_string(root().join("docs/shaders.md")).unwrap();
    let blocks = page.split("```wgsl\n").skip(1).map(|rest| rest.split_once("```").unwrap().0);
    let [term, pass] = blocks.collect::<Vec<_>>()[..] else { panic!("the page shows other blocks") };
    assert_eq!(term, include_str!("../../experiments/library/fresnel.wgsl"));
    // What stands around the pass in a file. Other tests' terms have other names.
    let pass = pass.replace("soft", "page_soft").replace("light_map", "page_light");
    let text = format!(
        "// effect: page_scatter, light that wanders\n\
         // parameter: page_soft_radius = 1 in [0, 9]; how far; the page\n//\n\
         // gives: page_light\n// domain: texel\n// cost: 1\n\
         fn page_drawn(albedo: vec3f) -> vec3f {{\n    return albedo;\n}}\n\n{pass}\n\
         // gives: page_part\n// adds: page_scatter\n// cost: 1\n\
         fn page_shown(page_soft_light: vec3f) -> vec3f {{\n    return page_soft_light;\n}}\n"
    );
    register("page_scatter", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
}

#[test]
fn the_page_of_shaders_names_every_file_of_functions() {
    let page = std::fs::read_to_string(root().join("docs/shaders.md")).unwrap();
    let row = page.lines().find(|line| line.starts_with("| `uses: FILES`")).unwrap();
    let named: Vec<&str> =
        row.split('`').skip(1).step_by(2).skip(1).filter(|word| *word != "rules/lib").collect();
    assert_eq!(named, LIBRARY.map(|(name, _)| name));
}

/// What stands in code marks in the page of shaders from a line on, up to the next line that is as `end`.
fn marked(from: &str, end: &str) -> BTreeSet<String> {
    let page = std::fs::read_to_string(root().join("docs/shaders.md")).unwrap();
    let lines: Vec<&str> = page
        .lines()
        .skip_while(|line| !line.starts_with(from))
        .take_while(|line| !line.starts_with(end))
        .collect();
    lines.join(" ").split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_page_of_shaders_names_every_condition_and_every_resource() {
    let mut conditions = marked("What `when` knows", "What `reads` knows");
    // Parameters, keys and what stands for a name; each of the others is known.
    for other in ["when", "rim_exponent", "has_NAME_map"] {
        assert!(conditions.remove(other), "{other}");
    }
    let forms = Form::ALL.map(Form::name);
    let known = Facts::CONDITIONS.iter().chain(&Choices::CONDITIONS).chain(&forms);
    assert_eq!(conditions, known.map(|&condition| condition.to_owned()).collect());

    let mut resources = marked("What `reads` knows", "(A sample may hold");
    assert!(resources.remove("reads"));
    assert_eq!(resources, Resource::BUILT_IN.map(|resource| resource.name().to_owned()).into());
}

/// The project's pages, by their paths in it.
fn pages_of_the_project() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = ["data", "docs", "experiments"].map(PathBuf::from).to_vec();
    let top = std::fs::read_dir(root()).unwrap().map(|entry| PathBuf::from(entry.unwrap().file_name()));
    found.extend(top.filter(|name| name.extension().is_some_and(|ending| ending == "md")));
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).unwrap() {
            let path = folder.join(entry.unwrap().file_name());
            if root().join(&path).is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "md") {
                found.push(path);
            }
        }
    }
    found
}

#[test]
fn every_figure_of_a_page_is_that_of_its_raw_file() {
    let mut quoting = 0;
    for page in pages_of_the_project() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
        quoting += usize::from(!pages::quoted(&text).unwrap().is_empty());
        let filled =
            pages::filled(&root().join(&page), &text).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        for (line, (is, should)) in text.lines().zip(filled.lines()).enumerate() {
            // To mend it: cargo run --release --example figures
            assert_eq!(is, should, "{}, line {}", page.display(), line + 1);
        }
        assert_eq!(text.len(), filled.len(), "{}", page.display());
    }
    assert!(quoting > 5, "only {quoting} pages quote raw files");
}

#[test]
fn every_raw_file_says_how_it_came_about() {
    let mut files = Vec::new();
    for page in pages_of_the_project() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
        files.extend(
            pages::quoted(&text).unwrap().into_iter().map(|file| root().join(&page).with_file_name(file)),
        );
    }
    assert!(!files.is_empty());
    for file in files {
        let raw: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        assert_eq!(pages::head_lacks(&raw), None, "{}", file.display());
    }
    let raw =
        serde_json::json!({"head": {"command": "c", "commit": "", "date": "2026-01-01", "machine": {}}});
    assert_eq!(pages::head_lacks(&raw), Some("commit"));
}

#[test]
fn the_table_of_raw_files_has_every_one_that_is_measured() {
    let [page, program] = ["README.md", "main.rs"]
        .map(|name| std::fs::read_to_string(root().join("experiments/figures").join(name)).unwrap());
    let files = program.split_once("const FILES: ").and_then(|(_, rest)| rest.split_once("];"));
    let files: Vec<&str> = files.unwrap().0.split('"').skip(1).step_by(2).collect();
    assert!(files.len() > 20, "{files:?}");
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
    for file in &files {
        let named = rows.iter().any(|row| row.contains(&format!("`{file}`")));
        assert!(named, "experiments/figures/README.md has no row for {file}");
    }
    let ticked = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    for row in &rows {
        let cells: Vec<&str> = row.split('|').collect();
        // Some have a script of their own, as they need what only a Python has.
        let script = ticked(cells[2]).iter().any(|made_by| root().join(made_by).is_file());
        for name in ticked(cells[1]).iter().filter(|name| name.ends_with(".json")) {
            let measured = script || files.contains(&name.as_str());
            assert!(measured, "experiments/figures/README.md: nothing measures {name}");
        }
    }
}

#[test]
fn no_page_has_a_figure_that_no_raw_file_gives() {
    let mut found = Vec::new();
    for page in pages_of_the_project() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
        let strays = strays::strays(&page, &text).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        found.extend(strays.into_iter().map(|words| format!("{}: {words}", page.display())));
    }
    // To mend it: quote the figure from a raw file (experiments/figures/README.md says how); or, if it was never
    // measured, name it in `DEFINITIONS` of experiments/figures/strays.rs, with the reason.
    assert!(found.is_empty(), "{}", found.join("\n"));
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
    for page in pages_of_the_project() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
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
    for page in pages_of_the_project() {
        let text = std::fs::read_to_string(root().join(&page)).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            links += 1;
            assert!(root().join(&page).with_file_name(file).exists(), "{}: {link}", page.display());
        }
    }
    assert!(links > 20, "only {links} links were found");
}
