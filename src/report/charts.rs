//! Charts as inline SVG. Colours are classes of the page's style sheet, so that they follow its
//! light and dark themes.

use std::fmt::Write as _;

use super::json::{Correlations, Summary, UnknownSummary};
use super::page::escape;
use super::words::{number, seconds};
use crate::fit::outcome::Iteration;

/// What a chart draws along x.
#[derive(Clone, Copy)]
enum Along {
    Passes,
    Seconds,
}

/// The loss (logarithmic) against passes and against seconds, side by side.
pub(super) fn convergence(summary: &Summary) -> String {
    if summary.history.is_empty() {
        return "<p class=\"quiet\">No iteration was made, so there is no curve.</p>".to_owned();
    }
    let panels = [Along::Passes, Along::Seconds].map(|along| convergence_panel(summary, along));
    format!("<div class=\"pair\">{}</div>", panels.concat())
}

/// The start, after its one pass, and every iteration. Variable projection's history begins with the
/// best linear unknowns there, the others' with the start itself.
fn track(summary: &Summary) -> Vec<Iteration> {
    let start = Iteration { iteration: 0, loss: summary.loss.start, evaluations: 1, seconds: 0.0 };
    let iterations = summary.history.iter().copied();
    std::iter::once(start)
        .chain(iterations.skip_while(|first| *first == Iteration { seconds: first.seconds, ..start }))
        .collect()
}

fn convergence_panel(summary: &Summary, along: Along) -> String {
    const WIDTH: f64 = 560.0;
    const HEIGHT: f64 = 300.0;
    const LEFT: f64 = 64.0;
    const TOP: f64 = 14.0;
    const RIGHT: f64 = WIDTH - 14.0;
    const BOTTOM: f64 = HEIGHT - 46.0;
    let title = match along {
        Along::Passes => "passes over the samples",
        Along::Seconds => "seconds",
    };
    let track = track(summary);
    let xs: Vec<f64> = track
        .iter()
        .map(|i| match along {
            Along::Passes => i.evaluations as f64,
            Along::Seconds => i.seconds,
        })
        .map(|x| if x.is_finite() { x } else { 0.0 })
        .collect();
    let losses: Vec<f64> = track.iter().map(|i| i.loss).collect();
    let (low, high) = log_range(&losses);
    let (x_ticks, x_end) = linear_ticks(xs.iter().copied().fold(0.0, f64::max));
    let x_at = |x: f64| LEFT + (RIGHT - LEFT) * x / x_end;
    // A loss of 0 has no logarithm: it is drawn at the foot.
    let y_at = |loss: f64| {
        let log = if loss > 0.0 { loss.log10().clamp(low, high) } else { low };
        BOTTOM - (BOTTOM - TOP) * (log - low) / (high - low)
    };

    let mut svg = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"loss against {title}\">"
    );
    for tick in log_ticks(low, high) {
        let (x, y, text) = (LEFT - 8.0, y_at(tick), tick_label(tick));
        let _ = write!(svg, "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
        let _ = write!(svg, "<text x=\"{x}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>", y + 4.0);
    }
    for tick in x_ticks {
        let (x, y, text) = (x_at(tick), BOTTOM + 19.0, tick_label(tick));
        let _ = write!(svg, "<path class=\"axis\" d=\"M{x:.1} {BOTTOM}v5\"/>");
        let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>");
    }
    let (x, y) = (0.5 * (LEFT + RIGHT), HEIGHT - 8.0);
    let _ = write!(svg, "<path class=\"axis\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>");
    let _ = write!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{title}</text>");
    let place = format!("translate(14 {}) rotate(-90)", 0.5 * (TOP + BOTTOM));
    let loss = escape(summary.loss_name);
    let _ = write!(svg, "<text transform=\"{place}\" text-anchor=\"middle\">loss ({loss})</text>");
    let points: Vec<(f64, f64)> = xs.iter().zip(&losses).map(|(&x, &y)| (x_at(x), y_at(y))).collect();
    let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
    let _ = write!(svg, "<path class=\"curve\" d=\"M{}\"/>", path.join("L"));
    // Beyond a hundred iterations dots would hide the curve.
    let radius = if points.len() > 100 { 1.5 } else { 4.0 };
    for (k, ((x, y), i)) in points.iter().zip(&track).enumerate() {
        let _ = write!(
            svg,
            "<circle class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}: loss {}, {} {}, {}</title></circle>",
            if k == 0 { "start".to_owned() } else { format!("iteration {}", i.iteration) },
            number(i.loss, 5),
            i.evaluations,
            if i.evaluations == 1 { "pass" } else { "passes" },
            seconds(i.seconds)
        );
    }
    svg + "</svg>"
}

