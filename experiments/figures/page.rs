//! docs/page.json: how large pages are, with and without their scenes.

use std::path::PathBuf;

use serde_json::{Value, json};
use skinfit::PrepareOptions;
use skinfit::prepare::Loaded;

use crate::lab::{Lab, Result};

/// Of the built-in scene and of the scanned head, with few effects and with all.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let player = lab.program().with_file_name("skinfit-page.html");
    let folder = lab.scratch.path();
    let built_in = skinfit::built_in_scene(folder)?;
    let scenes: [(&str, PathBuf); 3] = [
        ("the built-in head", built_in),
        ("a scanned head, the paper's effects", lab.head_scene("forest", "scene.toml")),
        ("a scanned head, all effects", lab.head_scene("forest", "full.toml")),
    ];
    let mut rows = Vec::new();
    for (i, (scene, path)) in scenes.into_iter().enumerate() {
        let page = folder.join(format!("{i}.html"));
        let words = [path.display().to_string(), page.display().to_string()];
        lab.skinfit(&format!("a page of {scene}"), &["page", &words[0], "-o", &words[1]], false)?;
        let loaded = Loaded::read(&path, &PrepareOptions::default())?;
        rows.push(json!({
            "scene": scene,
            "vertices": loaded.scene.mesh.positions.len(),
            "mebibytes": mebibytes(&page)?,
        }));
    }
    Ok(json!({ "player": mebibytes(&player)?, "rows": rows }))
}

fn mebibytes(file: &std::path::Path) -> Result<f64> {
    Ok(std::fs::metadata(file)?.len() as f64 / f64::from(1 << 20))
}
