//! What the values of a scene file mean: form, effects, parameters, fit and quality, each checked.

use toml::Spanned;

use super::error::{SceneError, Warnings, warn};
use super::file::{
    BloomTable, BoundsTable, EnvironmentTable, FitTable, ModelTable, ParamsTable, QualityTable, Source,
};
use super::maps::Spots;
use super::numbers::{interval, number, short, whole};
use super::{Bloom, FitSettings, Loss, Quality, map_fit};
use crate::model::bounds::Bounds;
use crate::model::choices::{
    Bounces, Choices, LobeLookup, NormalFilter, SkinReflection, SpecularMap, SpecularModel,
    SpecularVisibility, SplitSum, Visibility,
};
use crate::model::diffusion::DiffusionChoices;
use crate::model::effects::{Effect, Effects, Form, Lookups, Silhouette};
use crate::model::params::{Column, Param, Params};
use crate::model::texture_filter::TextureFilter;
use crate::model::transmission::TransmissionChoices;

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

/// The `[model]` table's `lookups`.
pub(super) fn lookups(source: &Source, model: &ModelTable) -> Result<Lookups, SceneError> {
    choice(source, "lookups", model.lookups.as_ref(), Lookups::ALL.map(|c| (c.name(), c)))
}

/// The `[model]` table's named choices; what is glossy and what turns follows from what is free.
pub(super) fn choices(source: &Source, model: &ModelTable) -> Result<Choices, SceneError> {
    Ok(Choices {
        specular_model: choice(
            source,
            "specular_model",
            model.specular_model.as_ref(),
            SpecularModel::ALL.map(|c| (c.name(), c)),
        )?,
        split_sum: choice(
            source,
            "split_sum",
            model.split_sum.as_ref(),
            SplitSum::ALL.map(|c| (c.name(), c)),
        )?,
        specular_visibility: choice(
            source,
            "specular_visibility",
            model.specular_visibility.as_ref(),
            SpecularVisibility::ALL.map(|c| (c.name(), c)),
        )?,
        lobe_lookup: choice(
            source,
            "lobe_lookup",
            model.lobe_lookup.as_ref(),
            LobeLookup::ALL.map(|c| (c.name(), c)),
        )?,
        specular_map: choice(
            source,
            "specular_map",
            model.specular_map.as_ref(),
            SpecularMap::ALL.map(|c| (c.name(), c)),
        )?,
        normal_filter: choice(
            source,
            "normal_filter",
            model.normal_filter.as_ref(),
            NormalFilter::ALL.map(|c| (c.name(), c)),
        )?,
        visibility: choice(
            source,
            "visibility",
            model.visibility.as_ref(),
            Visibility::ALL.map(|c| (c.name(), c)),
        )?,
        bounces: choice(source, "bounces", model.bounces.as_ref(), Bounces::ALL.map(|c| (c.name(), c)))?,
        skin_reflection: choice(
            source,
            "skin_reflection",
            model.skin_reflection.as_ref(),
            SkinReflection::ALL.map(|c| (c.name(), c)),
        )?,
        diffusion: DiffusionChoices::DEFAULT,
        transmission: TransmissionChoices::default(),
        glossy: false,
        turning: false,
    })
}