/// Decades that hold every positive value, with some room; at least half a decade.
pub(super) fn log_range(values: &[f64]) -> (f64, f64) {
    let logs = values.iter().filter(|v| **v > 0.0 && v.is_finite()).map(|v| v.log10());
    let (low, high) = logs.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    if low > high {
        return (-1.0, 0.0);
    }
    let room = (0.06 * (high - low)).max(0.25 * (0.5 - (high - low)).max(0.0)).max(0.02);
    (low - room, high + room)
}

/// Round values on a logarithmic axis: as many of 1, 2, 5 times powers of ten as read well.
pub(super) fn log_ticks(low: f64, high: f64) -> Vec<f64> {
    let decades = (low.floor() as i32)..=(high.ceil() as i32);
    let every = ((high - low) / 7.0).ceil().max(1.0) as i32;
    let steps: &[f64] = match high - low {
        span if span > 3.0 => &[1.0],
        span if span > 1.2 => &[1.0, 2.0, 5.0],
        span if span > 0.4 => &[1.0, 2.0, 3.0, 5.0, 7.0],
        _ => &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    };
    let of = |d: i32| steps.iter().map(move |m| m * 10.0_f64.powi(d));
    decades
        .filter(|d| d.rem_euclid(every) == 0)
        .flat_map(of)
        .filter(|t| (low..=high).contains(&t.log10()))
        .collect()
}

/// Round values from 0 to `end` or a little beyond, and where the axis ends.
pub(super) fn linear_ticks(end: f64) -> (Vec<f64>, f64) {
    let end = if end.is_finite() && end > 0.0 { end } else { 1.0 };
    let rough = end / 5.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
    let ticks = (0..=(end / step + 1e-9) as usize).map(|i| i as f64 * step).collect();
    (ticks, end * 1.02)
}

pub(super) fn tick_label(tick: f64) -> String {
    let text = number(tick, 2);
    match text.split_once('×') {
        // Powers of ten need no factor.
        Some(("1.0", power)) => power.to_owned(),
        Some((factor, power)) => format!("{}×{power}", factor.trim_end_matches(".0")),
        None if text.contains('.') => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        None => text,
    }
}

/// One unknown on the line between its bounds: start (ring), value (dot), one standard error (thick)
/// and three (thin).
pub(super) fn error_bar(unknown: &UnknownSummary, logarithmic: bool) -> String {
    const WIDTH: f64 = 240.0;
    const LEFT: f64 = 12.0;
    const RIGHT: f64 = WIDTH - 12.0;
    let (start, value) = (unknown.start, unknown.value);
    if !(start.is_finite() && value.is_finite()) {
        return String::new();
    }
    let error = unknown.std_error.filter(|e| e.is_finite()).unwrap_or(0.0);
    let [lower, upper] = unknown.bounds;
    let extremes = [start, value, value - 3.0 * error, value + 3.0 * error];
    let least = extremes.iter().copied().fold(f64::MAX, f64::min).max(lower);
    let most = extremes.iter().copied().fold(f64::MIN, f64::max).min(upper);
    let room = (0.2 * (most - least)).max(0.1 * value.abs()).max(1e-6);
    // A bound far beyond what the fit moved through would squeeze everything into one point.
    let reach = 30.0 * (most - least).max(0.1 * value.abs());
    let near = |bound: f64| (bound - value).abs() <= reach;
    let from = if near(lower) { lower } else { least - room };
    let to = if near(upper) { upper } else { most + room };
    let log = logarithmic && from > 0.0;
    let scale = |x: f64| if log { x.ln() } else { x };
    let at = |x: f64| {
        let share = (scale(x.max(from).min(to)) - scale(from)) / (scale(to) - scale(from));
        LEFT + (RIGHT - LEFT) * if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 }
    };
    let limit = |x: f64, near: bool, sign: f64| match near {
        true => format!("<path class=\"wall\" d=\"M{x:.1} 5v18\"/>"),
        false => format!(
            "<path class=\"open\" d=\"M{:.1} 10l{:.1} 4l{:.1} 4\"/>",
            x - 5.0 * sign,
            5.0 * sign,
            -5.0 * sign
        ),
    };
    let range = |k: f64| (at(value - k * error), at(value + k * error));
    let ((a1, b1), (a3, b3)) = (range(1.0), range(3.0));
    let title = format!(
        "start {}, value {}{}, bounds {} to {}",
        number(start, 4),
        number(value, 6),
        unknown.std_error.map_or_else(String::new, |e| format!(" ± {}", number(e, 2))),
        number(lower, 4),
        number(upper, 4)
    );
    let (from_x, to_x) = (at(start), at(value));
    format!(
        "<svg class=\"range\" viewBox=\"0 0 {WIDTH} 28\" role=\"img\" aria-label=\"{title}\"><title>{title}</title>\
         <path class=\"line\" d=\"M{LEFT} 14H{RIGHT}\"/>{}{}\
         <path class=\"moved\" d=\"M{from_x:.1} 14H{to_x:.1}\"/>\
         <path class=\"error3\" d=\"M{a3:.1} 14H{b3:.1}M{a3:.1} 10v8M{b3:.1} 10v8\"/><path class=\"error1\" d=\"M{a1:.1} 14H{b1:.1}\"/>\
         <circle class=\"from\" cx=\"{from_x:.1}\" cy=\"14\" r=\"4\"/><circle class=\"to\" cx=\"{to_x:.1}\" cy=\"14\" r=\"4.5\"/></svg>",
        limit(LEFT, near(lower), -1.0),
        limit(RIGHT, near(upper), 1.0),
    )
}

