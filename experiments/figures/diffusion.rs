//! docs/diffusion.json: the scanned head with light that scatters within the skin, fitted with and without it.

use serde_json::{Map, Value, json};

use crate::lab::{Choice, Lab, Result};
use crate::light::RAYS;

/// The scenes; the studio has lamps, and a view close up.
const SCENES: [&str; 3] = ["forest", "sunrise", "studio"];

/// Views, by their names in the scene files, and in the raw file.
const VIEWS: [(&str, &str); 4] =
    [("front", "front"), ("threequarter", "three_quarter"), ("profile", "profile"), ("closeup", "closeup")];

/// Effects of the scenes without what scatters, and without what comes through.
pub(crate) const WITHOUT: &str = r#"["diffuse", "normal_map", "occlusion", "rim", "lights", "shadows", "light_specular", "fresnel", "directional_occlusion"]"#;
const DIFFUSION: &str = r#"["diffuse", "normal_map", "occlusion", "rim", "lights", "shadows", "light_specular", "fresnel", "directional_occlusion", "diffusion"]"#;

/// What is free then.
pub(crate) const OTHERS: &str = r#"["base_weight", "rim_weight", "rim_exponent", "specular_weight", "roughness", "gloss", "f0", "normal_strength"]"#;
const LEVELS: &str = r#"["base_weight", "rim_weight", "rim_exponent", "specular_weight", "roughness", "gloss", "f0", "normal_strength", "diffusion_weight_1", "diffusion_weight_2", "diffusion_weight_3", "diffusion_radius_1", "diffusion_radius_2", "diffusion_radius_3"]"#;

/// What is fitted: its row's name, and settings of the scene file.
const CHOICES: [Choice; 14] = [
    ("no scattering", &[("model.effects", WITHOUT), ("fit.free", OTHERS)]),
    ("`diffusion`", &[("model.effects", DIFFUSION), ("fit.free", LEVELS)]),
    ("`diffusion`, `transmission`", &[]),
    ("the same, `light_map_size = 1024`", &[("diffusion", "{ light_map_size = 1024 }")]),
    ("the same, `ambient_normal = \"bumped\"`", &[("diffusion", "{ ambient_normal = \"bumped\" }")]),
    ("the same, `unblurred = \"pixel\"`", &[("diffusion", "{ unblurred = \"pixel\" }")]),
    (
        "the same, `unblurred = \"pixel\"`, `light_map_size = 1024`, `ambient_normal = \"bumped\"`",
        &[("diffusion", "{ unblurred = \"pixel\", light_map_size = 1024, ambient_normal = \"bumped\" }")],
    ),
    ("the same, `seams = \"joined\"`", &[("diffusion", "{ seams = \"joined\" }")]),
    ("the same, light through thin parts `\"gathered\"`", &[GATHERED]),
    (
        "the same, `\"gathered\"`, `unblurred = \"pixel\"`",
        &[GATHERED, ("diffusion", "{ unblurred = \"pixel\" }")],
    ),
    (
        "no scattering, 16 lights, both by rays",
        &[WITHOUT_RAYS[0], WITHOUT_RAYS[1], RAYS[0], RAYS[1], RAYS[2]],
    ),
    ("`diffusion`, `transmission`, 16 lights, both by rays", RAYS),
    (
        "the same, `unblurred = \"pixel\"`, `light_map_size = 1024`, `ambient_normal = \"bumped\"`",
        &[
            ("diffusion", "{ unblurred = \"pixel\", light_map_size = 1024, ambient_normal = \"bumped\" }"),
            RAYS[0],
            RAYS[1],
            RAYS[2],
        ],
    ),
    (
        "the same, and `\"gathered\"`",
        &[
            ("diffusion", "{ unblurred = \"pixel\", light_map_size = 1024, ambient_normal = \"bumped\" }"),
            GATHERED,
            RAYS[0],
            RAYS[1],
            RAYS[2],
        ],
    ),
];

const GATHERED: (&str, &str) = ("transmission", "{ method = \"gathered\" }");

const WITHOUT_RAYS: [(&str, &str); 2] = [("model.effects", WITHOUT), ("fit.free", OTHERS)];

/// All of them, as docs/results.md has them in a table.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let choices = lab.choices(&CHOICES, &SCENES, "full.toml", fitted)?;
    // What a view close up ends at where there is no scattering to be missed.
    let (dry, _) = lab.fit("no scattering at all", Some(&lab.head_scene("studio_dry", "light.toml")), &[])?;
    Ok(json!({ "choices": choices, "dry": fitted(&dry) }))
}

/// A row's figures of a fit of one scene.
fn fitted(report: &Value) -> Value {
    let mut row = Map::new();
    for (view, name) in VIEWS {
        row.insert(name.to_owned(), report["views"][view]["psnr"].clone());
    }
    for key in ["params", "evaluations"] {
        row.insert(key.to_owned(), report[key].clone());
    }
    row.insert("loss".to_owned(), report["loss"]["end"].clone());
    row.insert("seconds".to_owned(), report["seconds"]["fit"].clone());
    row.into()
}
