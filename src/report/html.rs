//! `report.html`: what a fit found, as one page.

use std::fmt::Write as _;

use rayon::prelude::*;

use super::json::{Summary, ViewMeans};
use super::misfit::{LEAST, Match, Misfit, SIGMAS};
use super::page::{Page, escape, filled, tile};
use super::pictures::Picture;
use super::verdict::{direction, entangled, verdict};
use super::words::{capital, count, counted, ending, list, number, seconds};
use super::{RunInfo, charts, diffusion, errors, figures, maps, tables};
use crate::fit::outcome::Ending;
use crate::fit::profile::Profile;

/// What the scores of views that were held out tell.
const HELD_OUT: &str = "Views that are held out took no part in the fit, and come last: their scores tell whether the \
    constants hold for what it has not seen.";

/// The page of the run called `title`; `errors` are the views' FLIP errors, in their order, and `scale` is the greatest
/// signed error that is told apart.
///
/// # Errors
/// When a picture cannot be encoded, with the reason.
pub fn page(
    title: &str,
    run: &RunInfo,
    summary: &Summary,
    errors: &[Picture],
    scale: f64,
) -> Result<String, String> {
    let sections = run.views.par_iter().zip(&summary.views.0).zip(errors);
    let sections = sections.map(|((view, (_, scores)), error)| figures::view(view, scores, error, scale));
    let views = sections.collect::<Result<Vec<_>, _>>()?.concat();
    let shown = run.maps.as_ref().map(maps::shown).transpose()?.unwrap_or_default();
    let diffused = diffusion::shown(&run.diffused)?;
    let fill = |key: &str| match key {
        "diffusion" => diffused.clone(),
        "warnings" => warnings(&summary.warnings),
        "misfit" => misfit(&summary.misfit),
        "views" => views.clone(),
        "held_out" if run.views.iter().any(|view| view.held_out) => format!("<p>{HELD_OUT}</p>\n"),
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
        lead: format!("{} {lead}", status(summary)),
        tiles: tiles(summary),
        main: filled(include_str!("fit.html"), fill),
    };
    Ok(page.html())
}

/// How the fit ended, and how good its end is: that it has converged does not make it good.
fn status(summary: &Summary) -> String {
    let pill = |class: &str, words: String| format!("<span class=\"pill {class}\">{words}</span>");
    let matched = summary.misfit.matched;
    let ended = match (summary.ending, matched) {
        (Ending::Converged, Some(Match::Close) | None) => "good",
        (Ending::Converged, _) => "",
        (Ending::RanOut | Ending::Stalled | Ending::Interrupted, _) => "warn",
    };
    let matching = matched.map(|matched| {
        let class = match matched {
            Match::Close => "good",
            Match::Rough => "warn",
            Match::Poor | Match::None => "bad",
        };
        pill(class, capital(matched.words()))
    });
    pill(ended, ending(summary.ending)) + &matching.unwrap_or_default()
}

/// The largest misfits in sentences.
fn misfit(misfit: &Misfit) -> String {
    if misfit.places.is_empty() {
        return "<p>No pixel is compared.</p>".to_owned();
    }
    let told: String =
        misfit.told().map(|place| format!("<li>{}.</li>", escape(&capital(&place.sentence())))).collect();
    let told = match told.is_empty() {
        true => "<p>No place is too bright or too dark on average.</p>".to_owned(),
        false => format!("<ul class=\"misfits\">{told}</ul>"),
    };
    format!(
        "{told}<p class=\"quiet\">Means of fit less target in linear radiance, over the pixels of a place: those of at \
         least {}% of the targets' mean radiance ({}) and {SIGMAS} standard errors, the largest first. Places overlap. \
         In creases less than 60% of the hemisphere is open; normals at the rim are more than 70° from the camera, \
         those that face it less than 30°; light side and shadow side are the thirds that the diffuse light falls on \
         most and least; highlights are the tenth that mirrors the most light.</p>",
        100.0 * LEAST,
        number(misfit.mean_radiance, 2),
    )
}

/// The run in a handful of numbers.
fn tiles(summary: &Summary) -> String {
    let score = |name, of: fn(&ViewMeans) -> Option<f64>, text: fn(f64) -> String| {
        let text = |means: ViewMeans| of(&means).map_or_else(|| "–".to_owned(), text);
        let whole = match summary.scores.fitted {
            Some(means) if means.views > 1 => Some(format!("mean of {} views", means.views)),
            _ => None,
        };
        let held = summary.scores.held_out.map(|means| format!("held out {}", text(means)));
        let note = whole.into_iter().chain(held).collect::<Vec<_>>().join(" · ");
        (name, summary.scores.fitted.map_or_else(|| "–".to_owned(), text), note)
    };
    let total = summary.seconds;
    let total =
        total.load + total.bake + total.samples + total.maps + total.fit + total.render + total.report;
    let tiles = [
        ("loss", number(summary.loss.end, 3), format!("from {}", number(summary.loss.start, 3))),
        score("PSNR", |means| means.psnr, |x| format!("{x:.1} <small>dB</small>")),
        score("SSIM", |means| means.ssim, |x| format!("{x:.3}")),
        score("FLIP", |means| means.flip, |x| format!("{x:.3}")),
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

/// The profile of the weakest unknown.
fn profiled(profile: &Profile) -> String {
    let cells = errors::rows(profile).0;
    let row = |heading: &str, of: &dyn Fn(&(String, f64)) -> String| -> String {
        let cells: String = cells.iter().map(|cell| format!("<td class=\"n\">{}</td>", of(cell))).collect();
        format!("<tr><th scope=\"row\">{heading}</th>{cells}</tr>")
    };
    let name = escape(&profile.name);
    let ends = [0, 1].map(|end| {
        let open = if profile.closed[end] { "" } else { " (not yet there, where the search ended)" };
        format!("{}{open}", number(profile.interval[end], 4))
    });
    let why = "the loss where it is held, the others solved for anew";
    format!(
        "<h3>Profile of the weakest: {name}</h3><p>Held beside the answer, the loss rises by what its \
         standard error stands for ({}) at {} and at {}; that error is {}.</p><div class=\"scroll\"><table class=\"params\" \
         id=\"profile\" title=\"{why}\"><tbody>{}{}</tbody></table></div>",
        number(profile.rise, 2),
        ends[0],
        ends[1],
        number(profile.std_error, 2),
        row(&format!("<code>{name}</code>"), &|(value, _)| value.clone()),
        row("loss", &|(_, loss)| number(*loss, 6)),
    )
}

/// What the images tell apart, and what not.
fn identifiability(summary: &Summary) -> String {
    let mut html = String::new();
    if summary.unknowns.is_empty() {
        html.push_str("<p>Nothing was free, so there was nothing to determine.</p>");
    } else if summary.undetermined.is_empty() {
        html.push_str("<p>Any change of the free parameters, alone or together, changes the images.</p>");
    } else {
        let items: String =
            summary.undetermined.iter().map(|d| format!("<li>{}</li>", escape(&direction(d)))).collect();
        let _ = write!(html, "<p>The images leave open:</p><ul class=\"directions\">{items}</ul>");
    }
    let held: Vec<String> = summary.unknowns.iter().filter(|u| u.at_bound).map(|u| u.name.clone()).collect();
    if !held.is_empty() {
        let whose = if held.len() == 1 { "its bound" } else { "their bounds" };
        let _ = write!(
            html,
            "<p>Held by {whose}, and so not determined from inside: {}.</p>",
            escape(&list(&held))
        );
    }
    if let Some(profile) = &summary.profile {
        html.push_str(&profiled(profile));
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