/// The correlation matrix as a heat map: one hue for each sign, the deeper the stronger.
pub(super) fn heat_map(correlations: &Correlations) -> String {
    let k = correlations.names.len();
    let cell = if k <= 16 { 44.0 } else { (704.0 / k as f64).max(12.0) };
    let labels: Vec<String> = correlations.names.iter().map(|name| escape(&shortened(name))).collect();
    let longest = correlations.names.iter().map(|n| shortened(n).chars().count()).max().unwrap_or(0) as f64;
    // A monospaced letter of the style sheet's size is 7.2 wide; slanted, it rises and runs by 5.1.
    let (left, top) = (7.2 * longest + 14.0, 5.1 * longest + 24.0);
    let (width, height) = (left + cell * k as f64 + top, top + cell * k as f64 + 4.0);
    let mut svg = format!(
        "<svg class=\"heat\" viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" role=\"img\" \
         aria-label=\"correlations of the unknowns\">"
    );
    for (i, label) in labels.iter().enumerate() {
        let middle = (i as f64 + 0.5) * cell;
        let (x, y) = (left - 8.0, top + middle + 4.0);
        let _ =
            write!(svg, "<text class=\"name\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{label}</text>");
        let (x, y) = (left + middle + 3.0, top - 7.0);
        let place = format!("translate({x:.1} {y:.1}) rotate(-45)");
        let _ = write!(svg, "<text class=\"name\" transform=\"{place}\">{label}</text>");
    }
    for (i, row) in correlations.matrix.iter().enumerate() {
        for (j, &r) in row.iter().enumerate().take(k) {
            let names = [&correlations.names[i], &correlations.names[j]].map(|name| escape(name));
            let (x, y) = (left + j as f64 * cell, top + i as f64 * cell);
            let _ = write!(
                svg,
                "<g transform=\"translate({x:.1} {y:.1})\"><title>{} and {}: {}</title>{}</g>",
                names[0],
                names[1],
                r.map_or_else(|| "no errors to correlate".to_owned(), |r| number(r, 3)),
                heat_cell(r, i == j, cell - 2.0)
            );
        }
    }
    svg + "</svg>"
}

/// One cell; those of an unknown with itself say nothing, and stay pale. Beside an unknown without an error, a dash.
fn heat_cell(r: Option<f64>, with_itself: bool, side: f64) -> String {
    let strength = r.filter(|r| !with_itself && r.is_finite()).map_or(0.0, |r| r.abs().min(1.0));
    let (hue, ink) = match (r.is_some_and(|r| r < 0.0), strength > 0.7) {
        _ if with_itself => ("plus", "self"),
        (negative, strong) => {
            (if negative { "minus" } else { "plus" }, if strong { "strong" } else { "weak" })
        }
    };
    let text = match r.filter(|r| r.is_finite()) {
        _ if side < 34.0 => String::new(),
        None => "–".to_owned(),
        Some(_) if with_itself => "1".to_owned(),
        Some(r) => format!("{r:.2}").replace('-', "−"),
    };
    let square = format!("width=\"{side:.1}\" height=\"{side:.1}\" rx=\"3\"");
    let (x, y) = (0.5 * side, 0.5 * side + 4.0);
    format!(
        "<rect class=\"cell\" {square}/><rect class=\"{hue}\" {square} fill-opacity=\"{strength:.3}\"/>\
         <text class=\"{ink}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{text}</text>"
    )
}

/// `name` with at most 24 characters.
fn shortened(name: &str) -> String {
    match name.chars().count() > 24 {
        true => name.chars().take(23).chain(['…']).collect(),
        false => name.to_owned(),
    }
}
