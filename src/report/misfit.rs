//! What a fit gets wrong as a whole, and where: residuals grouped by where they lie, told as sentences.
//!
//! A residual is the fit less the target in linear radiance, over the pixels that scores are taken of; a pixel's is the
//! mean of its three channels. A place is told when the signed mean of its residuals is at least [`LEAST`] of the
//! targets' mean radiance and [`SIGMAS`] of its standard errors, over at least [`LEAST_PIXELS`] of the pixels.
//!
//! Neighbouring pixels err alike, so blocks of pixels are the witnesses: the standard error is that of sums over blocks,
//! the greatest of those of blocks of 8, 16, 32, ... pixels a side, as long as there are `BLOCKS` of them.

mod place;
mod sums;
#[cfg(test)]
pub(crate) mod tests;

use serde::Serialize;

use self::place::{Bounds, Place};
use self::sums::{Blocks, Sums};
use super::ViewEvidence;
use super::metrics::COVERED;
use super::words::number;

/// Targets of less mean radiance are black: what is off by a share of it is a matter of roundings.
const DARK: f64 = 1e-6;
/// The least signed mean that is told, as a share of the targets' mean radiance.
pub const LEAST: f64 = 0.01;
/// The least signed mean that is told, in standard errors.
pub const SIGMAS: f64 = 3.0;
/// The least share of the pixels that a place must have.
pub const LEAST_PIXELS: f64 = 0.005;
/// The most places that are told.
pub const MOST: usize = 5;

/// What a fit gets wrong as a whole, and where.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Misfit {
    /// The share of the variance of the targets' radiance (over all compared pixels and channels) that the fit explains;
    /// none where there is no variance. It is below 0 where the targets' own mean would be nearer.
    pub explained: Option<f64>,
    /// The same in a word.
    #[serde(rename = "match")]
    pub matched: Option<Match>,
    /// The mean radiance of the targets.
    pub mean_radiance: f64,
    /// The least signed mean that is told.
    pub threshold: f64,
    /// Each place, the one first that adds the most to the squared error by its mean alone.
    pub places: Vec<PlaceMisfit>,
}

/// How well the fit matches the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Match {
    /// It explains 99% of their variance or more.
    Close,
    /// 90% or more.
    Rough,
    /// 50% or more.
    Poor,
    /// Less.
    None,
}

impl Match {
    const fn of(explained: f64) -> Self {
        match explained {
            _ if explained >= 0.99 => Self::Close,
            _ if explained >= 0.9 => Self::Rough,
            _ if explained >= 0.5 => Self::Poor,
            _ => Self::None,
        }
    }

    /// In two words or three.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Close => "a close match",
            Self::Rough => "a rough match",
            Self::Poor => "a poor match",
            Self::None => "no match",
        }
    }
}

/// The misfit of a place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaceMisfit {
    /// `in creases`, `at the rim`, `in view front`.
    pub place: String,
    /// The mean residual: positive where the fit is too bright.
    pub mean: f64,
    /// One standard error of it; none where there are too few blocks of pixels.
    pub std_error: Option<f64>,
    /// It as a share of the mean radiance that the targets have there; none where they are next to black.
    pub relative: Option<f64>,
    /// Share of the compared pixels.
    pub pixels: f64,
    /// Share of the squared error.
    pub squared_error: f64,
    /// Whether it is told.
    pub told: bool,
    /// Share of the squared error that the mean alone makes.
    #[serde(skip)]
    systematic: f64,
}

impl PlaceMisfit {
    /// Of a place among `count` pixels with a squared error of `total`.
    fn new(
        sums: &Sums,
        (place, words): (Place, String),
        std_error: Option<f64>,
        [count, total, threshold]: [f64; 3],
    ) -> Self {
        let (mean, target) = (sums.mean(), sums.target / sums.pixels);
        let share = |squares: f64| if total > 0.0 { squares / total } else { 0.0 };
        let pixels = sums.pixels / count;
        let significant = std_error.is_some_and(|error| mean.abs() >= SIGMAS * error);
        Self {
            place: words,
            mean,
            std_error,
            // A share of next to black says nothing: of less than a twentieth of the mean radiance.
            relative: (target > 5.0 * threshold).then(|| mean / target),
            pixels,
            squared_error: share(sums.squares),
            told: mean != 0.0 && mean.abs() >= threshold && significant && pixels >= LEAST_PIXELS,
            systematic: share(sums.pixels * place.channels().len() as f64 * mean * mean),
        }
    }

    /// `too dark in creases by 12%`.
    #[must_use]
    pub fn words(&self) -> String {
        let side = if self.mean < 0.0 { "dark" } else { "bright" };
        let by = self.relative.map_or_else(
            || format!("a radiance of {}", number(self.mean.abs(), 2)),
            |relative| percent(relative.abs()),
        );
        format!("too {side} {} by {by}", self.place)
    }

