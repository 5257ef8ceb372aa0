//! The losses, constants and pictures of fits, as they were when they were last looked at.
//!
//! No reference says what they should be: they say that nothing has moved them. Whoever changes the model, the bakes, the
//! samples or the solver on purpose makes `pins.json` anew by running this test with `SKINFIT_RENEW_PINS=1`, and says why
//! in the log. Scenes of the paper's model are fitted by the loss `l2`, which is the plain sum of squares and has no
//! constants of its own.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::sandbox::{Ran, program};
use crate::common;
use crate::fixtures::read_exr;

/// The pins, by scene.
type Pins = BTreeMap<String, Pin>;

/// What a fit of a scene from its start values finds.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pin {
    /// Surface samples.
    samples: u64,
    /// Loss at the start and at the end.
    losses: [f64; 2],
    /// Value and noise error (the standard error if residuals were independent) of each constant and channel that the
    /// images determine and no bound holds.
    constants: BTreeMap<String, [f64; 2]>,
    /// By view, the mean radiance of each of 8 x 8 blocks of the picture, row by row.
    pictures: BTreeMap<String, Vec<[f64; 3]>>,
}

/// Blocks along a picture's side.
const BLOCKS: usize = 8;

/// The scanned head's and the posed head's scenes by the paper's model.
const PLAIN: [&str; 5] = ["lps_forest", "lps_sunrise", "lps_studio", "lps_studio_dry", "mh_portrait"];

/// Files of scenes with more than that: with lights, and with diffusion.
const WHOLE: [&str; 2] = ["lps_studio/light.toml", "lps_forest/full.toml"];

/// Other instructions round a loss by 1e-7 of it; a change of the model that shows moves it by more.
const OF_A_LOSS: f64 = 1e-6;
/// A fit ends where a step would gain less than it can measure. What it can, hangs on how a processor's instructions round
/// sums: at losses that are the same to 1e-8, AVX2 and AVX-512 end up to 0.15 standard errors apart where constants stand
/// for each other.
const OF_AN_ERROR: f64 = 0.25;
/// Errors hang on where a fit ends: by up to 0.7% between those.
const BETWEEN_ERRORS: f64 = 0.02;
/// f32 has no more than some 1e-7 of a constant.
const OF_A_CONSTANT: f64 = 1e-7;
/// Twice what ends that are so far apart show, of a picture's mean.
const OF_A_PICTURE: f64 = 1e-4;

/// A scene's text with its paths made absolute, without lamps and materials, which are not of the paper's model.
pub(super) fn scene_text(data: &Path, scene: &str) -> String {
    let file = data.join(scene).join("scene.toml");
    let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut table: toml::Table = text.parse().unwrap();
    table.remove("light");
    table["mesh"].as_table_mut().unwrap().remove("skin");
    let folder = file.parent().unwrap();
    let absolute = |value: &mut toml::Value| {
        *value = folder.join(value.as_str().unwrap()).to_str().unwrap().into();
    };
    absolute(&mut table["mesh"]["file"]);
    absolute(&mut table["environment"]["file"]);
    let maps = table.get_mut("maps").and_then(toml::Value::as_table_mut);
    maps.into_iter().flatten().for_each(|(_, file)| absolute(file));
    let views = table["view"].as_array_mut().unwrap();
    views.iter_mut().for_each(|view| absolute(&mut view["target"]));
    table.to_string()
}

/// A number, or one a channel.
fn channels(value: &Value) -> Vec<f64> {
    match value.as_array() {
        Some(channels) => channels.iter().filter_map(Value::as_f64).collect(),
        None => value.as_f64().into_iter().collect(),
    }
}

/// What a fit finds.
fn found(cache: &Path, arguments: &[&str]) -> Pin {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program(cache);
    command.arg("fit").args(arguments).args(["-o", "run", "--engine", "cpu", "--json"]);
    let ran = Ran::of(command.current_dir(folder.path()));
    assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    let mut constants = BTreeMap::new();
    for (name, found) in report["params"].as_object().unwrap() {
        if found["at_bound"] == false && !found["std_error"].is_null() {
            let (values, errors) = (channels(&found["value"]), channels(&found["noise_error"]));
            for (c, (value, error)) in values.into_iter().zip(errors).enumerate() {
                constants.insert(format!("{name}.{c}"), [short(value), short(error)]);
            }
        }
    }
    let views = report["views"].as_object().unwrap().keys();
    Pin {
        samples: report["samples"].as_u64().unwrap(),
        losses: ["start", "end"].map(|end| short(report["loss"][end].as_f64().unwrap())),
        constants,
        pictures: views
            .map(|view| (view.clone(), blocks(&folder.path().join(format!("run/{view}_terms.exr")))))
            .collect(),
    }
}

