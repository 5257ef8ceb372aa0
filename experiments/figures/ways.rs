//! experiments/accuracy_vs_time: the ways to light and to scattering that a scene may choose among, error against time.

use serde_json::{Map, Value, json};

use crate::lab::{Lab, Result};
use crate::studies::{number, study_of};

/// Scenes of the scanned head; the studio takes no lights out of its panorama.
const LIT: [&str; 2] = ["forest", "sunrise"];
const SCATTERING: [&str; 3] = ["forest", "sunrise", "studio"];

const LIGHT: [&str; 12] = [
    "sky_lights",
    "visibility",
    "specular_visibility",
    "specular_model",
    "split_sum",
    "lobe_lookup",
    "skin_reflection",
    "bounces",
    "rays",
    "texture_filter",
    "normal_filter",
    "shadows",
];
const DIFFUSION: [&str; 8] =
    ["taps", "light_map_size", "seams", "ambient_normal", "stretch", "unblurred", "combined", "levels"];

/// Plots of the forest that the page shows.
const PLOTS: [&str; 5] = ["shadows", "sky_lights", "visibility", "specular_visibility", "rays"];

/// experiments/accuracy_vs_time/light.json, and plots beside it.
pub(crate) fn light(lab: &Lab) -> Result<Value> {
    let raw = swept(lab, "light.toml", &LIT, &LIGHT)?;
    for plot in PLOTS {
        let from = lab.scratch.path().join(format!("tradeoff_forest/{plot}.svg"));
        std::fs::copy(from, lab.root.join(format!("experiments/accuracy_vs_time/light_{plot}.svg")))?;
    }
    Ok(raw)
}

/// experiments/accuracy_vs_time/diffusion.json.
pub(crate) fn diffusion(lab: &Lab) -> Result<Value> {
    swept(lab, "full.toml", &SCATTERING, &DIFFUSION)
}

/// experiments/accuracy_vs_time/transmission.json.
pub(crate) fn transmission(lab: &Lab) -> Result<Value> {
    swept(lab, "full.toml", &SCATTERING, &["transmission"])
}

/// A table an axis: of each setting its errors and its time in each scene, at the constants of the scene's fit.
fn swept(lab: &Lab, file: &str, scenes: &[&str], axes: &[&str]) -> Result<Value> {
    let mut raw = json!({});
    for &scene in scenes {
        let path = lab.head_scene(scene, file);
        let (_, run) = lab.fit(&format!("fit {scene}"), Some(&path), &[])?;
        let params = run.join("params.toml").display().to_string();
        let mut options = vec!["--params", &params];
        options.extend(axes.iter().flat_map(|axis| ["--axis", axis]));
        for row in study_of(lab, "tradeoff", scene, Some(&path), &options)? {
            let axis = row["axis"].as_str().unwrap_or_default();
            let found = json!({
                "percent": 100.0 * number(&row["relative_rms"]),
                "flip": row["flip"],
                "ms": (row["unit"] == "seconds").then(|| 1e3 * number(&row["cost"])),
                "front": row["pareto"],
            });
            put(&mut raw[axis], &row, scene, found);
        }
    }
    Ok(raw)
}

/// Add a scene's cell to the row of a setting, which the scene may be the first to have.
fn put(table: &mut Value, row: &Value, scene: &str, found: Value) {
    if !table.is_array() {
        *table = json!([]);
    }
    let setting = &row["setting"];
    let name = setting.as_str().map_or_else(|| number(setting).to_string(), str::to_owned);
    let Some(rows) = table.as_array_mut() else { return };
    match rows.iter_mut().find(|row| row["name"] == name) {
        Some(row) => row[scene] = found,
        None => {
            let cells = [("name".to_owned(), Value::from(name)), (scene.to_owned(), found)];
            rows.push(cells.into_iter().collect::<Map<_, _>>().into());
        }
    }
}
