//! docs/normals.json: bumps of the scanned head that are smaller than a sample, by mean normals and by widened lobes.

use serde_json::{Value, json};

use crate::lab::{Lab, Result};
use crate::studies::{number, study_of};

/// Scenes of the scanned head; lights are taken out of their panoramas, so that there are highlights.
const SCENES: [&str; 2] = ["forest", "sunrise"];

/// A row a way: its error in each scene with one sample a pixel, in percent, and its seconds.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let mut rows: Vec<Value> = Vec::new();
    for scene in SCENES {
        let changes = [("quality.samples_per_axis", "1")];
        let file = lab.scene(scene, &lab.head_scene(scene, "light.toml"), &changes)?;
        let options = ["--axis", "normal_filter"];
        for (i, found) in study_of(lab, "tradeoff", scene, Some(&file), &options)?.iter().enumerate() {
            if rows.len() == i {
                rows.push(json!({ "name": found["setting"] }));
            }
            rows[i][scene] = json!({
                "percent": 100.0 * number(&found["relative_rms"]), "flip": found["flip"], "seconds": found["cost"],
            });
        }
    }
    Ok(json!({ "rows": rows }))
}
