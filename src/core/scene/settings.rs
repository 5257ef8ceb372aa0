//! What the values of a scene file mean: form, effects, parameters, fit and quality, each checked.

use std::path::Path;

use toml::Spanned;

use super::error::{SceneError, Warnings, warn};
use super::file::{FitTable, ModelTable, ParamsTable, QualityTable, Source};
use super::{FitSettings, Loss, Quality, map_fit};
use crate::model::effects::{Effect, Effects, Form, Silhouette};
use crate::model::params::{Column, Param, Params};

/// The `[model]` table's form and silhouette.
pub(super) fn form(source: &Source, model: &ModelTable) -> Result<(Form, Silhouette), SceneError> {
    let form = match &model.form {
        Some(name) => source.choose("form", name, &Form::ALL.map(|form| (form.name(), form)))?,
        None => Form::default(),
    };
    let silhouette = match &model.silhouette {
        Some(name) => source.choose("silhouette", name, &Silhouette::ALL.map(|s| (s.name(), s)))?,
        None => form.default_silhouette(),
    };
    Ok((form, silhouette))
}

/// The `effects` key, where there is one.
pub(super) fn effects(source: &Source, model: &ModelTable) -> Result<Option<Effects>, SceneError> {
    let all = Effect::ALL.map(|effect| (effect.name(), effect));
    let parse = |names: &Vec<Spanned<String>>| {
        let mut effects = Effects::default();
        for name in names {
            let effect = source.choose("effect", name, &all)?;
            if effects.has(effect) {
                let what = format!("the effect {} is listed twice", effect.name());
                return Err(source.error(name, what, "Take one of them out"));
            }
            effects = effects.with(effect);
        }
        Ok(effects)
    };
    model.effects.as_ref().map(parse).transpose()
}

/// Start values on top of the defaults of `form`.
pub(super) fn params(source: &Source, table: &ParamsTable, form: Form) -> Result<Params, SceneError> {
    let mut params = Params::defaults(form);
    apply(source, table, &mut params)?;
    Ok(params)
}

/// Read a file of parameters, one `name = value` (or `name = [r, g, b]`) a line, over `params`.
///
/// # Errors
/// When the file cannot be read, names an unknown parameter, or a value is out of bounds.
pub fn read_params(path: &Path, params: &mut Params) -> Result<(), SceneError> {
    let source = Source::read(path)?;
    let table: ParamsTable = source.parse()?;
    apply(&source, &table, params)
}

fn apply(source: &Source, table: &ParamsTable, params: &mut Params) -> Result<(), SceneError> {
    for (name, value) in table {
        let param = param(source, name)?;
        let info = param.info();
        let values = value.get_ref().channels();
        for number in values {
            if !info.admits(number) {
                let (lower, upper) = info.range();
                return Err(source.error(
                    value,
                    format!("{} = {} is out of bounds", info.name, short(number)),
                    format!("Give a finite number in {}", interval(lower, upper)),
                ));
            }
        }
        if !info.rgb && values != [values[0]; 3] {
            return Err(source.error(
                value,
                format!("{} takes one value, not one a channel", info.name),
                "Give a single number",
            ));
        }
        params.set_rgb(param, values);
    }
    Ok(())
}

fn param(source: &Source, name: &Spanned<String>) -> Result<Param, SceneError> {
    let all: Vec<_> = Param::all().map(|param| (param.name(), param)).collect();
    source.choose("parameter", name, &all)
}

