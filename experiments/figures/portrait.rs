//! docs/portrait.json, and the picture beside it: a path-traced head whose eyes are not skin, fitted with and without saying so.

use std::path::Path;

use serde_json::{Value, json};
use skinfit::gpu::upload::Content;
use skinfit::gpu::{Choice, Gpu, RenderOptions, Renderer};
use skinfit::prepare::{Baked, PrepareOptions};
use skinfit::render::antialias::Antialias;
use skinfit::render::shading::Shading;
use skinfit::shader::Budget;

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
    let eyes = eyes(&scene)?;
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
    Ok(json!({ "rows": rows, "eyes": eyes }))
}

/// How far the eyes are off that the renderer draws, beside those of the CPU's rays: a row a view, root mean squares in percent
/// of the radiance that rays find, over the pixels where rays find some.
fn eyes(scene: &Path) -> Result<Vec<Value>> {
    let baked = Baked::new(scene, &PrepareOptions::default())?;
    let gpu = Gpu::open(&Choice::default())?;
    let options = RenderOptions {
        antialias: Antialias::Grid(baked.scene.quality.samples_per_axis),
        shading: Shading::default(),
        budget: Budget::Exact,
        timed: false,
        animated: false,
    };
    let mut renderer = Renderer::new(&gpu, Content::of(&baked), options)?;
    let sampled = baked.clone().sample()?;
    let mut rows = Vec::new();
    for (view, samples) in baked.scene.views.iter().zip(&sampled.samples) {
        let drawn = renderer.render_plain(&view.camera, 1.0)?.ok_or("the head has no eyes of their own")?;
        let (mut misfit, mut energy) = (0.0, 0.0);
        for part in &samples.plain {
            for (got, want) in drawn.rgb[part.pixel as usize].iter().zip(part.rgb) {
                misfit += f64::from(got - want).powi(2);
                energy += f64::from(want).powi(2);
            }
        }
        let pixels: f32 = samples.plain.iter().map(|part| part.share).sum();
        rows.push(json!({ "view": view.name, "pixels": pixels, "error": 100.0 * (misfit / energy).sqrt() }));
    }
    Ok(rows)
}
