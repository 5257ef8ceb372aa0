//! The units in which the page and the terminal tell what a part is worth and what it costs: shares of the whole
//! model's, in percent.

use crate::timing::Timed;

/// The change of a case's loss, in percent of the `whole` model's. `None` where that is next to nothing, of which
/// percentages say nothing: the change itself is told then.
pub(super) fn loss_percent(change: f64, whole: f64) -> Option<f64> {
    let percent = 100.0 * change / whole;
    (whole > 0.0 && percent.abs() < 1e4).then_some(percent)
}

/// What a case needs less than the whole model, in percent.
pub(super) fn saved(own: f64, whole: f64) -> f64 {
    if whole > 0.0 { 100.0 * (1.0 - own / whole) } else { 0.0 }
}

/// The time that a case takes less than the whole model, in percent, and half the distance of its quartiles.
pub(super) fn time_saved(time: Timed) -> [f64; 2] {
    [100.0 * (1.0 - time.ratio.median), 50.0 * (time.ratio.upper - time.ratio.lower)]
}

/// A number with its sign.
pub(super) fn signed(x: f64, digits: usize) -> String {
    let text = format!("{x:+.digits$}");
    // What rounds to nothing has no sign.
    if text.chars().any(|c| ('1'..='9').contains(&c)) { text } else { text[1..].to_owned() }
}