/// A number as one would write it: 180, 1e300.
pub fn short(number: f64) -> String {
    let text = format!("{number:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

/// "[0, inf)" and the like.
#[must_use]
pub fn interval(lower: f64, upper: f64) -> String {
    let left = if lower.is_finite() { '[' } else { '(' };
    let right = if upper.is_finite() { ']' } else { ')' };
    format!("{left}{lower}, {upper}{right}")
}

/// What is free when a scene does not say: the constants of the paper's fragment program.
const DEFAULT_FREE: [Param; 7] = [
    Param::BaseWeight,
    Param::RimWeight,
    Param::RimExponent,
    Param::SideSpecular,
    Param::Hilite,
    Param::Reflection,
    Param::Occlusion,
];

/// The `[fit]` table. Without `free`, the paper's constants that an enabled effect asks for.
pub(super) fn fit(
    source: &Source,
    table: &FitTable,
    triples: &ParamsTable,
    effects: Effects,
    warnings: &mut Warnings,
) -> Result<FitSettings, SceneError> {
    let mut coloured = Vec::new();
    for name in &table.per_channel {
        let param = param(source, name)?;
        if !param.info().rgb {
            return Err(source.error(
                name,
                format!("{} takes one value, not one a channel", param.name()),
                "Take it out of per_channel",
            ));
        }
        if !table.free.iter().flatten().any(|free| free.get_ref() == param.name()) {
            return Err(source.error(
                name,
                format!("{} is in per_channel but not free", param.name()),
                "Add it to free, or take it out of per_channel",
            ));
        }
        coloured.push(param);
    }
    let is_triple = |value: &super::file::ParamValue| matches!(value, super::file::ParamValue::Rgb(_));
    for (name, value) in triples {
        let param = param(source, name)?;
        if param.info().rgb && is_triple(value.get_ref()) {
            coloured.push(param);
        }
    }
    let mut params: Vec<Param> = Vec::new();
    match &table.free {
        None => params.extend(DEFAULT_FREE.into_iter().filter(|param| param.asked_for(effects))),
        Some(names) => {
            for name in names {
                let param = param(source, name)?;
                if params.contains(&param) {
                    return Err(source.error(
                        name,
                        format!("{} is listed twice in free", param.name()),
                        "Take one of them out",
                    ));
                }
                if !param.asked_for(effects) {
                    let message = format!(
                        "{} is free, but no enabled effect asks for it: it will be reported as unidentifiable",
                        param.name()
                    );
                    warn(warnings, &source.path, message);
                }
                params.push(param);
            }
        }
    }
    let columns = params.into_iter().flat_map(|param| {
        if coloured.contains(&param) {
            Column::per_channel(param).to_vec()
        } else {
            vec![Column::tied(param)]
        }
    });
    let loss = match &table.loss {
        Some(name) => source.choose("loss", name, &Loss::ALL.map(|loss| (loss.name(), loss)))?,
        None => Loss::default(),
    };
    let maps = map_fit::settings(source, &table.maps)?;
    Ok(FitSettings { free: columns.collect(), loss, free_gains: table.gains, maps })
}

/// The `[quality]` table over the defaults.
pub(super) fn quality(source: &Source, table: &QualityTable) -> Result<Quality, SceneError> {
    let pick = |value: &Option<Spanned<i64>>, name: &str, least: i64, most: i64, default: u32| {
        whole(source, value.as_ref(), name, [least, most], default)
    };
    let default = Quality::default();
    Ok(Quality {
        samples_per_axis: pick(&table.samples_per_axis, "samples_per_axis", 1, 16, default.samples_per_axis)?,
        irradiance_size: pick(&table.irradiance_size, "irradiance_size", 4, 512, default.irradiance_size)?,
        lobe_size: pick(&table.lobe_size, "lobe_size", 4, 1024, default.lobe_size)?,
        hilite_size: pick(&table.hilite_size, "hilite_size", 4, 4096, default.hilite_size)?,
        lobes_per_octave: pick(&table.lobes_per_octave, "lobes_per_octave", 1, 8, default.lobes_per_octave)?,
        occlusion_rays: pick(&table.occlusion_rays, "occlusion_rays", 1, 1 << 16, default.occlusion_rays)?,
    })
}

/// A whole number within bounds, or `default` when it is not given.
pub(super) fn whole(
    source: &Source,
    value: Option<&Spanned<i64>>,
    name: &str,
    [least, most]: [i64; 2],
    default: u32,
) -> Result<u32, SceneError> {
    let Some(number) = value else { return Ok(default) };
    u32::try_from(*number.get_ref()).ok().filter(|&n| (least..=most).contains(&i64::from(n))).ok_or_else(
        || {
            let what = format!("{name} = {} is out of bounds", number.get_ref());
            source.error(number, what, format!("Give a whole number in [{least}, {most}]"))
        },
    )
}

/// A number that must be finite and satisfy `test`, or `default` when it is not given.
pub(super) fn number(
    source: &Source,
    value: Option<&Spanned<f64>>,
    default: f64,
    name: &str,
    wanted: &str,
    test: impl Fn(f64) -> bool,
) -> Result<f64, SceneError> {
    let Some(spanned) = value else { return Ok(default) };
    let number = *spanned.get_ref();
    if number.is_finite() && test(number) {
        return Ok(number);
    }
    Err(source.error(
        spanned,
        format!("{name} = {} is out of bounds", short(number)),
        format!("Give {wanted}"),
    ))
}
