//! The constants alone.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::names::PREFIX;
use super::target::Target;
use super::{Constants, Provenance, names};
use crate::fit::params_file::{quoted, value as rgb_value};
use crate::model::effects::Effect;
use crate::model::gain::Gain;
use crate::model::params::{Param, Params};

/// The constants that their effects read.
pub(super) fn text(target: Target, constants: Constants<'_>, from: &Provenance) -> String {
    // What the scene's lights give stands in shaders, which are made of a scene.
    let of_scene = |param: Param| {
        let start = [param.default(constants.form); 3];
        param.info().held || (param.info().found && constants.params.rgb(param) == start)
    };
    let used: Vec<Param> =
        Param::all().filter(|param| param.asked_for(constants.effects) && !of_scene(*param)).collect();
    if target == Target::Json {
        return json_text(&used, constants, from);
    }
    let mut text = String::new();
    for line in from.lines() {
        let _ = writeln!(text, "{} {line}", target.comment());
    }
    let (head, tail) = match target {
        Target::C => guard(),
        Target::Toml => (parameter_file_head(constants), gains(constants)),
        _ => ("\n".to_owned(), String::new()),
    };
    text += &head;
    for &param in &used {
        text += &line(target, param, constants.params);
        text.push('\n');
    }
    text + &tail
}

/// What keeps a header from being read twice.
fn guard() -> (String, String) {
    let name = format!("{PREFIX}constants_h").to_uppercase();
    (format!("\n#ifndef {name}\n#define {name}\n\n"), format!("\n#endif /* {name} */\n"))
}

/// What stands in a parameter file before the constants.
fn parameter_file_head(constants: Constants<'_>) -> String {
    let effects: Vec<&str> = constants.effects.iter().map(Effect::name).collect();
    let mut text = format!("form = \"{}\"\neffects = {effects:?}\n", constants.form.name());
    if let Some(loss) = constants.loss {
        let _ = writeln!(text, "loss = \"{loss}\"");
    }
    text + "\n[params]\n"
}

/// The views' gains, after them.
fn gains(constants: Constants<'_>) -> String {
    if constants.gains.is_empty() {
        return String::new();
    }
    let gain = |(view, Gain(rgb)): &(String, Gain)| format!("{} = {}\n", quoted(view), rgb_value(*rgb));
    format!("\n[gains]\n{}", constants.gains.iter().map(gain).collect::<String>())
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
            dialect.definition(&names::constant(param.identifier()), kind, &numbers)
        }
        (Target::C, None) => {
            let name = names::function(param.identifier());
            let floats = numbers.iter().map(|x| format!("{x:?}f")).collect::<Vec<_>>().join(", ");
            match numbers.len() {
                1 => format!("static const float {name} = {floats};"),
                n => format!("static const float {name}[{n}] = {{{floats}}};"),
            }
        }
        _ if numbers.len() == 1 => format!("{} = {}", key(param), list()),
        _ => format!("{} = [{}]", key(param), list()),
    };
    format!("{definition} {about}")
}

/// The name as a key of TOML: quoted where it has dots.
fn key(param: Param) -> String {
    if param.name().contains('.') { format!("\"{}\"", param.name()) } else { param.name().to_owned() }
}

fn json_text(used: &[Param], all: Constants<'_>, from: &Provenance) -> String {
    let number = |numbers: Vec<f64>| if numbers.len() == 1 { json!(numbers[0]) } else { json!(numbers) };
    let constants: Map<String, Value> =
        used.iter().map(|&param| (param.name().to_owned(), number(value(param, all.params)))).collect();
    let errors: Map<String, Value> =
        from.std_errors.iter().map(|(param, e)| (param.name().to_owned(), number(e.clone()))).collect();
    let loss = from.loss.as_ref().map(|(name, value)| json!({"name": name, "end": value}));
    let document = json!({
        "tool": format!("skinfit {}", env!("CARGO_PKG_VERSION")),
        "scene": from.scene,
        "params_file": from.params,
        "form": all.form.name(),
        "effects": all.effects.iter().map(Effect::name).collect::<Vec<_>>(),
        "set": from.set,
        "loss": loss,
        "std_errors": errors,
        "constants": constants,
    });
    format!("{document:#}\n")
}