/// The choice that a key names; without it the default.
fn choice<T: Copy + Default, const N: usize>(
    source: &Source,
    key: &str,
    given: Option<&Spanned<String>>,
    known: [(&'static str, T); N],
) -> Result<T, SceneError> {
    given.map_or_else(|| Ok(T::default()), |name| source.choose(key, name, &known))
}

/// The `effects` key, where there is one.
pub(super) fn effects(source: &Source, model: &ModelTable) -> Result<Option<Effects>, SceneError> {
    let offered: Vec<_> = Effect::offered().map(|effect| (effect.name(), effect)).collect();
    let parse = |names: &Vec<Spanned<String>>| {
        let mut effects = Effects::default();
        for name in names {
            let effect = match Effect::from_name(name.get_ref()) {
                Some(effect) => effect,
                None => source.choose("effect", name, &offered)?,
            };
            if effects.has(effect) {
                let what = format!("the effect {} is listed twice", effect.name());
                return Err(source.error(name, what, "Take one of them out"));
            }
            effects = effects.with(effect);
        }
        for name in names {
            let whole = Effect::from_name(name.get_ref()).and_then(|effect| effect.lacks(effects));
            if let Some(whole) = whole {
                let what =
                    format!("the effect {} is part of {}, which is not listed", name.get_ref(), whole.name());
                return Err(source.error(name, what, "Leave it out, or list both"));
            }
        }
        Ok(effects)
    };
    model.effects.as_ref().map(parse).transpose()
}

/// Start values on top of the defaults of `form`.
pub(super) fn params(source: &Source, table: &ParamsTable, form: Form) -> Result<Params, SceneError> {
    let mut params = Params::defaults(form);
    for (name, value) in table {
        let param = param(source, name)?;
        let values = value.get_ref().channels();
        check_value(param, values).map_err(|(what, remedy)| source.error(value, what, remedy))?;
        params.set_rgb(param, values);
    }
    Ok(params)
}

/// Whether a parameter may have these values in its three channels.
///
/// # Errors
/// What is wrong, and what to do.
pub(super) fn check_value(param: Param, values: [f64; 3]) -> Result<(), (String, String)> {
    let info = param.info();
    if info.held {
        let what = format!("{} follows from the scene's lights", info.name);
        return Err((what, "Change it there".to_owned()));
    }
    if let Some(&number) = values.iter().find(|&&number| !info.admits(number)) {
        let (lower, upper) = info.range();
        let what = format!("{} = {} is out of bounds", info.name, short(number));
        return Err((what, format!("Give a finite number in {}", interval(lower, upper))));
    }
    if !info.rgb && values != [values[0]; 3] {
        let what = format!("{} takes one value, not one a channel", info.name);
        return Err((what, "Give a single number".to_owned()));
    }
    Ok(())
}

fn param(source: &Source, name: &Spanned<String>) -> Result<Param, SceneError> {
    let all: Vec<_> = Param::all().map(|param| (param.name(), param)).collect();
    source.choose("parameter", name, &all)
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
    let params = free(source, table, effects, warnings)?;
    let mut coloured = per_channel(source, table, &params, effects)?;
    let is_triple = |value: &super::file::ParamValue| matches!(value, super::file::ParamValue::Rgb(_));
    for (name, value) in triples {
        let param = param(source, name)?;
        if param.info().rgb && is_triple(value.get_ref()) {
            coloured.push(param);
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
    Ok(FitSettings {
        free: columns.collect(),
        bounds: bounds(source, &table.bounds)?,
        loss,
        free_gains: table.gains,
        white_balance: table.white_balance,
        cameras: table.cameras,
        maps,
    })
}

/// `[fit.bounds]`: what parameters stay within, no more than the table lets them.
fn bounds(source: &Source, table: &BoundsTable) -> Result<Bounds, SceneError> {
    let mut all = Bounds::default();
    for (name, value) in table {
        let param = param(source, name)?;
        let &[lower, upper] = value.get_ref();
        check_bounds(param, [lower, upper]).map_err(|(what, remedy)| source.error(value, what, &remedy))?;
        all.set(param, [lower, upper]);
    }
    Ok(all)
}

/// Whether a fit may keep a parameter within these.
///
/// # Errors
/// What is wrong, and what to do.
pub fn check_bounds(param: Param, [lower, upper]: [f64; 2]) -> Result<(), (String, String)> {
    let info = param.info();
    if info.held {
        let what = format!("{} is the scene's: no fit moves it", info.name);
        return Err((what, "Take it out; bound the light's `color` in its place".to_owned()));
    }
    if !(lower < upper
        && lower >= info.lower
        && upper <= info.upper
        && lower.is_finite()
        && upper.is_finite())
    {
        let what = format!(
            "{} stays within [{}, {}]: there is no such interval",
            info.name,
            short(lower),
            short(upper)
        );
        let (lower, upper) = info.range();
        return Err((
            what,
            format!("Give two finite numbers in {}, the lesser first", interval(lower, upper)),
        ));
    }
    Ok(())
}

/// The free parameters: the names in `free`, or the default ones that an enabled effect asks for.
fn free(
    source: &Source,
    table: &FitTable,
    effects: Effects,
    warnings: &mut Warnings,
) -> Result<Vec<Param>, SceneError> {
    let Some(names) = &table.free else {
        return Ok(DEFAULT_FREE.into_iter().filter(|param| param.asked_for(effects)).collect());
    };
    let mut params: Vec<Param> = Vec::new();
    for name in names {
        let param = param(source, name)?;
        if params.contains(&param) {
            return Err(listed_twice(source, name, "free"));
        }
        if param.info().held {
            let what = format!("{} is the scene's: no fit moves it", param.name());
            return Err(source.error(name, what, "Take it out; free the light's `color` in its place"));
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
    Ok(params)
}

/// The parameters in `per_channel`, each of which must be free. One that is free by default counts as such where its
/// effect is switched off, so that a scene stays one with any of its effects left out.
fn per_channel(
    source: &Source,
    table: &FitTable,
    free: &[Param],
    effects: Effects,
) -> Result<Vec<Param>, SceneError> {
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
        if coloured.contains(&param) {
            return Err(listed_twice(source, name, "per_channel"));
        }
        let idle = table.free.is_none() && DEFAULT_FREE.contains(&param) && !param.asked_for(effects);
        if !free.contains(&param) && !idle {
            let remedy = match &table.free {
                Some(_) => "Add it to free, or take it out of per_channel".to_owned(),
                None => format!(
                    "Name what is fitted in free, this one among it, or take it out of per_channel. Without free, \
                     these are fitted: {}",
                    DEFAULT_FREE.map(Param::name).join(", ")
                ),
            };
            return Err(source.error(
                name,
                format!("{} is in per_channel but not free", param.name()),
                remedy,
            ));
        }
        coloured.push(param);
    }
    Ok(coloured)
}

fn listed_twice(source: &Source, name: &Spanned<String>, key: &str) -> SceneError {
    source.error(name, format!("{} is listed twice in {key}", name.get_ref()), "Take one of them out")
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
        shadow_rays: pick(&table.shadow_rays, "shadow_rays", 1, 1 << 12, default.shadow_rays)?,
        sky_rays: pick(&table.sky_rays, "sky_rays", 1, 1 << 16, default.sky_rays)?,
        lobe_rays: pick(&table.lobe_rays, "lobe_rays", 1, 1 << 12, default.lobe_rays)?,
        texture_filter: choice(
            source,
            "texture_filter",
            table.texture_filter.as_ref(),
            TextureFilter::ALL.map(|c| (c.name(), c)),
        )?,
    })
}

/// A wider blur than a quarter of the image is a veil over all of it.
const WIDEST_BLOOM: f64 = 0.25;

/// The `[bloom]` table over the defaults.
pub(super) fn bloom(source: &Source, table: &BloomTable) -> Result<Bloom, SceneError> {
    let wanted = format!("a share of the image's height in {}", interval(0.0, WIDEST_BLOOM));
    let within = |sigma: f64| (0.0..=WIDEST_BLOOM).contains(&sigma);
    let sigma = number(source, table.sigma.as_ref(), Bloom::default().sigma, "sigma", &wanted, within)?;
    Ok(Bloom { sigma })
}

/// Each light costs shadows of its own.
const MOST_SPOTS: i64 = 64;
/// Below it a spot is about a texel of a panorama of 8192 columns, above it no light from one direction.
const SPOT_DEGREES: [f64; 2] = [0.05, 45.0];

/// Which spots of the panorama become lights.
pub(super) fn spots(source: &Source, table: &EnvironmentTable) -> Result<Spots, SceneError> {
    let default = Spots::default();
    let [least, most] = SPOT_DEGREES;
    let wanted = format!("degrees in {}", interval(least, most));
    let given = table.light_spot_degrees.as_ref();
    let degrees = number(source, given, default.degrees, "light_spot_degrees", &wanted, |degrees| {
        (least..=most).contains(&degrees)
    })?;
    let count = whole(source, table.lights.as_ref(), "lights", [0, MOST_SPOTS], default.count)?;
    Ok(Spots { count, degrees })
}
