//! Reading `params.toml`, strictly.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::{ParamsFile, SceneValues};
use crate::engine::Unknown;
use crate::model::effects::{Effect, Effects, Form};
use crate::model::gain::Gain;
use crate::model::params::{Channels, Param, Params};
use crate::scene::{Loss, short};

/// What is wrong, and where in the text.
pub(super) struct Problem {
    pub(super) place: Option<Range<usize>>,
    pub(super) problem: String,
}

fn problem<T>(place: Range<usize>, problem: String) -> Result<T, Problem> {
    Err(Problem { place: Some(place), problem })
}

/// What `text` holds: for a scene of that form, over its values, or for itself.
pub(super) fn parse(text: &str, scene: Option<(Form, &Params)>) -> Result<ParamsFile, Problem> {
    let table = DeTable::parse(text).map_err(|e| Problem {
        place: e.span(),
        problem: format!("not TOML: {}. Correct the line or fit anew.", e.message().trim_end_matches('.')),
    })?;
    let named = match table.get_ref().get("form").map(|value| (value.get_ref(), value.span())) {
        Some((DeValue::String(name), place)) => Some((read_form(name, place.clone())?, place)),
        _ => None,
    };
    if let (Some((named, place)), Some((form, _))) = (&named, scene) {
        check_form(*named, form, place.clone())?;
    }
    let form = scene.map(|(form, _)| form).or(named.map(|(form, _)| form)).unwrap_or_default();
    let params = scene.map_or_else(|| Params::defaults(form), |(_, base)| base.clone());
    let mut file =
        ParamsFile { form, effects: None, loss: None, params, gains: Vec::new(), scenes: Vec::new() };
    let strangers = Strangers::of(table.get_ref());
    for (key, value) in table.get_ref() {
        match (key.get_ref().as_ref(), value.get_ref()) {
            ("form", DeValue::String(_)) | ("terms", DeValue::Array(_)) => {}
            ("effects", DeValue::Array(names)) => file.effects = Some(read_effects(names, &strangers)?),
            ("loss", DeValue::String(name)) => file.loss = Some(read_loss(name, value.span())?),
            ("params", DeValue::Table(params)) => read_params(params, &mut file.params, &strangers)?,
            ("gains", DeValue::Table(gains)) => file.gains = read_gains(gains)?,
            ("scenes", DeValue::Table(scenes)) => file.scenes = read_scenes(scenes, &strangers)?,
            ("form" | "effects" | "terms" | "loss" | "params" | "gains" | "scenes", _) => {
                let what = "form and loss are strings, effects and terms lists of them, params, gains and scenes tables";
                return problem(value.span(), format!("`{}` is of the wrong kind: {what}.", key.get_ref()));
            }
            (name, _) => {
                let known = "form, effects, terms, loss, [params], [gains] and [scenes]";
                return problem(key.span(), format!("unknown key `{name}`. This file knows {known}."));
            }
        }
    }
    Ok(file)
}

fn read_form(name: &str, place: Range<usize>) -> Result<Form, Problem> {
    match Form::ALL.into_iter().find(|form| form.name() == name) {
        Some(form) => Ok(form),
        None => problem(place, format!("unknown form `{name}`. It is `listing` or `corrected`.")),
    }
}

fn check_form(found: Form, form: Form, place: Range<usize>) -> Result<(), Problem> {
    if found == form {
        return Ok(());
    }
    let (found, form) = (found.name(), form.name());
    problem(
        place,
        format!(
            "these parameters are of the form `{found}`, but the scene's form is `{form}`. Use them with a scene of \
             their form, or fit this one anew."
        ),
    )
}

fn read_effects(names: &DeArray<'_>, strangers: &Strangers<'_>) -> Result<Effects, Problem> {
    let effect = |name: &Spanned<DeValue<'_>>| {
        let known = || Effect::offered().map(Effect::name).collect::<Vec<_>>().join(", ");
        match name.get_ref() {
            DeValue::String(text) => Effect::from_name(text).ok_or_else(|| Problem {
                place: Some(name.span()),
                problem: format!("unknown effect `{text}`. There are {}.", known()),
            }),
            _ => problem(name.span(), format!("an effect is a name. There are {}.", known())),
        }
    };
    let known = names
        .iter()
        .filter(|name| !matches!(name.get_ref(), DeValue::String(text) if strangers.have(text, "light_")));
    known.map(effect).collect()
}

/// Effects and parameters of lights, or of terms by files, that no scene has which was read: they say nothing of this one.
struct Strangers<'a>(Vec<&'a str>);

impl<'a> Strangers<'a> {
    /// Those whose names the key `terms` lists, beside all of lights.
    fn of(table: &'a DeTable<'_>) -> Self {
        let listed = table.get("terms").and_then(|names| names.get_ref().as_array());
        Self(listed.into_iter().flatten().filter_map(|name| name.get_ref().as_str()).collect())
    }

    /// Whether a name is one of them; that of a light begins with `head`.
    fn have(&self, name: &str, head: &str) -> bool {
        (name.starts_with(head) || self.0.contains(&name))
            && Effect::from_name(name).is_none()
            && Param::from_name(name).is_none()
    }
}

fn read_loss(name: &str, place: Range<usize>) -> Result<Loss, Problem> {
    let known = || Loss::ALL.map(Loss::name).join(", ");
    match Loss::ALL.into_iter().find(|loss| loss.name() == name) {
        Some(loss) => Ok(loss),
        None => problem(place, format!("unknown loss `{name}`. There are {}.", known())),
    }
}

