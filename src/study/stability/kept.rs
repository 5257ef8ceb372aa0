//! Cases kept in a file: what a search found, to be tried again on every run.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::case::{Batch, FragmentInputs, Setting};
use super::lights::LightKind;
use super::search::Found;
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::evaluate::Setup;
use crate::model::params::{Param, Params};
use crate::scene::error::SceneError;
use crate::scene::{Loss, Source};

/// The cases that every study tries again.
const KEPT: &str = include_str!("kept.toml");

/// A named batch.
#[derive(Clone, Debug)]
pub struct KeptCase {
    /// Its name in tables.
    pub name: String,
    /// The fragments.
    pub batch: Batch,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    case: Vec<CaseTable<Spanned<String>>>,
}

#[derive(Serialize)]
struct OutFile {
    case: Vec<CaseTable<String>>,
}

/// One case; `S` is text, with its place where it was read.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseTable<S> {
    name: S,
    /// Which evaluator failed it, and how: for the reader.
    #[serde(default)]
    found_by: String,
    #[serde(default)]
    failure: String,
    form: S,
    silhouette: S,
    effects: Vec<S>,
    lights: S,
    loss: S,
    #[serde(default)]
    params: BTreeMap<String, [f64; 3]>,
    fragment: Vec<FragmentTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FragmentTable {
    texel: [f64; 3],
    tangent: [f64; 3],
    bitangent: [f64; 3],
    normal: [f64; 3],
    view: [f64; 3],
    occlusion: f64,
    silhouette: f64,
    dapple: f64,
    albedo: [f64; 3],
    specular: f64,
    attenuator: f64,
}

macro_rules! same_fields {
    ($from:ty => $to:ty) => {
        impl From<$from> for $to {
            fn from(f: $from) -> Self {
                Self {
                    texel: f.texel,
                    tangent: f.tangent,
                    bitangent: f.bitangent,
                    normal: f.normal,
                    view: f.view,
                    occlusion: f.occlusion,
                    silhouette: f.silhouette,
                    dapple: f.dapple,
                    albedo: f.albedo,
                    specular: f.specular,
                    attenuator: f.attenuator,
                }
            }
        }
    };
}

same_fields!(FragmentTable => FragmentInputs);
same_fields!(FragmentInputs => FragmentTable);

/// The cases that come with the program.
///
/// # Errors
/// Never, as a test reads them too.
pub fn built_in() -> Result<Vec<KeptCase>, SceneError> {
    parse(&Source::of(Path::new("kept.toml"), KEPT.to_owned()))
}

/// The cases of a file, such as a study leaves.
///
/// # Errors
/// When it cannot be read or holds something else.
pub fn read(path: &Path) -> Result<Vec<KeptCase>, SceneError> {
    parse(&Source::read(path)?)
}

fn parse(source: &Source) -> Result<Vec<KeptCase>, SceneError> {
    let file: File = source.parse()?;
    file.case.into_iter().map(|table| case(source, table)).collect()
}

fn case(source: &Source, table: CaseTable<Spanned<String>>) -> Result<KeptCase, SceneError> {
    let all = Effect::BUILT_IN.map(|effect| (effect.name(), effect));
    let effects: Effects =
        table.effects.iter().map(|name| source.choose("effect", name, &all)).collect::<Result<_, _>>()?;
    let form = source.choose("form", &table.form, &Form::ALL.map(|form| (form.name(), form)))?;
    let silhouettes = Silhouette::ALL.map(|s| (s.name(), s));
    let silhouette = source.choose("silhouette", &table.silhouette, &silhouettes)?;
    let lights = source.choose("light", &table.lights, &LightKind::ALL.map(|l| (l.name(), l)))?;
    let loss = source.choose("loss", &table.loss, &Loss::ALL.map(|loss| (loss.name(), loss)))?;
    let name = table.name.get_ref();
    let refuse = |what: String, remedy: String| {
        Err(source.error(&table.name, format!("case {name:?}: {what}"), remedy))
    };
    let mut params = Params::defaults(form);
    for (key, value) in &table.params {
        let Some(param) = Param::from_name(key) else {
            let known: Vec<&str> = Param::built_in().map(Param::name).collect();
            return refuse(format!("unknown parameter {key:?}"), crate::scene::suggestion(key, &known));
        };
        let info = param.info();
        let (low, high) = info.range();
        if !value.iter().all(|&x| x.is_finite() && info.admits(x)) {
            return refuse(format!("{key} = {value:?}"), format!("Give finite numbers from {low} to {high}"));
        }
        if !info.rgb && *value != [value[0]; 3] {
            return refuse(
                format!("{key} = {value:?}"),
                "It is one number for all channels: give it three times".into(),
            );
        }
        params.set_rgb(param, *value);
    }
    if table.fragment.is_empty() {
        return refuse("has no fragment".into(), "Give it a [[case.fragment]] at least".into());
    }
    let mut fragments: Vec<FragmentInputs> = table.fragment.into_iter().map(Into::into).collect();
    for (number, fragment) in fragments.iter_mut().enumerate() {
        for (place, x) in fragment.numbers_mut().into_iter().enumerate() {
            // Every evaluator starts from the same, whatever it computes in. Of texels alone a file may hold anything.
            let single = *x as f32;
            if place >= TEXEL && !single.is_finite() {
                let what = format!("fragment {number} holds {x:e}");
                return refuse(
                    what,
                    "Give numbers that an f32 holds; only texels may be infinite or NaN".into(),
                );
            }
            *x = f64::from(single);
        }
    }
    let setup = Setup::new(form, silhouette, effects);
    let setting = Setting { setup, params, lights, loss };
    Ok(KeptCase { name: name.clone(), batch: Batch { setting, fragments } })
}

