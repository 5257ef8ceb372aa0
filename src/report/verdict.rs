//! Findings in words: how a fit ended, what it reached, and what to be wary of.

use super::errors;
use super::json::{Ordered, Summary, UnknownSummary};
use super::words::{capital, counted, list, number, seconds};
use crate::fit::outcome::Ending;

/// The verdict: how the fit ended, what it reached, and what to be wary of; a sentence an entry.
pub(super) fn verdict(summary: &Summary) -> Vec<String> {
    let mut sentences = vec![how_it_ended(summary), what_it_reached(summary)];
    sentences.extend(held_out(summary).map(|words| sentence(&words)));
    let misfit = [summary.misfit.explained_in_words(), summary.misfit.largest_in_words()];
    sentences.extend(misfit.into_iter().flatten().map(|words| sentence(&words)));
    let named = |wanted: &dyn Fn(&UnknownSummary) -> bool| -> Vec<String> {
        summary.unknowns.iter().filter(|u| wanted(u)).map(|u| u.name.clone()).collect()
    };
    let at_bound = named(&|u| u.at_bound);
    let unknown = named(&|u| !u.identifiable);
    match at_bound.len() {
        0 => {}
        1 => sentences
            .push(format!("{} ended on a bound: it may want a value that is not allowed.", at_bound[0])),
        _ => sentences
            .push(format!("{} ended on bounds: they may want values that are not allowed.", list(&at_bound))),
    }
    sentences.extend(filled(summary));
    match (unknown.is_empty(), summary.unknowns.is_empty()) {
        (_, true) => {
            sentences.push("Nothing was free: the images were compared with the start values.".to_owned());
        }
        (true, _) if !at_bound.is_empty() => sentences.push(format!(
            "The images determine every free parameter but {}, held by {}.",
            list(&at_bound),
            if at_bound.len() == 1 { "its bound" } else { "their bounds" },
        )),
        (true, _) => sentences.push("The images determine every free parameter.".to_owned()),
        (false, _) => sentences.push(format!("The images do not determine {}.", list(&unknown))),
    }
    sentences.extend(errors::sentences(summary));
    sentences.retain(|s| !s.is_empty());
    sentences
}

/// Shares that add up to the whole, a sentence for each channel of them.
fn filled(summary: &Summary) -> impl Iterator<Item = String> {
    let told = |shares: &Vec<String>| {
        format!("{} leave nothing beside them: they may want more than the whole.", list(shares))
    };
    summary.full_shares.iter().map(told)
}

fn how_it_ended(summary: &Summary) -> String {
    let after = format!(
        "after {} and {} over {}",
        counted(summary.iterations, "iteration"),
        counted(summary.evaluations, "pass"),
        counted(summary.samples, "sample"),
    );
    match summary.ending {
        Ending::Converged => format!("The fit converged {after}, in {}.", seconds(summary.seconds.fit)),
        Ending::RanOut => {
            format!("The iterations ran out {after}: more of them may lower the loss further.")
        }
        Ending::Stalled => format!(
            "The fit stalled {after}: no step lowers the loss, yet no tolerance was met. Try another start."
        ),
        Ending::Interrupted if summary.maps.is_some() => {
            format!("The fit was interrupted {after}; a new one can begin with the maps that it has left.")
        }
        Ending::Interrupted => format!("The fit was interrupted {after}; it can be resumed from its state."),
    }
}

fn what_it_reached(summary: &Summary) -> String {
    let (start, end) = (summary.loss.start, summary.loss.end);
    let (went, fall) = match start / end {
        ratio if ratio.is_finite() && ratio >= 1.05 => {
            ("fell", format!(", {} times lower", number(ratio, 3)))
        }
        _ if start > end => ("fell", String::new()),
        _ => ("went", String::new()),
    };
    let mut text = format!("The loss {went} from {} to {}{fall}", number(start, 4), number(end, 4));
    let fitted = summary.views.0.iter().filter(|(_, view)| !view.held_out);
    let psnr: Vec<f64> = fitted.filter_map(|(_, view)| view.psnr).collect();
    let (least, most) = psnr.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
    match psnr.len() {
        0 => {}
        1 => text += &format!("; the view is matched with a PSNR of {least:.1} dB"),
        n => text += &format!("; the {n} views are matched with a PSNR of {least:.1} to {most:.1} dB"),
    }
    text + "."
}

