//! docs/portrait.json, and the picture beside it: a path-traced head whose eyes are not skin, fitted with and without saying so.

use serde_json::{Value, json};

use crate::lab::{Lab, Result};
use crate::squares::{Place, drawn, side_by_side, traced};

/// What is shown.
const SHOWN: [Place; 3] = [("front", [0, 0, 384]), ("front", [112, 120, 160]), ("threequarter", [0, 0, 384])];
/// The constants that are told.
const CONSTANTS: [&str; 7] =
    ["base_weight", "rim_weight", "rim_exponent", "side_specular", "hilite", "reflection", "occlusion"];

/// A row a fit: its constants with their errors, and its scores.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let scene = lab.data.join("mh_portrait/scene.toml");
    let named = lab.scene("eyes told apart", &scene, &[])?;
    let whole = lab.scene("eyes as skin", &scene, &[("mesh.skin", "[\"skin\", \"eyes\"]")])?;
    let mut columns = vec![traced(lab, "mh", &SHOWN)?];
    let mut rows = Vec::new();
    for (name, scene) in [("eyes told apart", named), ("eyes as skin", whole)] {
        let (report, run) = lab.fit(name, Some(&scene), &[])?;
        let constants = CONSTANTS.map(|constant| {
            let found = &report["params"][constant];
            json!({ "name": constant, "value": found["value"], "std_error": found["std_error"] })
        });
        let psnr = |view: &str| report["views"][view]["psnr"].clone();
        rows.push(json!({
            "name": name, "samples": report["samples"], "loss": report["loss"]["end"],
            "front": psnr("front"), "threequarter": psnr("threequarter"), "constants": constants,
        }));
        columns.push(drawn(lab, &run, &SHOWN)?);
    }
    side_by_side(&columns, &SHOWN, "docs/images/portrait.png")?;
    Ok(json!({ "rows": rows }))
}
