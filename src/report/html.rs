//! `report.html`: what a fit found, as one page.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::json::{Summary, ViewSummary};
use super::page::{Page, escape, filled, tile};
use super::pictures::Picture;
use super::words::{count, counted, direction, ending, entangled, number, seconds, verdict};
use super::{RunInfo, charts, figures, maps, tables};
use crate::fit::outcome::Ending;

/// The page of the run called `title`; `errors` are the views' error pictures, in their order.
///
/// # Errors
/// When a picture cannot be encoded, with the reason.
pub fn page(title: &str, run: &RunInfo, summary: &Summary, errors: &[Picture]) -> Result<String, String> {
    let sections = run.views.par_iter().zip(&summary.views.0).zip(errors);
    let sections = sections.map(|((view, (_, scores)), error)| figures::view(view, scores, error));
    let views = sections.collect::<Result<Vec<_>, _>>()?.concat();
    let shown = run.maps.as_ref().map(maps::shown).transpose()?.unwrap_or_default();
    let fill = |key: &str| match key {
        "warnings" => warnings(&summary.warnings),
        "views" => views.clone(),
        "maps" => shown.clone(),
        "held" if run.maps.is_some() => format!("<p>{}</p>\n", maps::HELD),
        "parameters" => tables::parameters(summary),
        "identifiability" => identifiability(summary),
        "convergence" => charts::convergence(summary),
        "stages" => tables::stages(summary),
        "provenance" => tables::provenance(summary),
        _ => String::new(),
    };
    let lead = verdict(summary).iter().map(|s| escape(s)).collect::<Vec<_>>().join(" ");
    let page = Page {
        kind: "fit report",
        title,
        lead: format!("{} {lead}", status(summary.ending)),
        tiles: tiles(summary),
        main: filled(include_str!("fit.html"), fill),
    };
    Ok(page.html())
}

fn status(end: Ending) -> String {
    let class = match end {
        Ending::Converged => "good",
        Ending::RanOut | Ending::Stalled | Ending::Interrupted => "warn",
    };
    format!("<span class=\"pill {class}\">{}</span>", ending(end))
}

/// The run in a handful of numbers.
fn tiles(summary: &Summary) -> String {
    let views: Vec<&ViewSummary> = summary.views.0.iter().map(|(_, view)| view).collect();
    let mean = |score: fn(&ViewSummary) -> Option<f64>| {
        let scores: Vec<f64> = views.iter().filter_map(|v| score(v)).collect();
        (!scores.is_empty()).then(|| scores.iter().sum::<f64>() / scores.len() as f64)
    };
    let of_views = match views.len() {
        0 | 1 => String::new(),
        n => format!("mean of {n} views"),
    };
    let score = |x: Option<f64>, text: fn(f64) -> String| x.map_or_else(|| "–".to_owned(), text);
    let total = summary.seconds;
    let total = total.load + total.bake + total.samples + total.maps + total.fit + total.render;
    let tiles = [
        ("loss", number(summary.loss.end, 3), format!("from {}", number(summary.loss.start, 3))),
        ("PSNR", score(mean(|v| v.psnr), |x| format!("{x:.1} <small>dB</small>")), of_views.clone()),
        ("SSIM", score(mean(|v| v.ssim), |x| format!("{x:.3}")), of_views.clone()),
        ("FLIP", score(mean(|v| v.flip), |x| format!("{x:.3}")), of_views),
        ("samples", count(summary.samples), format!("{} · {}", escape(&summary.engine), summary.solver)),
        ("time", seconds(total), format!("fit {}", seconds(summary.seconds.fit))),
    ];
    tiles.iter().map(|(name, value, note)| tile(name, value, note)).collect()
}

fn warnings(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let items: String = warnings.iter().map(|w| format!("<li>{}</li>", escape(w))).collect();
    format!(
        "<section class=\"warnings\" id=\"warnings\"><h2>{}</h2><ul>{items}</ul></section>",
        counted(warnings.len() as u64, "warning")
    )
}

/// What the images tell apart, and what not.
fn identifiability(summary: &Summary) -> String {
    let mut html = String::new();
    if summary.unknowns.is_empty() {
        html.push_str("<p>Nothing was free, so there was nothing to determine.</p>");
    } else if summary.undetermined.is_empty() {
        html.push_str("<p>Every direction in the space of the unknowns changes the images.</p>");
    } else {
        let items: String =
            summary.undetermined.iter().map(|d| format!("<li>{}</li>", escape(&direction(d)))).collect();
        let _ = write!(html, "<p>The images leave open:</p><ul class=\"directions\">{items}</ul>");
    }
    let pairs = entangled(summary);
    if !pairs.is_empty() {
        let items: Vec<String> = pairs.iter().take(8).map(|p| escape(p)).collect();
        let more =
            if pairs.len() > 8 { format!(" and {} more pairs", pairs.len() - 8) } else { String::new() };
        let _ = write!(
            html,
            "<p>Hard to tell apart, by the correlation of their errors: {}{more}.</p>",
            items.join("; ")
        );
    }
    if summary.correlations.names.len() > 1 {
        html.push_str("<h3>Correlations of the errors</h3><div class=\"scroll\">");
        html.push_str(&charts::heat_map(&summary.correlations));
        html.push_str("</div>");
    }
    html
}
