//! The losses and constants of fits of the real scenes, as they were when they were last looked at.
//!
//! No reference says what they should be: they say that nothing has moved them. Whoever changes the model, the bakes,
//! the samples or the solver on purpose makes them anew from what this test prints, and says why in the log. They are
//! of the loss `l2`, which is the plain sum of squares and has no constants of its own.

use std::path::Path;

use serde_json::Value;

use super::sandbox::{Ran, program};
use crate::common;

/// A scene, and what a fit of it from the model's defaults finds.
struct Pin {
    scene: &'static str,
    /// Loss at the start and at the end.
    losses: [f64; 2],
    /// Surface samples.
    samples: u64,
    /// Value and noise error (the standard error if residuals were independent) of each constant that the images
    /// determine and no bound holds.
    constants: &'static [(&'static str, f64, f64)],
}

const PINS: [Pin; 4] = [
    Pin {
        scene: "lps_forest",
        losses: [0.287_737_777_262, 0.001_755_754_097_42],
        samples: 767_730,
        constants: &[
            ("base_weight", 1.032_543_688, 4.19e-4),
            ("rim_weight", 0.228_256_789, 1.11e-3),
            ("rim_exponent", 1.488_887_031, 9.44e-3),
            ("hilite", 0.324_858_913, 4.23e-3),
            ("reflection", 0.031_640_511_0, 1.08e-4),
            ("occlusion", 0.690_321_433, 1.77e-3),
            ("normal_strength", 0.416_530_079, 3.57e-3),
            ("specular_lobe", 48.292_485_0, 0.372),
        ],
    },
    Pin {
        scene: "lps_sunrise",
        losses: [0.081_681_377_195_0, 0.032_088_431_231_4],
        samples: 767_730,
        constants: &[
            ("base_weight", 0.749_849_455, 7.87e-3),
            ("rim_weight", 1.233_780_94, 6.97e-3),
            ("rim_exponent", 0.849_630_316, 1.21e-2),
            ("hilite", 0.112_338_833, 2.71e-3),
            ("reflection", 0.162_826_600, 2.76e-4),
            ("normal_strength", 0.807_672_993, 3.07e-3),
            ("specular_lobe", 86.177_073_4, 0.223),
        ],
    },
    Pin {
        scene: "lps_studio",
        losses: [0.054_129_126_156_3, 0.024_666_185_254_7],
        samples: 1_357_554,
        constants: &[
            ("base_weight", 4.167_793_53, 5.68e-2),
            ("rim_weight", 5.819_349_21, 4.80e-2),
            ("rim_exponent", 0.280_229_025, 5.51e-3),
            ("occlusion", 0.446_734_525, 8.03e-3),
            ("normal_strength", 3.474_046_67, 2.74e-2),
        ],
    },
    Pin {
        scene: "mh_portrait",
        losses: [1.686_024_544_57, 0.012_138_693_769_6],
        samples: 517_412,
        constants: &[
            ("base_weight", 0.543_986_854, 1.01e-3),
            ("rim_weight", 0.069_872_634_9, 1.61e-3),
            ("rim_exponent", 1.129_222_17, 1.83e-2),
            ("side_specular", 0.018_118_572_1, 2.39e-4),
            ("hilite", 0.466_558_596, 7.60e-3),
            ("reflection", 0.025_230_435_1, 2.78e-4),
            ("occlusion", 0.991_231_987, 4.89e-3),
        ],
    },
];

/// A scene's text with its paths made absolute, without lamps and materials, which are not of this model.
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

#[test]
fn fits_of_the_real_scenes_end_where_they_did() {
    let Some(data) = common::data() else { return };
    let data = data.canonicalize().unwrap();
    // Bakes are kept from run to run, under all that they depend on.
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graphics");
    let folder = tempfile::tempdir().unwrap();
    let mut moved = Vec::new();
    for pin in PINS {
        std::fs::write(folder.path().join("scene.toml"), scene_text(&data, pin.scene)).unwrap();
        let mut command = program(&cache);
        command.args(["fit", "scene.toml", "-o", "run", "--loss", "l2", "--engine", "cpu", "--json"]);
        let ran = Ran::of(command.current_dir(folder.path()));
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let report: Value = serde_json::from_str(&ran.out).unwrap();
        assert_eq!(report["samples"].as_u64(), Some(pin.samples), "{}", pin.scene);
        for (end, want) in ["start", "end"].into_iter().zip(pin.losses) {
            let got = report["loss"][end].as_f64().unwrap();
            println!("{}: loss at the {end} {got:e}", pin.scene);
            // Other instructions round a loss by 1e-7 of it; a change of the model that shows moves it by more.
            if (got - want).abs() > 1e-6 * want {
                moved.push(format!("{}: loss at the {end} {got:e} instead of {want:e}", pin.scene));
            }
        }
        let params = report["params"].as_object().unwrap();
        for (name, want, error) in pin.constants {
            let (got, found) = (&params[*name]["value"], params[*name]["noise_error"].as_f64());
            let got = got.as_f64().unwrap();
            println!("{}: {name} {got} +- {found:?}", pin.scene);
            // A fit ends where a step would gain less than it can measure: within a hundredth of a standard error.
            if (got - want).abs() > 0.01 * error {
                moved.push(format!("{}: {name} {got} instead of {want} +- {error:e}", pin.scene));
            }
            // They are written here to three digits.
            if found.is_none_or(|found| (found / error - 1.0).abs() > 0.01) {
                moved.push(format!("{}: {name} +- {found:?} instead of {error:e}", pin.scene));
            }
        }
    }
    assert!(moved.is_empty(), "{moved:#?}");
}
