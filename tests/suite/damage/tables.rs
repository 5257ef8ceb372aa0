//! Constants, plans, results and replayed cases, damaged: each reader says what is wrong in one paragraph that names
//! the file, or what it passes is finite and within bounds.

use skinfit::model::gain::Gain;
use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};
use skinfit::fit::params_file::{Origin, ParamsFile, SceneValues};
use skinfit::model::effects::{Effects, Form};
use skinfit::model::params::{Param, Params};
use skinfit::scene::Loss;
use skinfit::study::stability::check::check;
use skinfit::study::stability::kept;
use skinfit::study::stability::lights::LightBox;
use skinfit::study::stability::objectives::{Cpu, EngineEvaluator};
use skinfit::study::stability::plain::Plain;
use skinfit::study::stability::random::batch;
use skinfit::study::stability::search::Found;
use skinfit::study::sweep::collect::Collection;
use skinfit::study::sweep::plan::Plan;
use skinfit::study::sweep::result::{JobResult, Status};

use super::tree::{TreeDamage, json_text, toml_text, tree_damage};
use super::{Damage, damage, throw};
use crate::scene_folder::SCENE;
use proptest::prelude::*;

/// A file's text and what may happen to it: to what it says, to its letters, or both.
fn harmed(as_text: fn(&Value) -> Option<String>) -> impl Strategy<Value = Harmed> {
    let trees = prop::collection::vec(tree_damage(), 0..3);
    let letters = prop::collection::vec(damage(), 0..2);
    (trees, letters).prop_map(move |(trees, letters)| Harmed { trees, letters, as_text })
}

#[derive(Clone, Debug)]
struct Harmed {
    trees: Vec<TreeDamage>,
    letters: Vec<Damage>,
    as_text: fn(&Value) -> Option<String>,
}

impl Harmed {
    /// What is left of the file; `None` where it cannot be written at all.
    fn of(&self, whole: &Value) -> Option<Vec<u8>> {
        let tree = self.trees.iter().fold(whole.clone(), |tree, damage| damage.apply(tree));
        let text = (self.as_text)(&tree)?.into_bytes();
        Some(self.letters.iter().fold(text, |bytes, damage| damage.apply(bytes)))
    }
}

fn json_file(tree: &Value) -> Option<String> {
    Some(json_text(tree))
}

/// One paragraph that names the file.
fn paragraph(error: &impl ToString, file: &str) -> Result<(), TestCaseError> {
    let words = error.to_string();
    prop_assert!(!words.contains(['\n', '\u{1b}']), "{words:?}");
    prop_assert!(words.contains(file), "{words}");
    Ok(())
}

fn toml_tree(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

#[test]
fn no_file_of_constants_makes_its_reader_panic_or_pass_what_is_out_of_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("params.toml");
    let form = Form::Corrected;
    let mut params = Params::defaults(form);
    params.set_rgb(Param::Hilite, [0.4, 0.5, 0.6]);
    let gains = vec![("front".to_owned(), 1.0.into()), ("a side".to_owned(), Gain([1.25, 1.0, 0.75]))];
    let file = ParamsFile {
        form,
        effects: Some(Effects::SURFACE),
        loss: Some(Loss::Huber),
        params: params.clone(),
        gains: gains.clone(),
        scenes: vec![SceneValues {
            name: "noon".to_owned(),
            effects: Some(Effects::SURFACE),
            params: vec![(Param::KeyColor, [0.1, 0.2, 0.3])],
            gains,
        }],
    };
    let scene = Path::new("scene.toml");
    let whole = toml_tree(&file.to_toml(Origin { scene, outcome: None, set: &[], free: &[], numbers: &[] }));
    throw(1500, &harmed(toml_text), |harmed| {
        let Some(bytes) = harmed.of(&whole) else { return Ok(()) };
        std::fs::write(&path, bytes).unwrap();
        match ParamsFile::read(&path, form, &params) {
            Err(error) => paragraph(&error, "params.toml"),
            Ok(read) => {
                for param in Param::built_in() {
                    let admitted =
                        read.params.rgb(param).into_iter().all(|x| x.is_finite() && param.info().admits(x));
                    prop_assert!(admitted, "{}: {:?}", param.name(), read.params.rgb(param));
                }
                let gains = read.gains.iter().chain(read.scenes.iter().flat_map(|scene| &scene.gains));
                prop_assert!(
                    gains
                        .into_iter()
                        .all(|(_, gain)| gain.0.iter().all(|factor| factor.is_finite() && *factor > 0.0))
                );
                let mut own = read.scenes.iter().flat_map(|scene| &scene.params);
                prop_assert!(own.all(|(param, rgb)| rgb.iter().all(|x| param.info().admits(*x))));
                Ok(())
            }
        }
    });
}