/// Numbers of a fragment that come first and are of its texel.
const TEXEL: usize = 3;

/// What was found, as the text of a file that [`read`] takes.
///
/// # Errors
/// Never: the tables are plain.
pub fn to_toml(found: &[Found]) -> Result<String, toml::ser::Error> {
    let table = |(number, found): (usize, &Found)| {
        let Setting { setup, params, lights, loss } = found.batch.setting.clone();
        let default = Params::defaults(setup.form);
        let changed = Param::built_in().filter(|&param| params.rgb(param) != default.rgb(param));
        CaseTable {
            name: format!("found {}", number + 1),
            found_by: found.evaluator.clone(),
            failure: found.failure.clone(),
            form: setup.form.name().to_owned(),
            silhouette: setup.silhouette.name().to_owned(),
            effects: setup.effects.iter().map(|effect| effect.name().to_owned()).collect(),
            lights: lights.name().to_owned(),
            loss: loss.name().to_owned(),
            params: changed.map(|param| (param.name().to_owned(), params.rgb(param))).collect(),
            fragment: found.batch.fragments.iter().map(|&fragment| fragment.into()).collect(),
        }
    };
    toml::to_string(&OutFile { case: found.iter().enumerate().map(table).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::random::batch;

    #[test]
    fn cases_read_back_as_they_were_written_nan_and_signed_zeros_included() {
        let found: Vec<Found> = (0..30)
            .map(|i| Found { evaluator: "a".into(), failure: "b \"c\"".into(), batch: batch(3, i, 20) })
            .collect();
        let text = to_toml(&found).unwrap();
        let cases = parse(&Source::of(Path::new("a.toml"), text)).unwrap();
        // Other tests' lights bring some.
        let all: Vec<Param> = Param::all().collect();
        for (case, found) in cases.iter().zip(&found) {
            let told = |Batch { setting, fragments }: &Batch| {
                let Setting { setup, params, lights, loss } = setting;
                let params: Vec<[f64; 3]> = all.iter().map(|&param| params.rgb(param)).collect();
                format!("{setup:?} {params:?} {lights:?} {loss:?} {fragments:?}")
            };
            assert_eq!(told(&case.batch), told(&found.batch));
        }
    }

    #[test]
    fn the_kept_cases_are_sound_and_what_is_not_is_refused_with_its_place() {
        assert!(built_in().is_ok());
        let refused =
            |text: &str| parse(&Source::of(Path::new("a.toml"), text.to_owned())).unwrap_err().to_string();
        assert!(
            refused("[[cases]]\n").starts_with("a.toml: line 1: unknown key `cases`. Did you mean `case`?")
        );
        let text =
            to_toml(&[Found { evaluator: String::new(), failure: String::new(), batch: batch(1, 1, 1) }]);
        let text = text.unwrap().replace("lights = \"", "lights = \"x");
        assert!(refused(&text).contains("unknown light `x"), "{}", refused(&text));
    }

    #[test]
    fn numbers_that_no_evaluator_can_start_from_are_refused_with_their_case() {
        let found = Found { evaluator: String::new(), failure: String::new(), batch: batch(1, 1, 2) };
        let text = to_toml(&[found]).unwrap();
        let with = |change: &dyn Fn(&mut toml::Table)| {
            let mut file: toml::Table = text.parse().unwrap();
            change(file["case"][0].as_table_mut().unwrap());
            let text = toml::to_string(&file).unwrap();
            parse(&Source::of(Path::new("a.toml"), text)).map(drop).map_err(|error| error.to_string())
        };
        assert_eq!(with(&|_| ()), Ok(()));
        let numbers = |x: f64| toml::Value::from(vec![x; 3]);
        let param = |name: &'static str, x: f64| {
            with(&|case| _ = case["params"].as_table_mut().unwrap().insert(name.into(), numbers(x)))
                .unwrap_err()
        };
        for (words, wanted) in [
            (param("specular_lobe", -5.0), "specular_lobe = [-5.0, -5.0, -5.0]"),
            (param("base_weight", f64::INFINITY), "base_weight = [inf, inf, inf]"),
            (param("hilit", 1.0), "unknown parameter \"hilit\""),
            (
                with(&|case| case["fragment"][1]["occlusion"] = 1e39.into()).unwrap_err(),
                "fragment 1 holds 1e39",
            ),
            (with(&|case| case["fragment"] = toml::Value::Array(Vec::new())).unwrap_err(), "has no fragment"),
        ] {
            assert!(words.contains(wanted) && words.starts_with("a.toml: line "), "{words}");
            assert!(words.contains("case \"found 1\""), "{words}");
        }
        let anything = |x: f64| with(&|case| case["fragment"][0]["texel"] = numbers(x));
        assert!(anything(f64::NAN).is_ok() && anything(1e300).is_ok());
    }
}
