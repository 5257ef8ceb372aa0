//! docs/light.json: the scanned head under lamps and skies that it casts shadows in, fitted with each choice of its light.

use serde_json::{Value, json};

use crate::lab::{Choice, Lab, Result};
use crate::squares::{Place, drawn, side_by_side, traced};
use crate::studies::number;

/// The scenes. The studio has lamps of its own and no scattering below the skin.
const SCENES: [&str; 3] = ["forest", "sunrise", "studio_dry"];

/// The file of each that asks for lights.
const FILE: &str = "light.toml";

const AS_IT_IS: &str = "as the scene has it";

/// What is fitted: its row's name, and settings of the scene file.
const CHOICES: [Choice; 15] = [
    (AS_IT_IS, &[]),
    ("`skin_reflection = \"none\"`", &[("model.skin_reflection", "\"none\"")]),
    ("`bounces = \"none\"`", &[("model.bounces", "\"none\"")]),
    ("`visibility = \"scalar\"`", &[("model.visibility", "\"scalar\"")]),
    ("`specular_visibility = \"lagarde\"`", &[("model.specular_visibility", "\"lagarde\"")]),
    ("`lobe_lookup = \"off_peak\"`", &[("model.lobe_lookup", "\"off_peak\"")]),
    ("`split_sum = \"exact\"`", &[("model.split_sum", "\"exact\"")]),
    ("`specular_model = \"kelemen\"`", &[("model.specular_model", "\"kelemen\"")]),
    ("`specular_map = \"weight\"`", &[("model.specular_map", "\"weight\"")]),
    ("16 lights, `visibility = \"sh6\"`", &[("environment.lights", "16"), ("model.visibility", "\"sh6\"")]),
    ("16 lights, both by rays", RAYS),
    ("`texture_filter = \"trilinear\"`", &[TRILINEAR]),
    ("`texture_filter = \"anisotropic\"`", &[ANISOTROPIC]),
    ("16 lights, both by rays, `trilinear`", &[RAYS[0], RAYS[1], RAYS[2], TRILINEAR]),
    ("16 lights, both by rays, `anisotropic`", &[RAYS[0], RAYS[1], RAYS[2], ANISOTROPIC]),
];

/// Reference choices.
pub(crate) const RAYS: &[(&str, &str)] = &[
    ("environment.lights", "16"),
    ("model.visibility", "\"rays\""),
    ("model.specular_visibility", "\"rays\""),
];
const TRILINEAR: (&str, &str) = ("quality", "{ texture_filter = \"trilinear\" }");
const ANISOTROPIC: (&str, &str) = ("quality", "{ texture_filter = \"anisotropic\" }");

/// What the pictures show of the sunrise: the nose, an ear, a temple.
const SHOWN: [Place; 3] = [("front", [147, 155, 90]), ("front", [225, 145, 90]), ("front", [200, 65, 90])];

/// The lamps of the studio.
const LAMPS: [&str; 3] = ["key", "warm_spot", "ear_point"];

/// All of them, as docs/results.md has them in a table.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let choices = lab.choices(&CHOICES, &SCENES, FILE, fitted)?;
    let (held_out, held_out_mean) = held_out(lab)?;
    pictures(lab)?;
    let mean = |choice: &str| mean(&choices, choice);
    let less = |choice: &str| {
        let front = |choice: &str| {
            of_choice(&choices, choice).map_or(f64::NAN, |row| number(&row["sunrise"]["front"]))
        };
        front(AS_IT_IS) - front(choice)
    };
    let gain = |with: &str, without: &str| mean(with) - mean(without);
    Ok(json!({
        "filters": {
            "cheap": gain("`texture_filter = \"trilinear\"`", AS_IT_IS),
            "rays": gain("16 lights, both by rays, `trilinear`", "16 lights, both by rays"),
        },
        "specular_map_cost": less("`specular_map = \"weight\"`"),
        "kelemen_cost": less("`specular_model = \"kelemen\"`"),
        "choices": choices, "held_out": held_out, "held_out_mean": held_out_mean, "lamps": lamps(lab)?,
    }))
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

/// A choice's row.
fn of_choice<'a>(choices: &'a [Value], name: &str) -> Option<&'a Value> {
    choices.iter().find(|row| row["name"] == name)
}

/// The mean PSNR of all views of all scenes, with a choice.
fn mean(choices: &[Value], name: &str) -> f64 {
    let Some(row) = of_choice(choices, name) else { return f64::NAN };
    let views =
        SCENES.iter().flat_map(|scene| ["front", "three_quarter", "profile"].map(|view| &row[scene][view]));
    let psnr: Vec<f64> = views.map(number).collect();
    psnr.iter().sum::<f64>() / psnr.len() as f64
}

/// The nose, an ear and a temple in the sunrise: path traced, by the paper's effects, as the scene has it, and by rays.
fn pictures(lab: &Lab) -> Result<()> {
    let scene = |file: &str| lab.head_scene("sunrise", file);
    let by_rays = lab.scene("pictures by rays", &scene(FILE), RAYS)?;
    let mut columns = vec![traced(lab, "sunrise", &SHOWN)?];
    for (name, scene) in [("paper", scene("scene.toml")), ("light", scene(FILE)), ("rays", by_rays)] {
        let (_, run) = lab.fit(&format!("pictures, {name}"), Some(&scene), &[])?;
        columns.push(drawn(lab, &run, &SHOWN)?);
    }
    side_by_side(&columns, &SHOWN, "docs/images/sunrise.png")
}

/// The colours of the studio's lamps as a fit finds them that holds the base weight; the path tracer's are 1.
fn lamps(lab: &Lab) -> Result<Vec<Value>> {
    let colours = LAMPS.map(|lamp| format!("\"light.{lamp}.color\"")).join(", ");
    let free = format!(
        "[{colours}, \"rim_weight\", \"rim_exponent\", \"specular_weight\", \"roughness\", \"gloss\", \"f0\", \
         \"normal_strength\"]"
    );
    let each = format!("[{colours}, \"rim_weight\"]");
    let settings = [("fit.free", free.as_str()), ("fit.per_channel", each.as_str())];
    let scene = lab.scene("lamps", &lab.head_scene("studio_dry", FILE), &settings)?;
    let (report, _) = lab.fit("lamps", Some(&scene), &[])?;
    let row = |lamp: &str| {
        let found = &report["params"][format!("light.{lamp}.color")]["value"];
        json!({ "name": lamp, "red": found[0], "green": found[1], "blue": found[2] })
    };
    Ok(LAMPS.map(row).to_vec())
}

/// One skin for all scenes, each scored by a fit of the others; and the mean over the scenes of what those score that
/// were left out.
fn held_out(lab: &Lab) -> Result<(Vec<Value>, f64)> {
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
    let scores: Vec<f64> = rows.iter().map(|row| number(&row["scores"]["held_out"]["psnr"])).collect();
    Ok((rows, scores.iter().sum::<f64>() / scores.len() as f64))
}