/// The mean radiance of each block of a picture.
fn blocks(picture: &Path) -> Vec<[f64; 3]> {
    let planes = read_exr(picture);
    let (width, height) = (planes.width, planes.height);
    let rgb = planes.rgb(["R", "G", "B"]);
    let along = |block: usize, size: usize| block * size / BLOCKS..(block + 1) * size / BLOCKS;
    let mean = |(row, column): (usize, usize)| {
        let pixels: Vec<[f32; 3]> = along(row, height)
            .flat_map(|y| along(column, width).map(move |x| y * width + x))
            .map(|pixel| rgb[pixel])
            .collect();
        [0, 1, 2]
            .map(|c| short(pixels.iter().map(|rgb| f64::from(rgb[c])).sum::<f64>() / pixels.len() as f64))
    };
    (0..BLOCKS).flat_map(|row| (0..BLOCKS).map(move |column| (row, column))).map(mean).collect()
}

/// The pins as a file, a line a scene.
fn written(pins: &Pins) -> String {
    let line = |(scene, pin)| {
        format!("{}: {}", serde_json::to_string(scene).unwrap(), serde_json::to_string(pin).unwrap())
    };
    format!("{{\n{}\n}}\n", pins.iter().map(line).collect::<Vec<_>>().join(",\n"))
}

/// To eight digits, which say more than anybody compares.
fn short(x: f64) -> f64 {
    format!("{x:.7e}").parse().unwrap()
}

/// What differs from a pin.
fn moved(scene: &str, got: &Pin, pin: &Pin) -> Vec<String> {
    let mut moved = Vec::new();
    if got.samples != pin.samples {
        moved.push(format!("{scene}: {} samples instead of {}", got.samples, pin.samples));
    }
    for (end, (got, want)) in ["start", "end"].into_iter().zip(got.losses.into_iter().zip(pin.losses)) {
        // Where nothing is left, what is left is rounding.
        if (got - want).abs() > OF_A_LOSS * want + 1e-12 {
            moved.push(format!("{scene}: loss at the {end} {got:e} instead of {want:e}"));
        }
    }
    for (name, &[want, error]) in &pin.constants {
        let Some(&[got, found]) = got.constants.get(name) else {
            moved.push(format!("{scene}: {name} is not determined"));
            continue;
        };
        let least = OF_A_CONSTANT * want.abs();
        let differs = (got - want).abs() > OF_AN_ERROR * error + least;
        if differs || (found - error).abs() > BETWEEN_ERRORS * error + least {
            moved.push(format!("{scene}: {name} {got} +- {found:e} instead of {want} +- {error:e}"));
        }
    }
    for (view, want) in &pin.pictures {
        let mean = want.iter().flatten().sum::<f64>() / want.len() as f64 / 3.0;
        let pairs = got.pictures[view].iter().flatten().zip(want.iter().flatten());
        let most = pairs.map(|(got, want)| (got - want).abs()).fold(0.0, f64::max) / mean;
        println!("{scene}: {view}: {most:e}");
        if most > OF_A_PICTURE {
            moved.push(format!("{scene}: {view}: a block is off by {most:e} of the picture's mean"));
        }
    }
    moved
}

#[test]
fn fits_of_the_real_scenes_end_where_they_did() {
    let Some(data) = common::data() else { return };
    let data = data.canonicalize().unwrap();
    // Bakes are kept from run to run, under all that they depend on.
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let folder = tempfile::tempdir().unwrap();
    let mut all = Pins::new();
    all.insert("built_in".to_owned(), found(&cache, &["--loss", "l2"]));
    for scene in PLAIN {
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, scene_text(&data, scene)).unwrap();
        all.insert(scene.to_owned(), found(&cache, &[path.to_str().unwrap(), "--loss", "l2"]));
    }
    for scene in WHOLE {
        all.insert(scene.to_owned(), found(&cache, &[data.join(scene).to_str().unwrap()]));
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/cli/pins.json");
    if std::env::var_os("SKINFIT_RENEW_PINS").is_some() {
        std::fs::write(&file, written(&all)).unwrap();
    }
    let pins: Pins = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!(pins.keys().collect::<Vec<_>>(), all.keys().collect::<Vec<_>>());
    let moved: Vec<String> = all.iter().flat_map(|(scene, got)| moved(scene, got, &pins[scene])).collect();
    assert!(moved.is_empty(), "{moved:#?}");
}
