//! docs/results.md: fits of the built-in scene and of the scanned head, by solvers, losses and variants of the model.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::lab::{Lab, Result};

/// The two scenes of the scanned head.
const SCENES: [&str; 2] = ["forest", "sunrise"];

/// What is fitted besides the scene as it stands: its row's name, and settings of the scene file.
const VARIANTS: [(&str, &[(&str, &str)]); 16] = [
    ("`silhouette = \"vertex\"`", &[("model.silhouette", "\"vertex\"")]),
    ("`silhouette = \"bumped\"`", &[("model.silhouette", "\"bumped\"")]),
    ("`per_channel`: the five weights", &[("fit.per_channel", WEIGHTS)]),
    ("`gains = true`", &[("fit.gains", "true")]),
    ("`environment_rotation` free", &[("fit.free", "+ environment_rotation")]),
    (
        "`key_light` on and free",
        &[("model.effects", "+ key_light"), ("fit.free", "+ key_azimuth key_elevation key_color")],
    ),
    ("`form = \"listing\"`", &[("model.form", "\"listing\""), ("model.silhouette", "\"vertex\"")]),
    ("without `rim`", &[("model.effects", "- rim"), ("fit.free", "- rim_weight")]),
    ("without `rim`, 16 starts", &[("model.effects", "- rim"), ("fit.free", "- rim_weight")]),
    ("without `hilite`", &[("model.effects", "- hilite"), ("fit.free", "- hilite")]),
    ("without `reflection`", &[("model.effects", "- reflection"), ("fit.free", "- reflection")]),
    ("without `side_specular`", &[("model.effects", "- side_specular"), ("fit.free", "- side_specular")]),
    ("without `occlusion`", &[("model.effects", "- occlusion"), ("fit.free", "- occlusion")]),
    ("without `normal_map`", &[("model.effects", "- normal_map"), ("fit.free", "- normal_strength")]),
    ("coarse `[quality]`", COARSE),
    ("fine `[quality]`", FINE),
];

const WEIGHTS: &str = "[\"base_weight\", \"rim_weight\", \"side_specular\", \"hilite\", \"reflection\"]";

const COARSE: &[(&str, &str)] = &[
    ("quality.samples_per_axis", "1"),
    ("quality.irradiance_size", "16"),
    ("quality.lobe_size", "32"),
    ("quality.hilite_size", "32"),
    ("quality.occlusion_rays", "64"),
];

const FINE: &[(&str, &str)] = &[
    ("quality.samples_per_axis", "4"),
    ("quality.irradiance_size", "64"),
    ("quality.lobe_size", "128"),
    ("quality.hilite_size", "128"),
    ("quality.lobes_per_octave", "2"),
    ("quality.occlusion_rays", "1024"),
];

/// All of them, as docs/results.md has them in tables.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let (plain, folder) = lab.fit("built-in scene", None, &[])?;
    let scene = folder.join("scene.toml");
    let mut whole = Vec::new();
    for name in SCENES {
        whole.push((name, lab.fit(name, Some(&file(lab, name)), &[])?.0));
    }
    let scenes: Vec<Value> = whole.iter().map(|(name, report)| fitted(name, report)).collect();
    Ok(json!({
        "built_in": {
            "whole": fitted("built-in", &plain),
            "without_rim_and_hilite": without_rim_and_hilite(lab, &scene)?,
        },
        "scenes": scenes,
        "constants": constants(&whole),
        "solvers": solvers(lab)?,
        "losses": losses(lab)?,
        "variants": variants(lab, &whole)?,
    }))
}

/// A scene file of the scanned head.
fn file(lab: &Lab, scene: &str) -> PathBuf {
    lab.data.join(format!("lps_{scene}/scene.toml"))
}

/// A row's figures of a fit.
fn fitted(name: &str, report: &Value) -> Value {
    let views = report["views"].as_object().cloned().unwrap_or_default();
    let mean = |score: &str| {
        let scores: Vec<f64> = views.values().filter_map(|view| view[score].as_f64()).collect();
        scores.iter().sum::<f64>() / scores.len() as f64
    };
    let mut row = json!({
        "name": name,
        "start": report["loss"]["start"],
        "loss": report["loss"]["end"],
        "passes": report["evaluations"],
        "ending": report["ending"],
        "psnr": mean("psnr"),
        "ssim": mean("ssim"),
        "flip": mean("flip"),
        "views": report["views"],
        "params": report["params"],
    });
    // One name for a view, whatever its file calls it.
    if let Some(views) = row["views"].as_object_mut()
        && let Some(view) = views.remove("threequarter")
    {
        views.insert("three_quarter".to_owned(), view);
    }
    row
}

