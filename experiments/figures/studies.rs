//! What `skinfit ablate` and `tradeoff` find of the built-in scene and of the scanned head.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::lab::{Lab, Result, csv};

const SCENES: [&str; 3] = ["forest", "sunrise", "built_in"];

/// The scene file; none for the built-in scene.
fn scene(lab: &Lab, name: &str) -> Option<PathBuf> {
    (name != "built_in").then(|| lab.data.join(format!("lps_{name}/scene.toml")))
}

/// What a study of one of [`SCENES`] writes to `results.csv`.
fn study(lab: &Lab, command: &str, name: &str, options: &[&str]) -> Result<Vec<Value>> {
    study_of(lab, command, name, scene(lab, name).as_deref(), options)
}

/// What a study of a scene file, or of the built-in scene, writes to `results.csv`.
///
/// # Errors
/// When the study is refused.
pub(crate) fn study_of(
    lab: &Lab,
    command: &str,
    name: &str,
    scene: Option<&Path>,
    options: &[&str],
) -> Result<Vec<Value>> {
    let folder = lab.scratch.path().join(format!("{command}_{name}"));
    let (file, output) = (scene.map(|file| file.display().to_string()), folder.display().to_string());
    let mut arguments = vec![command];
    arguments.extend(file.as_deref());
    arguments.extend(["-o", &output]);
    arguments.extend(options);
    lab.skinfit(&format!("{command} {name}"), &arguments, true)?;
    csv(&std::fs::read_to_string(folder.join("results.csv"))?)
}

/// experiments/ablation: parts left out one by one, and two at a time.
pub(crate) fn ablation(lab: &Lab) -> Result<Value> {
    let mut raw = json!({});
    for name in SCENES {
        let pairs: &[&str] = if name == "sunrise" { &["--refit"] } else { &["--refit", "--pairs"] };
        let rows = study(lab, "ablate", name, pairs)?;
        let all: Vec<&Value> = rows.iter().filter(|row| row["view"] == "all").collect();
        let whole = all[0];
        let front = |part: &Value| {
            rows.iter()
                .find(|row| row["left_out"] == *part && row["view"] == "front")
                .map(|row| row["psnr_db"].clone())
        };
        let share = |row: &Value, what: &str| 100.0 * (1.0 - number(&row[what]) / number(&whole[what]));
        let mut cases: Vec<Value> = all[1..]
            .iter()
            .map(|row| {
                json!({
                    "name": row["left_out"],
                    "loss_percent": 100.0 * number(&row["loss_change"]) / number(&whole["loss"]),
                    "t": row["t"],
                    "psnr": row["psnr_db"],
                    "front": front(&row["left_out"]),
                    "flip": row["flip"],
                    "operations_percent": share(row, "operations"),
                    "bytes_percent": share(row, "bytes_a_sample"),
                })
            })
            .collect();
        cases.sort_by(|a, b| number(&b["loss_percent"]).total_cmp(&number(&a["loss_percent"])));
        let (pairs, parts): (Vec<Value>, Vec<Value>) = cases
            .into_iter()
            .partition(|case| case["name"].as_str().is_some_and(|name| name.contains(" + ")));
        raw[name] = json!({
            "psnr": whole["psnr_db"],
            "count_of_pairs": pairs.len(),
            "pairs": telling(&pairs, &parts),
            "parts": parts,
        });
    }
    Ok(raw)
}

