//! docs/light.json: the scanned head under lamps and skies that it casts shadows in, fitted with each choice of its light.

use std::time::Instant;

use serde_json::{Value, json};

use crate::lab::{Choice, Lab, Result};
use crate::studies::number;

/// The scenes. The studio has lamps of its own and no scattering below the skin.
const SCENES: [&str; 3] = ["forest", "sunrise", "studio_dry"];

/// The file of each that asks for lights.
const FILE: &str = "light.toml";

/// What is fitted: its row's name, and settings of the scene file.
const CHOICES: [Choice; 9] = [
    ("as the scene has it", &[]),
    ("`skin_reflection = \"none\"`", &[("model.skin_reflection", "\"none\"")]),
    ("`bounces = \"none\"`", &[("model.bounces", "\"none\"")]),
    ("`visibility = \"scalar\"`", &[("model.visibility", "\"scalar\"")]),
    ("`specular_visibility = \"lagarde\"`", &[("model.specular_visibility", "\"lagarde\"")]),
    ("16 lights, `visibility = \"sh6\"`", &[("environment.lights", "16"), ("model.visibility", "\"sh6\"")]),
    ("16 lights, both by rays", RAYS),
    ("`texture_filter = \"trilinear\"`", &[("quality", "{ texture_filter = \"trilinear\" }")]),
    ("`texture_filter = \"anisotropic\"`", &[("quality", "{ texture_filter = \"anisotropic\" }")]),
];

const RAYS: &[(&str, &str)] = &[
    ("environment.lights", "16"),
    ("model.visibility", "\"rays\""),
    ("model.specular_visibility", "\"rays\""),
];

/// All of them, as docs/results.md has them in a table.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let choices = lab.choices(&CHOICES, &SCENES, FILE, fitted)?;
    Ok(json!({ "choices": choices, "held_out": held_out(lab)?, "passes": passes(lab)?, "runs": runs(lab)? }))
}

/// What a pass takes with the paper's effects and with those of light, of the same pixels and samples.
fn passes(lab: &Lab) -> Result<Vec<Value>> {
    let files = [("the paper's effects", "scene.toml"), ("light, shadows, Fresnel and the sky", FILE)];
    let mut rows = Vec::new();
    for (name, file) in files {
        // Many passes, all of them over all pixels.
        let options = ["--solver", "lm", "--starts", "8", "--seed", "1"];
        let (report, _) =
            lab.fit(&format!("passes of {file}"), Some(&lab.head_scene("forest", file)), &options)?;
        let evaluations = number(&report["evaluations"]);
        rows.push(json!({
            "name": name,
            "passes": evaluations,
            "milliseconds": 1e3 * number(&report["seconds"]["fit"]) / evaluations,
        }));
    }
    Ok(rows)
}

/// Whole runs of the forest, as the command line has them: with nothing baked, and the best of five with all baked.
fn runs(lab: &Lab) -> Result<Vec<Value>> {
    let cache = lab.scratch.path().join("cache").display().to_string();
    let scene = lab.head_scene("forest", FILE);
    let run = |what: &str| -> Result<Value> {
        let start = Instant::now();
        let (report, _) = lab.fit(what, Some(&scene), &["--cache", &cache])?;
        let mut seconds = report["seconds"].clone();
        seconds["whole"] = start.elapsed().as_secs_f64().into();
        seconds["name"] = what.into();
        Ok(seconds)
    };
    let cold = run("nothing baked")?;
    let mut warm = (0..5).map(|_| run("all baked")).collect::<Result<Vec<Value>>>()?;
    warm.sort_by(|a, b| number(&a["whole"]).total_cmp(&number(&b["whole"])));
    warm.truncate(1);
    Ok([vec![cold], warm].concat())
}

/// A row's figures of a fit of one scene.
fn fitted(report: &Value) -> Value {
    let psnr = |view: &str| report["views"][view]["psnr"].clone();
    json!({
        "front": psnr("front"),
        "three_quarter": psnr("threequarter"),
        "profile": psnr("profile"),
        "loss": report["loss"]["end"],
        "params": report["params"],
    })
}

/// One skin for all scenes, each scored by a fit of the others.
fn held_out(lab: &Lab) -> Result<Value> {
    let files: Vec<String> =
        SCENES.iter().map(|scene| lab.head_scene(scene, FILE).display().to_string()).collect();
    let mut rows = Vec::new();
    for scene in SCENES {
        let run = lab.scratch.path().join(format!("held_{scene}")).display().to_string();
        let name = format!("lps_{scene}.light");
        let mut arguments: Vec<&str> = vec!["fit", "--engine", "cpu", "--json", "-o", &run];
        arguments.extend(files.iter().map(String::as_str));
        arguments.extend(["--hold-out", &name]);
        let text = lab.skinfit(&format!("one skin without {scene}"), &arguments, true)?;
        let report: Value = serde_json::from_str(&text)?;
        rows.push(json!({ "name": scene, "scores": report["scores"] }));
    }
    Ok(Value::Array(rows))
}