/// How well what was held out is matched, beside what was fitted, in a sentence without its end; `None` where nothing
/// was held out, or no pixel of it is covered.
#[must_use]
pub fn held_out(summary: &Summary) -> Option<String> {
    let held: Vec<(&String, f64, f64, f64)> = summary
        .views
        .0
        .iter()
        .filter(|(_, view)| view.held_out)
        .filter_map(|(name, view)| Some((name, view.psnr?, view.ssim?, view.flip?)))
        .collect();
    let each: Vec<String> = held
        .iter()
        .map(|(name, psnr, ssim, flip)| {
            format!("{name} with a PSNR of {psnr:.1} dB, SSIM {ssim:.3}, FLIP {flip:.3}")
        })
        .collect();
    let fitted = summary.scores.fitted.and_then(|means| Some((means.views, means.psnr?)));
    let beside = match fitted {
        Some((1, psnr)) => format!(", where the view that was fitted has {psnr:.1} dB"),
        Some((n, psnr)) => format!(", where the {n} views that were fitted have {psnr:.1} dB on average"),
        None => String::new(),
    };
    (!each.is_empty()).then(|| format!("held out: {}{beside}", each.join("; ")))
}

/// An undetermined direction in words.
pub(super) fn direction(components: &Ordered<f64>) -> String {
    let signed = |x: f64| format!("{}{:.2}", if x < 0.0 { "−" } else { "+" }, x.abs());
    match components.0.as_slice() {
        [] => "A combination of many unknowns, none of which stands out.".to_owned(),
        [(name, _)] => format!("{name}: changing it does not change the images."),
        [(a, x), (b, y)] => {
            let ratio = format!("in the ratio {:.2} : {:.2}", x.abs(), y.abs());
            match x * y < 0.0 {
                true => {
                    format!("{a} can be raised while {b} is lowered, {ratio}, without changing the images.")
                }
                false => format!("{a} and {b} can be raised together, {ratio}, without changing the images."),
            }
        }
        many => {
            let parts: Vec<String> = many.iter().map(|(name, x)| format!("{name} {}", signed(*x))).collect();
            format!("Moved together, {} leave the images as they are.", list(&parts))
        }
    }
}

/// Pairs of unknowns whose errors can hardly be told apart (|correlation| of 0.95 and more).
pub(super) fn entangled(summary: &Summary) -> Vec<String> {
    let names = &summary.correlations.names;
    let mut pairs = Vec::new();
    for (i, row) in summary.correlations.matrix.iter().enumerate() {
        for (j, r) in row.iter().enumerate().take(i) {
            let Some(r) = r.filter(|r| r.abs() >= 0.95) else { continue };
            pairs.push((r.abs(), format!("{} and {} ({})", names[j], names[i], number(r, 3))));
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs.into_iter().map(|(_, text)| text).collect()
}

/// `words` with a capital and a full stop.
fn sentence(words: &str) -> String {
    capital(words) + "."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_told_in_words() {
        let of = |parts: &[(&str, f64)]| {
            direction(&Ordered(parts.iter().map(|(n, x)| ((*n).to_owned(), *x)).collect()))
        };
        assert!(of(&[("hilite", 1.0)]).starts_with("hilite: changing it"));
        assert!(
            of(&[("a", 0.8), ("b", -0.6)])
                .contains("a can be raised while b is lowered, in the ratio 0.80 : 0.60")
        );
        assert!(of(&[("a", 0.8), ("b", 0.4), ("c", 0.4)]).contains("a +0.80, b +0.40 and c +0.40"));
    }
}
