//! What is left of the model, fitted again: from several starts, as what the whole fit ended at may lead into a worse
//! valley than the scene's own start, and either into a worse one than another.

use serde::Serialize;

use crate::StudyError;
use crate::engine::Point;
use crate::fit::FitOptions;
use crate::fit::outcome::{Ending, Outcome};
use crate::subject::Subject;

/// How many starts are drawn about the scene's own, as those of a fit from several starts are.
pub const DRAWN: u32 = 2;

/// Ends whose losses differ by a smaller share are those of one valley: fits stop within a hundredth of that.
const SAME: f64 = 1e-6;

/// Where the fits of a case began, and how they ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Starts {
    /// Every one.
    pub tried: Vec<Tried>,
    /// The one whose end was kept.
    pub best: String,
}

/// A fit from one start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// `whole`: where the whole model's fit ended; `scene`: the scene's own start; `drawn 1`, `drawn 2`.
    pub from: String,
    /// The loss where it ended.
    pub loss: f64,
    /// How it ended.
    pub ending: Ending,
}

impl Starts {
    /// `drawn 1, of 4`.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{}, of {}", self.best, self.tried.len())
    }
}

/// A fit whose standard errors know which residuals are neighbours.
pub(super) fn errors_of(subject: &Subject) -> FitOptions {
    FitOptions { widths: subject.scenes.widths(), ..FitOptions::default() }
}

/// The best fit of what is free in `subject`: from the scene's `own` start, from [`DRAWN`] drawn about it and, of a model
/// of which a part was left out, from where the fit of the `whole` ended.
///
/// # Errors
/// When a fit cannot be done.
pub fn refit(subject: &Subject, whole: Option<&Point>, own: &Point) -> Result<(Outcome, Starts), StudyError> {
    let mut tried = Vec::new();
    let from_whole = match whole.filter(|whole| *whole != own) {
        Some(whole) => {
            let outcome = subject.fit_from(whole, &errors_of(subject))?;
            let (loss, ending) = (outcome.loss_end, outcome.ending);
            tried.push(Tried { from: "whole".to_owned(), loss, ending });
            Some(outcome)
        }
        None => None,
    };
    let drawn = subject.fit_from(own, &FitOptions { starts: 1 + DRAWN, ..errors_of(subject) })?;
    let best = least(drawn.starts.iter().map(|start| start.loss_end));
    let name = |i: usize| if i == 0 { "scene".to_owned() } else { format!("drawn {i}") };
    let ends = drawn.starts.iter().enumerate();
    tried.extend(ends.map(|(i, start)| Tried { from: name(i), loss: start.loss_end, ending: start.ending }));
    let (outcome, best) = match from_whole {
        Some(whole) if is_no_worse(whole.loss_end, drawn.loss_end) => (whole, "whole".to_owned()),
        _ => (drawn, name(best)),
    };
    Ok((outcome, Starts { tried, best }))
}

/// The place of the least loss, the first of equal ones; one that is no number is greater than every other.
fn least(losses: impl Iterator<Item = f64>) -> usize {
    let rank = |loss: f64| if loss.is_nan() { f64::INFINITY } else { loss };
    let least = losses.enumerate().min_by(|(_, a), (_, b)| rank(*a).total_cmp(&rank(*b)));
    least.map_or(0, |(place, _)| place)
}

/// Whether an end is as good as the other, or of its valley.
fn is_no_worse(loss: f64, other: f64) -> bool {
    other.is_nan() || loss <= other * (1.0 + SAME)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_that_is_no_number_is_never_the_best_where_another_is_one() {
        let of = |losses: &[f64]| least(losses.iter().copied());
        assert_eq!(of(&[f64::NAN, 0.2, 0.1]), 2);
        assert_eq!(of(&[-f64::NAN, 0.2, f64::NAN]), 1);
        assert_eq!(of(&[0.1, 0.1, 0.2]), 0);
        assert_eq!([of(&[f64::NAN]), of(&[])], [0, 0]);
        assert!(is_no_worse(0.5, f64::NAN) && !is_no_worse(f64::NAN, 0.5));
        assert!(is_no_worse(0.5, 0.5) && !is_no_worse(0.5, 0.4));
    }
}
