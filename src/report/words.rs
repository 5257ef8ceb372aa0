//! Numbers and findings in words.

use super::json::{Ordered, Summary};
use crate::fit::outcome::Ending;

/// `x` to `digits` significant digits: plain between 0.001 and 10^6, else times a power of ten.
#[must_use]
pub fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return if x.is_nan() {
            "–"
        } else if x > 0.0 {
            "∞"
        } else {
            "−∞"
        }
        .to_owned();
    }
    let scientific = format!("{x:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = exponent.parse().unwrap_or(0);
    let text = match power {
        _ if x == 0.0 => "0".to_owned(),
        -3..6 => format!("{x:.*}", usize::try_from(digits as i32 - 1 - power).unwrap_or(0)),
        _ => format!("{mantissa}×10{}", superscript(power)),
    };
    text.replace('-', "−")
}

fn superscript(power: i32) -> String {
    let raise = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => char::from_u32('⁰' as u32 + (c as u32 - '0' as u32)).unwrap_or(c),
    };
    power.to_string().chars().map(raise).collect()
}

/// A value with as many decimals as its standard error deserves, and the error (two digits).
pub(super) fn with_error(value: f64, error: f64) -> (String, String) {
    let place = error.log10().floor();
    let decimals = (1.0 - place).clamp(0.0, 8.0);
    if !(error > 0.0 && place > -8.0 && value.abs() < 1e6) {
        return (number(value, 6), number(error, 2));
    }
    (format!("{value:.*}", decimals as usize).replace('-', "−"), format!("{error:.*}", decimals as usize))
}

/// Seconds, in the unit that reads best.
#[must_use]
pub fn seconds(s: f64) -> String {
    match s {
        _ if !s.is_finite() => "–".to_owned(),
        _ if s >= 120.0 => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
        _ if s >= 0.9995 || s <= 0.0 => format!("{} s", number(s, 3)),
        _ if s >= 0.0005 => format!("{} ms", number(1e3 * s, 3)),
        _ => format!("{} µs", number(1e6 * s, 2)),
    }
}

/// A count with thin spaces between thousands, or `one` thing and so many `many`.
#[must_use]
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let parted =
        digits.chars().enumerate().map(|(i, c)| match i > 0 && (digits.len() - i).is_multiple_of(3) {
            true => format!("\u{202f}{c}"),
            false => c.to_string(),
        });
    parted.collect()
}

/// `3 iterations`, `1 iteration`.
pub(super) fn counted(n: u64, thing: &str) -> String {
    let plural = match thing.strip_suffix("ss") {
        _ if n == 1 => thing.to_owned(),
        Some(_) => format!("{thing}es"),
        None => format!("{thing}s"),
    };
    format!("{} {plural}", count(n))
}

/// `a, b and c`.
pub(super) fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

/// How the fit ended, with a capital.
pub(super) fn ending(ending: Ending) -> String {
    capital(ending.words())
}

/// `words`, which begin with a letter of ASCII, with a capital.
pub(super) fn capital(words: &str) -> String {
    let (first, rest) = words.split_at(1);
    first.to_uppercase() + rest
}

/// `words` with a capital and a full stop.
fn sentence(words: &str) -> String {
    capital(words) + "."
}

/// The verdict: how the fit ended, what it reached, and what to be wary of; a sentence an entry.
pub(super) fn verdict(summary: &Summary) -> Vec<String> {
    let mut sentences = vec![how_it_ended(summary), what_it_reached(summary)];
    sentences.extend(held_out(summary).map(|words| sentence(&words)));
    let misfit = [summary.misfit.explained_in_words(), summary.misfit.largest_in_words()];
    sentences.extend(misfit.into_iter().flatten().map(|words| sentence(&words)));
    let named = |wanted: &dyn Fn(&super::json::UnknownSummary) -> bool| -> Vec<String> {
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
    sentences.extend(super::errors::sentences(summary));
    sentences.retain(|s| !s.is_empty());
    sentences
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (x, digits, want) in [
            (0.0, 4, "0"),
            (0.712_345, 4, "0.7123"),
            (-12.5, 3, "−12.5"),
            (123_456.0, 4, "123456"),
            (0.000_012_3, 2, "1.2×10⁻⁵"),
            (-4.5e12, 2, "−4.5×10¹²"),
            (999.96, 4, "1000"),
            (f64::NEG_INFINITY, 3, "−∞"),
            (f64::NAN, 3, "–"),
        ] {
            assert_eq!(number(x, digits), want);
        }
        assert_eq!(with_error(0.712_345, 0.000_43), ("0.71235".to_owned(), "0.00043".to_owned()));
        assert_eq!(with_error(-31.7, 2.34), ("−31.7".to_owned(), "2.3".to_owned()));
        assert_eq!(with_error(5.0, 123.0), ("5".to_owned(), "123".to_owned()));
        assert_eq!(with_error(0.5, 0.0), ("0.500000".to_owned(), "0".to_owned()));
        assert_eq!((count(1_234_567), count(12)), ("1\u{202f}234\u{202f}567".to_owned(), "12".to_owned()));
        assert_eq!((counted(1, "pass"), counted(2, "pass")), ("1 pass".to_owned(), "2 passes".to_owned()));
        assert_eq!(seconds(0.0123), "12.3 ms");
        assert_eq!(seconds(754.0), "12 min 34 s");
        assert_eq!(list(&["a", "b", "c"].map(str::to_owned)), "a, b and c");
    }

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