fn read_params(table: &DeTable<'_>, params: &mut Params, strangers: &Strangers<'_>) -> Result<(), Problem> {
    for (key, value) in table.iter().filter(|(key, _)| !strangers.have(key.get_ref(), "light.")) {
        let param = named(key)?;
        params.set_rgb(param, read_rgb(param, value)?);
    }
    Ok(())
}

/// The parameter that a key names.
fn named(key: &Spanned<std::borrow::Cow<'_, str>>) -> Result<Param, Problem> {
    let name = key.get_ref().as_ref();
    if Param::from_name(name).is_some_and(|param| param.info().held) {
        return problem(key.span(), format!("`{name}` is the scene's own: its lights give it."));
    }
    let known = || Param::all().map(Param::name).collect::<Vec<_>>().join(", ");
    Param::from_name(name).ok_or_else(|| Problem {
        place: Some(key.span()),
        problem: format!("unknown parameter `{name}`. There are {}.", known()),
    })
}

/// What scenes have of their own.
fn read_scenes(table: &DeTable<'_>, strangers: &Strangers<'_>) -> Result<Vec<SceneValues>, Problem> {
    let mut scenes = Vec::new();
    for (name, tables) in table {
        let mut own = SceneValues { name: name.get_ref().to_string(), ..SceneValues::default() };
        let DeValue::Table(parts) = tables.get_ref() else {
            let name = &own.name;
            return problem(tables.span(), format!("`{name}` is of the wrong kind: a scene is a table."));
        };
        for (key, value) in parts {
            match (key.get_ref().as_ref(), value.get_ref()) {
                ("effects", DeValue::Array(names)) => own.effects = Some(read_effects(names, strangers)?),
                ("params", DeValue::Table(params)) => own.params = read_own(params, strangers)?,
                ("gains", DeValue::Table(gains)) => own.gains = read_gains(gains)?,
                ("effects" | "params" | "gains", _) => {
                    let key = key.get_ref();
                    return problem(
                        value.span(),
                        format!(
                            "`{key}` is of the wrong kind: effects are a list of names, params and gains tables."
                        ),
                    );
                }
                (name, _) => {
                    return problem(
                        key.span(),
                        format!("unknown key `{name}`. A scene has effects, params and gains."),
                    );
                }
            }
        }
        scenes.push(own);
    }
    Ok(scenes)
}

/// The values of a scene's own parameters, in the order of the table.
fn read_own(table: &DeTable<'_>, strangers: &Strangers<'_>) -> Result<Vec<(Param, [f64; 3])>, Problem> {
    let mut own = Vec::new();
    for (key, value) in table.iter().filter(|(key, _)| !strangers.have(key.get_ref(), "light.")) {
        let param = named(key)?;
        if !param.is_of_scene() {
            let what = format!("{} is the skin's, for all scenes: it stands under [params].", param.name());
            return problem(key.span(), what);
        }
        own.push((param, read_rgb(param, value)?));
    }
    own.sort_by_key(|(param, _)| *param);
    Ok(own)
}

fn read_rgb(param: Param, value: &Spanned<DeValue<'_>>) -> Result<[f64; 3], Problem> {
    let info = param.info();
    let bounded = |value: &Spanned<DeValue<'_>>| {
        let number = number(param.name(), value)?;
        if info.admits(number) {
            return Ok(number);
        }
        let (name, (low, high)) = (info.name, info.range());
        problem(value.span(), format!("{name} = {} is outside its bounds {low} to {high}.", short(number)))
    };
    match value.get_ref() {
        DeValue::Array(channels) if info.rgb => three(info.name, value, channels, bounded),
        DeValue::Array(_) => {
            problem(value.span(), format!("{} takes one number for all channels.", info.name))
        }
        _ => Ok([bounded(value)?; 3]),
    }
}

/// A number a channel.
fn three(
    name: &str,
    value: &Spanned<DeValue<'_>>,
    channels: &[Spanned<DeValue<'_>>],
    read: impl Fn(&Spanned<DeValue<'_>>) -> Result<f64, Problem>,
) -> Result<[f64; 3], Problem> {
    match channels {
        [r, g, b] => Ok([read(r)?, read(g)?, read(b)?]),
        _ => problem(value.span(), format!("{name} takes a number or three: [r, g, b].")),
    }
}

fn read_gains(table: &DeTable<'_>) -> Result<Vec<(String, Gain)>, Problem> {
    let (lower, upper) = Unknown::Gain(0, Channels::Tied).bounds();
    let mut gains: Vec<(usize, String, Gain)> = Vec::new();
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        let bounded = |value: &Spanned<DeValue<'_>>| {
            let gain = number(name, value)?;
            if (lower..=upper).contains(&gain) {
                return Ok(gain);
            }
            let bounds = format!("{lower} to {upper}");
            problem(value.span(), format!("the gain of {name} is {gain}, outside its bounds {bounds}."))
        };
        let gain = match value.get_ref() {
            DeValue::Array(channels) => three(name, value, channels, bounded)?,
            _ => [bounded(value)?; 3],
        };
        gains.push((key.span().start, name.to_owned(), Gain(gain)));
    }
    gains.sort_by_key(|&(place, ..)| place);
    Ok(gains.into_iter().map(|(_, name, gain)| (name, gain)).collect())
}

/// A finite number.
fn number(name: &str, value: &Spanned<DeValue<'_>>) -> Result<f64, Problem> {
    let number = match value.get_ref() {
        DeValue::Integer(digits) if digits.radix() == 10 => digits.as_str().parse::<f64>().ok(),
        DeValue::Float(digits) => digits.as_str().parse::<f64>().ok(),
        _ => None,
    };
    match number.filter(|x| x.is_finite()) {
        Some(number) => Ok(number),
        None => problem(value.span(), format!("{name} must be a finite decimal number.")),
    }
}
