//! What standard errors rest on, and how far the weakest unknown may go, in words.

use super::json::{Ordered, Summary};
use super::words::number;
use crate::fit::error_basis::ErrorBasis;
use crate::fit::profile::Profile;
use crate::fit::sandwich::Blocks;

/// Errors that differ from those of independent residuals by less than this factor do so by chance.
const NOTABLE: f64 = 1.5;

/// What the errors rest on, in a sentence; `over_noise` is by how many times the most they exceed those of independent
/// residuals, `None` without errors. `None` where there is nothing to say: residuals are independent as far as one
/// sees, or are roundings.
#[must_use]
pub fn basis_in_words(basis: ErrorBasis, over_noise: Option<f64>) -> Option<String> {
    match basis {
        ErrorBasis::Rounding => None,
        // Without any error there is nothing that it is assumed for.
        ErrorBasis::Independent => over_noise
            .map(|_| "errors assume independent residuals: which are neighbours is not known".to_owned()),
        ErrorBasis::Blocks(Blocks { alike, .. }) if alike > 1 => {
            let times = over_noise.filter(|ratio| *ratio >= NOTABLE)?;
            let times = number(times, 2);
            Some(format!(
                "residuals are alike over about {alike} pixels: errors are up to {times} times those of independent ones"
            ))
        }
        ErrorBasis::Blocks(_) => {
            let times = number(over_noise.filter(|ratio| *ratio >= NOTABLE)?, 2);
            Some(format!(
                "residuals vary otherwise than their weights say: errors are up to {times} times those by weight"
            ))
        }
    }
}

/// What a profile shows, in a sentence; `None` where it confirms the standard error.
#[must_use]
pub fn profile_in_words(profile: &Profile) -> Option<String> {
    if !profile.is_valley() {
        return None;
    }
    let Profile { name, interval: [lower, upper], closed, .. } = profile;
    let end = |value: f64, closed: bool, beyond: &str| {
        let value = number(value, 3);
        if closed { value } else { format!("{value} or {beyond}") }
    };
    let (from, to) = (end(*lower, closed[0], "less"), end(*upper, closed[1], "more"));
    let mut words = format!(
        "{name} lies in a valley: from {from} to {to} the loss is as good as at {}",
        number(profile.value, 4)
    );
    if let Some(place) = profile.lower() {
        words += &format!(", and at {} it is lower", number(place.value, 3));
    }
    Some(words)
}

/// A sentence of its own.
pub(super) fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    // A parameter's name keeps its letters.
    let named = words.split(' ').next().is_some_and(|word| word.contains('_') || word.contains('.'));
    if named { format!("{words}.") } else { format!("{first}{}.", letters.as_str()) }
}

/// What is said of the errors of a run.
pub(super) fn sentences(summary: &Summary) -> Vec<String> {
    let basis = basis_in_words(summary.errors.basis, summary.errors.most_over_noise);
    let profile = summary.profile.as_ref().and_then(profile_in_words);
    basis.into_iter().chain(profile).map(|words| sentence(&words)).collect()
}

/// The rows of a profile: the unknown's value and the loss there.
pub(super) fn rows(profile: &Profile) -> Ordered<f64> {
    Ordered(profile.points.iter().map(|point| (number(point.value, 4), point.loss)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::profile::ProfilePoint;

    #[test]
    fn errors_are_told_where_they_are_more_than_noise() {
        let blocks = |alike| ErrorBasis::Blocks(Blocks { alike, side: 24, count: 90, next: 0.8 });
        assert_eq!(
            basis_in_words(blocks(12), Some(5.6)).unwrap(),
            "residuals are alike over about 12 pixels: errors are up to 5.6 times those of independent ones"
        );
        assert_eq!(basis_in_words(blocks(12), Some(1.2)), None);
        assert_eq!(basis_in_words(blocks(1), Some(1.1)), None);
        assert!(basis_in_words(blocks(1), Some(2.0)).unwrap().contains("vary otherwise"));
        assert!(basis_in_words(ErrorBasis::Independent, Some(1.0)).unwrap().contains("assume independent"));
        assert_eq!(basis_in_words(ErrorBasis::Independent, None), None);
        assert_eq!(basis_in_words(ErrorBasis::Rounding, None), None);
    }

    #[test]
    fn a_valley_is_told_with_its_open_end() {
        let mut profile = Profile {
            name: "specular_lobe".to_owned(),
            value: 158.0,
            std_error: 29.0,
            rise: 1e-5,
            interval: [131.0, 640.0],
            closed: [true, false],
            points: vec![
                ProfilePoint { value: 158.0, loss: 0.1 },
                ProfilePoint { value: 640.0, loss: 0.099 },
            ],
            passes: 9,
        };
        assert_eq!(
            sentence(&profile_in_words(&profile).unwrap()),
            "specular_lobe lies in a valley: from 131 to 640 or more the loss is as good as at 158.0, and at 640 it is lower."
        );
        profile.points.pop();
        (profile.interval, profile.closed) = ([130.0, 188.0], [true, true]);
        assert_eq!(profile_in_words(&profile), None);
        assert_eq!(sentence("residuals are alike"), "Residuals are alike.");
    }
}
