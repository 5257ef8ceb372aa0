//! docs/window.json and docs/window_card.json: how fast the window is; docs/images/window.png: what it looks like.

use serde_json::{Value, json};

use crate::lab::{Lab, Result};
use crate::timings::card;

/// Sizes of the window.
const SIZES: [&str; 2] = ["640x640", "1440x900"];

/// On the adapter that is here, and by the CPU engine; and a picture of it, whose fit goes to `runs`.
pub(crate) fn software(lab: &Lab) -> Result<Value> {
    let picture = ["view", "--screenshot", "docs/images/window.png", "--fit", "--probe", "160,150"];
    lab.skinfit("the window's picture", &picture, false)?;
    rows(lab, &["auto", "cpu"])
}

/// On a card.
pub(crate) fn graphics_card(lab: &Lab) -> Result<Value> {
    card(lab)?;
    rows(lab, &["auto"])
}

fn rows(lab: &Lab, engines: &[&str]) -> Result<Value> {
    let mut rows = Vec::new();
    for engine in engines {
        for size in SIZES {
            let run = lab.scratch.path().join(format!("window-{engine}-{size}")).display().to_string();
            let what = format!("the window, {engine}, {size}");
            let said = lab.skinfit(
                &what,
                &["view", "--bench", "--engine", engine, "--size", size, "-o", &run],
                false,
            )?;
            // What the fit says stands before it.
            let from = said.find("\n{").map_or(0, |at| at + 1);
            let mut row: Value = serde_json::from_str(&said[from..])?;
            row["size"] = json!(size.replace('x', " x "));
            rows.push(row);
        }
    }
    Ok(json!({ "rows": rows }))
}