/// The built-in scene with the rim and the back light switched off.
fn without_rim_and_hilite(lab: &Lab, scene: &std::path::Path) -> Result<Value> {
    let settings = changed(
        scene,
        &[("model.effects", "- rim hilite"), ("fit.free", "- rim_weight rim_exponent hilite")],
    )?;
    let settings: Vec<(&str, &str)> = settings.iter().map(|(key, value)| (*key, value.as_str())).collect();
    let mut text: toml_edit::DocumentMut = std::fs::read_to_string(scene)?.parse()?;
    // Start values that nothing asks for would be refused as free.
    if let Some(params) = text["model"]["params"].as_table_like_mut() {
        params.remove("hilite");
        params.remove("rim_weight");
    }
    let trimmed = lab.scratch.path().join("trimmed.toml");
    std::fs::write(&trimmed, text.to_string())?;
    let scene = lab.scene("without rim and hilite", &trimmed, &settings)?;
    let report = lab.fit("built-in scene without rim and hilite", Some(&scene), &[])?.0;
    Ok(fitted("without rim and hilite", &report))
}

/// Settings with lists of names that grow (`+ names`) or shrink (`- names`) written out.
fn changed<'k>(scene: &std::path::Path, settings: &[(&'k str, &str)]) -> Result<Vec<(&'k str, String)>> {
    let text: toml_edit::DocumentMut = std::fs::read_to_string(scene)?.parse()?;
    let mut written = Vec::new();
    for &(key, value) in settings {
        let (sign, names) = value.split_at_checked(2).unwrap_or((value, ""));
        if !["+ ", "- "].contains(&sign) {
            written.push((key, value.to_owned()));
            continue;
        }
        let (table, list) = key.split_once('.').ok_or("a list stands in a table")?;
        let list =
            text[table][list].as_array().ok_or_else(|| format!("{key} is no list in {}", scene.display()))?;
        let mut list: Vec<&str> = list.iter().filter_map(toml_edit::Value::as_str).collect();
        let names: Vec<&str> = names.split(' ').collect();
        if sign == "+ " {
            list.extend(names);
        } else {
            list.retain(|name| !names.contains(name));
        }
        written.push((key, format!("{list:?}")));
    }
    Ok(written)
}

/// Each constant with its standard error, or where it ended instead, a column a scene.
fn constants(whole: &[(&str, Value)]) -> Vec<Value> {
    let in_words = |param: &Value| {
        let value = param["value"].as_f64().unwrap_or(f64::NAN);
        if param["at_bound"] == true {
            return format!("{value}, at its bound");
        }
        let Some(error) = param["std_error"].as_f64() else { return format!("{value:.4}, undetermined") };
        // The error to one digit, and the value to the same place.
        let decimals = (-error.log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{value:.decimals$} ± {error:.decimals$}")
    };
    let names = whole[0].1["unknowns"].as_array().cloned().unwrap_or_default();
    let names = names.iter().filter_map(|unknown| unknown["name"].as_str());
    names
        .map(|name| {
            let mut row = json!({ "name": name });
            for (scene, report) in whole {
                row[scene] = in_words(&report["params"][name]).into();
            }
            row
        })
        .collect()
}

/// A row for each kind of fit, a column a scene.
fn by_scene(lab: &Lab, rows: &[(&str, Vec<&str>)]) -> Result<Value> {
    let mut table = Vec::new();
    for (name, options) in rows {
        let mut row = json!({ "name": name });
        for scene in SCENES {
            let report = lab.fit(&format!("{scene}, {name}"), Some(&file(lab, scene)), options)?.0;
            row[scene] = fitted(scene, &report);
        }
        table.push(row);
    }
    Ok(table.into())
}

fn solvers(lab: &Lab) -> Result<Value> {
    by_scene(
        lab,
        &[
            ("`varpro`", vec![]),
            ("`varpro`, 16 starts", vec!["--starts", "16", "--seed", "1"]),
            ("`lm`", vec!["--solver", "lm"]),
            ("`lbfgs`", vec!["--solver", "lbfgs"]),
            // It would take thousands of passes to come to rest.
            ("`nelder-mead`, 500 iterations", vec!["--solver", "nelder-mead", "--max-iterations", "500"]),
        ],
    )
}

fn losses(lab: &Lab) -> Result<Value> {
    let names = ["relative_l2", "l2", "huber", "smape"];
    let shown = names.map(|name| format!("`{name}`"));
    let rows: Vec<(&str, Vec<&str>)> =
        shown.iter().zip(names).map(|(shown, name)| (shown.as_str(), vec!["--loss", name])).collect();
    by_scene(lab, &rows)
}

fn variants(lab: &Lab, whole: &[(&str, Value)]) -> Result<Value> {
    let mut first = json!({ "name": "as above" });
    for (scene, report) in whole {
        first[scene] = fitted(scene, report);
    }
    let mut rows = vec![first];
    for (name, settings) in VARIANTS {
        let mut row = json!({ "name": name });
        for scene in SCENES {
            let what = format!("{scene}, {name}");
            let settings = changed(&file(lab, scene), settings)?;
            let settings: Vec<(&str, &str)> =
                settings.iter().map(|(key, value)| (*key, value.as_str())).collect();
            let variant = lab.scene(&what, &file(lab, scene), &settings)?;
            let starts: &[&str] =
                if name.ends_with("16 starts") { &["--starts", "16", "--seed", "1"] } else { &[] };
            row[scene] = fitted(scene, &lab.fit(&what, Some(&variant), starts)?.0);
        }
        rows.push(row);
    }
    Ok(rows.into())
}
