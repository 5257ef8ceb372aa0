//! docs/suggest.json: which effects the scanned head's scenes call for, as `skinfit suggest` finds it.

use serde_json::{Value, json};

use crate::lab::{Lab, Result};
use crate::studies::number;

/// The scenes, by the files with everything that they may call for.
const SCENES: [(&str, &str); 3] =
    [("forest", "light.toml"), ("sunrise", "light.toml"), ("studio_dry", "light.toml")];

/// The scene whose front is drawn on the page.
const DRAWN: &str = "forest";

/// Of each scene the steps to the set that was chosen, from the cheapest set on, and how many sets were judged.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let mut raw = json!({});
    for (scene, file) in SCENES {
        let folder = lab.scratch.path().join(format!("suggest_{scene}"));
        let (path, output) =
            (lab.head_scene(scene, file).display().to_string(), folder.display().to_string());
        lab.skinfit(&format!("suggest {scene}"), &["suggest", &path, "-o", &output], false)?;
        let found: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("results.json"))?)?;
        let (sets, steps) = (listed(&found["sets"]), listed(&found["steps"]));
        raw[scene] = json!({
            "steps": steps.iter().enumerate().map(|(at, step)| row(sets, steps, at, step)).collect::<Vec<_>>(),
            "judged": sets.len(),
        });
        if scene == DRAWN {
            std::fs::copy(folder.join("front.svg"), lab.root.join("docs/images/suggest.svg"))?;
        }
    }
    Ok(raw)
}

/// A step's row: what was added or taken out, or all of the first set; its score, what it gained, what a pass and a
/// frame take in times of the first set's, and what is baked.
fn row(sets: &[Value], steps: &[Value], at: usize, step: &Value) -> Value {
    let set =
        |step: &Value| step["set"].as_u64().and_then(|set| sets.get(set as usize)).unwrap_or(&Value::Null);
    let scored = |step: &Value| number(&set(step)["held_out"]);
    let effects: Vec<&str> = listed(&set(step)["effects"]).iter().filter_map(Value::as_str).collect();
    let before = at.checked_sub(1).map(|before| &steps[before]);
    let gain = before.map(|before| scored(step) - scored(before));
    // What has to be baked beside what the set before has.
    let had = before.map_or(&[][..], |before| listed(&before["counts"]["bakes"]));
    let bakes = listed(&step["counts"]["bakes"]).iter().filter(|bake| !had.contains(bake));
    let bakes: Vec<&str> = bakes.filter_map(Value::as_str).collect();
    json!({
        "name": if at == 0 { effects.join(", ").into() } else { step["what"].clone() },
        "psnr": scored(step),
        "gain": gain,
        "pass": step["cpu"]["ratio"]["median"],
        "frame": step["gpu"]["ratio"]["median"],
        "bakes": bakes.join(", "),
        "operations": set(step)["operations"],
    })
}

fn listed(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}
