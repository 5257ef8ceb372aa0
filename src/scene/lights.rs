//! The `[[light]]` tables: a light's keys by its type, checked.

use std::ops::Range;

use glam::DVec3;
use toml::Spanned;

use super::error::SceneError;
use super::file::{LightTable, ParamValue, Source};
use super::light::{Beam, Cone, Lamp, Light, LightKind};

/// KHR_lights_punctual's cone, where a spot does not say: half angles in degrees.
pub(super) const DEFAULT_CONE: [f64; 2] = [0.0, 45.0];

/// A type of light in scene files.
#[derive(Clone, Copy)]
struct Type {
    name: &'static str,
    required: &'static [&'static str],
    optional: &'static [&'static str],
}

const DIRECTIONAL: Type = Type {
    name: "directional",
    required: &["direction", "irradiance"],
    optional: &["angular_diameter_degrees"],
};
const POINT: Type =
    Type { name: "point", required: &["position", "intensity"], optional: &["range", "radius"] };
const SPOT: Type = Type {
    name: "spot",
    required: &["position", "direction", "intensity"],
    optional: &["range", "radius", "inner_degrees", "outer_degrees"],
};

/// All lights of a scene file, in its order.
pub(super) fn plan(source: &Source, tables: &[Spanned<LightTable>]) -> Result<Vec<Light>, SceneError> {
    let mut lights: Vec<Light> = Vec::new();
    for table in tables.iter().map(Spanned::get_ref) {
        let light = light(source, table)?;
        if is_skys(&light.name) {
            let what = format!("the name `{}` is that of a light from the panorama", light.name);
            return Err(source.error(&table.name, what, "Choose another one: not sky_ and a number"));
        }
        if lights.iter().any(|other| same_name(&other.name, &light.name)) {
            let what = format!("two lights are named `{}`", light.name);
            let remedy = "Give each light a name of its own (case does not count)";
            return Err(source.error(&table.name, what, remedy));
        }
        lights.push(light);
    }
    Ok(lights)
}

/// Whether exported constants could tell two lights apart: their names are in capitals.
pub(super) fn same_name(a: &str, b: &str) -> bool {
    a.eq_ignore_ascii_case(b)
}

/// Whether a name is one of those of `[environment] lights`.
pub(super) fn is_skys(name: &str) -> bool {
    let number = name.to_ascii_lowercase();
    number
        .strip_prefix("sky_")
        .is_some_and(|rest| !rest.is_empty() && rest.chars().all(|c| c.is_ascii_digit()))
}

fn light(source: &Source, table: &LightTable) -> Result<Light, SceneError> {
    let all = [DIRECTIONAL, POINT, SPOT].map(|kind| (kind.name, kind));
    let kind = source.choose("type of light", &table.kind, &all)?;
    check_keys(source, table, kind)?;
    let number =
        |value: &Option<Spanned<f64>>, default: f64| value.as_ref().map_or(default, |v| *v.get_ref());
    let vector = |value: &Option<Spanned<[f64; 3]>>| {
        value.as_ref().map_or(DVec3::ZERO, |v| DVec3::from_array(*v.get_ref()))
    };
    let color = |value: &Option<Spanned<ParamValue>>| {
        value.as_ref().map_or([0.0; 3], |value| value.get_ref().channels())
    };
    let lamp = || Lamp {
        position: vector(&table.position),
        intensity: color(&table.intensity),
        range: table.range.as_ref().map(|range| *range.get_ref()),
        radius: number(&table.radius, 0.0),
    };
    let kind = match kind.name {
        "directional" => LightKind::Directional(Beam {
            direction: vector(&table.direction),
            irradiance: color(&table.irradiance),
            angular_diameter_degrees: number(&table.angular_diameter_degrees, 0.0),
        }),
        "point" => LightKind::Point(lamp()),
        _ => {
            let [inner, outer] = DEFAULT_CONE;
            let cone = Cone {
                direction: vector(&table.direction),
                inner_degrees: number(&table.inner_degrees, inner),
                outer_degrees: number(&table.outer_degrees, outer),
            };
            LightKind::Spot(lamp(), cone)
        }
    };
    Light::new(table.name.get_ref(), kind).map_err(|error| {
        let given = keys(table).into_iter().find(|(key, _)| *key == error.key).and_then(|(_, span)| span);
        source.error(&place(given.unwrap_or(table.name.span())), error.what, error.remedy)
    })
}

/// A place in the file.
fn place(span: Range<usize>) -> Spanned<()> {
    Spanned::new(span, ())
}

/// Refuse keys that the type of light lacks, and those that it lacks itself.
fn check_keys(source: &Source, table: &LightTable, kind: Type) -> Result<(), SceneError> {
    let Type { name, required, optional } = kind;
    for (key, span) in keys(table) {
        let needed = required.contains(&key);
        match span {
            Some(span) if !needed && !optional.contains(&key) => {
                let known = [required, optional].concat().join(", ");
                let what = format!("a {name} light has no `{key}`");
                let remedy = format!("Take the key out, or change the type. A {name} light has: {known}");
                return Err(source.error(&place(span), what, remedy));
            }
            None if needed => {
                let what = format!("the {name} light `{}` lacks `{key}`", table.name.get_ref());
                let remedy = format!("Add {key}. A {name} light needs {}", required.join(", "));
                return Err(source.error(&table.name, what, remedy));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The keys that depend on the type of light, and where they stand.
fn keys(table: &LightTable) -> [(&'static str, Option<Range<usize>>); 9] {
    fn span<T>(value: &Option<Spanned<T>>) -> Option<Range<usize>> {
        value.as_ref().map(Spanned::span)
    }
    [
        ("direction", span(&table.direction)),
        ("irradiance", span(&table.irradiance)),
        ("angular_diameter_degrees", span(&table.angular_diameter_degrees)),
        ("position", span(&table.position)),
        ("intensity", span(&table.intensity)),
        ("range", span(&table.range)),
        ("radius", span(&table.radius)),
        ("inner_degrees", span(&table.inner_degrees)),
        ("outer_degrees", span(&table.outer_degrees)),
    ]
}
