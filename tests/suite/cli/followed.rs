//! Pages that lead through the program, followed word by word: what a block marked `sh` says is run in the page's order, what
//! a block marked `toml NAME` holds is written to that file.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::Command;

use super::sandbox::Ran;
use crate::graphics::bench::cache;

/// A block of a page: the words behind its fence, and its lines.
fn blocks(page: &str) -> Vec<(String, String)> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(kind) = line.strip_prefix("```") else { continue };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        blocks.push((kind.to_owned(), block.join("\n") + "\n"));
    }
    blocks
}

/// Follow a page in a new folder; returns the folder and what was said on the way.
fn follow(page: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    let mut said = String::new();
    for (kind, block) in blocks(&text) {
        if kind == "sh" {
            let ran = shell(folder.path(), &block);
            assert_eq!(ran.code, Some(0), "{page}: {block}{}", ran.err);
            said += &ran.out;
            said += &ran.err;
        } else if let Some(name) = kind.strip_prefix("toml ") {
            std::fs::write(folder.path().join(name), block).unwrap();
        }
    }
    (folder, said)
}

/// Lines of a shell, which finds the program by its name.
fn shell(folder: &Path, lines: &str) -> Ran {
    let program = Path::new(env!("CARGO_BIN_EXE_skinfit")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("sh");
    command.args(["-e", "-c", lines]).current_dir(folder).env("PATH", path);
    Ran::of(command.env("SKINFIT_CACHE", cache()))
}

#[test]
fn the_first_own_head() {
    let (folder, said) = follow("docs/first-head.md");
    let path = |name: &str| folder.path().join(name);
    assert!(said.contains("high (y)") && said.contains("wrote own/scene.toml"), "{said}");
    assert!(!said.contains("warning"), "{said}");
    for made in ["own/front.png", "own/profile.png", "own/run/report.html", "own/skin.glsl"] {
        assert!(path(made).is_file(), "{made}");
    }
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(path("own/run/report.json")).unwrap()).unwrap();
    // The model made these targets, with other constants held: a close match is all that is left of them.
    for view in ["front", "profile"] {
        assert!(report["views"][view]["psnr"].as_f64().unwrap() > 30.0, "{report}");
    }
    // The mistake that the page speaks of is told in the words that it shows.
    let scene = std::fs::read_to_string(path("own/scene.toml")).unwrap();
    std::fs::write(path("own/scene.toml"), scene.replacen("fov_y_degrees = 25.0", "fov_y_degrees = 26.5", 1))
        .unwrap();
    let told = shell(folder.path(), "skinfit fit own/scene.toml -o own/wrong").err;
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/first-head.md")).unwrap();
    let (_, shown) = blocks(&page).into_iter().find(|(kind, _)| kind == "text").unwrap();
    assert!(told.contains(shown.trim_end()), "{told}");
    assert!(told.contains("with fov_y_degrees = 25.0"), "{told}");
    import_as_told(folder.path(), &page);
}

/// The program's line on a page that begins so, within single accents.
fn line_of<'a>(page: &'a str, begins: &str) -> &'a str {
    let at = page.find(&format!("`{begins}")).unwrap();
    page[at + 1..].split('`').next().unwrap()
}

/// As `import` is told on the page: the scene file that earlier lines wrote is there.
fn import_as_told(folder: &Path, page: &str) {
    for kept in ["sparse/0", "images"] {
        std::fs::create_dir_all(folder.join(kept)).unwrap();
    }
    std::fs::write(folder.join("sparse/0/cameras.txt"), "1 SIMPLE_PINHOLE 320 320 721.7 160 160\n").unwrap();
    std::fs::write(folder.join("sparse/0/images.txt"), "1 0 1 0 0 0 0 0.75 1 front.exr\n\n").unwrap();
    std::fs::copy(folder.join("own/targets/front.exr"), folder.join("images/front.exr")).unwrap();
    let line = line_of(page, "skinfit import colmap");
    let ran = shell(folder, line);
    assert_eq!(ran.code, Some(0), "{line}: {}", ran.err);
    let written = line.split_once(" -o ").unwrap().1;
    assert!(ran.out.contains(&format!("wrote {written}: 1 view")), "{}", ran.out);
    // What the other solvers' lines write is not what the page has written so far.
    for line in
        ["metashape", "transforms", "opencv"].map(|kind| line_of(page, &format!("skinfit import {kind}")))
    {
        assert!(line.ends_with(&format!(" -o {written}")), "{line}");
    }
}

#[test]
fn the_report_has_what_its_page_speaks_of() {
    let sandbox = super::sandbox::Sandbox::new();
    // With what only some scenes have.
    sandbox.edit("[quality]", "[diffusion]\nlight_map_size = 64\n[quality]");
    sandbox.edit("\"reflection\"]", "\"reflection\", \"diffusion\"]");
    sandbox.fit("run", &["--free", "base_weight"]);
    let report = sandbox.text("run/report.html");
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/report.md")).unwrap();
    let named: Vec<&str> = page.split("\"**").skip(1).filter_map(|rest| rest.split("**\"").next()).collect();
    assert!(named.len() >= 5, "{named:?}");
    for heading in named {
        let heading = heading.replace('\n', " ");
        assert!(report.contains(&format!("<h2>{heading}</h2>")), "{heading} is no heading of the report");
    }
    assert!(report.contains("of the targets' variance") || report.contains("of the targets&#39; variance"));
}

#[test]
fn into_engines() {
    let (folder, said) = follow("docs/engines.md");
    assert!(!said.contains("warning"), "{said}");
    for made in [
        "baked/irradiance.exr",
        "baked/specular.exr",
        "baked/hilite.exr",
        "baked/irradiance.ktx2",
        "baked/specular.ktx2",
        "baked/hilite.dds",
        "baked/vertices.glb",
        "baked/occlusion.csv",
        "baked/Skin.mat",
        "baked/Skin.mat.meta",
        "baked/Skin.shader",
        "baked/Skin.hlsl",
        "baked/Skin_color.png",
        "baked/Skin_color.png.meta",
        "baked/irradiance.dds.meta",
        "Skin.hlsl",
        "Skin.shader",
        "skin.gdshaderinc",
        "skin.tres",
        "Skin.ush",
        "Skin.txt",
        "skin.glsl",
        "skin.h",
        "skin.wgsl",
    ] {
        assert!(folder.path().join(made).is_file(), "{made}");
    }
    // The names that the page has are those of the files.
    for text in ["Skin.hlsl", "skin.gdshaderinc", "Skin.ush"] {
        let text = std::fs::read_to_string(folder.path().join(text)).unwrap();
        assert!(
            text.contains("struct SkinfitSurface") && text.contains("skinfit_shade(SkinfitSurface at"),
            "{text}"
        );
    }
    // What is pasted into Unreal takes the files of the page's cubes.
    let nodes = std::fs::read_to_string(folder.path().join("Skin.txt")).unwrap();
    for cube in ["irradiance", "specular", "hilite"] {
        assert!(nodes.contains(&format!("'/Game/{cube}.{cube}'")), "{nodes}");
    }
}