/// The pairs that add more than their parts do one by one, the most so first, and those that save most.
fn telling(pairs: &[Value], parts: &[Value]) -> Vec<Value> {
    let alone = |name: &str| {
        parts.iter().find(|part| part["name"] == name).map_or(f64::NAN, |part| number(&part["loss_percent"]))
    };
    let mut pairs: Vec<Value> = pairs
        .iter()
        .map(|pair| {
            let one_by_one: f64 = pair["name"].as_str().unwrap_or_default().split(" + ").map(alone).sum();
            let mut pair = pair.clone();
            pair["one_by_one_percent"] = one_by_one.into();
            pair["ratio"] = (number(&pair["loss_percent"]) / one_by_one).into();
            pair
        })
        .collect();
    // All of the diffuse light, which is left out as an effect already.
    pairs.retain(|pair| pair["name"] != "base_weight + rim");
    // What adds less than a percent has no ratio to speak of.
    let weight =
        |pair: &Value| if number(&pair["loss_percent"]) < 1.0 { 0.0 } else { number(&pair["ratio"]) };
    pairs.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    let mut saving = pairs.split_off(pairs.len().min(4));
    saving.retain(|pair| number(&pair["loss_percent"]) < 10.0);
    saving.sort_by(|a, b| number(&b["operations_percent"]).total_cmp(&number(&a["operations_percent"])));
    saving.truncate(3);
    pairs.extend(saving);
    pairs
}

/// experiments/accuracy_vs_time: each approximation swept, a table an axis.
pub(crate) fn tradeoff(lab: &Lab) -> Result<Value> {
    let mut raw = json!({});
    for name in SCENES {
        let (_, run) = lab.fit(&format!("fit {name}"), scene(lab, name).as_deref(), &[])?;
        let params = run.join("params.toml").display().to_string();
        let settings = study(lab, "tradeoff", name, &["--params", &params])?;
        for plot in ["silhouette.svg", "rays.svg"].into_iter().filter(|_| name == "forest") {
            let from = lab.scratch.path().join("tradeoff_forest").join(plot);
            std::fs::copy(from, lab.root.join("experiments/accuracy_vs_time").join(plot))?;
        }
        for row in &settings {
            let axis = row["axis"].as_str().unwrap_or_default();
            let of_axis: Vec<&Value> = settings.iter().filter(|other| other["axis"] == axis).collect();
            let mut found = json!({
                "percent": 100.0 * number(&row["relative_rms"]),
                "flip": row["flip"],
            });
            // Counts stand in one cell: `passes 9; loss 0.0166`.
            for count in row["counts"].as_str().unwrap_or_default().split("; ") {
                if let Some((what, count)) = count.rsplit_once(' ') {
                    found[what.replace(' ', "_")] = count.parse::<f64>().unwrap_or(f64::NAN).into();
                }
            }
            put(&mut raw[axis], &of_axis, row, name, found);
        }
    }
    Ok(raw)
}

/// A setting's name, be it a number.
fn in_words(setting: &Value) -> String {
    setting
        .as_str()
        .map_or_else(|| setting.as_f64().map_or_else(String::new, |n| n.to_string()), str::to_owned)
}

/// The edges of the meshes that silhouettes are swept over, beside those of the scene's own mesh.
const EDGES: [&str; 5] =
    ["4 times as long", "twice as long", "the mesh's own", "half as long", "a quarter as long"];

/// Add a scene's column to the row of a setting. The meshes of a head differ in their edges: those rows stand by how
/// much coarser than the scene's own they are.
fn put(table: &mut Value, of_axis: &[&Value], row: &Value, scene: &str, found: Value) {
    let setting = in_words(&row["setting"]);
    let settings = of_axis.iter().map(|row| in_words(&row["setting"]));
    let meshes: Vec<String> = settings.filter(|setting| setting.starts_with("vertex")).collect();
    let name = meshes.iter().position(|mesh| *mesh == setting).and_then(|mesh| EDGES.get(mesh).copied());
    let name = name.unwrap_or(&setting);
    if !table.is_array() {
        *table = json!([]);
    }
    let Some(rows) = table.as_array_mut() else { return };
    let at = rows.iter().position(|row| row["name"] == name).unwrap_or_else(|| {
        rows.push(json!({ "name": name }));
        rows.len() - 1
    });
    rows[at][scene] = found;
}

/// A number; what is none counts nothing.
pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(0.0)
}