#[test]
fn no_plan_makes_its_reader_or_its_jobs_scenes_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.toml");
    let whole = json!({
        "command": "fit", "scene": "scene.toml", "results": "out",
        "settings": {"starts": 2, "seed": 1, "quality": {"samples_per_axis": 1}},
        "axis": [
            {"key": "fit.loss", "values": ["l2", "huber"]},
            {"key": "model.effects", "values": [["diffuse", "rim"], ["diffuse"]]},
            {"key": "model.params.hilite", "values": [0.5, [0.1, 0.2, 0.3]]},
        ],
        "job": [{"command": "ablate", "refit": true}, {"command": "fit", "solver": "lm"}],
    });
    throw(1500, &harmed(toml_text), |harmed| {
        let Some(bytes) = harmed.of(&whole) else { return Ok(()) };
        std::fs::write(&path, bytes).unwrap();
        match Plan::read(&path) {
            Err(error) => paragraph(&error, "plan.toml"),
            Ok(plan) => {
                for job in plan.jobs.iter().take(20) {
                    prop_assert!(plan.job(&job.index.to_string()).is_ok());
                    let scene = plan.scene(job).unwrap_or_default();
                    match plan.scene_text(job, &scene, SCENE) {
                        Ok(text) => prop_assert!(text.parse::<toml::Table>().is_ok(), "{text}"),
                        Err(error) => paragraph(&error, "")?,
                    }
                }
                Ok(())
            }
        }
    });
}

/// The cells of a table of comma-separated values (RFC 4180), a row each.
fn cells(csv: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut cell) = (Vec::new(), Vec::new(), String::new());
    let (mut quoted, mut letters) = (false, csv.chars().peekable());
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => cell.extend(letters.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => row.push(std::mem::take(&mut cell)),
            '\n' if !quoted => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            other => cell.push(other),
        }
    }
    assert!(!quoted && row.is_empty() && cell.is_empty(), "unfinished: {csv}");
    rows
}

#[test]
fn no_result_makes_the_collector_panic_hang_or_write_a_crooked_table() {
    let folder = tempfile::tempdir().unwrap();
    let result = JobResult {
        job: 1,
        identity: "0001-0".to_owned(),
        command: "fit".to_owned(),
        status: Status::Done,
        settings: BTreeMap::from([
            ("fit.loss".to_owned(), json!("l2")),
            ("model.effects".to_owned(), json!(["rim"])),
        ]),
        figures: BTreeMap::from([
            ("loss_end".to_owned(), json!(0.5)),
            ("ending".to_owned(), json!("a \"b\", c")),
        ]),
        rows: vec![BTreeMap::from([("left_out".to_owned(), json!("rim")), ("loss".to_owned(), json!(0.25))])],
        seconds: 0.5,
    };
    let (first, whole) =
        (JobResult { job: 0, identity: "0000-0".to_owned(), ..result.clone() }, json!(result));
    first.write(folder.path()).unwrap();
    let path = JobResult::path(folder.path(), "0001-0");
    throw(1500, &harmed(json_file), |harmed| {
        let Some(bytes) = harmed.of(&whole) else { return Ok(()) };
        std::fs::write(&path, bytes).unwrap();
        match Collection::of_folder(folder.path()) {
            Err(error) => paragraph(&error, folder.path().to_str().unwrap()),
            Ok(collection) => {
                for collection in [collection.clone().without_times(), collection.with_times()] {
                    let rows = cells(&collection.csv());
                    prop_assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{}", collection.csv());
                    let json: Value = serde_json::from_str(&collection.json().unwrap()).unwrap();
                    prop_assert!(json["jobs"].is_array());
                }
                Ok(())
            }
        }
    });
}

#[test]
fn no_file_of_cases_makes_a_study_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new_cases.toml");
    let found: Vec<Found> =
        (0..2).map(|i| Found { evaluator: "a".into(), failure: "b".into(), batch: batch(5, i, 3) }).collect();
    // TOML's own reader: what is not finite stands there as it does in no tree of JSON.
    let text =
        kept::to_toml(&found).unwrap().replace("inf", "0.0").replace("nan", "0.0").replace("-0.0", "0.0");
    let whole = toml_tree(&text);
    let lights = LightBox::new(None);
    throw(700, &harmed(toml_text), |harmed| {
        let Some(bytes) = harmed.of(&whole) else { return Ok(()) };
        std::fs::write(&path, bytes).unwrap();
        match kept::read(&path) {
            Err(error) => paragraph(&error, "new_cases.toml"),
            Ok(cases) => {
                for case in cases {
                    for param in Param::built_in() {
                        let values = case.batch.setting.params.rgb(param);
                        prop_assert!(values.into_iter().all(|x| param.info().admits(x)), "{values:?}");
                    }
                    // Whether they agree is the study's to say: they are asked.
                    let _ = check(&Plain::<f32>::new(), &lights, &case.batch, &[]);
                    let _ = check(&EngineEvaluator(Cpu), &lights, &case.batch, &[]);
                }
                Ok(())
            }
        }
    });
}
