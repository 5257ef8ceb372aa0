//! docs/light.json: the scanned head under lamps and skies that it casts shadows in, fitted with each choice of its light.

use serde_json::{Value, json};

use crate::lab::{Choice, Lab, Result};

/// The scenes. The studio has lamps of its own and no scattering below the skin.
const SCENES: [&str; 3] = ["forest", "sunrise", "studio_dry"];

/// The file of each that asks for lights.
const FILE: &str = "light.toml";

/// What is fitted: its row's name, and settings of the scene file.
const CHOICES: [Choice; 7] = [
    ("as the scene has it", &[]),
    ("`skin_reflection = \"none\"`", &[("model.skin_reflection", "\"none\"")]),
    ("`bounces = \"none\"`", &[("model.bounces", "\"none\"")]),
    ("`visibility = \"scalar\"`", &[("model.visibility", "\"scalar\"")]),
    ("`specular_visibility = \"lagarde\"`", &[("model.specular_visibility", "\"lagarde\"")]),
    ("16 lights, `visibility = \"sh6\"`", &[("environment.lights", "16"), ("model.visibility", "\"sh6\"")]),
    ("16 lights, both by rays", RAYS),
];

const RAYS: &[(&str, &str)] = &[
    ("environment.lights", "16"),
    ("model.visibility", "\"rays\""),
    ("model.specular_visibility", "\"rays\""),
];

/// All of them, as docs/results.md has them in a table.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let choices = lab.choices(&CHOICES, &SCENES, FILE, fitted)?;
    Ok(json!({ "choices": choices, "held_out": held_out(lab)? }))
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
