//! Tables of the page: parameters, scores, stages.

use std::fmt::Write as _;

use super::charts::error_bar;
use super::json::{Summary, UnknownSummary, Value};
use super::page::escape;
use super::words::{number, seconds, with_error};
use crate::model::params::{Param, ParamInfo, Scale};
use crate::render::tonemap::ToneMap;

/// The unknowns: start, value with its standard error, both against the bounds, and what to note.
pub(super) fn parameters(summary: &Summary) -> String {
    let mut rows = String::new();
    let mut last = "";
    for unknown in &summary.unknowns {
        let (base, channel) = match unknown.name.rsplit_once('.') {
            Some((base, channel @ ("r" | "g" | "b"))) if parameter(base).is_some() => (base, channel),
            _ => (unknown.name.as_str(), ""),
        };
        let info = parameter(base).map(Param::info);
        rows.push_str(&row(summary, unknown, info, (base, channel), base == last));
        last = base;
    }
    format!(
        "<div class=\"scroll\"><table class=\"params\"><thead><tr><th>parameter</th><th class=\"n\">start</th>\
         <th class=\"n\">value ± standard error</th><th>between its bounds</th><th class=\"n\">sensitivity</th>\
         <th>notes</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

/// The parameter of that name, which may stand after its scene's.
fn parameter(name: &str) -> Option<Param> {
    let own = || name.rsplit_once('/').filter(|_| !name.starts_with("gain."));
    Param::from_name(name).or_else(|| Param::from_name(own()?.1))
}

fn row(
    summary: &Summary,
    unknown: &UnknownSummary,
    info: Option<&ParamInfo>,
    (base, channel): (&str, &str),
    follows: bool,
) -> String {
    let meaning = match info {
        _ if follows => String::new(),
        Some(info) => escape(info.meaning),
        None => "factor on the view's image".to_owned(),
    };
    let unit = info.map_or("", |i| i.unit);
    let unit = if unit.is_empty() { String::new() } else { format!(" <small>{}</small>", escape(unit)) };
    let dot = if channel.is_empty() { String::new() } else { format!("<i class=\"channel {channel}\"></i>") };
    let swatch = if follows { String::new() } else { swatch(summary, base) };
    let (value, error) = match unknown.std_error.filter(|e| e.is_finite()) {
        Some(e) => {
            let (value, error) = with_error(unknown.value, e);
            let noise =
                unknown.noise_error.filter(|noise| e > 1.05 * noise).map_or_else(String::new, |noise| {
                    format!(" <small>by independent residuals {}</small>", number(noise, 2))
                });
            (value, format!(" <span class=\"pm\">± {error}</span>{noise}"))
        }
        None => (number(unknown.value, 4), String::new()),
    };
    let logarithmic = info.is_some_and(|i| i.scale == Scale::Log);
    format!(
        "<tr{}><th scope=\"row\">{dot}<code>{}</code>{swatch}<small>{meaning}</small></th><td class=\"n\">{}</td>\
         <td class=\"n\"><b>{value}</b>{error}{unit}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
        if follows { " class=\"follows\"" } else { "" },
        escape(&unknown.name),
        number(unknown.start, 4),
        error_bar(unknown, logarithmic),
        number(unknown.sensitivity, 3),
        notes(unknown),
    )
}

/// A patch of a coloured parameter's hue: its channels against the greatest of them.
fn swatch(summary: &Summary, base: &str) -> String {
    let Some((_, param)) = summary.params.0.iter().find(|(name, _)| name == base) else {
        return String::new();
    };
    match param.value {
        Value::Rgb(rgb) => {
            let most = rgb.iter().copied().fold(1e-9, f64::max);
            let [r, g, b] = ToneMap::default().encode_bytes(rgb.map(|c| (c / most) as f32));
            format!("<i class=\"swatch\" style=\"background:rgb({r} {g} {b})\" title=\"its hue\"></i>")
        }
        Value::Tied(_) => String::new(),
    }
}

fn notes(unknown: &UnknownSummary) -> String {
    let mut notes = String::new();
    if unknown.at_bound {
        let [lower, upper] = unknown.bounds;
        let near_lower = (unknown.value - lower).abs() <= (upper - unknown.value).abs();
        let which = if near_lower {
            format!("lower bound {}", number(lower, 4))
        } else {
            format!("upper bound {}", number(upper, 4))
        };
        let _ = write!(notes, "<span class=\"pill warn\">at its {which}</span>");
    }
    if !unknown.identifiable {
        notes.push_str("<span class=\"pill bad\">undetermined</span>");
    }
    notes
}

/// The stages' shares of the time: a bar and its legend.
pub(super) fn stages(summary: &Summary) -> String {
    let s = summary.seconds;
    let stages = [
        ("load", 0, s.load),
        ("bake", 1, s.bake),
        ("samples", 2, s.samples),
        ("maps", 5, s.maps),
        ("fit", 3, s.fit),
        ("render", 4, s.render),
        ("report", 6, s.report),
    ];
    let stages = stages.map(|(name, i, t)| (name, i, if t.is_finite() { t.max(0.0) } else { 0.0 }));
    let total: f64 = stages.iter().map(|(_, _, t)| t).sum();
    let (mut bar, mut legend) = (String::new(), String::new());
    // Few fits have whole maps.
    for (name, i, t) in stages.into_iter().filter(|(name, _, t)| *name != "maps" || *t > 0.0) {
        let share = if total > 0.0 { 100.0 * t / total } else { 0.0 };
        let time = seconds(t);
        if share > 0.0 {
            let _ = write!(
                bar,
                "<i class=\"s{i}\" style=\"width:{share:.2}%\" title=\"{name}: {time}, {share:.0}%\"></i>"
            );
        }
        let _ = write!(
            legend,
            "<li><i class=\"s{i}\"></i>{name} <b>{time}</b> <span class=\"quiet\">{share:.0}%</span></li>"
        );
    }
    format!(
        "<div class=\"stages\">{bar}</div><ul class=\"legend\">{legend}<li>together <b>{}</b></li></ul>",
        seconds(total)
    )
}

/// Names and texts.
pub(super) fn provenance(summary: &Summary) -> String {
    let more = [
        ("solver", summary.solver.to_owned()),
        ("engine", summary.engine.clone()),
        ("loss", summary.loss_name.to_owned()),
    ];
    let all = summary.provenance.0.iter().cloned().chain(more.map(|(n, t)| (n.to_owned(), t)));
    let rows: String = all.map(|(n, t)| format!("<dt>{}</dt><dd>{}</dd>", escape(&n), escape(&t))).collect();
    format!("<dl>{rows}</dl>")
}
