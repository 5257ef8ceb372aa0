//! The line of a file that declares a parameter.

use super::declaration::{list, number};
use crate::model::params::{LARGEST, Owner, Scale};
use crate::model::registry::leaked;

/// `parameter: NAME = 0.5 in [0, inf), rgb, linear; what it does; where it comes from`; the default may be one a channel,
/// `(0.5, 0.2, 0.1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DeclaredParameter {
    /// As users write it: `sheen_weight`, of a family's member `light.key.color`.
    pub(super) name: &'static str,
    /// As rules write it: each `.` a `_`.
    pub(super) identifier: &'static str,
    pub(super) default: f64,
    /// The default in each channel, where these differ.
    pub(super) channels: Option<[f64; 3]>,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) unit: &'static str,
    pub(super) rgb: bool,
    pub(super) linear: bool,
    pub(super) scale: Scale,
    pub(super) owner: Owner,
    pub(super) held: bool,
    pub(super) found: bool,
    /// The whole that it is a share of.
    pub(super) share: Option<&'static str>,
    /// The effect of the file's that asks for it, where not all do.
    pub(super) of: Option<&'static str>,
    /// The effects that show nothing where it is 0 in every channel.
    pub(super) weighs: &'static [&'static str],
    pub(super) meaning: &'static str,
    pub(super) source: &'static str,
}

/// How a parameter is declared.
pub(super) const PARAMETER_LINE: &str = "NAME = DEFAULT in [LOWER, UPPER], then `, rgb`, `, linear`, `, log`, `, scene`, `, of EFFECT`, `, weighs EFFECT`, `, share of WHOLE` or `, unit UNIT` where \
                      they hold, then `; what it does; where it comes from`. The default lies within the bounds";

/// A number, or one a channel: `(0.2, 0.1, 0)`.
fn default_of(text: &str) -> Option<[f64; 3]> {
    let Some(channels) = text.trim().strip_prefix('(') else { return number(text).map(|number| [number; 3]) };
    let channels = channels.strip_suffix(')')?.split(',').map(number).collect::<Option<Vec<f64>>>()?;
    channels.try_into().ok()
}

pub(super) fn parameter(value: &'static str) -> Option<DeclaredParameter> {
    let mut parts = value.splitn(3, ';').map(str::trim);
    let (numbers, meaning) = (parts.next()?, parts.next()?);
    let (name, rest) = numbers.split_once('=')?;
    let (default, rest) = rest.split_once(" in ")?;
    let rest = rest.trim();
    let end = rest.find([']', ')'])?;
    let (lower, upper) = rest[..end].strip_prefix(['[', '('])?.split_once(',')?;
    let bound = |text: &str| match text.trim() {
        "inf" => Some(f64::INFINITY),
        "-inf" => Some(f64::NEG_INFINITY),
        other => number(other),
    };
    let name = name.trim();
    let channels = default_of(default)?;
    let mut parameter = DeclaredParameter {
        name,
        identifier: if name.contains('.') { leaked(&name.replace('.', "_")) } else { name },
        default: channels[0],
        channels: Some(channels).filter(|channels| *channels != [channels[0]; 3]),
        lower: bound(lower)?,
        upper: bound(upper)?,
        unit: "",
        rgb: false,
        linear: false,
        scale: Scale::Linear,
        owner: Owner::Skin,
        held: false,
        found: false,
        share: None,
        of: None,
        weighs: &[],
        meaning,
        source: parts.next().unwrap_or_default(),
    };
    for flag in list(&rest[end + 1..]) {
        match flag {
            "rgb" => parameter.rgb = true,
            "linear" => parameter.linear = true,
            "log" => parameter.scale = Scale::Log,
            "scene" => parameter.owner = Owner::Scene,
            "held" => (parameter.held, parameter.owner) = (true, Owner::Scene),
            "found" => (parameter.found, parameter.owner) = (true, Owner::Scene),
            other => match other.split_once(' ')? {
                ("of", effect) => parameter.of = Some(effect.trim()),
                ("share", whole) => parameter.share = Some(whole.strip_prefix("of ")?.trim()),
                ("weighs", effect) => {
                    parameter.weighs = [parameter.weighs, &[effect.trim()]].concat().leak();
                }
                ("unit", unit) => parameter.unit = unit.trim(),
                _ => return None,
            },
        }
    }
    let DeclaredParameter { lower, upper, linear, scale, rgb, .. } = parameter;
    let within = channels.iter().all(|default| (lower.max(-LARGEST)..=upper.min(LARGEST)).contains(default));
    let coloured = rgb || parameter.channels.is_none();
    // Logarithms are of positive numbers, and a linear parameter is solved for by its value.
    let steps = scale == Scale::Linear || (lower > 0.0 && !linear);
    // Shares add up by their values, which a step solves for together, and none takes from another.
    let of_skin = parameter.owner == Owner::Skin;
    let adds_up = |whole: &str| !whole.is_empty() && linear && lower >= 0.0 && of_skin;
    let shared = parameter.share.is_none_or(adds_up);
    (within && coloured && lower < upper && steps && shared && !meaning.is_empty()).then_some(parameter)
}
