//! The constants alone.

use serde_json::{Map, Value, json};

use super::Provenance;
use super::target::Target;
use crate::model::effects::Effects;
use crate::model::params::{Param, Params};

/// The constants that `effects` read.
pub(super) fn text(target: Target, effects: Effects, params: &Params, from: &Provenance) -> String {
    let used: Vec<Param> = Param::all().filter(|param| param.asked_for(effects)).collect();
    if target == Target::Json {
        return json_text(&used, params, from);
    }
    let mut lines: Vec<String> =
        from.lines().iter().map(|line| format!("{} {line}", target.comment())).collect();
    lines.push(String::new());
    lines.extend(used.iter().map(|&param| line(target, param, params)));
    lines.join("\n") + "\n"
}

/// A constant's value: three numbers of what may differ by channel, else one.
fn value(param: Param, params: &Params) -> Vec<f64> {
    if param.info().rgb { params.rgb(param).to_vec() } else { vec![params.scalar(param)] }
}

fn line(target: Target, param: Param, params: &Params) -> String {
    let numbers = value(param, params);
    let about = format!("{} {}", target.comment(), param.info().meaning);
    let list = || numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
    let definition = match (target, target.dialect()) {
        (_, Some(dialect)) => {
            let kind = if numbers.len() == 3 { "vec3f" } else { "f32" };
            dialect.definition(&format!("SKINFIT_{}", param.name().to_uppercase()), kind, &numbers)
        }
        (Target::C, None) => {
            let name = param.name();
            let floats = numbers.iter().map(|x| format!("{x:?}f")).collect::<Vec<_>>().join(", ");
            match numbers.len() {
                1 => format!("static const float skinfit_{name} = {floats};"),
                n => format!("static const float skinfit_{name}[{n}] = {{{floats}}};"),
            }
        }
        _ if numbers.len() == 1 => format!("{} = {}", param.name(), list()),
        _ => format!("{} = [{}]", param.name(), list()),
    };
    format!("{definition} {about}")
}

fn json_text(used: &[Param], params: &Params, from: &Provenance) -> String {
    let number = |numbers: Vec<f64>| if numbers.len() == 1 { json!(numbers[0]) } else { json!(numbers) };
    let constants: Map<String, Value> =
        used.iter().map(|&param| (param.name().to_owned(), number(value(param, params)))).collect();
    let errors: Map<String, Value> =
        from.std_errors.iter().map(|(param, e)| (param.name().to_owned(), number(e.clone()))).collect();
    let loss = from.loss.as_ref().map(|(name, value)| json!({"name": name, "end": value}));
    let document = json!({
        "tool": format!("skinfit {}", env!("CARGO_PKG_VERSION")),
        "scene": from.scene,
        "params_file": from.params,
        "loss": loss,
        "std_errors": errors,
        "constants": constants,
    });
    format!("{document:#}\n")
}
