//! docs/closeup.json, and the pictures beside it: skin at close range, path traced, fitted with light that scatters, and without.

use serde_json::{Value, json};
use skinfit::report::plot::{Dot, Joined, Plot};

use crate::diffusion::{OTHERS, WITHOUT};
use crate::lab::{Lab, Result};
use crate::squares::{Place, Shown, drawn, side_by_side, traced};

/// The best of docs/diffusion.json's choices close up.
const DIFFUSION: &str = r#"{ unblurred = "pixel", light_map_size = 1024, ambient_normal = "bumped" }"#;
/// What is shown.
const SHOWN: [Place; 3] =
    [("closeup", [120, 150, 130]), ("closeup", [190, 240, 130]), ("threequarter", [218, 150, 84])];

/// Across the edge of the nose's shadow on the cheek, from light to dark: rows that are averaged, and columns.
const ROWS: std::ops::Range<usize> = 205..215;
const COLUMNS: std::ops::Range<usize> = 138..184;
/// Pixels at either end that are taken for all light and all shadow.
const ENDS: usize = 8;
/// Millimetres a pixel on the cheek.
const MILLIMETRES: f64 = 0.18;

/// Of the path tracer's random walk in red, green and blue, in millimetres: what the scenes were rendered with.
const MEAN_FREE_PATHS: [f64; 3] = [3.7, 1.4, 0.7];

/// The fits' figures, the profile across the shadow's edge, and how wide the edge is in each channel.
pub(crate) fn measure(lab: &Lab) -> Result<Value> {
    let full = lab.head_scene("studio", "full.toml");
    let with = lab.scene("scattered", &full, &[("diffusion", DIFFUSION)])?;
    let without = lab.scene("unscattered", &full, &[("model.effects", WITHOUT), ("fit.free", OTHERS)])?;
    let (mut columns, mut rows) =
        (vec![traced(lab, "studio", &SHOWN)?], vec![("path traced".to_owned(), Value::Null)]);
    for (name, scene) in [("with diffusion", with), ("without", without)] {
        let (report, run) = lab.fit(name, Some(&scene), &[])?;
        rows.push((name.to_owned(), report["views"]["closeup"]["psnr"].clone()));
        columns.push(drawn(lab, &run, &SHOWN)?);
    }
    side_by_side(&columns, &SHOWN, "docs/images/closeup.png")?;
    let profiles: Vec<Vec<[f64; 3]>> = columns.iter().map(|views| profile(&views[0])).collect();
    plot(&rows.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), &profiles)?;
    let rows = rows.into_iter().zip(&profiles).map(|((name, psnr), profile)| {
        let [red, green, blue] = [0, 1, 2].map(|c| width(profile, c));
        json!({ "name": name, "psnr": psnr, "red": red, "green": green, "blue": blue, "profile": profile })
    });
    Ok(json!({ "rows": rows.collect::<Vec<_>>(), "mean_free_paths": MEAN_FREE_PATHS }))
}

/// Mean radiance of the rows, pixel by pixel.
fn profile(shown: &Shown) -> Vec<[f64; 3]> {
    let mean = |column: usize| {
        let of =
            |c: usize| ROWS.map(|row| f64::from(shown.pixels[row * shown.width + column][c])).sum::<f64>();
        [0, 1, 2].map(|c| of(c) / ROWS.len() as f64)
    };
    COLUMNS.map(mean).collect()
}

/// From a quarter of the way between shadow and light to three quarters, in millimetres.
fn width(profile: &[[f64; 3]], c: usize) -> f64 {
    let mean = |part: &[[f64; 3]]| part.iter().map(|rgb| rgb[c]).sum::<f64>() / part.len() as f64;
    let (light, dark) = (mean(&profile[..ENDS]), mean(&profile[profile.len() - ENDS..]));
    // The last place that is as light, so that a mole before the edge is none.
    let crossing = |share: f64| {
        let level = dark + share * (light - dark);
        let k = (0..profile.len() - 1).rev().find(|&k| profile[k][c] >= level && profile[k + 1][c] < level);
        k.map_or(f64::NAN, |k| k as f64 + (profile[k][c] - level) / (profile[k][c] - profile[k + 1][c]))
    };
    MILLIMETRES * (crossing(0.25) - crossing(0.75))
}

fn plot(names: &[&str], profiles: &[Vec<[f64; 3]>]) -> Result<()> {
    let mut dots = Vec::new();
    for (i, profile) in profiles.iter().enumerate() {
        for (k, rgb) in profile.iter().enumerate() {
            // Blue is as green is, only narrower: six curves are enough to read.
            for (c, y) in rgb[..2].iter().copied().enumerate() {
                let x = MILLIMETRES * k as f64;
                let title = format!("{}: {x:.2} mm, {y:.3}", names[i]);
                dots.push(Dot { x, y, label: String::new(), title, series: 2 * i + c, front: true });
            }
        }
    }
    let series = names.iter().flat_map(|name| ["red", "green"].map(|c| format!("{name}, {c}"))).collect();
    let (x, y) = ("millimetres across the shadow's edge", "radiance");
    let plot = Plot { x, y, log_x: false, dots, series, joined: Joined::Series };
    Ok(std::fs::write("docs/images/terminator.svg", plot.file())?)
}