    /// The same with what of the pixels and of the squared error the place has.
    #[must_use]
    pub fn sentence(&self) -> String {
        let radiance = number(self.mean.abs(), 2);
        let (pixels, squares) = (percent(self.pixels), percent(self.squared_error));
        format!(
            "{} (mean radiance off by {radiance}; {pixels} of the pixels, {squares} of the squared error)",
            self.words()
        )
    }
}

impl Misfit {
    /// Of the views' targets and fits; images of one view are of one size.
    #[must_use]
    pub fn of(views: &[ViewEvidence]) -> Self {
        let bounds = Bounds::of(views);
        let names = if views.len() > 1 { views.len() } else { 0 };
        let places = [Place::Everywhere, Place::Creases, Place::Rim, Place::Facing]
            .into_iter()
            .chain([Place::LightSide, Place::ShadowSide, Place::Highlights])
            .chain((0..names).map(Place::View))
            .chain((0..3).map(Place::Channel));
        let blocks = Blocks::of(views);
        let mut sums: Vec<(Place, Sums)> = places.map(|place| (place, Sums::over(&blocks))).collect();
        let (mut count, mut target_sum, mut target_squares) = (0.0, [0.0; 3], [0.0; 3]);
        for (index, view) in views.iter().enumerate() {
            for at in 0..view.fit.rgb.len() {
                let Some((residual, target)) = residual(view, at) else { continue };
                count += 1.0;
                for c in 0..3 {
                    target_sum[c] += target[c];
                    target_squares[c] += target[c] * target[c];
                }
                let block = blocks.at(index, view, at);
                for (place, sums) in
                    sums.iter_mut().filter(|(place, _)| place.holds(&bounds, index, view, at))
                {
                    sums.add(place.channels(), block, residual, target);
                }
            }
        }
        if count == 0.0 {
            return Self::default();
        }
        // The first place is everywhere.
        let total: f64 = sums.first().map_or(0.0, |(_, sums)| sums.squares);
        let mean_radiance = target_sum.iter().sum::<f64>() / (3.0 * count);
        let squares: f64 = target_squares.iter().sum();
        let variance = squares - target_sum.iter().map(|sum| sum * sum / count).sum::<f64>();
        // Of a flat target nothing but the rounding of the sums is left.
        let explained = (variance > 1e-12 * squares).then(|| 1.0 - total / variance);
        let threshold = LEAST * mean_radiance.abs().max(DARK);
        let seen = sums.into_iter().filter(|(_, sums)| sums.pixels > 0.0);
        let told = |(place, sums): (Place, Sums)| {
            let std_error = sums.std_error(&blocks);
            PlaceMisfit::new(&sums, (place, place.words(views)), std_error, [count, total, threshold])
        };
        let mut places: Vec<PlaceMisfit> = seen.map(told).collect();
        places.sort_by(|a, b| b.systematic.total_cmp(&a.systematic));
        Self { explained, matched: explained.map(Match::of), mean_radiance, threshold, places }
    }

    /// The places that are told, the largest misfit first.
    pub fn told(&self) -> impl Iterator<Item = &PlaceMisfit> {
        self.places.iter().filter(|place| place.told).take(MOST)
    }

    /// How much the model explains, in a sentence without its end; none where there is nothing to explain.
    #[must_use]
    pub fn explained_in_words(&self) -> Option<String> {
        let (explained, matched) = (self.explained?, self.matched?);
        let share = match explained {
            _ if explained <= 0.0 => "none".to_owned(),
            _ if explained > 0.999 => "more than 99.9%".to_owned(),
            _ => format!("{:.1}%", 100.0 * explained),
        };
        Some(format!("the model explains {share} of the targets' variance: {}", matched.words()))
    }

    /// The largest misfit, in a sentence without its end; none where nothing was compared.
    #[must_use]
    pub fn largest_in_words(&self) -> Option<String> {
        match self.told().next() {
            Some(place) => Some(format!("largest misfit: {}", place.words())),
            None if self.places.is_empty() => None,
            None => Some("no place is too bright or too dark on average".to_owned()),
        }
    }
}

/// Residual and target of a pixel in linear radiance; none where it is not compared. Beyond where an 8-bit target is
/// clipped, nothing is known to be wrong.
pub(super) fn residual(view: &ViewEvidence, at: usize) -> Option<([f64; 3], [f64; 3])> {
    if view.coverage[at] < COVERED {
        return None;
    }
    let (fit, target) = (view.fit.rgb[at].map(f64::from), view.target.rgb[at].map(f64::from));
    let channel = |c: usize| {
        let (fit, target) = (fit[c], target[c]);
        let beyond = view.clip.is_some_and(|clip| {
            (target >= f64::from(clip.high) && fit >= target)
                || (target <= f64::from(clip.low) && fit <= target)
        });
        if beyond { 0.0 } else { fit - target }
    };
    let residual = [0, 1, 2].map(channel);
    residual.iter().chain(&target).all(|x| x.is_finite()).then_some((residual, target))
}

pub(super) fn mean(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

/// A share in percent.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent >= 9.95 { format!("{percent:.0}%") } else { format!("{percent:.1}%") }
}
