//! Help pages, the parameter table, and words that are not understood.

use skinfit::model::params::{ParamInfo, TABLE};
use skinfit::shader::term::library;

use super::sandbox::Sandbox;

#[test]
fn every_help_page_holds_an_example_that_is_understood() {
    let sandbox = Sandbox::new();
    for command in [
        "",
        "inspect",
        "import",
        "panorama",
        "panorama merge",
        "panorama stitch",
        "fit",
        "ablate",
        "tradeoff",
        "suggest",
        "render",
        "bake",
        "demo",
        "params",
        "shader",
        "export",
        "info",
        "stability",
        "sweep",
        "collect",
    ] {
        let arguments: Vec<&str> =
            command.split(' ').chain(["--help"]).filter(|word| !word.is_empty()).collect();
        let help = sandbox.run(&arguments).done().out;
        let examples: Vec<&str> = help.lines().filter(|line| line.starts_with("  skinfit ")).collect();
        assert!(!examples.is_empty(), "{command}: no example\n{help}");
        for example in &examples {
            assert!(example.starts_with(&format!("  skinfit {command}")), "{example}");
        }
        // Each option that an example uses is described on the same page.
        for option in examples.iter().flat_map(|line| line.split(' ')).filter(|word| word.starts_with("--")) {
            assert!(help.matches(option).count() > 1 || command.is_empty(), "{command}: {option}\n{help}");
        }
        assert!(
            help.lines().all(|line| line.chars().count() <= 100),
            "{command}: a line is too long\n{help}"
        );
    }
    let version = sandbox.run(&["--version"]).done().out;
    assert_eq!(version, format!("skinfit {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn what_exit_code_1_means_is_said_of_each_command_that_has_its_own() {
    let sandbox = Sandbox::new();
    for (command, words) in [
        ("fit", "the fit failed"),
        ("ablate", "a fit did not converge"),
        ("tradeoff", "no settings meet --within or --budget"),
        ("bake", "the command was interrupted"),
        ("stability", "a case failed on an evaluator"),
        ("sweep", "a job failed"),
        ("collect", "a job is missing or failed"),
    ] {
        let help = sandbox.run(&[command, "--help"]).done().out;
        assert!(help.contains(&format!("\n  1  {words}")), "{command}: {help}");
    }
}

/// A Markdown cell's text.
fn plain(cell: &str) -> String {
    cell.trim_start_matches("| ").trim_end_matches(" |").replace("\\|", "|")
}

/// What every format tells of a parameter.
fn told(row: &ParamInfo) -> Vec<String> {
    [row.name, row.unit, row.source, row.meaning].iter().map(|&word| word.to_owned()).collect()
}

#[test]
fn the_parameter_table_is_whole_in_every_format() {
    let sandbox = Sandbox::new();
    let print = |format: &str| sandbox.run(&["params", "--format", format]).done().out;
    assert_eq!(sandbox.run(&["params"]).done().out, print("text"));
    let (text, markdown) = (print("text"), print("markdown"));
    let library = library::terms().iter().flat_map(|term| &term.params).map(|param| param.info());
    let table: Vec<&ParamInfo> = TABLE.iter().chain(library).collect();
    assert!(table.iter().any(|row| row.name == "roughness"));
    // Behind them those of a light of each kind.
    let of_lights = |line: &&str| line.starts_with("light.beam.") || line.starts_with("light.lamp.");
    let lights = text.lines().filter(of_lights).count();
    assert!(lights > 6, "{text}");
    assert_eq!(text.lines().count(), 1 + table.len() + lights);
    assert_eq!(markdown.lines().count(), 2 + table.len() + lights);
    for (i, row) in table.iter().enumerate() {
        let line = text.lines().nth(1 + i).unwrap();
        assert!(line.starts_with(row.name), "{line}");
        assert!(told(row).iter().all(|word| line.contains(word.as_str())), "{line}");
        let cells: Vec<&str> = markdown.lines().nth(2 + i).unwrap().split(" | ").collect();
        assert_eq!(cells.len(), 8, "{cells:?}");
        assert!(told(row).iter().all(|word| cells.iter().any(|cell| plain(cell) == *word)), "{cells:?}");
    }
    let json: serde_json::Value = serde_json::from_str(&print("json")).unwrap();
    let rows = json.as_array().unwrap();
    assert_eq!(rows.len(), table.len() + lights);
    for (json, row) in rows.iter().zip(&table) {
        assert_eq!((json["name"].as_str(), json["unit"].as_str()), (Some(row.name), Some(row.unit)));
        for (form, default) in [("corrected", row.corrected), ("listing", row.listing)] {
            let want = row.channels.map_or_else(|| serde_json::json!(default), |rgb| serde_json::json!(rgb));
            assert_eq!(json["default"][form], want, "{}", row.name);
        }
        for (json, bound) in json["bounds"].as_array().unwrap().iter().zip([row.lower, row.upper]) {
            assert_eq!(json.as_f64(), Some(bound).filter(|bound| bound.is_finite()), "{}", row.name);
        }
    }
}

#[test]
fn words_that_the_command_line_does_not_know() {
    let sandbox = Sandbox::new();
    let before = sandbox.files();
    let rows: &[(&[&str], &str)] = &[
        (&[], "Usage: skinfit"),
        (&["fitt"], "similar subcommand exists: 'fit'"),
        (&["fit", "--sover", "lm"], "'--solver'"),
        (&["fit", "scene.toml", "--solver", "newton"], "possible values: varpro, lm, lbfgs, nelder-mead"),
        (&["fit", "scene.toml", "--loss", "l3"], "possible values: l2, relative_l2, huber, smape"),
        (&["fit", "scene.toml", "--starts", "0"], "0 is not in 1..=10000"),
        (&["fit", "scene.toml", "--max-iterations", "0"], "0 is not in 1.."),
        (&["fit", "scene.toml", "--threads", "0"], "0 is not in 1..=1024"),
        (&["fit", "scene.toml", "--cache", "c", "--no-cache"], "cannot be used with"),
        (&["render", "scene.toml"], "--output <FILE>"),
        (
            &["render", "scene.toml", "-o", "a.png", "--effects", "difuse"],
            "unknown effect `difuse`. Did you mean `diffuse`?",
        ),
        (&["render", "scene.toml", "-o", "a.png", "--effects", ","], "names no effect"),
        (&["render", "scene.toml", "-o", "a.png", "--effects", "rim,rim"], "rim is listed twice"),
        (&["render", "scene.toml", "-o", "a.png", "--exposure", "nan"], "give stops in [-64, 64]"),
        (
            &["render", "scene.toml", "-o", "a.png", "--tone", "filmic"],
            "possible values: clip, reinhard, aces",
        ),
        (&["bake", "scene.toml"], "--output <DIR>"),
        (
            &["bake", "scene.toml", "-o", "baked", "--effects", "hilit"],
            "unknown effect `hilit`. Did you mean `hilite`?",
        ),
        (&["demo"], "<FOLDER>"),
        (&["params", "--format", "xml"], "possible values: text, markdown, json"),
    ];
    for (arguments, words) in rows {
        let ran = sandbox.run(arguments);
        assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""), "{arguments:?}: {ran:?}");
        assert!(ran.err.contains(words), "{arguments:?}: {words:?} is not said: {}", ran.err);
    }
    assert!(sandbox.files() == before, "files were left");
}
